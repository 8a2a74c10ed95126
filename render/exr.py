"""Views on disk: one multi-layer EXR, written and read through OpenImageIO.

Layers and their channels are in `CHANNELS`, all of them float32; ``R``, ``G``, ``B`` are the
radiance. Attributes: ``lightloc:format`` names the format and its version, ``lightloc:camera`` is
the pinhole (3 floats, metres), and ``lightloc:crc32`` (hexadecimal; may be missing) is the CRC-32
of the little-endian pixels in this order of channels, because EXR itself has no checksum.
"""

from __future__ import annotations

import os
import zlib
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from render.view import View

FORMAT = "lightloc-view-1"
CHANNELS = {
    "radiance": ("R", "G", "B"),
    "variance": ("variance.R", "variance.G", "variance.B"),
    "position": ("position.X", "position.Y", "position.Z"),
    "normal": ("normal.X", "normal.Y", "normal.Z"),
    "albedo": ("albedo.R", "albedo.G", "albedo.B"),
    "roughness": ("roughness.Y",),
    "shape": ("shape.I",),
    "pure": ("pure.I",),
    "film": ("film.R", "film.G", "film.B"),
}
MAGIC = b"\x76\x2f\x31\x01"  # the first bytes of every EXR file


def write_exr(view: View, path: str | Path) -> None:
    """Write a view as one EXR file, whole or not at all: same view, same bytes.

    Raises:
        ValueError: the name does not end in ``.exr``, or the file can't be written.
    """
    path = Path(path)
    if path.suffix.lower() != ".exr":
        raise ValueError(f"{path}: a view is written as EXR; expected a name that ends in .exr")
    pixels = np.concatenate(
        [np.atleast_3d(getattr(view, layer)).astype("<f4") for layer in CHANNELS], axis=2
    )
    names = [name for channels in CHANNELS.values() for name in channels]
    spec = oiio.ImageSpec(*view.size, len(names), oiio.FLOAT)
    spec.channelnames = names
    spec.attribute("compression", "zip")
    spec.attribute("lightloc:format", FORMAT)
    spec.attribute("lightloc:camera", oiio.TypeDesc("float[3]"), tuple(view.camera.tolist()))
    spec.attribute("lightloc:crc32", f"{zlib.crc32(pixels.tobytes()):08x}")
    part = path.with_name(path.stem + ".part.exr")  # OpenImageIO goes by the extension
    try:
        file = oiio.ImageOutput.create(str(part))
        if file is None:
            raise ValueError(f"{path}: can't be written ({_one_line(oiio.geterror())})")
        done = file.open(str(part), spec) and file.write_image(pixels)
        if not (file.close() and done):
            raise ValueError(f"{path}: can't be written ({_one_line(file.geterror())})")
        os.replace(part, path)
    finally:
        part.unlink(missing_ok=True)


def read_exr(path: str | Path) -> View:
    """Read what `write_exr` wrote.

    Raises:
        ValueError: one sentence naming the file and the field: there is no such file, it is no
            EXR file or not in this format, a channel is missing, pixels are missing or damaged,
            or a value is not finite or out of range.
    """
    try:
        with open(path, "rb") as start:
            magic = start.read(len(MAGIC))
    except FileNotFoundError:
        raise ValueError(f"{path}: no such file") from None
    except OSError as error:
        raise ValueError(f"{path}: can't be read ({error.strerror})") from None
    if magic != MAGIC:
        raise ValueError(f"{path}: not an EXR file")
    file = oiio.ImageInput.open(str(path))
    if file is None:
        raise ValueError(f"{path}: a damaged EXR file ({_one_line(oiio.geterror())})")
    try:
        layers, camera = _read(path, file)
    finally:
        file.close()
    try:
        return View(**layers, camera=camera)
    except ValueError as error:
        raise ValueError(f"{path}: {error}") from None


def _read(path: str | Path, file: oiio.ImageInput) -> tuple[dict[str, NDArray], NDArray]:
    """The layers by name, and the camera."""
    spec = file.spec()
    found = spec.getattribute("lightloc:format")
    if found != FORMAT:
        raise ValueError(f"{path}: lightloc:format is {found}; expected {FORMAT}")
    camera = spec.getattribute("lightloc:camera")
    if camera is None:
        raise ValueError(f"{path}: attribute lightloc:camera is missing")
    place = {name: c for c, name in enumerate(spec.channelnames)}
    for name in (name for channels in CHANNELS.values() for name in channels):
        if name not in place:
            raise ValueError(f"{path}: channel {name} is missing")
    pixels = file.read_image(0, 0, 0, spec.nchannels, oiio.FLOAT)
    if pixels is None:
        raise ValueError(f"{path}: pixels are missing or damaged ({_one_line(file.geterror())})")
    layers = {
        layer: pixels[:, :, [place[name] for name in channels]]
        for layer, channels in CHANNELS.items()
    }
    checksum = spec.getattribute("lightloc:crc32")
    whole = np.concatenate(list(layers.values()), axis=2).astype("<f4")
    if checksum is not None and checksum != f"{zlib.crc32(whole.tobytes()):08x}":
        raise ValueError(f"{path}: pixels are damaged (their lightloc:crc32 differs)")
    single = {layer: values[..., 0] for layer, values in layers.items() if values.shape[2] == 1}
    return layers | single, np.array(camera, np.float32)


def _one_line(error: str) -> str:
    return " ".join(error.split()) or "OpenImageIO gave no reason"
