"""Slices of the fields D, L and V (Eq. 6, 7, 8) as pictures with axes, walls and lights."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from validation.draw import css, paint, place, png, stops
from validation.jobs import write_bytes
from validation.records import Result
from validation.report.axes import Axes, Tick, linear_bar, log_bar
from validation.report.words import metres

NEAR = 0.05  # of the room's diagonal: lights this close to the slice are drawn on it
D_PERCENTILES = (1.0, 99.0)  # D grows without bound near unlit corners; they'd eat the colours
FRAME_STEPS = 48  # patches of colour along each side of the limiter's frame
CELL_SHADES = 5  # neighbouring limiters differ in shade, so that the cells show (Figure 2b)
CELL_SHADE = 0.05  # of the brightness, per shade

Array = NDArray[Any]


@dataclass(frozen=True)
class Slice:
    """One field's picture and what is written around it."""

    symbol: str
    title: str
    caption: str
    picture: str
    stops: list[str] = field(default_factory=list)
    ticks: list[Tick] = field(default_factory=list)
    unit: str = ""
    frame: list[dict[str, Any]] = field(default_factory=list)
    note: str = ""


@dataclass(frozen=True)
class Slices:
    """All slices at one height, with what they share."""

    height: float
    axes: Axes
    walls: str
    true: list[tuple[float, float, int]]
    found: list[tuple[float, float, int]]
    elsewhere: int
    near: float
    slices: list[Slice]


def draw_slices(
    folder: Path, arrays: Mapping[str, Array], room: Mapping[str, Array] | None, result: Result
) -> Slices:
    """Draw fields.npz's arrays into PNG files in a folder; row 0 of a field is at ymin.

    Raises
    ------
        ValueError: the extent is not finite, or a field has the wrong shape.
    """
    extent = np.asarray(arrays["extent"], dtype=float).ravel()
    height = float(arrays["height"])
    if extent.shape != (4,) or not np.isfinite([*extent, height]).all():
        raise ValueError(f"extent {extent.tolist()} or height {height} is no place in a room")
    axes = Axes.around(extent)
    true, found, elsewhere, near = _lights(result, axes, height)
    drawn = [_draw_d(folder, _field("D", arrays))]
    if "limiter" in arrays:
        drawn.append(_draw_l(folder, arrays, room, axes, height))
    if "V" in arrays:
        drawn.append(_draw_v(folder, _field("V", arrays)))
    walls = axes.path(section(room, height)) if room is not None else ""
    return Slices(height, axes, walls, true, found, elsewhere, near, drawn)


def section(room: Mapping[str, Array], height: float) -> NDArray[np.float64]:
    """Return the segments (n, 2, 2) in which a room's triangles meet the plane z = height.

    >>> room = {"vertices": np.array([[0, 0, 0], [2, 0, 0], [0, 0, 4]]), "faces": [[0, 1, 2]]}
    >>> sorted(section(room, 2.0)[0].tolist()), len(section(room, 5.0))
    ([[0.0, 0.0], [1.0, 0.0]], 0)
    """
    triangles = np.asarray(room["vertices"], dtype=float)[np.asarray(room["faces"], dtype=int)]
    above = triangles[..., 2] >= height
    mixed = above.any(axis=1) & ~above.all(axis=1)
    triangles, above = triangles[mixed], above[mixed]
    ends = np.roll(triangles, -1, axis=1)
    crossing = above != np.roll(above, -1, axis=1)  # two sides of each triangle left
    start, end = triangles[crossing], ends[crossing]
    share = (height - start[:, 2]) / (end[:, 2] - start[:, 2])
    crossed = start[:, :2] + share[:, None] * (end[:, :2] - start[:, :2])
    return np.asarray(crossed.reshape(-1, 2, 2))


def _draw_d(folder: Path, values: Array) -> Slice:
    with np.errstate(divide="ignore", invalid="ignore"):
        logarithm = np.log10(values)
    fine = logarithm[np.isfinite(logarithm)]
    low, high = np.percentile(fine, D_PERCENTILES) if fine.size else (0.0, 1.0)
    # One scale however little D varies, so that round-off is not drawn as structure.
    low, high = (low, high) if high - low > 0.01 else (low - 0.5, high + 0.5)
    dark = values == 0
    picture = _save(folder, "D", paint(np.where(dark, low, logarithm), low, high, "viridis"))
    notes = ["Darkest where D is 0: a surface that a light there would light is dark."]
    notes = notes if dark.any() else []
    if fine.size + dark.sum() < values.size:
        notes.append("Blank where no observation bounds a light.")
    return Slice(
        symbol="D(p)",
        title="the brightest that a light at p can be",
        caption="Every observation bounds a light at p from above; the intensity-distance field D "
        "is the least of these bounds (Eq. 6). At a true light it is at least the light's own "
        "intensity.",
        picture=picture,
        stops=stops("viridis"),
        ticks=log_bar(float(low), float(high)),
        unit="W/sr, logarithmic",
        note=" ".join(notes),
    )


def _draw_l(
    folder: Path,
    arrays: Mapping[str, Array],
    room: Mapping[str, Array] | None,
    axes: Axes,
    z: float,
) -> Slice:
    limiter = np.asarray(arrays["limiter"], dtype=float)
    if limiter.ndim != 3 or limiter.shape[2] != 3:
        raise ValueError(f"limiter has shape {limiter.shape}, and not (h, w, 3)")
    known = np.isfinite(limiter).all(axis=-1)
    if "L" in arrays and arrays["L"].shape == known.shape:
        index = np.asarray(arrays["L"])
        known &= index >= 0
        shade = (np.where(known, index, 0).astype(np.int64) * 2654435761 >> 7) % CELL_SHADES
    else:
        shade = np.zeros(known.shape, dtype=np.int64)
    places = np.asarray(room["vertices"], dtype=float) if room is not None else limiter[known]
    levels = places[:, 2] if len(places) else np.array([z])
    low = np.array([axes.xmin, axes.ymin, levels.min()])
    high = np.array([axes.xmax, axes.ymax, levels.max()])
    painted = np.zeros((*known.shape, 4), dtype=np.uint8)
    colours = place(np.where(known[..., None], limiter, low), low, high).astype(float)
    shaded = colours * (1 + CELL_SHADE * (shade - CELL_SHADES // 2))[..., None]
    painted[..., :3] = np.clip(np.round(shaded), 0, 255)
    painted[..., 3] = np.where(known, 255, 0)
    middle = np.array([axes.xmax, (axes.ymin + axes.ymax) / 2, 0.0])
    upright = [np.array([*middle[:2], level]) for level in np.linspace(low[2], high[2], 9)]
    return Slice(
        symbol="L(p)",
        title="which surface limits it",
        caption="The colour is that of the surface whose bound is the least (Eq. 7): the hue runs "
        "around the walls as in the frame, the lightness from floor to ceiling. Many small cells "
        "meet at a light; broad ones are where few surfaces decide.",
        picture=_save(folder, "L", painted),
        stops=[css(place(at, low, high)) for at in upright],
        ticks=linear_bar(float(low[2]), float(high[2])),
        unit="height of that surface in m, in the hue of the right-hand wall",
        frame=axes.frame(lambda at: css(place(np.array([*at, z]), low, high)), FRAME_STEPS),
    )


def _draw_v(folder: Path, values: Array) -> Slice:
    fine = values[np.isfinite(values)]
    most = float(fine.max()) if fine.size and fine.max() > 0 else 1.0
    return Slice(
        symbol="V(p)",
        title="the votes for a light at p",
        caption="How many different surfaces limit the neighbourhood of p (Eq. 8), counted by the "
        "distance from one to the next (section 4.3): they agree on one intensity there, and so "
        "vote for a light. The peaks are the paper's first candidates.",
        picture=_save(folder, "V", paint(values.astype(float), 0.0, most, "magma")),
        stops=stops("magma"),
        ticks=linear_bar(0.0, most),
        unit="mean distance between neighbouring limiters in m",
    )


def _field(name: str, arrays: Mapping[str, Array]) -> Array:
    values = np.asarray(arrays[name], dtype=float)
    if values.ndim != 2 or values.size == 0:
        raise ValueError(f"{name} has shape {values.shape}, and is no slice (h, w)")
    return values


def _save(folder: Path, name: str, painted: NDArray[np.uint8]) -> str:
    file = f"slice_{name}.png"
    write_bytes(folder / file, png(np.ascontiguousarray(painted[::-1])))  # a picture's top is ymax
    return file


def _lights(
    result: Result, axes: Axes, height: float
) -> tuple[list[tuple[float, float, int]], list[tuple[float, float, int]], int, float]:
    near = NEAR * (result.diagonal or float(np.hypot(axes.width, axes.depth)))
    kept: list[list[tuple[float, float, int]]] = []
    elsewhere = 0
    lights = result.lights
    for group in (lights.true, lights.found) if lights else ([], []):
        marks = []
        for index, light in enumerate(group):
            x, y, z = light.position
            if x is None or y is None or z is None or abs(z - height) > near:
                elsewhere += 1
            else:
                marks.append((*axes.at(x, y), index + 1))
        kept.append(marks)
    return kept[0], kept[1], elsewhere, near


def near_words(slices: Slices) -> str:
    """Say which lights the slices show."""
    words = f"Lights within {metres(slices.near)} of the slice are drawn"
    if slices.elsewhere == 0:
        return words + "; none lies farther off"
    return words + f"; {slices.elsewhere} true or found lie farther off"
