"""The camera's view of a case, as pictures: rendered, rendered again, and the difference."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from validation.draw import DIFFERENCE, developed, difference
from validation.jobs import write_bytes

WHITE_PERCENTILE = 99.0  # this percentile of the rendered view ...
WHITE_LEVEL = 0.9  # ... is shown at this share of the display's white, so few pixels burn out
DIFFERENCE_PERCENTILE = 99.5  # the difference's scale leaves out the rare bright pixel
DIFFERENCE_FLOOR = 0.01  # of white: smaller differences are not blown up to look like large ones


@dataclass(frozen=True)
class View:
    """Pictures of a camera's view, by file name, and the scales they are drawn with.

    `white` is the radiance shown as display white and `scale` the difference at the ends of the
    colour bar, in W·sr⁻¹·m⁻²; `scale_percent` is the latter as a share of the mean radiance.
    """

    rendered: str
    rerendered: str | None
    difference: str | None
    width: int
    height: int
    white: float
    scale: float
    scale_percent: float
    rms_percent: float
    not_finite: int
    stops: tuple[str, ...]


def draw_view(folder: Path, arrays: Mapping[str, NDArray[np.floating]]) -> View:
    """Draw view.npz's arrays (h, w, 3) of linear radiance into PNG files in a folder.

    Both views share one exposure, taken from the rendered one.

    Raises
    ------
        ValueError: an array is no picture, or the two views differ in size.
    """
    rendered = _picture("rendered", arrays["rendered"])
    again = _picture("rerendered", arrays["rerendered"]) if "rerendered" in arrays else None
    if again is not None and again.shape != rendered.shape:
        raise ValueError(f"the views differ in size: {rendered.shape} and {again.shape}")
    lit = rendered[np.isfinite(rendered)]
    bright = float(np.percentile(lit, WHITE_PERCENTILE)) if lit.size else 0.0
    white = bright / WHITE_LEVEL if bright > 0 else 1.0
    write_bytes(folder / "rendered.png", developed(rendered, white))
    broken = int(np.sum(~np.isfinite(rendered).all(axis=-1)))
    scale = scale_percent = rms_percent = 0.0
    if again is not None:
        write_bytes(folder / "rerendered.png", developed(again, white))
        broken += int(np.sum(~np.isfinite(again).all(axis=-1)))
        apart = (again - rendered).mean(axis=-1)
        sizes = np.abs(apart[np.isfinite(apart)])
        largest = float(np.percentile(sizes, DIFFERENCE_PERCENTILE)) if sizes.size else 0.0
        scale = max(largest, DIFFERENCE_FLOOR * white)
        mean = float(lit.mean()) if lit.size else 0.0
        if mean > 0 and sizes.size:
            scale_percent = 100 * scale / mean
            rms_percent = 100 * float(np.sqrt(np.mean(sizes**2))) / mean
        write_bytes(folder / "difference.png", difference(apart, scale))
    return View(
        rendered="rendered.png",
        rerendered="rerendered.png" if again is not None else None,
        difference="difference.png" if again is not None else None,
        width=rendered.shape[1],
        height=rendered.shape[0],
        white=white,
        scale=scale,
        scale_percent=scale_percent,
        rms_percent=rms_percent,
        not_finite=broken,
        stops=DIFFERENCE,
    )


def _picture(name: str, pixels: NDArray[np.floating]) -> NDArray[np.float64]:
    if pixels.ndim != 3 or pixels.shape[2] != 3 or pixels.size == 0:
        raise ValueError(f"{name} has shape {pixels.shape}, and is no picture (h, w, 3)")
    return pixels.astype(np.float64)
