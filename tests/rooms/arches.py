"""A vaulted hall: two rows of fluted columns, arches between them, a nave and two aisles."""

from __future__ import annotations

import numpy as np

from rooms.shapes import (
    Design,
    Pile,
    ball,
    box,
    circle,
    lathe,
    moved,
    points,
    ring,
    sheet,
    smooth,
    steps,
)

SEED = 1
BAY, SPRING, TOP = 1.6, 2.0, 3.0  # width of an arch, where it and the nave's vault begin
NAVE, AISLE = 1.32, 3.0  # y of the arches' faces and of the outer walls
ROW = 1.5  # y of the columns

SHAFT = [
    (0.17, 0.1),
    (0.19, 0.14),
    (0.15, 0.2),
    (0.15, 0.5),
    (0.148, 0.9),
    (0.14, 1.3),
    (0.13, 1.7),
]
CAPITAL = [(0.13, 1.68), (0.15, 1.71), (0.14, 1.75), (0.16, 1.8), (0.2, 1.86), (0.22, 1.93)]
URN = [
    (0.0, 0.0), (0.12, 0.0), (0.12, 0.03), (0.05, 0.07), (0.05, 0.12), (0.16, 0.22), (0.2, 0.34),
    (0.18, 0.44), (0.1, 0.5), (0.1, 0.55), (0.15, 0.6), (0.13, 0.6), (0.09, 0.55), (0.0, 0.5),
]  # fmt: skip


def arch(middle: float, side: float) -> list:
    """One bay: the wall above its arch, and its vault as far as the outer wall."""
    span = BAY / 2 - 0.2
    c, s = circle(steps(40) / 2)
    x = middle + np.concatenate([[-BAY / 2], -span * c, [BAY / 2]])
    z = SPRING + np.concatenate([[0], span * np.maximum(s, 0), [0]])
    face = sheet(np.stack([points(x, side * NAVE, z), points(x, side * NAVE, TOP)]))
    y = side * (NAVE + (AISLE - NAVE) * steps(8)[:, None])
    return [face, sheet(points(x, y, z))]


def column(pile: Pile, x: float, y: float) -> None:
    """One column on its base, with its capital."""
    pile.add(box((x - 0.21, y - 0.21, -0.01), (x + 0.21, y + 0.21, 0.11)), 0.5)
    pile.add(moved(lathe(smooth(SHAFT, 4), 96, flutes=16, depth=0.12), (x, y, 0)), 0.7)
    pile.add(moved(lathe(smooth(CAPITAL, 3), 64, flutes=8, depth=0.06), (x, y, 0)), 0.6)
    pile.add(box((x - 0.22, y - 0.2, 1.92), (x + 0.22, y + 0.2, 2.02)), 0.6)


def arches() -> Design:
    """The hall, 8 by 6 by 4.5."""
    rng = np.random.default_rng(SEED)
    pile = Pile()
    pile.add(box((-4, -3, 0), (4, 3, 4.5)), 0.6)
    for i in range(16):  # the floor's tiles, a little above it
        for j in range(12):
            x, y = -4 + i / 2, -3 + j / 2
            tile = box((x + 0.01, y + 0.01, -0.01), (x + 0.49, y + 0.49, 0.01))
            pile.add(tile, (0.3, 0.5)[(i + j) % 2])
    c, s = circle(steps(96) / 2)
    vault = points((-4 + 8 * steps(48))[:, None], -NAVE * c, TOP + NAVE * np.maximum(s, 0))
    pile.add(sheet(vault), 0.7)
    for i in range(6):
        x = -4 + i * BAY
        rib = ring(NAVE, 0.07, 64, 16, 0.5)  # in the plane z = 0: stood up, its ends on the walls
        v = rib[0]
        pile.add((points(v[:, 2] + x, v[:, 0], v[:, 1] + TOP), rib[1]), 0.5)
        for side in (-1, 1):
            column(pile, x, side * ROW)
            if i < 5:
                for part in arch(x + BAY / 2, side):
                    pile.add(part, 0.6)
    for x, y in ((-1.5, -2.5), (1.6, 2.5), (3.3, 0.3), (0.1, 2.55)):
        pile.add(box((x - 0.2, y - 0.2, -0.01), (x + 0.2, y + 0.2, 0.6)), 0.4)
        pile.add(moved(lathe(smooth(URN, 4), 64), (x, y, 0.6 - 0.005)), 0.3)
    for x, y, r in ((0.4, 0.6, 0.22), (1.4, -0.7, 0.3), (-0.9, -0.5, 0.16)):
        pile.add(moved(ball(r, 32, 48), (x, y, r - 0.005)), 0.5)
    lights = [
        (-0.8, -0.3, 2.2), (0.3, -0.6, 1.3), (2.9, 0.3, 3.3),
        (-0.9, 2.3, 1.5), (3.4, 1.9, 0.5), (2.3, 2.2, 1.0),
    ]  # fmt: skip
    return Design.of(pile, rng, [(-3.7, -0.9, 1.7), (1.0, 0.4, 1.6)], 80.0, lights)
