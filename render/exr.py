"""Views on disk: one multi-layer EXR, written and read through OpenImageIO.

Layers and their channels are in `CHANNELS`, all of them float32; ``R``, ``G``, ``B`` are the
radiance. Attributes: ``lightloc:format`` names the format and its version, ``lightloc:camera`` is
the pinhole (3 floats), ``lightloc:unit`` the unit of length (metres where it is missing),
``lightloc:transport`` is "direct" or "full" (with interreflected light), and ``lightloc:crc32``
(hexadecimal; may be missing) is the CRC-32 of the pixels in this order of channels, then of the
camera, both little-endian, then of the unit in UTF-8 where it is not "m", because EXR itself has no
checksum.
"""

from __future__ import annotations

import re
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
from numpy.typing import ArrayLike, NDArray

from lightloc.files import regular, whole
from render.view import View

FORMAT = "lightloc-view-1"
METRE = "m"  # of files that say no unit
CHANNELS = {
    "radiance": ("R", "G", "B"),
    "variance": ("variance.R", "variance.G", "variance.B"),
    "position": ("position.X", "position.Y", "position.Z"),
    "normal": ("normal.X", "normal.Y", "normal.Z"),
    "facet": ("facet.X", "facet.Y", "facet.Z"),
    "albedo": ("albedo.R", "albedo.G", "albedo.B"),
    "roughness": ("roughness.Y",),
    "shape": ("shape.I",),
    "pure": ("pure.I",),
    "film": ("film.R", "film.G", "film.B"),
}
NO_DATE = ""  # else OpenImageIO writes the present one, and no two files are the same
LONGEST = 100  # characters of OpenImageIO's own words in a message
MAGIC = b"\x76\x2f\x31\x01"  # the first bytes of every EXR file


def write_exr(view: View, path: str | Path) -> None:
    """Write a view as one EXR file, whole or not at all: same view, same bytes.

    Parameters
    ----------
    view : View
        The view.
    path : str or Path
        The file, whose name ends in ``.exr``.

    Raises
    ------
    ValueError
        If the name does not end in ``.exr``, or the file can't be written.

    Examples
    --------
    >>> import tempfile
    >>> from render import load, photograph, read_exr, write_exr
    >>> view = photograph(load("box_one"), width=8, transport="direct")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_exr(view, f"{folder}/view.exr")
    ...     read_exr(f"{folder}/view.exr") == view
    True
    """
    path = Path(path)
    if path.suffix.lower() != ".exr":
        raise ValueError(f"{path}: a view is written as EXR; expected a name that ends in .exr")
    layers = [np.atleast_3d(getattr(view, layer)) for layer in CHANNELS]
    pixels = np.ascontiguousarray(np.concatenate(layers, axis=2), "<f4")  # however each lies
    names = [name for channels in CHANNELS.values() for name in channels]
    spec = oiio.ImageSpec(*view.size, len(names), oiio.FLOAT)
    spec.channelnames = names
    spec.attribute("compression", "zip")
    spec.attribute("lightloc:format", FORMAT)
    spec.attribute("lightloc:camera", oiio.TypeDesc("float[3]"), tuple(view.camera.tolist()))
    spec.attribute("lightloc:unit", view.unit)
    spec.attribute("lightloc:transport", "full" if view.interreflected else "direct")
    spec.attribute("lightloc:crc32", _checksum(pixels, view.camera, view.unit))
    spec.attribute("DateTime", NO_DATE)
    try:
        with whole(path) as part:
            file = oiio.ImageOutput.create("exr")
            if file is None:
                raise ValueError(f"{path}: can't be written ({one_line(oiio.geterror())})")
            done = file.open(str(part), spec) and file.write_image(pixels)
            if not (file.close() and done):
                said = one_line(file.geterror().replace(str(part), path.name))
                raise ValueError(f"{path}: can't be written ({said})")
    except OSError as error:
        raise ValueError(f"{path}: can't be written ({error.strerror})") from None


def read_exr(path: str | Path) -> View:
    """Read what `write_exr` wrote.

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    View
        The view, with radiance in W sr^-1 m^-2 and positions in the unit of length that it says.

    Raises
    ------
    ValueError
        In one sentence that names the file and the field: if there is no such file, it is no EXR
        file or not in this format, a channel is missing, pixels are missing or damaged, or a value
        is not finite or out of range.

    Examples
    --------
    >>> from render import read_exr
    >>> read_exr("gone.exr")
    Traceback (most recent call last):
        ...
    ValueError: gone.exr: no such file
    """
    with opened(path) as file:
        parts = _read(path, file)
    try:
        return View(**parts)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


@contextmanager
def opened(path: str | Path) -> Iterator[oiio.ImageInput]:
    """An EXR file to be read; raises ValueError naming it where it is none."""
    try:
        with open(regular(path), "rb") as start:
            magic = start.read(len(MAGIC))
    except OSError as error:
        raise ValueError(f"{path}: can't be read ({error.strerror})") from None
    if magic != MAGIC:
        raise ValueError(f"{path}: not an EXR file")
    file = None
    try:
        file = oiio.ImageInput.open(str(path))
        if file is None:
            raise ValueError(f"{path}: a damaged EXR file ({one_line(oiio.geterror())})")
        yield file
    except UnicodeDecodeError:
        raise ValueError(f"{path}: a damaged EXR file (a name in it is not text)") from None
    finally:
        if file is not None:
            file.close()


def is_view(path: str | Path) -> bool:
    """Tell views, which `write_exr` wrote, from pictures by other programs.

    Parameters
    ----------
    path : str or Path
        An EXR file.

    Returns
    -------
    bool
        Whether it says that it is a view.

    Raises
    ------
    ValueError
        If there is no such file or it is no EXR file; the message names it.

    Examples
    --------
    >>> import tempfile
    >>> from render import is_view, load, photograph, write_exr
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_exr(photograph(load("box_one"), width=4, transport="direct"), f"{folder}/a.exr")
    ...     is_view(f"{folder}/a.exr")
    True
    """
    with opened(path) as file:
        return bool(file.spec().get_string_attribute("lightloc:format"))


def light_of_view(path: str | Path) -> str:
    """Which light a view holds, "direct" or "full"; empty where the file is none, or gone."""
    try:
        with opened(path) as file:
            return str(file.spec().get_string_attribute("lightloc:transport"))
    except ValueError:
        return ""


def _read(path: str | Path, file: oiio.ImageInput) -> dict[str, Any]:
    """The arguments of a View."""
    spec = file.spec()
    style, transport, checksum = (
        spec.get_string_attribute(f"lightloc:{name}") for name in ("format", "transport", "crc32")
    )
    if not style:
        raise ValueError(
            f"{path}: lightloc:format is ''; expected {FORMAT} (observe_picture reads what other "
            "programs wrote)"
        )
    if style != FORMAT:
        raise ValueError(f"{path}: lightloc:format is '{one_line(style)}'; expected {FORMAT}")
    if transport not in ("direct", "full"):
        raise ValueError(
            f"{path}: lightloc:transport is '{one_line(transport)}'; expected direct or full"
        )
    camera = spec.getattribute("lightloc:camera")
    if np.shape(camera) != (3,):
        raise ValueError(f"{path}: attribute lightloc:camera is missing; expected 3 floats")
    place = {name: c for c, name in enumerate(spec.channelnames)}
    for name in (name for channels in CHANNELS.values() for name in channels):
        if name not in place:
            raise ValueError(f"{path}: channel {name} is missing")
    pixels = file.read_image(0, 0, 0, spec.nchannels, oiio.FLOAT)
    if pixels is None:
        raise ValueError(f"{path}: pixels are missing or damaged ({one_line(file.geterror())})")
    layers = {
        layer: pixels[:, :, [place[name] for name in channels]]
        for layer, channels in CHANNELS.items()
    }
    unit = spec.get_string_attribute("lightloc:unit") or METRE
    whole = np.concatenate(list(layers.values()), axis=2)
    if checksum and checksum != _checksum(whole, camera, unit):
        raise ValueError(f"{path}: is damaged (its lightloc:crc32 differs)")
    for layer, channels in CHANNELS.items():
        if len(channels) == 1:
            layers[layer] = layers[layer][..., 0]
    return {**layers, "camera": camera, "interreflected": transport == "full", "unit": unit}


def _checksum(pixels: NDArray, camera: ArrayLike, unit: str) -> str:
    parts = [np.ascontiguousarray(part, "<f4").tobytes() for part in (pixels, camera)]
    parts += [] if unit == METRE else [unit.encode()]
    return f"{zlib.crc32(b''.join(parts)):08x}"


def one_line(text: str) -> str:
    """The first of OpenImageIO's complaints, short, without the path and code before each."""
    parts = re.split(r"EXR Error \(.*?\): EXR_ERR_\w+", " ".join(text.split()))
    first = next((part.strip() for part in parts if part.strip()), "")
    return "".join(letter for letter in first if letter.isprintable())[:LONGEST]
