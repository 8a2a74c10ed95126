"""The picture to look at: light averaged over each pixel, with less noise than a pixel has."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

WINDOW = 3  # pixels on each side that lend their indirect light
ALIKE = 0.995  # cosine of 0.1 rad: neighbours that face alike show one smooth surface
ALBEDO_STEPS = 1000  # albedo and roughness are compared to three places
FACING = 0.1  # of the diagonal: how far apart opposite normals count as


def smooth(
    light: NDArray, shape: NDArray, normal: NDArray, albedo: NDArray, roughness: NDArray
) -> NDArray[np.float64]:
    """Indirect light (h, w, 3), averaged over neighbours that show the same surface.

    Interreflected light varies slowly along a surface and its samples are noisy, so a pixel
    borrows those of the pixels around it with its shape, normal, albedo and roughness.
    """
    h, w = shape.shape
    kind = np.dstack([shape, np.round(albedo * ALBEDO_STEPS), np.round(roughness * ALBEDO_STEPS)])
    _, label = np.unique(kind.reshape(h * w, -1), axis=0, return_inverse=True)
    label, n = label.reshape(h, w), normal.astype(np.float32)
    total, count = np.zeros((h, w, 3)), np.zeros((h, w, 1))
    for down in range(-WINDOW, WINDOW + 1):
        for across in range(-WINDOW, WINDOW + 1):
            to, of = _overlap(h, down), _overlap(h, -down)
            here, there = (to, _overlap(w, across)), (of, _overlap(w, -across))
            same = label[here] == label[there]
            same &= np.einsum("ijk,ijk->ij", n[here], n[there]) > ALIKE
            total[here] += np.where(same[..., None], light[there], 0)
            count[here] += same[..., None]
    return np.where(count > 0, total / np.maximum(count, 1), light)


def borrow(
    light: NDArray, features: NDArray, pixel: NDArray, wanted: NDArray, weights: NDArray
) -> NDArray[np.float64]:
    """For each ray of some pixels, the light (h, w, 3) of the likest pixel of the nine around it.

    ``features`` (h, w, f) and ``wanted`` (n, k, f) are those of `likeness`; ``pixel`` (n,) counts
    row by row. Returns the mean over each pixel's k rays by their (k,) weights, (n, 3).
    """
    h, w = light.shape[:2]
    step = np.array([-1, 0, 1])
    rows = (pixel // w)[:, None, None] + step[:, None]
    columns = (pixel % w)[:, None, None] + step
    around = rows.clip(0, h - 1) * w + columns.clip(0, w - 1)  # (n, 3, 3)
    around = around.reshape(len(pixel), 9)
    near = features.reshape(h * w, -1)[around]
    apart = np.square(wanted[:, :, None] - near[:, None]).sum(axis=-1)  # (n, k, 9)
    best = np.take_along_axis(around, apart.argmin(axis=-1), axis=1)
    return weights @ light.reshape(h * w, 3)[best]


def likeness(
    position: NDArray, normal: NDArray, shape: NDArray, diagonal: float
) -> NDArray[np.float64]:
    """Features whose distance says how alike two surface points are, in the unit of length."""
    return np.concatenate(
        [position, FACING * diagonal * normal, diagonal * shape[..., None]], axis=-1
    )


def _overlap(size: int, move: int) -> slice:
    return slice(max(0, -move), size - max(0, move))
