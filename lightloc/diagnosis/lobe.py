"""A GGX lobe over arrays: what it adds to S, and its slope along the free axes.

In NumPy, so that a right model, which is asked once, compiles no kernel.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lightloc.brdf import BRDF, Conductor, Mixed, Plastic, Sum
from lightloc.diagnosis.departure import Array, Lit

STEP = 1e-3
"""Of the distance from a light to a surface: the step of the slope's differences."""


@dataclass(frozen=True, eq=False)
class Lobe:
    """One GGX lobe at n observations.

    Parameters
    ----------
    alpha : (n,) array
        Roughness.
    strength : (n, c) array
        Factor on the reflectance; 0 where there is no such lobe.
    ior : (n,) array
        Relative index of refraction; infinite where the lobe reflects all.
    """

    alpha: Array
    strength: Array
    ior: Array

    def rougher(self, factor: float) -> Lobe:
        """The same with so many times the roughness."""
        return Lobe(self.alpha * factor, self.strength, self.ior)


def lobes_of(material: BRDF, n: int) -> list[Lobe]:
    """The lobes of a material of n observations; none where it has no such."""
    if isinstance(material, Sum):
        return [lobe for part in material.brdfs for lobe in lobes_of(part, n)]
    if isinstance(material, Mixed):
        return [
            Lobe(lobe.alpha, lobe.strength * (material.index == i)[:, None], lobe.ior)
            for i, part in enumerate(material.brdfs)
            for lobe in lobes_of(part, n)
        ]
    if not isinstance(material, Conductor | Plastic):
        return []
    ior = material.ior if isinstance(material, Plastic) else np.full((1, 1), np.inf)
    return [
        Lobe(
            np.broadcast_to(material.alpha[:, :1], (n, 1))[:, 0],
            np.broadcast_to(material.specular, (n, material.specular.shape[1])),
            np.broadcast_to(ior, (n, 1))[:, 0],
        )
    ]


def brought(lit: Lit, lobe: Lobe) -> tuple[Array, Array]:
    """S (n, k, c) of a lobe, with shadows, and its slope (n, k, c, d)."""
    q, axes, places = lit.evidence.q, lit.evidence.problem.axes, lit.lights.positions
    n, k, c, d = len(q), len(places), q.channels, len(axes)
    seen = lit.seen.T[:, :, None]
    S = reflected(lobe, q.positions, q.normals, q.directions, places)[:, :, None] * seen
    slope = np.zeros((n, k, d))
    away = places - q.positions[:, None]
    step = STEP * float(np.median(np.linalg.norm(away, axis=2))) if k else 0.0
    for a, axis in enumerate(axes):
        ahead, behind = places.copy(), places.copy()
        ahead[:, axis] += step
        behind[:, axis] -= step
        sides = [reflected(lobe, q.positions, q.normals, q.directions, p) for p in (ahead, behind)]
        slope[:, :, a] = (sides[0] - sides[1]) / (2 * step)
    strength = np.broadcast_to(lobe.strength, (n, c))[:, None]
    return S * strength, (slope * seen)[:, :, None] * strength[:, :, :, None]


def reflected(lobe: Lobe, x: Array, normal: Array, w: Array, places: Array) -> NDArray[np.float64]:
    """F D G / (4 n . w) over the squared distance, at (k, 3) places: (n, k)."""
    away = places - x[:, None]
    d2 = np.square(away).sum(axis=2)
    l = away / np.sqrt(d2)[:, :, None]
    h = l + w[:, None]
    h /= np.maximum(np.linalg.norm(h, axis=2), 1e-12)[:, :, None]
    cos_l, cos_w = np.einsum("nkx,nx->nk", l, normal), (normal * w).sum(axis=1)[:, None]
    cos_h, a2 = np.einsum("nkx,nx->nk", h, normal), np.square(lobe.alpha)[:, None]
    spread = a2 / (np.pi * np.square(1 + (a2 - 1) * np.square(cos_h)))
    value = spread * masked(cos_l, a2) * masked(cos_w, a2) / (4 * np.maximum(cos_w, 1e-6))
    value = value * fresnel(np.einsum("nkx,nx->nk", h, w), lobe.ior[:, None])
    return np.where((cos_l > 0) & (cos_w > 0), value / d2, 0.0)


def masked(cosine: Array, a2: Array) -> Array:
    """Smith's masking of a direction."""
    cos2 = np.maximum(np.square(cosine), 1e-10)
    return 2 / (1 + np.sqrt(1 + a2 * np.maximum(1 - cos2, 0) / cos2))


def fresnel(cosine: Array, ior: Array) -> Array:
    """Unpolarized reflectance of a dielectric; 1 where its index is infinite."""
    eta = np.where(np.isinf(ior), 2.0, ior)
    inner = np.sqrt(1 - (1 - np.square(cosine)) / np.square(eta))
    s_wave = (cosine - eta * inner) / (cosine + eta * inner)
    p_wave = (eta * cosine - inner) / (eta * cosine + inner)
    return np.where(np.isinf(ior), 1.0, (np.square(s_wave) + np.square(p_wave)) / 2)
