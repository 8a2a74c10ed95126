"""A picture that any program wrote, as a value."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from render.colour import Colours
from render.layers import Layers

POINT = (0.0, 0.0, 0.0, 1.0)  # the row or the column of a matrix that moves no point


@dataclass(frozen=True, eq=False)
class Picture:
    """A picture's pixels and, where it has them, layers of what they show.

    Made by `read_picture`. Arrays are over the display window, NaN where nothing is known.

    Parameters
    ----------
    name : str
        Its file.
    radiance : (h, w, c) array
        W sr^-1 m^-2 or whatever unit the picture has, in its own colours; c is 1 or 3.
    sigma : (h, w, c) array or None
        Its standard error, from a layer of variances or standard deviations.
    position : (h, w, 3) array or None
        The point that is seen, in the scene's unit of length.
    normal : (h, w, 3) array or None
        The shading normal there.
    albedo : (h, w, c) array or None
        The albedo there, in the picture's own colours.
    camera : (3,) array or None
        Where it was seen from.
    inside : (h, w) array of bool
        Which pixels the file has: those in its data window.
    colours : str
        The colour space, as a user reads it.
    to_rec_709 : (3, 3) array
        From its colours to linear Rec. 709.

    Examples
    --------
    >>> import tempfile
    >>> from render import load, photograph, read_picture, write_exr
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_exr(photograph(load("box_one"), width=8, transport="direct"), f"{folder}/a.exr")
    ...     picture = read_picture(f"{folder}/a.exr")
    >>> print(picture)
    8 x 6 pixels with position, normal, albedo; colours: linear Rec. 709 (assumed)
    """

    name: str
    radiance: NDArray[np.float64]
    sigma: NDArray[np.float64] | None
    position: NDArray[np.float64] | None
    normal: NDArray[np.float64] | None
    albedo: NDArray[np.float64] | None
    camera: NDArray[np.float64] | None
    inside: NDArray[np.bool_]
    colours: str
    to_rec_709: NDArray[np.float64]

    @property
    def known(self) -> NDArray[np.bool_]:
        """(h, w) bool: the pixels that have a value, and an error where there is a layer of it."""
        value = self.radiance if self.sigma is None else self.radiance + self.sigma
        return np.asarray(np.isfinite(value).all(axis=2))

    def __str__(self) -> str:
        height, width = self.inside.shape
        layers = [n for n in ("position", "normal", "albedo") if getattr(self, n) is not None]
        missing = int((self.inside & ~self.known).sum())
        below = int((self.known & (np.nan_to_num(self.radiance) < 0).any(axis=2)).sum())
        return (
            f"{width} x {height} pixels"
            + (f" with {', '.join(layers)}" if layers else "")
            + (f", {self.inside.sum()} of them in the file" if not self.inside.all() else "")
            + (f", {missing} without a finite value (left out)" if missing else "")
            + (f", {below} below zero (kept)" if below else "")
            + f"; colours: {self.colours}"
        )


def read_picture(*paths: str | Path) -> Picture:
    """Read a picture that any program wrote: one EXR file, or several with a layer each.

    Parameters
    ----------
    *paths : str or Path
        EXR files, the picture's own first. Layers are told by their names, as Mitsuba, Blender,
        pbrt and Arnold give them; of several files, where the channels are R, G, B or X, Y, Z
        alone, by the file's name.

    Returns
    -------
    Picture
        The picture. Where the radiance is not finite, or its error is not known though others are,
        it is NaN.

    Raises
    ------
    ValueError
        In one sentence that names the file: if there is none or it is no EXR file, none of its
        layers is a picture or several may be, values are not linear, a layer has another size than
        the picture, pixels are damaged, or the camera's matrix has no inverse.

    Examples
    --------
    >>> from render import read_picture
    >>> read_picture("gone.exr")
    Traceback (most recent call last):
        ...
    ValueError: gone.exr: no such file
    """
    if not paths:
        raise ValueError("read_picture expects at least one file")
    files = [Path(path) for path in paths]
    layers = Layers.of(files)
    name = str(files[0])
    try:
        colours = Colours.of(layers.attributes)
        camera = _camera(layers.attributes.get("worldToCamera"))
    except ValueError as error:
        raise ValueError(f"{name}: {error}") from None
    values = {}
    B, inside = layers.read("radiance")
    for meaning, layer in layers.found.items():
        value, _ = layers.read(meaning)
        if value.shape[:2] != inside.shape:
            raise ValueError(
                f"{layer.path}: {meaning} has {_size(value)} pixels; the picture has {_size(B)}"
            )
        with np.errstate(invalid="ignore"):  # of NaN that signal
            values[meaning] = value.astype(float)
    B = values["radiance"]
    grey = B.shape[2] == 1
    return Picture(
        name=name,
        radiance=np.where(np.isfinite(B).all(axis=2, keepdims=True), B, np.nan),
        sigma=_errors(values, B.shape),
        position=values.get("position"),
        normal=values.get("normal"),
        albedo=values.get("albedo"),
        camera=camera,
        inside=inside,
        colours="grey" if grey else str(colours),
        to_rec_709=colours.to_rec_709,
    )


def _size(pixels: NDArray) -> str:
    return f"{pixels.shape[1]} x {pixels.shape[0]}"


def _errors(values: dict[str, NDArray], shape: tuple[int, ...]) -> NDArray[np.float64] | None:
    """The standard errors of the radiance, NaN where they are not known."""
    for meaning, power in (("variance", 0.5), ("stddev", 1.0)):
        if meaning in values:
            value = values[meaning]
            value = np.where(np.isfinite(value) & (value >= 0), value, np.nan) ** power
            return np.broadcast_to(value if shape[2] > 1 else value[..., :1], shape)
    return None


def _camera(matrix: ArrayLike | None) -> NDArray[np.float64] | None:
    """The pinhole's place from EXR's ``worldToCamera``.

    The format wants vectors to be rows; some programs write it for columns.
    """
    if matrix is None:
        return None
    given = np.array(matrix, float)
    m = given.reshape(4, 4) if given.size == 16 else np.zeros((4, 4))
    rows = m if np.allclose(m[:, 3], POINT) else m.T
    try:
        if not (np.isfinite(m).all() and np.allclose(rows[:, 3], POINT)):
            raise np.linalg.LinAlgError
        return np.linalg.solve(rows[:3, :3].T, -rows[3, :3])
    except np.linalg.LinAlgError:
        raise ValueError("attribute worldToCamera is no matrix of a camera") from None
