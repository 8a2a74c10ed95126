"""Figure 1: from I(q,p) of one observation to D(p) and L(p), in a room with one light."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lightloc import Conductor, Observations, PointLights, intensity, radiance
from validation import draw
from validation.figures.page import Drawing
from validation.figures.plane import Scene
from validation.rooms import SQUARE, PlaneRoom

LIGHT, BRIGHT = (0.36, 0.62, 0.0), 2.0  # metres, W/sr: off every symmetry of the square
X0 = 0.66  # of the lower wall
TILT = np.deg2rad(35.0)  # of omega from the normal, to the right
ALPHA = 0.25  # roughness of the shiny x0

TITLE = "From one observation's bound I(q, p) to the field D(p) and its limiters L(p)"
PAPER = (
    "One light (green) in a diffuse square room; B(q) is plotted along each wall. The bound that "
    "a single point x0 (red) puts on a light at p (a), the same if x0 were shiny and seen along "
    "the arrow (b), the least bound of all points, D(p) (c), and which point gives it, L(p) (d)."
)


@dataclass(frozen=True, eq=False)
class Data:
    """The scene, x0's index, omega, and I of x0 as it is and as a microfacet surface, (g,)."""

    scene: Scene
    x0: int
    omega: NDArray[np.float64]
    diffuse: NDArray[np.float64]
    shiny: NDArray[np.float64]

    @property
    def bound_at_light(self) -> float:
        """D in the light's own cell, W/sr: no less than its intensity, but for the grid."""
        D, grid = self.scene.fields[0], self.scene.grid
        cell = np.linalg.norm(grid.points - self.scene.lights.positions, axis=1).argmin()
        return float(D[cell])


def data() -> Data:
    from lightloc import Outline

    lights = PointLights([LIGHT], [BRIGHT])
    scene = Scene.of(PlaneRoom("one light", Outline.polygon(SQUARE), lights, seed=0))
    q = scene.q
    x0 = int(np.linalg.norm(q.positions - [X0, 0, 0], axis=1).argmin())
    omega = np.array([np.sin(TILT), np.cos(TILT), 0.0])
    one = Observations(
        positions=q.positions[[x0]],
        normals=q.normals[[x0]],
        directions=omega[None],
        radiance=[0.0],
        material=Conductor(alpha=ALPHA),
    )
    shiny = one.with_radiance(radiance(one, lights), 0.0)
    plain = Observations(
        positions=q.positions[[x0]],
        normals=q.normals[[x0]],
        directions=omega[None],
        radiance=q.radiance[[x0]],
        material=q.material,
    )
    points = scene.grid.points
    I = [intensity(each, points)[0, :, 0] for each in (plain, shiny)]
    return Data(scene, x0, omega, *I)


def drawing(watch: Callable[[float], None]) -> Drawing:
    d = data()
    scene, q = d.scene, d.scene.q
    figure = draw.canvas(10.5, 9.6, f"Figure 1. {TITLE}")
    (a, b), (c, last) = figure.subplots(2, 2)
    draw.field(a, d.diffuse, scene.grid, "I in W/sr")
    draw.field(b, d.shiny, scene.grid, "I in W/sr")
    draw.field(c, scene.fields[0], scene.grid, "D in W/sr")
    draw.limiters(last, scene.fields[1], scene.grid, scene.colours)
    titles = {
        a: "(a) I((x0, ω), p), x0 diffuse",
        b: f"(b) I((x0, ω), p), x0 shiny: GGX, α = {ALPHA}",
        c: "(c) D(p), the least of all I(q, p)",
        last: "(d) L(p), in the colour of the limiting wall point",
    }
    for axes, title in titles.items():
        draw.walls(axes, q, scene.colours)
        draw.plane(axes, title)
        draw.true(axes, scene.lights.positions, c=draw.GREEN, s=70, label="true light")
    for axes in (a, b):
        draw.true(axes, q.positions[[d.x0]], s=70, label="x0")
    foot = q.positions[d.x0, :2]
    b.annotate(
        "ω",
        xy=tuple(foot),
        xytext=tuple(foot + 0.33 * d.omega[:2]),
        color=draw.RED,
        fontsize=12,
        ha="center",
        va="center",
        arrowprops={"arrowstyle": "<-", "color": draw.RED, "linewidth": 2.2},
        zorder=7,
    )
    draw.legend(figure, a)
    ours = (
        f"The light has {BRIGHT:g} W/sr at ({LIGHT[0]:g}, {LIGHT[1]:g}) m; its cell's D is "
        f"{d.bound_at_light:.3f} W/sr, and regions of L from all four walls meet in it. "
        f"A shiny x0 allows little light along the mirror direction of ω and much elsewhere. The "
        f"highest bar outside the walls is B = {q.radiance.max():.1f} W/(sr m²)."
    )
    watch(1.0)
    return Drawing(1, TITLE, PAPER, ours, figure)
