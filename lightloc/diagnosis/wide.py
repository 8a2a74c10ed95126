"""Wide lights: patches that shine alike in all directions, or panels that shine to one side.

A patch is a parallelogram about the light's place. Its unknowns are its half sides: in the plane
one vector, which makes it a line. A panel shines as a diffuse surface does, by the cosine.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from lightloc.answer import Kind
from lightloc.diagnosis.departure import Array, Departure, Lit, Modelled
from lightloc.diagnosis.emission import starts as facing
from lightloc.diagnosis.lamps import seen_from, tangents
from lightloc.given import PointLights

FINE, COARSE, MANY = 5, 3, 20_000
"""Points along a side, and where there are so many pairs of an observation and a light."""

HALF, LARGEST = 0.06, 0.3
"""Half sides to begin with, and at most, of the region's longest side."""

BORDER = 1e-3
"""Of the region's longest side: as near to its border, a light is at it."""

EVEN = 2 / np.sqrt(3)
"""Twice the standard deviation of what is evenly bright along a side, in half sides."""

PATCHES, PANELS = "the width of lights", "lights that are panels"

TRIAL = "the lights as told: the middles of lights so wide, with their whole intensities"


def wide(lit: Lit) -> list[Departure]:
    """All lights as patches, unless one is at the border: it may be outside."""
    problem, (low, high) = lit.evidence.problem, lit.evidence.problem.bounds[:, None]
    p, axes = lit.lights.positions, lit.evidence.problem.axes
    near = np.minimum(p - low, high - p)[:, axes]
    if not near.size or near.min() < BORDER * problem.size:
        return []
    return [departure(lit, PATCHES, patches, across)]


def panels_of(lit: Lit) -> Departure:
    """All lights as panels, which lamps are asked for that do not explain: a small one is one."""
    return departure(lit, PANELS, panels, before)


def departure(
    lit: Lit,
    name: str,
    model: Callable[[Lit, Array], Modelled],
    starts: Callable[[Lit], Array],
) -> Departure:
    """Every light with half sides of its own."""
    d = len(lit.evidence.problem.axes)
    each, most = (d - 1) * d, LARGEST * lit.evidence.problem.size
    unit = lit.evidence.problem.unit

    def said(u: Array, e: Array) -> str:
        sides, errors = (2 * np.linalg.norm(a.reshape(-1, d - 1, d), axis=2) for a in (u, e))
        one, many = ("a panel", "panels") if name == PANELS else ("a patch", "patches")
        parts = [
            f"light {i} of {' x '.join(f'{a:.2g}' for a in side)} (± {error.max():.1g}) {unit}"
            for i, (side, error) in enumerate(zip(sides, errors, strict=True), 1)
        ]
        what = one if len(parts) == 1 else f"{many}, each"
        return f"no points shine here but {what}: {', '.join(parts)}"

    return Departure(
        Kind.EXTENDED,
        name,
        model,
        lambda lit, u: model(lit, u).by_unknowns,
        starts,
        said,
        TRIAL,
        lambda lit: np.outer([-most, most], np.ones(each * len(lit.lights))),
        none=0,
        kept=lambda u, some: u.reshape(-1, each)[some].ravel(),
        more=lambda u, k: np.append(u, u[-each:]),
        width=lambda u: (
            2 / np.sqrt(3) * np.linalg.norm(u.reshape(-1, d - 1, d), axis=2).max(axis=1)
        ),
    )


def across(lit: Lit) -> Array:
    """Flat along each plane of two axes, or along each axis."""
    k, axes = len(lit.lights), lit.evidence.problem.axes
    eye = HALF * lit.evidence.problem.size * np.eye(len(axes))
    return np.stack([np.tile(np.delete(eye, i, axis=0).ravel(), k) for i in range(len(axes))])


def before(lit: Lit) -> Array:
    """Facing where each light shines most."""
    k, axes = len(lit.lights), lit.evidence.problem.axes
    d = len(axes)
    ahead = np.zeros((k, 3))
    ahead[:, axes] = facing(lit).reshape(k, d)
    dull = ~ahead.any(axis=1)
    ahead[dull, axes[-1]] = -1.0
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    sides = tangents(ahead, axes)[:, :, axes]
    if d == 2:
        sides = -sides  # that it faces where it is to
    return (HALF * lit.evidence.problem.size * sides).reshape(1, -1)


def patches(lit: Lit, u: Array) -> Modelled:
    """B of patches."""
    return summed(lit, u, panel=False)


def panels(lit: Lit, u: Array) -> Modelled:
    """B of panels."""
    return summed(lit, u, panel=True)


def summed(lit: Lit, u: Array, panel: bool) -> Modelled:
    """B of all points that lights with half sides u are made of."""
    problem, k = lit.evidence.problem, len(lit.lights)
    (n, c), axes = problem.radiance.shape, problem.axes
    d = len(axes)
    half = u.reshape(k, d - 1, d)
    at, weight = spots(FINE if n * k < MANY else COARSE, d - 1)
    m = len(at)
    places = np.repeat(lit.lights.positions, m, axis=0)
    places[:, axes] += np.einsum("mj,kjx->kmx", at, half).reshape(k * m, d)
    places = np.clip(places, *problem.bounds)  # as lights are
    points = PointLights(places, np.ones((k * m, c)))
    S, slope = replace(lit, lights=points, memo={}).brought
    S, slope = S.reshape(n, k, m, c), slope.reshape(n, k, m, c, d)
    each = (d - 1) * d
    turned = np.zeros((n, k, c, each))
    if panel:
        w, far = seen_from(problem, places)
        w, far = w[:, :, axes].reshape(n, k, m, d), far.reshape(n, k, m)
        normal, by = normals(half)
        t = np.einsum("nkmx,kx->nkm", w, normal)
        on = t > 0
        along = -(normal[:, None] - t[..., None] * w) / far[..., None] * on[..., None]
        slope = np.maximum(t, 0)[..., None, None] * slope + S[..., None] * along[:, :, :, None]
        turned = np.einsum("nkmx,kux->nkmu", w, by) * on[..., None]
        turned = np.einsum("m,nkmu,nkmc->nkcu", weight, turned, S)
        S = S * np.maximum(t, 0)[..., None]
    by_half = turned + np.einsum("m,mj,nkmcx->nkcjx", weight, at, slope).reshape(n, k, c, each)
    by_half = (by_half * lit.lights.intensities[:, :, None]).swapaxes(1, 2).reshape(n, c, k * each)
    return lit.summed(
        np.einsum("m,nkmc->nkc", weight, S), np.einsum("m,nkmcx->nkcx", weight, slope), by_half
    )


def spots(count: int, d: int) -> tuple[Array, Array]:
    """(m, d) where points of a light are along its sides, and (m,) how bright: Gauss, Legendre."""
    x, share = np.polynomial.legendre.leggauss(count)
    at = np.stack(np.meshgrid(*[x] * d, indexing="ij"), axis=-1).reshape(-1, d)
    weight = np.prod(np.stack(np.meshgrid(*[share / 2] * d, indexing="ij"), axis=-1), axis=-1)
    return at, weight.ravel()


def normals(half: Array) -> tuple[Array, Array]:
    """(k, d) where half sides (k, d - 1, d) face, with derivatives (k, (d - 1) d, d)."""
    k, _, d = half.shape
    eye = np.eye(d)
    if d == 2:
        turn = np.array([[0.0, 1.0], [-1.0, 0.0]])
        normal, by = half[:, 0] @ turn, np.tile(eye @ turn, (k, 1, 1))
    else:
        u, v = half[:, :1], half[:, 1:]
        normal = np.cross(u, v)[:, 0]
        by = np.concatenate([np.cross(eye, v), np.cross(u, eye)], axis=1)
    size = np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    normal = normal / size
    by = by - np.einsum("kux,kx->ku", by, normal)[..., None] * normal[:, None]
    return normal, by / size[:, None]
