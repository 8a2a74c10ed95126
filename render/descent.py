"""Mitsuba's differentiable rendering and Adam: what a user would try with a renderer at hand.

What Mitsuba 3.9.1 does with a point light's `position` (each is a test of this file):

- It is flagged as non-differentiable, and an optimizer built from scene parameters drops it
  without a word. Set by hand, from a variable that lives outside the scene parameters, it works.
- `direct` and `path` then deliver the derivative of the shading, equal to
  `lightloc.shading_gradient`. What moves with a shadow's edge is not in it: visibility is a test.
- `prb` and its kin raise ("not attached to the AD graph"), and `direct_projective`, whose
  gradients are those of moving edges, gives zero: its edges are of shapes, not of a point light.

So positions are variables outside of the scene, written into Mitsuba's own emitters, and what is
rendered is the direct light at the observed points, emitter by emitter: `direct` without the
noise of its choice among lights. Many starts run side by side, each lane of the wavefront with
the emitters of its own start: 32 starts take some 4 times as long as one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from lightloc import Observations, PointLights
from render.geometry import LIGHT
from render.room import Room, relight
from render.transport import is_free, probe

SEED = 2018
FAINTEST = 1e-8  # of the brightest start: none is fainter, so that its logarithm is a number
TINY = 1e-30  # keeps a division by zero from start lights that nothing sees


@dataclass(frozen=True)
class Adam:
    """How long and how fast `optimize` descends.

    Tried on up to ten scenes (five rooms, 2 and 4 lights): rates of .003, .01 and .03, 500 and
    1000 steps, a memory of .99 and .999, and as the loss squared errors that are relative, absolute
    or over sigma. With 4 lights 4 to 5 times as many starts succeed at 1000 steps as at 500. With
    Adam's own memory of .999 one huge gradient beside a wall slows a light for hundreds of steps.

    Parameters
    ----------
    starts : int
        Random starts, which run side by side.
    steps : int
        Of each.
    points : int
        Observations that are rendered, chosen at random.
    rate : float
        Of the room's diagonal, a step of a position.
    log_rate : float
        A step of an intensity's logarithm.
    slowdown : float
        Both rates fall to this share by the last step.
    memory : float
        Its beta_2.
    dark : float
        Of the median standard error: none counts as smaller.
    inset : float
        Of the room's size: no light comes nearer to the walls of its box.

    Examples
    --------
    >>> from render import Adam
    >>> Adam(starts=8).steps
    1000
    """

    starts: int = 32
    steps: int = 1000
    points: int = 2048
    rate: float = 0.01
    log_rate: float = 0.05
    slowdown: float = 0.01
    memory: float = 0.99
    dark: float = 0.3
    inset: float = 0.01


@dataclass(frozen=True, eq=False)
class Descent:
    """Where all starts ended, and the one with the least loss.

    Parameters
    ----------
    lights
        Of the best start.
    positions : (m, k, 3) array
        In the room's unit of length.
    intensities : (m, k, c) array
        W/sr.
    losses : (m,) array
        Mean of the squared residuals in standard errors; infinite where one is none.
    """

    lights: PointLights
    positions: NDArray[np.float64]
    intensities: NDArray[np.float64]
    losses: NDArray[np.float64]


@dataclass(frozen=True)
class Lamps:
    """A room lit by k point emitters that can be put elsewhere; its own lights are not in it."""

    room: Room
    parameters: Any
    count: int

    @staticmethod
    def of(room: Room, count: int) -> Lamps:
        middle = np.tile(room.bounds.mean(axis=0), (count, 1))
        lit = relight(room, PointLights(middle, np.ones((count, 1)), room.unit))
        return Lamps(lit, mi.traverse(lit.scene), count)

    def put(self, positions: list[Any], intensities: list[Any]) -> None:
        """Write k Point3f and k Color3f, each one value or one per lane, into the emitters."""
        for i, (p, I) in enumerate(zip(positions, intensities, strict=True), start=1):
            self.parameters[f"{LIGHT.format(i)}.position"] = p
            self.parameters[f"{LIGHT.format(i)}.intensity.value"] = I
        self.parameters.update()

    def radiance(self, si: Any) -> Any:
        """Direct radiance at surface interactions (Color3f), with its derivatives."""
        scene, context, bsdf = self.room.scene, mi.BSDFContext(), si.bsdf()
        total = mi.Color3f(0)
        for emitter in scene.emitters():
            sample, incident = emitter.sample_direction(si, mi.Point2f(0.5))
            lit = is_free(scene, si, dr.detach(sample.p))
            scattered = bsdf.eval(context, si, si.to_local(sample.d))
            total += dr.select(lit, incident * scattered, 0)
        return total


def optimize(
    room: Room, q: Observations, count: int, *, options: Adam | None = None, seed: int = SEED
) -> Descent:
    """Find lights by gradient descent through Mitsuba's differentiable renderer, a rival of ours.

    Adam descends from random places in the room's box to ``count`` lights that explain ``q``. The
    loss is the mean of ((B - rendered) / sigma)^2. No sigma counts as less than 0.3 of their
    median; where more than half of them are 0, the mean of B takes the place of all.

    Parameters
    ----------
    room : Room
        Its surfaces are rendered; its lights are not looked at.
    q : Observations
        Direct light at points of the room.
    count : int
        Number of lights.
    options : Adam, optional
        How long and how fast to descend (`render.descent.Adam`); its own values where None.
    seed : int
        Seed of the starts, and of the choice of observations.

    Returns
    -------
    Descent
        ``lights`` of the best start; ``positions`` (m, k, 3) and ``intensities`` (m, k, c) in the
        room's unit of length, and ``losses`` (m,) of all m.

    Raises
    ------
    ValueError
        If ``q`` holds interreflected light, or ``count`` is below 1.

    Examples
    --------
    >>> import numpy as np
    >>> from render import load, observe, optimize
    >>> from render.descent import Adam
    >>> room = load("box_one")
    >>> q = observe(room, points=256, transport="direct")
    >>> there = optimize(room, q, 1, options=Adam(starts=2, steps=200))
    >>> bool(np.allclose(there.lights.positions, room.lights.positions, atol=0.01))
    True
    """
    if q.interreflected or count < 1:
        raise ValueError("optimize expects direct light and at least one light")
    o = options or Adam()
    rng = np.random.default_rng(seed)
    lamps = Lamps.of(room, count)
    seen = _Seen.of(lamps, q, np.sort(rng.permutation(len(q))[: o.points]), o)
    low, high = room.bounds
    margin = o.inset * (high - low)
    corners = [mi.Point3f(corner.tolist()) for corner in (low + margin, high - margin)]
    places = rng.uniform(low + margin, high - margin, (o.starts * count, 3))
    adam = mi.ad.Adam(lr=o.rate, beta_2=o.memory)
    adam["position"] = mi.Point3f(places.T.astype(np.float32))
    adam["log"] = dr.zeros(mi.Color3f, len(places))
    adam["log"] = dr.repeat(seen.best_scale(lamps, adam), count)
    for step in range(o.steps):
        slower = o.slowdown ** (step / o.steps)
        adam.set_learning_rate(
            {"position": o.rate * room.diagonal * slower, "log": o.log_rate * slower}
        )
        dr.backward(dr.sum(seen.losses(lamps, adam)))
        for name in ("position", "log"):  # one light on a surface must not end all starts
            slope = dr.grad(adam[name])
            dr.set_grad(adam[name], dr.select(dr.isfinite(slope), slope, 0))
        adam.step()
        adam["position"] = dr.clip(dr.detach(adam["position"]), *corners)
    losses = np.array(seen.losses(lamps, adam), float)
    losses = np.where(np.isfinite(losses), losses, np.inf)
    positions = np.array(adam["position"], float).T.reshape(-1, count, 3)
    intensities = np.array(dr.exp(adam["log"]), float).T.reshape(-1, count, 3)[..., : q.channels]
    best = int(np.argmin(losses))
    lights = PointLights(positions[best], intensities[best], room.unit)
    return Descent(lights, positions, intensities, losses)


@dataclass(frozen=True)
class _Seen:
    """What all starts are compared with: each observation once for each start, start by start."""

    si: Any
    B: Any  # Color3f
    weight: Any  # Color3f, 1 / sigma; in one channel of three where B has but one
    n: int
    starts: int

    @staticmethod
    def of(lamps: Lamps, q: Observations, some: NDArray, o: Adam) -> _Seen:
        n = len(some)
        lane = dr.tile(dr.arange(mi.UInt32, n), o.starts)
        si = probe(lamps.room.scene, q.positions[some], q.directions[some])
        sigma = np.maximum(q.known_sigma, o.dark * np.median(q.known_sigma, axis=0))
        if not sigma.all():
            sigma = np.broadcast_to(q.radiance.mean(axis=0), sigma.shape)
        B, weight = np.zeros((n, 3)), np.zeros((n, 3))
        B[:, : q.channels] = q.radiance[some]
        weight[:, : q.channels] = 1 / sigma[some] / np.sqrt(q.channels)
        wide = dr.gather(mi.SurfaceInteraction3f, si, lane)
        B_wide, weight_wide = (
            dr.gather(mi.Color3f, mi.Color3f(rows.T.astype(np.float32)), lane)
            for rows in (B, weight)
        )
        dr.eval(wide, B_wide, weight_wide)
        return _Seen(wide, B_wide, weight_wide, n, o.starts)

    def render(self, lamps: Lamps, adam: Any) -> Any:
        """Every start's lights, rendered at every observation (Color3f)."""
        first = dr.repeat(dr.arange(mi.UInt32, self.starts), self.n) * lamps.count
        each = [first + i for i in range(lamps.count)]
        lamps.put(
            [dr.gather(mi.Point3f, adam["position"], i) for i in each],
            [dr.exp(dr.gather(mi.Color3f, adam["log"], i)) for i in each],
        )
        return lamps.radiance(self.si)

    def losses(self, lamps: Lamps, adam: Any) -> Any:
        """The loss of each start (Float)."""
        z = (self.render(lamps, adam) - self.B) * self.weight
        return dr.block_sum(dr.sum(dr.square(z)), self.n) / self.n

    def best_scale(self, lamps: Lamps, adam: Any) -> Any:
        """The logarithm of the one intensity for all lights of a start that has the least loss."""
        rendered = dr.detach(self.render(lamps, adam)) * self.weight
        scale = [
            dr.block_sum(own * B, self.n) / dr.maximum(dr.block_sum(own * own, self.n), TINY)
            for own, B in zip(rendered, self.B * self.weight, strict=True)
        ]
        bright = mi.Color3f(scale)
        least = FAINTEST * dr.max(dr.max(bright, axis=None))
        return dr.log(dr.maximum(bright, dr.maximum(least, TINY)))
