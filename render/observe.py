"""Observe a room by probes: points on its surfaces, and B(q) at each with its standard error."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, Literal

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from lightloc import Mixed, Observations
from lightloc.given import SceneMaterial
from render.material import bsdf_of, material_at
from render.room import Room

Transport = Literal["direct", "full"]

PROBE_SHARE = 1e-3  # a probe starts this share of the room's diagonal off the surface
CLEARANCE = 0.02  # the viewer stands at least this share of the diagonal away
LANES = 1 << 21  # samples in one wavefront of the path integrator
POOL = 16  # neighbours whose standard errors are pooled
DARKEST = 1e-3  # albedo that counts as black
FACING = 0.1  # of the diagonal: how far apart opposite normals count as
ROUNDS = 64  # attempts at placing points before a scene counts as unobservable


def observe(
    room: Room,
    *,
    points: int = 4096,
    spp: int = 256,
    seed: int = 0,
    transport: Transport = "full",
    noise: float = 0.0,
    shapes: Sequence[str] | None = None,
    watch: Callable[[float], None] = lambda share: None,
) -> Observations:
    """Sample the room's surfaces by area and measure B(q) at each point.

    Args:
        points: how many observations.
        spp: path samples per point for the indirect part (``transport="full"``).
        seed: of everything random here; same seed, same bytes, for any number of threads.
        transport: "direct" is exact, light by light; "full" adds all interreflection.
        noise: k of section 6.1: Gaussian noise of k sqrt(B mean(B)) on top (with mean(B) the
            unit, so that it does not depend on the unit of radiance).
        shapes: ids of the shapes to sample; all of them where None.
        watch: is told the share that is done, while paths are traced.

    Raises:
        ValueError: an argument is out of range, a shape is unknown, or no point can be seen.
    """
    if points < 1 or spp < 2 or not 0 <= noise < 1 or transport not in ("direct", "full"):
        raise ValueError(
            "observe expects points >= 1, spp >= 2, 0 <= noise < 1 and transport 'direct' or "
            f"'full'; got {points}, {spp}, {noise:g}, '{transport}'"
        )
    x, w = _viewed_points(room, points, np.random.default_rng(seed), shapes)
    si = probe(room, x, w)
    B, sigma = direct(room, si), np.zeros((points, 3))
    if transport == "full":
        more, sigma = indirect(room, si, spp, seed, watch)
        B = B + more
    q = observations(si, B, sigma, room, interreflected=transport == "full")
    return add_noise(q, noise, seed) if noise else q


def remeasure(room: Room, q: Observations, *, spp: int = 256, seed: int = 0) -> Observations:
    """B at the points and directions of ``q`` in a room that is lit otherwise, without noise.

    Raises ValueError where the lights have colours and ``q`` is grey.
    """
    if room.lights.channels > q.channels:
        raise ValueError("grey observations can't be measured again under coloured lights")
    si = probe(room, q.positions, q.directions)
    B, sigma = direct(room, si), np.zeros((len(q), 3))
    if q.interreflected:
        more, sigma = indirect(room, si, spp, seed)
        B = B + more
    return q.with_radiance(B[:, : q.channels], sigma[:, : q.channels])


def observations(
    si: Any, B: NDArray, sigma: NDArray, room: Room, interreflected: bool = False
) -> Observations:
    """Observations at surface interactions, grey where lights and materials are."""
    material = material_at(si)
    if room.lights.channels == 1 and material.channels == 1:
        B, sigma = B[:, :1], sigma[:, :1]
    w = _numpy(si.to_world(si.wi))

    def seen(n: NDArray) -> NDArray:
        return n * np.where((n * w).sum(axis=1, keepdims=True) < 0, -1.0, 1.0)

    return Observations(
        positions=_numpy(si.p),
        normals=seen(_numpy(si.sh_frame.n)),
        facets=seen(_numpy(si.n)),
        directions=w,
        radiance=B,
        sigma=sigma,
        material=material,
        interreflected=interreflected,
    )


def add_noise(q: Observations, k: float, seed: int) -> Observations:
    """Gaussian shot noise with standard deviation k sqrt(B mean(B)), added to ``sigma``.

    A B that is below zero already gets none more.
    """
    B = np.maximum(q.radiance, 0)
    extra = k * np.sqrt(B * B.mean(axis=0))
    jitter = np.random.default_rng([seed, 1]).normal(size=q.radiance.shape)
    return q.with_radiance(q.radiance + extra * jitter, np.hypot(q.sigma, extra))


def attach(q: Observations, room: Room) -> Observations:
    """Give observations read from a file the BSDFs that only their scene has."""
    parts = q.material.brdfs if isinstance(q.material, Mixed) else (q.material,)
    if not any(isinstance(part, SceneMaterial) for part in parts):
        return q
    return replace(q, material=material_at(probe(room, q.positions, q.directions)))


def probe(room: Room, x: NDArray, w: NDArray) -> Any:
    """Surface interactions at (n, 3) points x, each seen along its direction w."""
    reach = PROBE_SHARE * room.diagonal
    ray = mi.Ray3f(mi.Point3f((x + reach * w).T), mi.Vector3f(-w.T))
    si = room.scene.ray_intersect(ray)
    dr.eval(si)
    return si


def direct(room: Room, si: Any) -> NDArray[np.float64]:
    """Direct radiance at interactions, exact: Mitsuba's emitters, shadow rays and BSDFs.

    Returns (n, 3) W sr^-1 m^-2.
    """
    context, bsdf = mi.BSDFContext(), si.bsdf()
    total = mi.Color3f(0)
    for emitter in room.scene.emitters():
        sample, incident = emitter.sample_direction(si, mi.Point2f(0.5))
        lit = ~room.scene.ray_test(si.spawn_ray_to(sample.p))
        total += dr.select(lit, incident * bsdf.eval(context, si, si.to_local(sample.d)), 0)
    return np.broadcast_to(_numpy(total), (dr.width(si), 3))


def indirect(
    room: Room,
    si: Any,
    spp: int,
    seed: int,
    watch: Callable[[float], None] = lambda share: None,
) -> tuple[NDArray, NDArray]:
    """Interreflected radiance at interactions, and its standard error, each (n, 3).

    One BSDF-sampled bounce by hand, then Mitsuba's path integrator from there: what arrives
    straight from the lights is left to `direct`, which needs no samples.
    """
    n = dr.width(si)
    path = mi.load_dict({"type": "path", "max_depth": -1, "rr_depth": 8})
    sampler = mi.load_dict({"type": "independent", "sample_count": spp})
    mean, error = np.zeros((n, 3)), np.zeros((n, 3))
    rows = max(1, LANES // spp)
    for block, first in enumerate(range(0, n, rows)):
        count = min(rows, n - first)
        lane = dr.arange(mi.UInt32, count * spp) // spp + first
        here = dr.gather(mi.SurfaceInteraction3f, si, lane)
        sampler.seed((seed * 1000003 + block) % 2**32, count * spp)
        sample, weight = here.bsdf().sample(
            mi.BSDFContext(), here, sampler.next_1d(), sampler.next_2d()
        )
        ray = here.spawn_ray(here.to_world(sample.wo))
        radiance, valid, _ = path.sample(room.scene, sampler, ray, active=dr.any(weight > 0))
        value = weight * dr.select(valid, radiance, 0)
        dr.eval(value)  # or each sum would trace the paths again
        sums = [dr.block_sum(channel, spp) for channel in value]
        squares = [dr.block_sum(dr.square(channel), spp) for channel in value]
        dr.eval(sums, squares)
        m, m2 = np.array(sums, float).T / spp, np.array(squares, float).T / spp
        mean[first : first + count] = m
        error[first : first + count] = np.sqrt(np.maximum(m2 - m * m, 0) / (spp - 1))
        watch((first + count) / n)
    return mean, _pooled(error, si, room.diagonal)


def _pooled(error: NDArray, si: Any, diagonal: float) -> NDArray[np.float64]:
    """Root mean square of the standard errors over points of one BSDF that lie nearby and face
    alike; of diffuse ones as a share of their albedo, which may be a texture's.

    A point's own estimate rises and falls with its samples: a fit weighted by it trusts low
    values most, which pulled intensities down by 2 to 5 % (measured, 256 spp).
    """
    bsdf = si.bsdf()
    which = bsdf_of(si)
    kind, flags = bsdf.flags(), mi.BSDFFlags
    lobed = mi.has_flag(kind, flags.Glossy) | mi.has_flag(kind, flags.Delta)
    plain = mi.has_flag(kind, flags.DiffuseReflection) & ~lobed
    albedo = np.maximum(_numpy(dr.select(plain, bsdf.eval_diffuse_reflectance(si), 1)), DARKEST)
    share = error / albedo
    place = [_numpy(si.p), FACING * diagonal * _numpy(si.sh_frame.n), diagonal * which[:, None]]
    features = np.concatenate(place, axis=1)
    _, near = cKDTree(features).query(features, k=min(POOL, len(error)))
    return albedo * np.sqrt(np.square(share[near.reshape(len(error), -1)]).mean(axis=1))


def _viewed_points(
    room: Room, count: int, rng: np.random.Generator, shapes: Sequence[str] | None
) -> tuple[NDArray, NDArray]:
    """Points by area over the shapes, each with a direction from which it is really seen."""
    chosen = _choose(room, shapes)
    areas = np.array([float(np.array(shape.surface_area()).ravel()[0]) for shape in chosen])
    points, views = np.zeros((0, 3)), np.zeros((0, 3))
    for _ in range(ROUNDS):
        want = count - len(points) + 64
        strata = (rng.permutation(want) + rng.random(want)) / want
        which = np.searchsorted(np.cumsum(areas) / areas.sum(), strata).clip(0, len(chosen) - 1)
        uv, disc = rng.random((2, want)), rng.random((2, want))
        for s, shape in enumerate(chosen):
            mine = which == s
            if mine.any():
                x, w = _seen(room, shape, uv[:, mine], disc[:, mine])
                points, views = np.concatenate([points, x]), np.concatenate([views, w])
        if len(points) >= count:
            keep = np.sort(rng.permutation(len(points))[:count])
            return points[keep], views[keep]
    raise ValueError(f"{room.path}: no viewpoint sees enough of the chosen shapes")


def _seen(room: Room, shape: Any, uv: NDArray, disc: NDArray) -> tuple[NDArray, NDArray]:
    """Of sampled points of one shape, those with a cosine-distributed view that is free."""
    on = shape.sample_position(0, mi.Point2f(uv))
    side = mi.Vector3f(on.n)
    if "TwoSided" in shape.bsdf().class_name():  # look from the side that faces the room
        ahead = room.scene.ray_test(mi.Ray3f(on.p + side * PROBE_SHARE * room.diagonal, side))
        behind = room.scene.ray_test(mi.Ray3f(on.p - side * PROBE_SHARE * room.diagonal, -side))
        side = dr.select(behind & ~ahead, -side, side)
    w = mi.Frame3f(side).to_world(mi.warp.square_to_cosine_hemisphere(mi.Point2f(disc)))
    start = on.p + w * (PROBE_SHARE * room.diagonal)
    free = ~room.scene.ray_test(mi.Ray3f(start, w, CLEARANCE * room.diagonal, 0, []))
    back = room.scene.ray_intersect(mi.Ray3f(start, -w))
    same = dr.norm(back.p - on.p) < 0.1 * PROBE_SHARE * room.diagonal
    front = (dr.dot(back.sh_frame.n, w) > 0) | ("TwoSided" in shape.bsdf().class_name())
    good = np.array(free & back.is_valid() & same & front)
    return _numpy(on.p)[good], _numpy(w)[good]


def _choose(room: Room, shapes: Sequence[str] | None) -> list[Any]:
    everything = room.scene.shapes()
    if shapes is None:
        return list(everything)
    by_id = {shape.id(): shape for shape in everything}
    unknown = [name for name in shapes if name not in by_id]
    if unknown or not shapes:
        raise ValueError(
            f"{room.path}: has no shape '{unknown[0] if unknown else ''}' "
            f"(it has: {', '.join(by_id)})"
        )
    return [by_id[name] for name in shapes]


def _numpy(v: Any) -> NDArray[np.float64]:
    return np.array(v, dtype=np.float64).T
