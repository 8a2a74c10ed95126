"""A store room: heaps of boxes, balls, rings, bowls and cones, as they fell."""

from __future__ import annotations

import numpy as np

from rooms.shapes import Design, Part, Pile, ball, box, lathe, moved, ring, smooth, uniform

SEED = 5
WIDE, HIGH = 6.0, 3.2
CELL = 0.05  # of the map of heights that things fall on
SUNK = 0.01  # how far a thing sinks into what it lies on

BOWL = [
    (0.0, 0.1), (0.4, 0.0), (0.45, 0.05), (0.8, 0.3), (1.0, 0.7), (0.97, 0.71), (0.75, 0.35),
    (0.4, 0.12), (0.0, 0.15),
]  # fmt: skip


def thing(rng: np.random.Generator) -> tuple[Part, float, float]:
    """Something with its lowest point at z = 0, how far it reaches about z, and its height."""
    r, kind = uniform(rng, 0.1, 0.24), int(rng.integers(5))
    if kind == 0:
        return moved(ball(r, 28, 40), (0, 0, r)), r, 2 * r
    if kind == 1:
        return moved(ring(0.7 * r, 0.3 * r, 48, 24), (0, 0, 0.3 * r)), r, 0.6 * r
    if kind == 2:
        return moved(lathe(smooth(BOWL, 3), 48), size=r), r, 0.7 * r
    if kind == 3:
        return lathe([(0, 0), (0.8 * r, 0), (0.8 * r, 0.2 * r), (0, 2.2 * r)], 32), r, 1.5 * r
    half = np.array([uniform(rng, 0.5, 1.0), uniform(rng, 0.5, 1.0), uniform(rng, 0.4, 1.2)]) * r
    tilted = moved(box(-half, half), turn=uniform(rng, 0, 1), tilt=uniform(rng, -0.03, 0.03))
    low = tilted[0].min(axis=0)[2]
    return moved(tilted, (0, 0, -low)), 1.2 * r, -2 * low


def clutter() -> Design:
    """The store room, 6 by 6 by 3.2."""
    rng = np.random.default_rng(SEED)
    pile = Pile()
    pile.add(box((0, 0, 0), (WIDE, WIDE, HIGH)), 0.6)
    heaps = [(4.6, 1.4, 1.0), (3.2, 3.4, 1.1), (1.4, 4.8, 0.9), (5.0, 4.8, 0.8), (2.4, 1.2, 0.6)]
    ground = np.zeros((int(WIDE / CELL), int(WIDE / CELL)))
    for i in range(190):
        x, y, spread = heaps[i % len(heaps)]
        part, reach, tall = thing(rng)
        x += spread * (uniform(rng, -0.5, 0.5) + uniform(rng, -0.5, 0.5))
        y += spread * (uniform(rng, -0.5, 0.5) + uniform(rng, -0.5, 0.5))
        x, y = (min(max(at, reach + CELL), WIDE - reach - CELL) for at in (x, y))
        rows = slice(int((x - 0.6 * reach) / CELL), int((x + 0.6 * reach) / CELL) + 1)
        columns = slice(int((y - 0.6 * reach) / CELL), int((y + 0.6 * reach) / CELL) + 1)
        z = float(ground[rows, columns].max())
        grey = float(rng.integers(1, 9)) / 10
        if z + tall > 1.9:  # the heap is high enough
            continue
        ground[rows, columns] = z + 0.8 * tall
        pile.add(moved(part, (x, y, z - SUNK), turn=uniform(rng, 0, 1)), grey)
    lights = [
        (0.9, 4.8, 2.1), (1.9, 3.2, 1.4), (5.3, 3.2, 1.2),
        (3.6, 5.0, 2.0), (1.2, 1.6, 1.1), (3.4, 1.9, 0.7),
    ]  # fmt: skip
    return Design.of(pile, rng, [(0.4, 0.5, 2.2), (3.8, 3.6, 0.6)], 78.0, lights)
