"""Layers of EXR files that any program wrote, found by the names that renderers give them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from render.exr import one_line, opened

NAMES = {  # letters and digits of names in use; the first that is there is taken
    "radiance": (
        *("", "radiance", "combined", "beauty", "rgba", "rgb", "color", "colour", "image", "img"),
        *("c", "ci", "main"),
    ),
    "position": ("position", "pos", "p", "pp", "worldposition", "positionworld", "pworld", "wp"),
    "normal": (
        *("shadingnormal", "shnormal", "ns", "normal", "nn", "normals", "worldnormal"),
        *("normalworld", "nworld", "n"),
    ),
    "albedo": (
        *("albedo", "diffusealbedo", "diffcol", "diffusecolor", "denoisealbedo"),
        "denoisingalbedo",
    ),
    "variance": ("variance", "var"),
    "stddev": ("stddev", "standarddeviation", "sigma"),
}
COLOUR = (("r", "g", "b"), ("red", "green", "blue"))
VECTOR = (("x", "y", "z"), *COLOUR)
GREY = (("y",), ("l",), ("v",))
LARGEST = 1 << 28  # pixels: a picture of more is a damaged header


@dataclass(frozen=True)
class Layer:
    """Where the channels of a layer lie in a file."""

    path: Path
    part: int
    channels: tuple[int, ...]


@dataclass(frozen=True)
class Layers:
    """The layers of some files, by what they mean.

    Parameters
    ----------
    found
        Each layer's place, by the keys of `NAMES`.
    attributes
        Those of the part that holds the radiance, in front of those of the others.
    """

    found: dict[str, Layer]
    attributes: dict[str, Any]

    @staticmethod
    def of(paths: Sequence[Path]) -> Layers:
        """Look for them; raises ValueError where no layer is a picture, or several may be."""
        places: dict[str, dict[str, tuple[Path, int, int]]] = {}
        attributes: dict[tuple[Path, int], dict[str, Any]] = {}
        for path in paths:
            with opened(path) as file:
                for part, spec in enumerate(_specs(path, file)):
                    attributes[path, part] = {a.name: a.value for a in spec.extra_attribs}
                    for channel, name in enumerate(spec.channelnames):
                        layer, _, letter = name.rpartition(".")
                        layer = _word(layer.rpartition(".")[2]) or _of_part(spec)
                        if not layer and len(paths) > 1:
                            layer = _of_file(path)
                        there = places.setdefault(layer, {})
                        there.setdefault(letter.lower(), (path, part, channel))
        name = paths[0]
        found = {"radiance": _picture(name, places)}
        for meaning in ("position", "normal", "albedo", "variance", "stddev"):
            kinds = VECTOR if meaning in ("position", "normal") else (*COLOUR, *GREY)
            for known in NAMES[meaning]:
                layer = _layer(places.get(known, {}), kinds)
                if layer:
                    found[meaning] = layer
                    break
        first = found["radiance"]
        own = attributes.pop((first.path, first.part))
        rest = {name: value for more in attributes.values() for name, value in more.items()}
        return Layers(found, rest | own)

    def read(self, meaning: str) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
        """The (h, w, c) pixels of the display window, and (h, w) which of them are in the file.

        NaN where they are not. Raises ValueError where pixels are missing or damaged.
        """
        layer = self.found[meaning]
        path, channels = layer.path, layer.channels
        with opened(path) as file:
            file.seek_subimage(layer.part, 0)
            spec = file.spec()
            if not 0 < spec.full_width * spec.full_height <= LARGEST:
                raise ValueError(
                    f"{path}: a damaged EXR file (its display window is "
                    f"{spec.full_width} x {spec.full_height} pixels)"
                )
            first, last = min(channels), max(channels) + 1
            pixels = file.read_image(layer.part, 0, first, last, oiio.FLOAT)
            if pixels is None:
                said = one_line(file.geterror())
                raise ValueError(f"{path}: pixels are missing or damaged ({said})")
        pixels = pixels.reshape(spec.height, spec.width, -1)[..., [c - first for c in channels]]
        whole = np.full((spec.full_height, spec.full_width, len(channels)), np.nan, np.float32)
        inside = np.zeros(whole.shape[:2], bool)
        left, top = spec.x - spec.full_x, spec.y - spec.full_y
        there = (_span(top, spec.height), _span(left, spec.width))
        here = (_span(-top, spec.full_height), _span(-left, spec.full_width))
        whole[there], inside[there] = pixels[here], True
        return whole, inside


def _span(start: int, length: int) -> slice:
    return slice(max(start, 0), max(start + length, 0))


def _specs(path: Path, file: oiio.ImageInput) -> list[oiio.ImageSpec]:
    specs: list[oiio.ImageSpec] = []
    while file.seek_subimage(len(specs), 0):
        spec = file.spec()
        if spec.deep:
            raise ValueError(f"{path}: is a deep picture; expected one value per channel and pixel")
        specs.append(spec)
    return specs


def _word(text: str) -> str:
    return re.sub("[^a-z0-9]", "", text.lower())


def _of_part(spec: oiio.ImageSpec) -> str:
    """The layer that a part's name says, where the file has several."""
    several = spec.get_int_attribute("oiio:subimages", 1) > 1
    return _word(spec.get_string_attribute("name").rpartition(".")[2]) if several else ""


def _of_file(path: Path) -> str:
    """The layer that a file's name says: its last word that is in `NAMES`."""
    known = {name for names in NAMES.values() for name in names}
    words = [_word(part) for part in re.split(r"[ ._-]+", path.stem)]
    pairs = [a + b for a, b in pairwise(words)]
    return next((word for word in (*pairs[::-1], *words[::-1]) if word in known), "")


def _layer(
    there: dict[str, tuple[Path, int, int]], kinds: Sequence[tuple[str, ...]]
) -> Layer | None:
    for letters in kinds:
        if all(letter in there for letter in letters):
            path, part, _ = there[letters[0]]
            if all(there[letter][:2] == (path, part) for letter in letters):
                return Layer(path, part, tuple(there[letter][2] for letter in letters))
    return None


def _picture(name: Path, places: dict[str, dict[str, tuple[Path, int, int]]]) -> Layer:
    """The layer that is the picture."""
    if any({"ry", "by"} & set(there) for there in places.values()):
        raise ValueError(f"{name}: holds luminance and chroma (Y, RY, BY); save R, G and B")
    for kinds in (COLOUR, GREY):
        for known in NAMES["radiance"]:
            layer = _layer(places.get(known, {}), kinds)
            if layer and not (kinds is GREY and "x" in places[known]):
                return layer
        if kinds is COLOUR:
            others = {name for names in NAMES.values() for name in names}
            layers = {n: _layer(there, kinds) for n, there in places.items() if n not in others}
            pictures = {n: layer for n, layer in layers.items() if layer}
            if len(pictures) > 1:
                raise ValueError(
                    f"{name}: which layer is the picture? (it has {', '.join(sorted(pictures))}; "
                    "expected R, G and B, Combined or beauty)"
                )
            if pictures:
                return next(iter(pictures.values()))
    raise ValueError(f"{name}: has no picture; expected channels R, G and B, or Y")
