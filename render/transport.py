"""Light transport at surface points: direct light by light, indirect and other light by paths."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from lightloc.given import RAY_OFFSET
from render.material import bsdf_of

Transport = Literal["direct", "full"]

SHADOW_EPSILON = 8.9e-4  # share of a shadow ray left out at its far end, as in Mitsuba
PROBE_SHARE = 1e-3  # a probe starts this share of the scene's diagonal off the surface
SMALLEST = 0.03  # diagonal: paths leave a surface by 9e-5, so that B is off by 0.5 % (measured)
LANES = 1 << 21  # samples in one wavefront of the path integrator
POOL = 16  # neighbours whose standard errors are pooled
DARKEST = 1e-3  # albedo that counts as black
LONGEST = 2**31 - 1  # path that Mitsuba can be asked for
KNOWN = 0x0B5E55  # goes into the seed of known light: its errors are its own
FACING = 0.1  # of the diagonal: how far apart opposite normals count as


def bounds_of(scene: Any) -> NDArray[np.float64]:
    """(2, 3) lower and upper corner of the surfaces' box, in the scene's unit of length."""
    boxes = [shape.bbox() for shape in scene.shapes()]
    return np.array(
        [
            np.min([np.array(box.min).ravel() for box in boxes], axis=0),
            np.max([np.array(box.max).ravel() for box in boxes], axis=0),
        ]
    )


def diagonal_of(scene: Any) -> float:
    """Length of that box's diagonal."""
    low, high = bounds_of(scene)
    return float(np.linalg.norm(high - low))


def probe(scene: Any, x: NDArray, w: NDArray) -> Any:
    """Surface interactions at (n, 3) points x, each seen along its direction w."""
    reach = PROBE_SHARE * diagonal_of(scene)
    ray = mi.Ray3f(mi.Point3f((x + reach * w).T), mi.Vector3f(-w.T))
    si = scene.ray_intersect(ray)
    dr.eval(si)
    return si


def direct(scene: Any, si: Any) -> NDArray[np.float64]:
    """(n, 3) direct radiance at interactions, W sr^-1 m^-2.

    Exact, by Mitsuba's emitters, shadow rays and BSDFs.
    """
    context, bsdf = mi.BSDFContext(), si.bsdf()
    total = mi.Color3f(0)
    for emitter in scene.emitters():
        sample, incident = emitter.sample_direction(si, mi.Point2f(0.5))
        lit = is_free(scene, si, sample.p)
        total += dr.select(lit, incident * bsdf.eval(context, si, si.to_local(sample.d)), 0)
    return np.broadcast_to(to_numpy(total), (dr.width(si), 3))


def is_free(scene: Any, si: Any, p: Any) -> Any:
    """Whether nothing lies between surface interactions and points, by shadow rays."""
    start = off_surface(scene, si, p - si.p)
    d = p - start
    distance = dr.norm(d)
    return ~scene.ray_test(mi.Ray3f(start, d / distance, distance * (1 - SHADOW_EPSILON), 0, []))


def off_surface(scene: Any, si: Any, d: Any) -> Any:
    """Where rays along d leave surface interactions: nearer than Mitsuba's in a scene below 1."""
    size = min(1.0, float(dr.norm(scene.bbox().extents())))
    off = RAY_OFFSET * (size + dr.max(dr.abs(si.p)))
    return si.p + si.n * dr.mulsign(off, dr.dot(si.n, d))


def indirect(
    scene: Any,
    si: Any,
    spp: int,
    seed: int,
    watch: Callable[[float], None] = lambda share: None,
    max_depth: int | None = None,
) -> tuple[NDArray, NDArray]:
    """Interreflected radiance at interactions, and its standard error, (n, 3) W sr^-1 m^-2 each.

    One BSDF-sampled bounce by hand, then Mitsuba's path integrator from there: what arrives
    straight from the lights is left to `direct`, which needs no samples.
    """
    path = _paths(max_depth and max_depth - 1)

    def sample(here: Any, sampler: Any) -> Any:
        chosen, weight = here.bsdf().sample(
            mi.BSDFContext(), here, sampler.next_1d(), sampler.next_2d()
        )
        ray = here.spawn_ray(here.to_world(chosen.wo))
        scattered = dr.any(weight > 0)  # not so where a blend, seen from behind, has NaN
        radiance, valid, _ = path.sample(scene, sampler, ray, active=scattered)
        return dr.select(scattered & valid, weight * radiance, 0)

    mean, error = _averaged(scene, si, sample, spp, seed, watch)
    return mean, _pooled(error, si, diagonal_of(scene))


def known_light(
    scene: Any,
    x: NDArray,
    w: NDArray,
    spp: int,
    seed: int,
    transport: Transport,
    watch: Callable[[float], None] = lambda share: None,
    max_depth: int | None = None,
) -> tuple[NDArray, NDArray]:
    """Radiance by a scene's own emitters, of any kind, at points x along w, and its standard error.

    Each is (n, 3), W sr^-1 m^-2. What arrives straight from emitters that are points or come from
    one direction is exact; where there are others, all is sampled by Mitsuba's path integrator.
    """
    own = int(np.random.SeedSequence([KNOWN, seed]).generate_state(1)[0])
    si = probe(scene, x, w)
    if all(mi.has_flag(emitter.flags(), mi.EmitterFlags.Delta) for emitter in scene.emitters()):
        straight = direct(scene, si)
        if transport == "direct":
            return straight, np.zeros((len(x), 3))
        more, error = indirect(scene, si, spp, own, watch, max_depth)
        return straight + more, error
    path = _paths(2 if transport == "direct" else max_depth)
    reach = PROBE_SHARE * diagonal_of(scene)

    def sample(here: Any, sampler: Any) -> Any:
        towards = here.to_world(here.wi)
        ray = mi.Ray3f(here.p + reach * towards, -towards)
        radiance, valid, _ = path.sample(scene, sampler, ray)
        return dr.select(valid, radiance, 0)

    mean, error = _averaged(scene, si, sample, spp, own, watch)
    return mean, _pooled(error, si, diagonal_of(scene))


def irradiance(
    scene: Any,
    x: NDArray,
    n: NDArray,
    spp: int,
    seed: int,
    *,
    straight: bool,
    bounced: bool,
    max_depth: int | None = None,
) -> tuple[NDArray, NDArray]:
    """Irradiance by a scene's emitters at points x facing n, and its standard error.

    Each is (n, 3), W m^-2. It is of light that arrives straight from emitters, or by way of
    surfaces, or both. The points need not lie on surfaces.
    """
    meters = dr.zeros(mi.SurfaceInteraction3f, len(x))
    meters.p, meters.n = mi.Point3f(x.T), mi.Normal3f(n.T)
    path = _paths(max_depth and max_depth - 1)

    def sample(here: Any, sampler: Any) -> Any:
        total = mi.Color3f(0)
        for emitter in scene.emitters() if straight else ():
            to, incident = emitter.sample_direction(here, sampler.next_2d())
            lit = is_free(scene, here, to.p)
            total += dr.select(lit, incident * dr.maximum(dr.dot(here.n, to.d), 0), 0)
        if bounced:
            d = mi.warp.square_to_cosine_hemisphere(sampler.next_2d())
            ray = here.spawn_ray(mi.Frame3f(here.n).to_world(d))
            radiance, valid, _ = path.sample(scene, sampler, ray)
            first = scene.ray_intersect(ray)
            emitted = first.emitter(scene).eval(first)  # light that arrives straight
            total += dr.pi * dr.select(valid, radiance - emitted, 0)
        return total

    mean, error = _averaged(scene, meters, sample, spp, seed, lambda share: None)
    alike = np.zeros(len(x), int)
    return mean, _shared(error, alike, x, FACING * diagonal_of(scene) * n)


def _paths(max_depth: int | None) -> Any:
    """Mitsuba's paths up to that length, or until they carry nothing."""
    depth = -1 if max_depth is None else min(max_depth, LONGEST)
    return mi.load_dict({"type": "path", "max_depth": depth, "rr_depth": 8})


def _averaged(
    scene: Any,
    si: Any,
    sample: Callable[[Any, Any], Any],
    spp: int,
    seed: int,
    watch: Callable[[float], None],
) -> tuple[NDArray, NDArray]:
    """(n, 3) mean of ``spp`` samples at each of n interactions, and its standard error.

    Raises ValueError where the scene is too small for Mitsuba's paths.
    """
    n, across = dr.width(si), diagonal_of(scene)
    if across < SMALLEST:
        raise ValueError(
            f"the scene is only {across:.2g} units of length across, too small for Mitsuba's paths "
            f"(expected at least {SMALLEST:g}): write it in a smaller unit, as mm"
        )
    sampler = mi.load_dict({"type": "independent", "sample_count": spp})
    mean, error = np.zeros((n, 3)), np.zeros((n, 3))
    rows = max(1, LANES // spp)
    for block, first in enumerate(range(0, n, rows)):
        count = min(rows, n - first)
        lane = dr.arange(mi.UInt32, count * spp) // spp + first
        here = dr.gather(mi.SurfaceInteraction3f, si, lane)
        sampler.seed((seed * 1000003 + block) % 2**32, count * spp)
        value = sample(here, sampler)
        dr.eval(value)  # or each sum would trace the paths again
        sums = [dr.block_sum(channel, spp) for channel in value]
        squares = [dr.block_sum(dr.square(channel), spp) for channel in value]
        dr.eval(sums, squares)
        m, m2 = np.array(sums, float).T / spp, np.array(squares, float).T / spp
        mean[first : first + count] = m
        error[first : first + count] = np.sqrt(np.maximum(m2 - m * m, 0) / (spp - 1))
        watch((first + count) / n)
    return mean, error


def _pooled(error: NDArray, si: Any, diagonal: float) -> NDArray[np.float64]:
    """(n, 3) root mean square of the standard errors over points that are alike.

    These have one BSDF, lie nearby and face alike. Of diffuse ones it is taken as a share of their
    albedo, which may be a texture's.

    A point's own estimate rises and falls with its samples: a fit weighted by it trusts low
    values most, which pulled intensities down by 2 to 5 % (measured, 256 spp).
    """
    bsdf = si.bsdf()
    which = bsdf_of(si)
    kind, flags = bsdf.flags(), mi.BSDFFlags
    lobed = mi.has_flag(kind, flags.Glossy) | mi.has_flag(kind, flags.Delta)
    plain = mi.has_flag(kind, flags.DiffuseReflection) & ~lobed
    albedo = np.maximum(to_numpy(dr.select(plain, bsdf.eval_diffuse_reflectance(si), 1)), DARKEST)
    n = FACING * diagonal * to_numpy(si.sh_frame.n)
    alike = np.broadcast_to(np.array(plain), len(which)) & (albedo > DARKEST).all(axis=1)
    which = np.where(alike, -1, which)  # of diffuse surfaces the shares are of one kind
    return albedo * _shared(error / albedo, which, to_numpy(si.p), n)


def _shared(error: NDArray, which: NDArray, *features: NDArray) -> NDArray[np.float64]:
    """(n, c) root mean square of the standard errors over the `POOL` points nearest in features.

    They are of the same kind, ``which`` (n,), and a point's own is not among them unless there is
    no other: it is large where the point's own mean is, so that a fit weighted by it would trust
    means that happen to be low.
    """
    place, square, pooled = np.concatenate(features, axis=1), np.square(error), np.square(error)
    for kind in np.unique(which):
        rows = np.flatnonzero(which == kind)
        if len(rows) < 2 or not square[rows].any():  # as of all rays that meet nothing
            continue
        _, near = cKDTree(place[rows]).query(place[rows], k=min(POOL + 1, len(rows)))
        others = near != np.arange(len(rows))[:, None]
        total = np.where(others[..., None], square[rows][near], 0).sum(axis=1)
        pooled[rows] = total / others.sum(axis=1)[:, None]
    return np.sqrt(pooled)


def to_numpy(v: Any) -> NDArray[np.float64]:
    """Dr.Jit's or Mitsuba's vectors as an (n, 3) array."""
    return np.array(v, dtype=np.float64).T
