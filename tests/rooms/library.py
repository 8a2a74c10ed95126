"""A library: shelves full of books on two walls, tables, chairs of turned wood, a globe."""

from __future__ import annotations

import numpy as np

from rooms.shapes import (
    Design,
    Part,
    Pile,
    ball,
    box,
    circle,
    joined,
    lathe,
    moved,
    points,
    ring,
    sheet,
    smooth,
    steps,
    tube,
    uniform,
)

SEED = 4
CASE, DEEP, BOARD = 1.0, 0.3, 0.025  # width and depth of a bookcase, thickness of its boards
SHELVES, GAP = 6, 0.36

LEG = [
    (0.4, 0.0), (0.7, 0.04), (0.5, 0.1), (0.8, 0.2), (1.0, 0.35), (0.8, 0.6), (0.5, 0.7),
    (0.9, 0.74), (0.5, 0.78), (0.9, 0.85), (0.9, 1.0),
]  # fmt: skip


def book(thick: float, tall: float, deep: float) -> tuple[Part, Part]:
    """Cover and pages, standing with the round spine towards -y, x from 0 to thick."""
    c, s = circle(steps(12) / 2)
    rim = thick / 2
    x, y = rim - rim * c, rim - rim * np.maximum(s, 0)
    spine = sheet(np.stack([points(x, y, 0), points(x, y, tall)]))
    inner = box((0.002, rim, 0.003), (thick - 0.002, deep - 0.004, tall - 0.003))
    boards = [
        box((at, rim, 0.0), (at + 0.002, deep - 0.001, tall - 0.0005)) for at in (0, thick - 0.002)
    ]
    return joined(spine, *boards), inner


def bookcase(rng: np.random.Generator) -> list[tuple[Part, float]]:
    """A case with its books, its back on y = 0 and its front towards -y, x from 0 to its width."""
    top = SHELVES * GAP + BOARD
    parts = [
        (box((x, -DEEP, -0.01), (x + BOARD, 0.01, top + 0.05)), 0.3) for x in (0, CASE - BOARD)
    ]
    for i in range(SHELVES + 1):
        z = 0.05 + i * GAP
        parts.append((box((0.01, 0.01 - DEEP, z - BOARD), (CASE - 0.01, 0.01, z)), 0.3))
        x = BOARD + 0.003
        while i < SHELVES:
            thick, tall = uniform(rng, 0.022, 0.06), uniform(rng, 0.2, 0.31)
            deep, grey = uniform(rng, 0.16, 0.22), float(rng.integers(1, 8)) / 10
            if x + thick > CASE - BOARD - 0.003:
                break
            if rng.random() < 0.06:  # a gap
                x += uniform(rng, 0.03, 0.12)
                continue
            at = (x, -deep - uniform(rng, 0.0, 0.05), z - 0.001)
            cover, pages = book(thick, tall, deep)
            parts += [(moved(cover, at), grey), (moved(pages, at), 0.8)]
            x += thick + 0.002
    return parts


def chair(pile: Pile, x: float, y: float, turn: float) -> None:
    """Four legs, a round seat, a back of spindles; it looks along +x before it is turned."""
    parts = [lathe([(0, 0.43), (0.21, 0.43), (0.23, 0.45), (0.21, 0.47), (0, 0.465)], 48)]
    leg = lathe(smooth(LEG, 3), 20)
    for a, b in ((-0.13, -0.13), (-0.13, 0.13), (0.13, -0.13), (0.13, 0.13)):
        parts.append(moved(leg, (a, b, -0.003), size=(0.025, 0.025, 0.445)))
    for i in range(7):
        c, s = circle(0.5 + (i - 3) * 0.045)
        parts.append(moved(leg, (0.18 * c, 0.18 * s, 0.46), size=(0.014, 0.014, 0.42)))
    parts.append(moved(ring(0.18, 0.025, 48, 16, 0.36), (0, 0, 0.88), turn=0.32))
    for part in parts:
        pile.add(moved(part, (x, y, 0), turn), 0.5)


def desk(pile: Pile, low, high, height: float) -> None:
    """A table on four turned legs."""
    pile.add(box((*low, height - 0.04), (*high, height)), 0.4)
    leg = lathe(smooth(LEG, 4), 32)
    for x in (low[0] + 0.1, high[0] - 0.1):
        for y in (low[1] + 0.1, high[1] - 0.1):
            pile.add(moved(leg, (x, y, -0.003), size=(0.045, 0.045, height - 0.02)), 0.4)


def library() -> Design:
    """The library, 7 by 5.5 by 3."""
    rng = np.random.default_rng(SEED)
    pile = Pile()
    pile.add(box((0, 0, 0), (7, 5.5, 3)), 0.6)
    for i in range(5):
        for part, grey in bookcase(rng):
            pile.add(moved(part, (0.8 + i * 1.02, 5.5, 0)), grey)
    for i in range(4):
        for part, grey in bookcase(rng):
            pile.add(moved(part, (7.0, 4.7 - i * 1.02, 0), turn=-0.25), grey)
    desk(pile, (2.6, 2.3), (4.6, 3.3), 0.75)
    for x, y, turn in (
        (3.1, 2.1, 0.27), (4.0, 2.15, 0.22), (3.2, 3.6, 0.76), (4.1, 3.65, 0.7),
        (5.3, 1.0, 0.35), (1.6, 4.3, 0.9),
    ):  # fmt: skip
        chair(pile, x, y, turn)
    for x, y in ((3.0, 2.7), (3.8, 3.0), (4.2, 2.6)):  # books lie on the table, in stacks
        z = 0.749
        for _ in range(int(rng.integers(2, 6))):
            cover, pages = book(uniform(rng, 0.025, 0.05), 0.28, 0.2)
            turn, thick = uniform(rng, 0, 1), cover[0][:, 0].max()
            for part, grey in ((cover, float(rng.integers(1, 8)) / 10), (pages, 0.8)):
                lying = moved(part, (0, -0.1, -0.14))
                v = points(lying[0][:, 2], lying[0][:, 1], thick - lying[0][:, 0])
                pile.add(moved((v, lying[1]), (x, y, z), turn), grey)
            z += thick - 0.0005
    x, y = 1.9, 2.9  # the globe in its ring
    pile.add(moved(lathe(smooth(LEG, 4), 32), (x, y, -0.003), size=(0.1, 0.1, 0.6)), 0.3)
    pile.add(moved(ball(0.26, 48, 72), (x, y, 0.86)), 0.7)
    pile.add(moved(ring(0.3, 0.025, 72, 16), (x, y, 0.86)), 0.3)
    pile.add(moved(ring(0.285, 0.015, 72, 12), (x, y, 0.86), tilt=0.2, turn=0.1), 0.4)
    pile.add(tube((6.0, 0.9, -0.01), (6.0, 0.9, 1.5), 0.03, 24), 0.2)  # a standing lamp
    pile.add(moved(lathe([(0.22, 0), (0.21, 0.02), (0.12, 0.3)], 48), (6.0, 0.9, 1.45)), 0.7)
    pile.add(moved(lathe([(0, 0), (0.2, 0), (0.2, 0.03), (0, 0.05)], 48), (6.0, 0.9, -0.003)), 0.2)
    lights = [(3.6, 2.9, 1.5), (5.9, 3.6, 2.3), (1.3, 4.6, 1.9), (5.2, 1.7, 0.9), (2.3, 3.5, 0.5)]
    return Design.of(pile, rng, [(0.4, 0.5, 1.8), (4.3, 3.6, 1.0)], 75.0, lights)
