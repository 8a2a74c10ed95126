"""Rooms as boxes by floor, arrows between them: SVG in the colours of the page.

An arrow to the next floor is a plain curve. One that passes floors goes straight down through
them in a lane beside the boxes, and bends only above and below it. All that lead to one room share
its lane, so that they join on the way. Pointing at a room brings out its arrows.
"""

from __future__ import annotations

import textwrap
from collections.abc import Mapping, Sequence

WIDTH, BOX, TALL, GAP, EDGE = 740, 190, 58, 54, 6
"""Pixels: of the picture, of a box and its height, between floors, and around it all."""

APART = {1: 0, 2: 508, 3: 252}
"""Pixels from box to box on a floor of so many: they leave the same lanes free."""

LANE, CLEAR, ASIDE = 9, 13, 40
"""Pixels between lanes, from a lane to a box, and from a box's middle to where a lane ends."""

LETTERS = 29
"""Of a caption's line."""

INK, PALE = "var(--color-foreground-primary, #222)", "var(--color-foreground-muted, #777)"
ACCENT, PAPER = "var(--color-brand-primary, #2962ff)", "var(--color-background-secondary, #f6f7f9)"

Floors = Sequence[Sequence[str]]
Arrow = tuple[str, str]
Place = tuple[float, float]


def picture(floors: Floors, captions: Mapping[str, str], arrows: Sequence[Arrow]) -> str:
    """The whole picture, as one ``svg`` element."""
    places = places_of(floors)
    height = 2 * EDGE + len(floors) * TALL + (len(floors) - 1) * GAP
    near, far = lines(floors, places, arrows)
    numbers = [
        f'<text class="floor" x="{EDGE}" y="{places[floor[0]][1] + TALL / 2 + 4:g}">'
        f"{len(floors) - i}</text>"
        for i, floor in enumerate(floors)
    ]
    return "\n".join(
        [
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" '
            'role="img" aria-label="The rooms of lightloc, floor by floor, and their imports">',
            f"<style>{style(places)}</style>",
            '<marker id="tip" viewBox="0 0 8 8" refX="7.5" refY="4" markerWidth="7" '
            'markerHeight="7" markerUnits="userSpaceOnUse" orient="auto">'
            '<path d="M0 1 L8 4 L0 7 z" fill="context-stroke"/></marker>',
            *['<g class="far">', *far, "</g>", '<g class="near">', *near, "</g>"],
            *numbers,
            *[box(room, place, captions[room]) for room, place in places.items()],
            "</svg>",
        ]
    )


def style(rooms: Sequence[str] | Mapping[str, Place]) -> str:
    """Quiet lines, and what stands out while a room is pointed at."""
    own = [f"svg:has(#box-{r}:hover) :is(.from-{r}, .to-{r})" for r in rooms]
    return (
        f".room rect {{ fill: {PAPER}; stroke: {PALE}; stroke-width: 1; }}"
        f".room text {{ fill: {INK}; font: 11.5px system-ui, sans-serif; text-anchor: middle; }}"
        f".room .name {{ font-size: 15px; font-weight: 600; }} .room .said {{ fill: {PALE}; }}"
        f".floor {{ fill: {PALE}; font: 12px system-ui, sans-serif; }}"
        f".arrow {{ fill: none; stroke: {INK}; }}"
        ".near { opacity: .6; stroke-width: 1.5; } .far { opacity: .28; stroke-width: 1; }"
        "svg:has(.room:hover) g:is(.near, .far) { opacity: 1; }"
        "svg:has(.room:hover) .arrow { opacity: .1; }"
        f"{', '.join(own)} {{ stroke: {ACCENT}; stroke-width: 2; opacity: 1 !important; }}"
        f".room:hover rect {{ stroke: {ACCENT}; stroke-width: 1.6; }}"
    )


def box(room: str, place: Place, caption: str) -> str:
    """A room with its name and what it is."""
    x, y = place
    said = textwrap.wrap(caption, LETTERS)
    first = y + TALL / 2 + (-3 if len(said) == 1 else -8)
    texts = [f'<text class="name" x="{x:g}" y="{first:g}">{room}</text>']
    texts += [
        f'<text class="said" x="{x:g}" y="{first + 17 + 13 * i:g}">{line}</text>'
        for i, line in enumerate(said)
    ]
    frame = f'<rect x="{x - BOX / 2:g}" y="{y:g}" width="{BOX}" height="{TALL}" rx="8"/>'
    return f'<g class="room" id="box-{room}" data-room="{room}">{frame}{"".join(texts)}</g>'


def lines(
    floors: Floors, places: Mapping[str, Place], arrows: Sequence[Arrow]
) -> tuple[list[str], list[str]]:
    """The arrows to the next floor, and those that pass floors."""
    lanes, near, far = lanes_of(floors, places, arrows), [], []
    for a, b in arrows:
        passed = a in rows_above(floors, b, 2)
        drawn = path(places[a], places[b], lanes[b] if passed else None)
        (far if passed else near).append(
            f'<path class="arrow from-{a} to-{b}" data-from="{a}" data-to="{b}" d="{drawn}" '
            'marker-end="url(#tip)"/>'
        )
    return near, far


def rows_above(floors: Floors, room: str, least: int) -> set[str]:
    """The rooms that are ``least`` floors or more above one."""
    row = next(i for i, floor in enumerate(floors) if room in floor)
    return {one for floor in floors[: max(0, row - least + 1)] for one in floor}


def places_of(floors: Floors) -> dict[str, Place]:
    """The middle of each box's upper edge."""
    places = {}
    for i, floor in enumerate(floors):
        step = APART.get(len(floor), WIDTH / len(floor))
        for k, room in enumerate(floor):
            x = WIDTH / 2 + step * (k - (len(floor) - 1) / 2)
            places[room] = (x, EDGE + i * (TALL + GAP))
    return places


def lanes_of(
    floors: Floors, places: Mapping[str, Place], arrows: Sequence[Arrow]
) -> dict[str, float]:
    """Where arrows that pass floors come down to each room: x, nearest to where they begin and end.

    A lane is free of boxes on the floors that it passes, and no two lanes that pass one floor are
    the same.
    """
    row = {room: i for i, floor in enumerate(floors) for room in floor}
    lanes: dict[str, float] = {}
    passed: dict[str, set[int]] = {}
    for a, b in arrows:
        if a in rows_above(floors, b, 2):
            passed.setdefault(b, set()).update(range(row[a] + 1, row[b]))
    for b in sorted(passed, key=lambda b: (-len(passed[b]), b)):
        taken = {lanes[other] for other in lanes if passed[other] & passed[b]}
        boxes = [places[room][0] for i in passed[b] for room in floors[i]]
        begins = [places[a][0] for a, end in arrows if end == b]
        wish = (places[b][0] + sum(begins) / len(begins)) / 2
        free = [
            x
            for x in (WIDTH / 2 + LANE * (k - 50) for k in range(101))
            if x not in taken and all(abs(x - middle) >= BOX / 2 + CLEAR for middle in boxes)
        ]
        lanes[b] = min(free, key=lambda x: (abs(x - wish), x))
    return lanes


def path(above: Place, below: Place, lane: float | None) -> str:
    """From the lower edge of one box to the upper edge of another, by a lane if there is one."""
    x, y = above[0], above[1] + TALL
    if lane is None:
        return f"M{x:g} {y:g} " + bend((x, y), below)
    first, last = (lane, y + GAP), (lane, below[1] - GAP)
    end = (below[0] + (ASIDE if lane > below[0] else -ASIDE), below[1])
    return f"M{x:g} {y:g} {bend((x, y), first)} V{last[1]:g} {bend(last, end)}"


def bend(start: Place, end: Place) -> str:
    """A curve that leaves and arrives upright."""
    middle = (start[1] + end[1]) / 2
    return f"C{start[0]:g} {middle:g} {end[0]:g} {middle:g} {end[0]:g} {end[1]:g}"
