"""Figure 6: a furnished room in place of a scanned one, from noisy points of its walls alone.

We have no scan. The standard scene ``furnished`` is lit by two of its own four lights and its
direct light observed with noise on the diffuse walls and the ceiling; sofa, table and the rest
still cast their shadows. Points in shadow are left out, as a scan's user would leave them out.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

import render
from lightloc import Geodesic, Observations, Paper, PointLights, Votes
from lightloc.fields import Field
from lightloc.fit import Problem
from lightloc.paper import grid_over, optimize, peaks_of, rendered, votes_of
from validation import draw
from validation.figures.page import Drawing
from validation.figures.plane import apart
from validation.figures.solid import OPTIONS, POINTS, SEED

SCENE, LAMPS = "furnished", (0, 3)
WALLS = (
    "ceiling",
    "west_wall",
    "south_wall",
    "north_wall",
)  # the others are hidden more
NOISE = 0.01  # k: a point's mean over 25 pictures with the k = 0.05 of section 6.1
LIT = 0.05  # of the mean B: darker points lie in shadow
SHARE = 0.8  # of the first light that is taken away
OPTIONS_HERE: Paper = replace(OPTIONS, height=0.1, lowering=0.9)  # the highest peaks alone

TITLE = "A furnished room, from noisy points of its walls alone"
PAPER = (
    "A scanned room with two lights, coloured with B(q) (a, b), the recovered lights as red "
    "spheres. From wall points alone: the initial medial axis with V(p) has a clear maximum at "
    "one light (c, circled green); after a few iterations the second is revealed (d)."
)


@dataclass(frozen=True, eq=False)
class Data:
    """The room, the points used, V before and after, and what was found.

    ``q`` has all points of the walls, ``problem`` the lit ones, which are used. ``first`` and
    ``second`` are the highest peaks of both V, (3,) each; ``one`` and ``two`` the lights optimized
    from the first, and from both; ``dark`` counts the points of which more than B was taken away,
    and which have 0 left; ``mse`` and ``expected`` are the mean squared error of the two lights
    and of the noise.
    """

    room: render.Room
    problem: Problem
    q: Observations
    before: Votes
    after: Votes
    first: NDArray[np.float64]
    second: NDArray[np.float64]
    one: PointLights
    two: PointLights
    dark: int
    mse: float
    expected: float


def data(watch: Callable[[float], None]) -> Data:
    full = render.load(SCENE)
    lamps = list(LAMPS)
    room = render.relight(
        full, PointLights(full.lights.positions[lamps], full.lights.intensities[lamps])
    )
    q = render.observe(
        room, points=POINTS, seed=SEED, transport="direct", noise=NOISE, shapes=WALLS
    )
    some = np.flatnonzero(q.radiance[:, 0] > LIT * q.radiance.mean())
    problem = Problem.of(q, q.known_sigma, room.geometry, q.bounds).rows_of(some)
    o, radius = OPTIONS_HERE, q.diagonal / 2
    surface = Geodesic.of(q.positions[some], q.normals[some], o.threshold * radius)
    grid = grid_over(problem.bounds, o)
    field = Field.over(problem.surfels, grid, problem.geometry)
    watch(0.3)

    def vote(B: NDArray) -> tuple[Votes, NDArray[np.float64]]:
        votes = votes_of(field, grid, B, surface, radius, o)[0]
        return votes, peaks_of(votes, problem.rows, radius, o)[0]

    before, first = vote(problem.radiance)
    one, _ = optimize(problem, first[None], grid, radius, o)
    explained = rendered(problem, one.positions) @ one.intensities
    watch(0.6)
    left = problem.radiance - SHARE * explained
    after, second = vote(np.maximum(left, 0.0))
    two, mse = optimize(problem, np.stack([first, second]), grid, radius, o)
    expected = float(np.square(problem.sigma).mean())
    dark = int((left < 0).sum())
    return Data(room, problem, q, before, after, first, second, one, two, dark, mse, expected)


def drawing(watch: Callable[[float], None]) -> Drawing:
    d = data(watch)
    figure = draw.canvas(13.0, 9.6, f"Figure 6. {TITLE}")
    places = figure.add_gridspec(2, 2)
    cells = [places[row, column] for row in (0, 1) for column in (0, 1)]
    bounds, true = d.room.bounds, d.room.lights.positions
    everything = render.observe(d.room, points=POINTS, seed=SEED, transport="direct", noise=NOISE)
    used = d.q.radiance[:, 0] > LIT * d.q.radiance.mean()
    titles = (
        "(a) B(q) of the whole room, with the lights found",
        "(b) B(q) of the points that are used",
        "(c) medial axis with V(p) at first",
        f"(d) V(p) with {SHARE:.0%} of the first light taken away",
    )
    a, b, c, last = (
        draw.space(figure, place, title, bounds) for place, title in zip(cells, titles, strict=True)
    )
    draw.radiance_points(a, everything)
    draw.radiance_points(b, d.q, np.flatnonzero(used))
    draw.cloud(c, d.before)
    draw.cloud(last, d.after)
    for axes in (a, b, c, last):
        draw.true(axes, true)
    draw.found(a, d.two.positions)
    draw.found(c, d.first[None], "candidate", linestyles="--")
    draw.found(last, d.second[None], "new candidate", edgecolors=draw.BLUE, linestyles="--")
    draw.legend(figure, a, c, last)
    watch(1.0)
    return Drawing(6, TITLE, PAPER, sentence(d), figure)


def sentence(d: Data) -> str:
    """What was done and what came out."""
    true = d.room.lights
    off = apart(np.stack([d.first, d.second]), true.positions).min(axis=1)
    end = apart(true.positions, d.two.positions).min(axis=1, initial=np.inf)
    size = d.room.bounds[1] - d.room.bounds[0]
    return (
        f"We have no scan. Scene {SCENE} ({size[0]:.2g} x {size[1]:.2g} x {size[2]:.2g} m), lit by "
        f"two of its four lights; direct light, noise of k = {NOISE:g}; {d.problem.rows} points "
        f"of {len(WALLS)} diffuse planes, known albedos. The first maximum is {off[0]:.2f} m from "
        f"a light. In place of the paper's iterations the light that was optimized from there was "
        f"taken away once, by {SHARE:.0%}: the maximum of what is left lies {off[1]:.2f} m from "
        f"the other light. Optimized together, {len(d.two)} light(s) lie within {end.max():.2g} m "
        f"of the true ones; mean squared error {d.mse:.2g}, of the noise {d.expected:.2g}."
    )
