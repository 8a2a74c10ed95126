"""A GGX lobe over arrays: what it adds to S, and its slope along the free axes.

In NumPy, so that a right model, which is asked once, compiles no kernel.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lightloc.brdf import BRDF, Conductor, Mixed, Plastic, Sum
from lightloc.diagnosis.coat import INDEX, let_in
from lightloc.diagnosis.departure import Array, Lit

STEP = 1e-4
"""Of the region's longest side: the step of the slope's differences."""


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

    @property
    def coats(self) -> NDArray[np.bool_]:
        """(n,) where it is the lobe of a coat, with a base below."""
        return np.isfinite(self.ior) & (self.strength > 0).any(axis=1)

    @property
    def key(self) -> bytes:
        """Says which lobe it is, but for its strength."""
        return self.alpha.tobytes() + self.ior.tobytes()

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


def shine(lit: Lit, lobe: Lobe) -> Array:
    """S (n, k, c) of a lobe, with shadows."""
    q = lit.evidence.q
    value = kept(lit, ("shine", lobe.key), lambda: glare(lit, lobe)(lit.lights.positions))
    strength = np.broadcast_to(lobe.strength, (len(q), q.channels))
    return np.asarray((value * lit.seen.T)[:, :, None] * strength[:, None])


def shine_slope(lit: Lit, lobe: Lobe) -> Array:
    """Its slope (n, k, c, d)."""
    q = lit.evidence.q
    value = kept(lit, ("slope", lobe.key), lambda: sloped(lit, glare(lit, lobe)))
    strength = np.broadcast_to(lobe.strength, (len(q), q.channels))
    return np.asarray((value * lit.seen.T[:, :, None])[:, :, None] * strength[:, None, :, None])


def glare(lit: Lit, lobe: Lobe) -> Callable[[Array], Array]:
    """A lobe of unit strength, of lights at (k, 3) places: (n, k)."""
    q = lit.evidence.q
    return lambda places: reflected(lobe, q.positions, q.normals, q.directions, places)


def passed(lit: Lit, alpha: Array) -> Array:
    """What a coat of (n,) roughnesses lets in and out again: (n, k)."""
    places = lit.lights.positions
    return np.asarray(kept(lit, ("passed", alpha.tobytes()), lambda: coat(lit, alpha)(places)))


def passed_slope(lit: Lit, alpha: Array) -> Array:
    """Its slope (n, k, d)."""
    return kept(lit, ("turn", alpha.tobytes()), lambda: sloped(lit, coat(lit, alpha)))


def coat(lit: Lit, alpha: Array) -> Callable[[Array], Array]:
    """`passed` of lights at (k, 3) places."""
    q = lit.evidence.q
    out = let_in(alpha, (q.normals * q.directions).sum(axis=1)[:, None]) / INDEX**2

    def both(places: Array) -> Array:
        away = places - q.positions[:, None]
        cosine = np.einsum("nkx,nx->nk", away, q.normals) / np.linalg.norm(away, axis=2)
        return np.asarray(let_in(alpha, cosine) * out)

    return both


def sloped(lit: Lit, value: Callable[[Array], Array]) -> Array:
    """The slope (n, k, d) of a function of places (k, 3) that gives (n, k), by differences."""
    axes, places = lit.evidence.problem.axes, lit.lights.positions
    step, here = STEP * lit.evidence.problem.size, value(places)
    each = [(value(places + step * (np.arange(3) == axis)) - here) / step for axis in axes]
    return np.stack(each, axis=2)


def kept(lit: Lit, key: tuple[str, bytes], value: Callable[[], Array]) -> Array:
    """A value, computed once for the same lights."""
    if key not in lit.memo:
        lit.memo[key] = value()
    return np.asarray(lit.memo[key])


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
