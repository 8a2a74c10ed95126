"""A camera's view as the bytes of a PNG file."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.colors import LinearSegmentedColormap
from numpy.typing import NDArray

from validation.draw.colours import png, srgb

NOT_FINITE = (255, 0, 255)
# Blue for less, orange for more: told apart by every common kind of colour vision.
# Dark at zero, so that a picture of differences is dark where nothing differs.
DIFFERENCE = ("#7cc7ff", "#2f7fd0", "#14355c", "#101216", "#5c3209", "#d9780f", "#ffc26b")


def developed(linear: NDArray[Any], white: float) -> bytes:
    """Radiance (h, w, 3) with `white` as the display's; magenta where it is not finite."""
    fine = np.asarray(np.isfinite(linear).all(axis=-1))
    pixels = srgb(np.where(fine[..., None], linear, 0) / white)
    pixels[~fine] = NOT_FINITE
    return png(pixels)


def difference(values: NDArray[Any], scale: float) -> bytes:
    """Values (h, w) between -scale and scale; magenta where they are not finite."""
    colours = LinearSegmentedColormap.from_list("difference", DIFFERENCE)
    pixels = colours(np.nan_to_num(0.5 + values / scale / 2), bytes=True)
    pixels[~np.isfinite(values), :3] = NOT_FINITE
    return png(pixels)
