"""Upper bounds on BRDFs, by which whole clusters of observations are left out of a field.

f(x, l, w) (n . l)_+ <= flat + cosine (n . l)_+ for every direction l to a light. In float64, with
the formulas of `lightloc.brdf`; whoever compares with float32 leaves room for its roundings.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lightloc.brdf.microfacet import GRAZING, transmittance_table


@dataclass(frozen=True)
class Ceiling:
    """The two numbers of each observation and channel.

    Parameters
    ----------
    flat : (n, c) array
        What a specular lobe reaches at its peak, sr^-1.
    cosine : (n, c) array
        What a diffuse base adds for each unit of n . l, sr^-1.
    attained
        Whether f (n . l)_+ is cosine (n . l)_+ everywhere, as for a Lambertian surface; then
        kernels need not evaluate it.
    """

    flat: NDArray[np.float64]
    cosine: NDArray[np.float64]
    attained: bool = False


def lambert(albedo: NDArray[np.float64], cos_w: NDArray[np.float64]) -> Ceiling:
    """f = albedo / pi; ``cos_w`` (n, 1) is n . w."""
    cosine = np.where(cos_w > 0, albedo / np.pi, 0.0)
    return Ceiling(np.zeros_like(cosine), cosine, attained=True)


def lobe(
    alpha: NDArray[np.float64], specular: NDArray[np.float64], cos_w: NDArray[np.float64]
) -> NDArray[np.float64]:
    """(n, c): most of F D G1(l) G1(w) / (4 n.w), with F <= 1, G1(l) <= 1 and D at its peak.

    D = 1 / (pi alpha^2 (cos^2 + sin^2 / alpha^2)^2) peaks at the normal where alpha <= 1, with
    1 / (pi alpha^2), and at the horizon beyond, with alpha^2 / pi.
    """
    peak = np.maximum(alpha**2, alpha**-2.0) / np.pi
    tan2 = np.maximum(1 - cos_w**2, 0) / np.maximum(cos_w**2, GRAZING)
    masking = 2 / (1 + np.sqrt(1 + alpha**2 * tan2))
    lit = cos_w > 0
    return np.where(lit, specular * peak * masking / (4 * np.where(lit, cos_w, 1)), 0.0)


def conductor(
    alpha: NDArray[np.float64], specular: NDArray[np.float64], cos_w: NDArray[np.float64]
) -> Ceiling:
    """The lobe alone."""
    flat = lobe(alpha, specular, cos_w)
    return Ceiling(flat, np.zeros_like(flat))


def plastic(
    alpha: NDArray[np.float64],
    diffuse: NDArray[np.float64],
    ior: NDArray[np.float64],
    specular: NDArray[np.float64],
    nonlinear: NDArray[np.float64],
    cos_w: NDArray[np.float64],
) -> Ceiling:
    """The lobe, over a base that the coat lets at most its largest transmittance into."""
    pairs, row = np.unique(
        np.concatenate(np.broadcast_arrays(alpha, ior), axis=1), axis=0, return_inverse=True
    )
    tables, inside = zip(*(transmittance_table(a, eta) for a, eta in pairs), strict=True)
    through = np.array([table.max() for table in tables])[row.reshape(-1)][:, None]
    back = np.array(inside)[row.reshape(-1)][:, None]
    base = diffuse / (1 - back * (1 + nonlinear * (diffuse - 1)))
    cosine = np.where(cos_w > 0, base * through**2 / (np.pi * ior**2), 0.0)
    flat = lobe(alpha, specular, cos_w)
    flat, cosine = np.broadcast_arrays(flat, cosine)
    return Ceiling(flat, cosine)


def mixed(parts: list[Ceiling], index: NDArray[np.intp]) -> Ceiling:
    """Each point has the ceiling of its own part."""
    shape = (len(index), max(part.cosine.shape[1] for part in parts))
    flat, cosine = np.zeros(shape), np.zeros(shape)
    for b, part in enumerate(parts):
        mine = index == b
        flat[mine] = np.broadcast_to(part.flat, shape)[mine]
        cosine[mine] = np.broadcast_to(part.cosine, shape)[mine]
    return Ceiling(flat, cosine, all(part.attained for part in parts))
