"""The integrating sphere: the one room whose B, interreflection and all, has a closed form."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lightloc import Geometry, Lambert, Observations, PointLights, remove_indirect

MEAN, LEAST, MOST = 0.2, 0.9, 1.1  # of the z-scores: |mean| at most, deviation within
DIRECT_PERCENT = 1.0  # RMS error of the direct light recovered, of its mean


def closed_form(q: Observations, lights: PointLights) -> tuple[NDArray, NDArray]:
    """B and its direct part at points of a diffuse sphere about the origin, (n, 1), W sr^-1 m^-2.

    B = rho / pi (sum I_i cos / d_i^2 + rho / (1 - rho) sum I_i / R^2) for lights anywhere inside.
    Radius and albedo are those of the observations.

    Raises
    ------
    ValueError
        If they are not of such a sphere.
    """
    radius = np.linalg.norm(q.positions, axis=1)
    R = radius.mean()
    if np.ptp(radius) > 1e-3 * R or not isinstance(q.material, Lambert) or q.channels != 1:
        raise ValueError("the closed form holds for a grey diffuse sphere about the origin")
    albedo = q.material.albedo
    to_light = lights.positions - q.positions[:, None]
    d = np.linalg.norm(to_light, axis=2)
    cosine = -(to_light * q.positions[:, None]).sum(axis=2) / (d * R)
    direct = albedo / np.pi * ((cosine / d**2) @ lights.intensities)
    around = albedo**2 / (np.pi * (1 - albedo)) * lights.intensities.sum() / R**2
    return direct + around, direct


def judge_sphere(
    q: Observations, lights: PointLights, geometry: Geometry, seed: int
) -> tuple[dict[str, float], list[str]]:
    """Compare a rendered B with the closed form, and the direct light recovered with its own.

    Returns the figures (z-scores' mean and deviation, RMS of the recovered direct light in percent
    of its mean) and a sentence for each that is out of its limits.
    """
    B, direct = closed_form(q, lights)
    z = (q.radiance - B) / q.sigma
    left = remove_indirect(q, geometry, seed).radiance - direct
    rms = float(100 * np.sqrt(np.square(left).mean()) / direct.mean())
    mean, deviation = float(z.mean()), float(z.std())
    why = []
    if not abs(mean) <= MEAN:
        why.append(f"B is off its closed form: the z-scores' mean is {mean:.2f}, beyond {MEAN}.")
    if not LEAST <= deviation <= MOST:
        why.append(f"The z-scores' deviation is {deviation:.2f}, outside {LEAST} to {MOST}.")
    if not rms <= DIRECT_PERCENT:
        why.append(f"The direct light recovered is off by {rms:.2f} % RMS; 1 % is allowed.")
    return {"z_mean": mean, "z_std": deviation, "direct_rms_percent": rms}, why
