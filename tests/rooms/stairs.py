"""A staircase: two flights with a landing between, a gallery, turned balusters, handrails."""

from __future__ import annotations

import numpy as np

from rooms.shapes import Design, Pile, ball, box, lathe, moved, ring, smooth, tube

SEED = 2
TREAD, RISER, STEPS = 0.3, 0.18, 9
FOOT, SLIM, WIDE = 1.2, 4.6, 1.4  # x of the first step; x and y of the flights' open sides
LANDING, GALLERY = STEPS * RISER, 2 * STEPS * RISER
EDGE = WIDE + STEPS * TREAD  # y of the gallery's edge
INSET, RAIL = 0.07, 0.9  # of the balusters from the edge, height of the handrail

BALUSTER = [
    (0.03, 0.0), (0.03, 0.1), (0.016, 0.12), (0.024, 0.15), (0.014, 0.18), (0.026, 0.28),
    (0.03, 0.36), (0.02, 0.5), (0.012, 0.66), (0.022, 0.7), (0.012, 0.74), (0.018, 0.84),
    (0.018, 1.0),
]  # fmt: skip
VASE = [
    (0.0, 0.0), (0.14, 0.0), (0.2, 0.15), (0.23, 0.35), (0.16, 0.55), (0.09, 0.65), (0.12, 0.75),
    (0.1, 0.75), (0.07, 0.65), (0.0, 0.5),
]  # fmt: skip


def railing(pile: Pile, feet, tops, ends) -> None:
    """Balusters from their feet to the heights of their tops, and a handrail between two ends."""
    for (x, y, z), top in zip(feet, tops, strict=True):
        turned = lathe(smooth(BALUSTER, 3), 24)
        pile.add(moved(turned, (x, y, z - 0.005), size=(1, 1, top - z)), 0.7)
    pile.add(tube(*ends, 0.04, 24), 0.3)


def newel(pile: Pile, x: float, y: float, z: float) -> None:
    """A post at a railing's end, a ball on it."""
    pile.add(box((x - 0.06, y - 0.06, z - 0.01), (x + 0.06, y + 0.06, z + 1.05)), 0.4)
    pile.add(moved(ball(0.08, 24, 32), (x, y, z + 1.11)), 0.4)


def flights(pile: Pile) -> None:
    """The steps of both flights, their balusters and rails."""
    near, far = WIDE - INSET, SLIM + INSET
    feet, others = [], []
    for i in range(STEPS):
        x, y, z = FOOT + i * TREAD, WIDE + i * TREAD, (i + 1) * RISER
        high = LANDING + z
        pile.add(box((x, -0.01, -0.01), (x + TREAD, WIDE - 0.03, z - 0.04)), 0.6)
        pile.add(box((x - 0.03, -0.01, z - 0.045), (x + TREAD + 0.02, WIDE, z)), 0.4)
        if i < STEPS - 1:  # the last one is the gallery's own edge
            low = high - 2 * RISER
            pile.add(box((SLIM + 0.03, y, low), (6.01, y + TREAD, high - 0.04)), 0.6)
            pile.add(box((SLIM, y - 0.03, high - 0.045), (6.01, y + TREAD + 0.02, high)), 0.4)
            others += [(far, y + 0.08, high), (far, y + 0.23, high)]
        feet += [(x + 0.08, near, z), (x + 0.23, near, z)]
    slope = RISER / TREAD
    railing(
        pile,
        feet,
        [RAIL + RISER + (x - FOOT) * slope for x, _, _ in feet],
        [(FOOT, near, RAIL + RISER), (FOOT + STEPS * TREAD, near, RAIL + RISER + LANDING)],
    )
    railing(
        pile,
        others,
        [RAIL + RISER + LANDING + (y - WIDE) * slope for _, y, _ in others],
        [(far, WIDE, RAIL + RISER + LANDING), (far, EDGE, RAIL + RISER + GALLERY)],
    )
    newel(pile, FOOT - 0.1, near, 0.0)
    newel(pile, FOOT + STEPS * TREAD + 0.06, near, LANDING)
    newel(pile, far, near, LANDING)
    newel(pile, far, EDGE + INSET, GALLERY)


def stairs() -> Design:
    """The hall with its staircase, 6 by 6 by 5."""
    rng = np.random.default_rng(SEED)
    pile = Pile()
    pile.add(box((0, 0, 0), (6, 6, 5)), 0.6)
    flights(pile)
    pile.add(box((FOOT + STEPS * TREAD + 0.02, -0.01, LANDING - 0.2), (6.01, WIDE, LANDING)), 0.5)
    pile.add(box((-0.01, EDGE - TREAD, GALLERY - 0.2), (6.01, 6.01, GALLERY)), 0.5)
    between = [(x / 8, WIDE - INSET, LANDING) for x in range(33, 37)]
    height = LANDING + RAIL
    railing(
        pile,
        between,
        [height] * len(between),
        [(FOOT + STEPS * TREAD, WIDE - INSET, height), (SLIM + INSET, WIDE - INSET, height)],
    )
    edge = EDGE - TREAD + INSET
    along = [(x / 8, edge, GALLERY) for x in range(1, 37)]
    height = GALLERY + RAIL
    railing(pile, along, [height] * len(along), [(-0.1, edge, height), (4.67, edge, height)])
    for x in (0.4, 3.6):  # the gallery's posts, vases and a table in the hall
        pile.add(box((x - 0.1, EDGE - 0.1, -0.01), (x + 0.1, EDGE + 0.1, GALLERY - 0.1)), 0.7)
    for x, y, size in ((5.5, 0.45, 1.0), (2.9, 5.4, 1.2), (0.45, 0.5, 1.1)):
        z = LANDING if x > 5 else 0.0
        pile.add(moved(lathe(smooth(VASE, 4), 48), (x, y, z - 0.005), size=size), 0.3)
    pile.add(moved(lathe([(0, 0.7), (0.5, 0.7), (0.5, 0.74), (0, 0.74)], 64), (2.4, 2.9, 0)), 0.4)
    pile.add(moved(lathe(smooth(BALUSTER, 4), 32), (2.4, 2.9, -0.005), size=(3, 3, 0.72)), 0.4)
    pile.add(moved(ring(0.2, 0.06, 64, 24), (2.35, 2.95, 0.795)), 0.7)
    pile.add(moved(ball(0.13, 32, 48), (2.35, 2.95, 0.93)), 0.5)
    lights = [(4.6, 0.8, 2.4), (5.4, 3.0, 3.5), (5.3, 2.4, 1.1), (2.5, 0.7, 2.6), (1.1, 2.2, 0.9)]
    return Design.of(pile, rng, [(0.35, 3.3, 2.2), (4.4, 1.7, 1.7)], 85.0, lights)
