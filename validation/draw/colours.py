"""Colour maps of the report, each legible to colour-blind eyes, and the camera's sRGB curve."""

from io import BytesIO
from typing import Any

import matplotlib
import matplotlib.image
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating]
Bytes = NDArray[np.uint8]

# Blue for less, orange for more: told apart by every common kind of colour vision.
# Dark at zero, so that a picture of differences is dark where nothing differs.
DIFFERENCE_STOPS = ("#7cc7ff", "#2f7fd0", "#14355c", "#101216", "#5c3209", "#d9780f", "#ffc26b")
STOPS_SHOWN = 16  # enough for a smooth colour bar in CSS
RING = (0.42, 0.82)  # lightness (OKLCH) at the floor and at the ceiling of the limiter's colours
RING_CHROMA = 0.15  # the most that sRGB holds at most hues
RING_CHROMA_LEAST = 0.25  # share of the chroma left at the room's middle, where hue is arbitrary


def table(name: str) -> Bytes:
    """Return a colour map as (256, 3) bytes: one of matplotlib's, or 'difference'."""
    if name == "difference":
        stops = np.array([_rgb(stop) for stop in DIFFERENCE_STOPS], dtype=float)
        at = np.linspace(0, len(stops) - 1, 256)
        rows = [np.interp(at, np.arange(len(stops)), stops[:, channel]) for channel in range(3)]
        return np.round(np.stack(rows, axis=1)).astype(np.uint8)
    colours = matplotlib.colormaps[name](np.linspace(0, 1, 256))
    return np.round(colours[:, :3] * 255).astype(np.uint8)


def stops(name: str) -> list[str]:
    """Return a colour map as a few '#rrggbb', for CSS and plotly."""
    rows = table(name)[np.linspace(0, 255, STOPS_SHOWN).round().astype(int)]
    return [_hex(row) for row in rows]


def paint(values: Floats, low: float, high: float, name: str) -> Bytes:
    """Colour values (h, w) between two ends; return (h, w, 4), transparent where not finite."""
    fine = np.isfinite(values)
    span = high - low if high > low else 1.0
    share = np.clip((np.where(fine, values, low) - low) / span, 0, 1)
    painted = np.empty((*values.shape, 4), dtype=np.uint8)
    painted[..., :3] = table(name)[np.round(share * 255).astype(int)]
    painted[..., 3] = np.where(fine, 255, 0)
    return painted


def srgb(linear: Floats) -> Bytes:
    """Encode linear values, 1 being white, as sRGB bytes (IEC 61966-2-1)."""
    clipped = np.clip(linear, 0, 1)
    low, high = clipped * 12.92, 1.055 * np.power(clipped, 1 / 2.4) - 0.055
    return np.round(np.where(clipped <= 0.0031308, low, high) * 255).astype(np.uint8)


def place(position: Floats, low: Floats, high: Floats) -> Bytes:
    """Colour places (..., 3) of a room between its corners `low` and `high`; return (..., 3) bytes.

    The hue runs once around the room's walls and the lightness from floor to ceiling: the linear
    gradient of the paper's Figure 1d, for a room in 3D.
    """
    share = (position - low) / np.maximum(high - low, np.finfo(np.float32).eps)
    x, y = 2 * share[..., 0] - 1, 2 * share[..., 1] - 1
    lightness = RING[0] + (RING[1] - RING[0]) * np.clip(share[..., 2], 0, 1)
    reach = np.clip(np.maximum(np.abs(x), np.abs(y)), RING_CHROMA_LEAST, 1)
    return srgb(oklch(lightness, RING_CHROMA * reach, np.arctan2(y, x)))


def oklch(lightness: Floats, chroma: Floats, hue: Floats) -> Floats:
    """Convert OKLCH (Ottosson 2020; hue in radians) to linear sRGB (..., 3), which may leave 0..1.

    Equal steps of hue and lightness look equal there, so no wall stands out by accident.
    """
    a, b = chroma * np.cos(hue), chroma * np.sin(hue)
    long = (lightness + 0.3963377774 * a + 0.2158037573 * b) ** 3
    medium = (lightness - 0.1055613458 * a - 0.0638541728 * b) ** 3
    short = (lightness - 0.0894841775 * a - 1.2914855480 * b) ** 3
    red = 4.0767416621 * long - 3.3077115913 * medium + 0.2309699292 * short
    green = -1.2684380046 * long + 2.6097574011 * medium - 0.3413193965 * short
    blue = -0.0041960863 * long - 0.7034186147 * medium + 1.7076147010 * short
    return np.stack([red, green, blue], axis=-1)


def css(colour: Bytes) -> str:
    """Return three bytes as '#rrggbb'."""
    return _hex(colour)


def png(pixels: Bytes) -> bytes:
    """Encode (h, w, 3 or 4) bytes as PNG, the same bytes for the same pixels."""
    file = BytesIO()
    metadata: dict[str, Any] = {"Software": None}
    # A PNG that named the library's version would differ after an upgrade that changed nothing.
    matplotlib.image.imsave(file, pixels, format="png", metadata=metadata)
    return file.getvalue()


def _hex(colour: Bytes) -> str:
    return "#" + "".join(f"{int(channel):02x}" for channel in colour)


def _rgb(colour: str) -> tuple[int, int, int]:
    return int(colour[1:3], 16), int(colour[3:5], 16), int(colour[5:7], 16)
