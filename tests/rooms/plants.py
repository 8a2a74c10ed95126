"""A winter garden: pots on the floor and on benches, palms, broad leaves and grasses in them."""

from __future__ import annotations

import numpy as np

from rooms.shapes import (
    Design,
    Part,
    Pile,
    box,
    circle,
    lathe,
    moved,
    points,
    sheet,
    smooth,
    steps,
    tube,
    uniform,
)

SEED = 3

POT = [
    (0.0, 0.0), (0.6, 0.0), (0.7, 0.3), (0.85, 0.8), (0.9, 0.85), (1.0, 0.85), (1.0, 1.0),
    (0.9, 1.0), (0.86, 0.9), (0.0, 0.88),
]  # fmt: skip


def leaf(length: float, width: float, rise: float, bend: float, rows: int, sides: int) -> Part:
    """A leaf from the origin along x: it rises, bends down, and is folded along its middle."""
    s, u = steps(rows)[:, None], 2 * steps(sides) - 1
    half = width * 2 * s * (1 - s) * (1.6 - s)  # widest a little before the middle
    z = length * (rise * s - bend * s * s) + 0.4 * half * np.abs(u)
    return sheet(points(length * s, half * u, z))


def broad(rng: np.random.Generator, height: float) -> list[Part]:
    """A stem, large leaves all along it."""
    parts = [tube((0, 0, 0), (0, 0, height), 0.015, 12)]
    for i in range(52):
        z = height * (0.15 + 0.85 * i / 52)
        one = leaf(
            uniform(rng, 0.22, 0.36), uniform(rng, 0.1, 0.15), uniform(rng, 0.2, 0.9),
            uniform(rng, 0.5, 1.0), 12, 6,
        )  # fmt: skip
        parts.append(moved(one, (0, 0, z), turn=i * 0.382 + uniform(rng, -0.03, 0.03)))
    return parts


def palm(rng: np.random.Generator, height: float) -> list[Part]:
    """Arching fronds, leaflets on both sides of each."""
    parts = []
    for i in range(12):
        turn, reach = i / 12 + uniform(rng, -0.03, 0.03), uniform(rng, 0.5, 0.8) * height
        rise, bend = uniform(rng, 1.2, 2.4), uniform(rng, 1.0, 1.8)
        s = steps(16)
        x, z = reach * s, reach * (rise * s - bend * s * s)
        c, v = circle(np.arange(6) / 6)
        thin = 0.008 * (1.1 - s)[:, None]
        rib = points(x[:, None], thin * c, z[:, None] + thin * v)
        frond = [sheet(rib, (False, True))]
        for j in range(2, 17):
            for side in (-1, 1):
                long = 0.32 * height * (1.15 - s[j])
                one = leaf(long, 0.05 * height, 0.15, uniform(rng, 0.3, 0.7), 8, 2)
                frond.append(moved(one, (x[j], 0, z[j]), turn=side * (0.2 - 0.1 * s[j])))
        parts += [moved(part, turn=turn) for part in frond]
    return parts


def grass(rng: np.random.Generator, height: float) -> list[Part]:
    """A tuft of long blades."""
    parts = []
    for _ in range(130):
        long = uniform(rng, 0.25, 0.6) * height
        rise, turn = uniform(rng, 1.5, 4.0), uniform(rng, 0, 1)
        one = leaf(long, 0.025, rise, uniform(rng, 0.2, 0.9) * rise, 12, 2)
        out = uniform(rng, 0.0, 0.06)
        c, s = circle(turn)
        parts.append(moved(one, (out * c, out * s, 0), turn=turn))
    return parts


def plants() -> Design:
    """The winter garden, 5 by 5 by 3."""
    rng = np.random.default_rng(SEED)
    pile = Pile()
    pile.add(box((0, 0, 0), (5, 5, 3)), 0.6)
    pile.add(box((4.2, 1.1, 0.55), (5.01, 3.9, 0.62)), 0.4)  # a bench and a stand of steps
    for y in (1.2, 3.7):
        pile.add(box((4.3, y, -0.01), (4.4, y + 0.1, 0.56)), 0.4)
    for i in range(3):
        pile.add(box((1.4, 4.1 + 0.3 * i, -0.01), (3.6, 5.01, 0.25 + 0.25 * i)), 0.5)
    kinds = (broad, palm, grass)
    stood = [  # x, y, z, kind, height of the plant, size of the pot
        (4.35, 0.6, 0.0, 1, 1.1, 0.24), (4.6, 1.5, 0.62, 2, 0.9, 0.15),
        (4.6, 2.2, 0.62, 0, 0.8, 0.14), (4.6, 2.95, 0.62, 2, 1.1, 0.16),
        (4.6, 3.6, 0.62, 1, 0.6, 0.14), (4.4, 4.4, 0.0, 0, 1.7, 0.24),
        (1.7, 4.25, 0.25, 2, 0.8, 0.12), (2.5, 4.25, 0.25, 1, 0.5, 0.12),
        (3.2, 4.5, 0.5, 0, 0.7, 0.12), (2.1, 4.8, 0.75, 0, 0.6, 0.11),
        (0.8, 4.3, 0.0, 1, 1.2, 0.22), (2.6, 0.5, 0.0, 0, 1.3, 0.2),
        (3.3, 2.6, 0.0, 2, 1.2, 0.18), (1.4, 0.5, 0.0, 2, 1.0, 0.18),
    ]  # fmt: skip
    for x, y, z, kind, height, size in stood:
        pot = lathe(smooth(POT, 3), 48)
        pile.add(moved(pot, (x, y, z - 0.005), size=(size, size, 1.6 * size)), 0.3 + 0.1 * kind)
        green = (0.3, 0.4, 0.5)[kind]
        for part in kinds[kind](rng, height):
            pile.add(moved(part, (x, y, z + 1.4 * size)), green)  # some end inside a wall
    lights = [(3.4, 1.1, 1.2), (2.2, 3.4, 1.2), (3.8, 2.9, 2.4), (3.1, 4.3, 2.0)]
    return Design.of(pile, rng, [(0.4, 0.9, 1.7), (3.6, 3.1, 0.9)], 75.0, lights)
