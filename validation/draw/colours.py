"""Colours of places and of hues, the camera's sRGB curve, and PNG files."""

from io import BytesIO
from typing import Any

import matplotlib.image
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.floating]
Bytes = NDArray[np.uint8]

RING = (0.42, 0.82)  # lightness (OKLCH) at the floor and at the ceiling of the limiter's colours
RING_CHROMA = 0.15  # the most that sRGB holds at most hues
RING_CHROMA_LEAST = 0.25  # share of the chroma left at the room's middle, where hue is arbitrary


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


def png(pixels: Bytes) -> bytes:
    """Encode (h, w, 3 or 4) bytes as PNG, the same bytes for the same pixels."""
    file = BytesIO()
    metadata: dict[str, Any] = {"Software": None}
    # A PNG that named the library's version would differ after an upgrade that changed nothing.
    matplotlib.image.imsave(file, pixels, format="png", metadata=metadata)
    return file.getvalue()
