"""GGX: distribution, Smith's masking, Fresnel's equations, the transmittance of a rough coat.

Walter et al., "Microfacet Models for Refraction through Rough Surfaces" (EGSR 2007), equations
33 and 34; visible normals after Heitz (2018). Written for Dr.Jit arrays except for the coat's
table, which is computed once a material in NumPy.
"""

from __future__ import annotations

import functools
from typing import Any

import drjit as dr
import numpy as np
from numpy.typing import NDArray

TABLE_NODES = 64  # nodes in cos(theta) of the transmittance, as Mitsuba's roughplastic has
GRAZING = 1e-10  # cos^2 below which masking's derivative would overflow float32
QUADRATURE_OUTSIDE = 32  # Gauss-Legendre nodes an axis; from inside the coat total reflection
QUADRATURE_INSIDE = 128  # has an edge and needs more


def ggx(alpha: Any, normal: Any, h: Any) -> Any:
    """D(h). The tangential part of h is formed first: 1 - cos^2 would cancel in float32."""
    cos_h = dr.dot(normal, h)
    across = dr.squared_norm(h - normal * cos_h)
    return dr.rcp(dr.pi * dr.square(alpha) * dr.square(across / dr.square(alpha) + cos_h * cos_h))


def smith(alpha: Any, normal: Any, v: Any) -> Any:
    """G1(v) = 2 / (1 + sqrt(1 + alpha^2 tan^2))."""
    cos_v = dr.dot(normal, v)
    tan2 = dr.squared_norm(v - normal * cos_v) / dr.maximum(dr.square(cos_v), GRAZING)
    return 2 / (1 + dr.sqrt(1 + dr.square(alpha) * tan2))


def fresnel_conductor(cosine: Any, eta: Any, k: Any) -> Any:
    """Unpolarized reflectance at a conductor with index eta + i k."""
    cos2 = cosine * cosine
    sin2 = 1 - cos2
    u = eta * eta - k * k - sin2
    a2_b2 = dr.sqrt(u * u + 4 * eta * eta * k * k)
    twice_a_cos = 2 * cosine * dr.safe_sqrt(0.5 * (a2_b2 + u))
    s_wave = (a2_b2 + cos2 - twice_a_cos) / (a2_b2 + cos2 + twice_a_cos)
    p_over_s = (cos2 * a2_b2 + sin2 * sin2 - twice_a_cos * sin2) / (
        cos2 * a2_b2 + sin2 * sin2 + twice_a_cos * sin2
    )
    return 0.5 * s_wave * (1 + p_over_s)


def fresnel_dielectric(cosine: Any, eta: Any) -> Any:
    """Unpolarized reflectance entering a dielectric of relative index eta >= 1."""
    inner = dr.sqrt(1 - (1 - cosine * cosine) / (eta * eta))
    s_wave = (cosine - eta * inner) / (cosine + eta * inner)
    p_wave = (eta * cosine - inner) / (eta * cosine + inner)
    return 0.5 * (s_wave * s_wave + p_wave * p_wave)


@functools.lru_cache(maxsize=256)
def transmittance_table(alpha: float, eta: float) -> tuple[NDArray[np.float64], float]:
    """Light that a rough coat lets in, and the part that it reflects back inside.

    Returns (T, r): T (64,) at cosines 0, 1/63 .. 1 from outside, r the cosine-weighted mean
    reflectance from within.
    """
    cosines = np.maximum(np.linspace(0, 1, TABLE_NODES), 1e-6)
    outside = np.array([_coat(alpha, mu, eta, QUADRATURE_OUTSIDE)[1] for mu in cosines])
    inside = np.array([_coat(alpha, mu, 1 / eta, QUADRATURE_INSIDE)[0] for mu in cosines])
    return outside, float(np.mean(inside * cosines) * 2)


def _coat(alpha: float, mu: float, eta: float, nodes: int) -> tuple[float, float]:
    """(reflected, transmitted) share of a beam at cosine mu: the mean over visible normals."""
    x, weight = np.polynomial.legendre.leggauss(nodes)
    u, v = np.meshgrid(0.5 * x + 0.5, 0.5 * x + 0.5)
    area = np.outer(weight, weight) / 4
    wi = np.array([np.sqrt(1 - mu * mu), 0.0, mu])
    m = _visible_normals(alpha, wi, u, v)
    cos_i = m @ wi
    ratio = np.where(cos_i > 0, eta, 1 / eta)
    cos_t2 = 1 - (1 - cos_i**2) / ratio**2
    cos_t = np.sqrt(np.maximum(cos_t2, 0))
    c = np.abs(cos_i)
    s_wave = (c - ratio * cos_t) / (c + ratio * cos_t)
    p_wave = (ratio * c - cos_t) / (ratio * c + cos_t)
    reflectance = np.where(cos_t2 > 0, 0.5 * (s_wave**2 + p_wave**2), 1.0)
    back = 2 * cos_i[..., None] * m - wi
    through = m * (c / ratio - cos_t)[..., None] - wi / ratio[..., None]
    reflected = np.where(back[..., 2] > 0, _smith(alpha, back[..., 2]) * reflectance, 0)
    transmitted = np.where(
        through[..., 2] < 0, _smith(alpha, through[..., 2]) * (1 - reflectance), 0
    )
    return float((reflected * area).sum()), float((transmitted * area).sum())


def _smith(alpha: float, cosine: NDArray[np.float64]) -> NDArray[np.float64]:
    cos2 = np.clip(cosine**2, 1e-12, 1)
    return 2 / (1 + np.sqrt(1 + alpha**2 * (1 - cos2) / cos2))


def _visible_normals(
    alpha: float, wi: NDArray[np.float64], u: NDArray[np.float64], v: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Map the unit square to GGX normals as seen from wi (Heitz 2018), concentric disc."""
    stretched = np.array([alpha * wi[0], alpha * wi[1], wi[2]])
    stretched /= np.linalg.norm(stretched)
    a, b = 2 * u - 1, 2 * v - 1
    wide = np.abs(a) > np.abs(b)
    radius = np.where(wide, a, b)
    with np.errstate(divide="ignore", invalid="ignore"):
        angle = np.where(wide, np.pi / 4 * b / a, np.pi / 2 - np.pi / 4 * a / b)
    angle = np.where(radius == 0, 0.0, angle)
    x, y = radius * np.cos(angle), radius * np.sin(angle)
    s = 0.5 * (1 + stretched[2])
    y = (1 - s) * np.sqrt(np.maximum(1 - x * x, 0)) + s * y
    z = np.sqrt(np.maximum(1 - x * x - y * y, 0))
    along = np.array([-stretched[2], 0.0, stretched[0]])  # wi lies in the xz plane
    across = np.array([0.0, 1.0, 0.0])
    h = x[..., None] * across + y[..., None] * along + z[..., None] * stretched
    h = np.stack([alpha * h[..., 0], alpha * h[..., 1], np.maximum(h[..., 2], 0)], axis=-1)
    return h / np.linalg.norm(h, axis=-1, keepdims=True)
