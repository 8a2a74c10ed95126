"""The container of glTF: its JSON, its buffers, and the arrays and pictures in them."""

from __future__ import annotations

import base64
import json
import os
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import unquote, unquote_to_bytes

import numpy as np
from numpy.typing import NDArray

MAGIC, JSON, BINARY = 0x46546C67, 0x4E4F534A, 0x004E4942
COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
MOST = 1 << 26  # values of an accessor that has no data of its own
BROKEN = (KeyError, IndexError, TypeError, ValueError, AttributeError, OverflowError)


@dataclass(frozen=True)
class GltfFile:
    """A file's JSON ``tree``, and the ``chunk`` that stands behind it in GLB."""

    path: Path
    tree: dict[str, Any]
    chunk: bytes

    @staticmethod
    def read(path: Path) -> GltfFile:
        """Raises ValueError, with the file, where it is no glTF 2."""
        data, chunk = path.read_bytes(), b""
        try:
            if data[:4] == struct.pack("<I", MAGIC):
                (size, kind), rest = struct.unpack_from("<II", data, 12), 20
                if kind != JSON:
                    raise ValueError
                text, rest = data[rest : rest + size], rest + size
                if len(data) >= rest + 8:
                    size, kind = struct.unpack_from("<II", data, rest)
                    chunk = data[rest + 8 : rest + 8 + size] if kind == BINARY else b""
                data = text
            tree = json.loads(data)
            version = str(tree["asset"]["version"])
        except (*BROKEN, struct.error, RecursionError):
            raise ValueError(f"{path}: is no glTF file, or is cut off") from None
        if version.split(".")[0] != "2":
            raise ValueError(f"{path}: is glTF {version}; expected version 2")
        return GltfFile(path, tree, chunk)

    def table(self, name: str) -> list[dict[str, Any]]:
        """A list at the top of the file, [] where there is none."""
        found: list[dict[str, Any]] = self.tree.get(name, [])
        return found

    def files(self) -> list[Path]:
        """The buffers and pictures beside it that it names."""
        named = [part.get("uri", "data:") for part in self.table("buffers") + self.table("images")]
        return [self.path.parent / unquote(uri) for uri in named if not uri.startswith("data:")]

    def array(self, number: int) -> NDArray[np.float64]:
        """(n, width) values of an accessor, those that are normalized in -1 to 1."""
        accessor = self.table("accessors")[number]
        kind, width = np.dtype(COMPONENTS[accessor["componentType"]]), WIDTHS[accessor["type"]]
        count = int(accessor["count"])
        if "bufferView" in accessor:
            values = self._strided(accessor, kind, count, width).copy()
        elif 0 <= count <= MOST:
            values = np.zeros((count, width), kind)
        else:
            raise ValueError
        if "sparse" in accessor:
            sparse = accessor["sparse"]
            indices, other = sparse["indices"], sparse["values"]
            where = np.dtype(COMPONENTS[indices["componentType"]])
            at = self._strided(indices, where, int(sparse["count"]), 1)[:, 0]
            values[at] = self._strided(other, kind, len(at), width)
        if accessor.get("normalized") and kind.kind in "iu":
            return np.maximum(values.astype(float) / np.iinfo(kind).max, -1)
        return values.astype(float)

    def picture(self, number: int) -> bytes:
        """The bytes of an image."""
        image = self.table("images")[number]
        if "bufferView" in image:
            view = self.table("bufferViews")[image["bufferView"]]
            first = view.get("byteOffset", 0)
            return self._buffer(view["buffer"])[first : first + view["byteLength"]]
        return self._bytes(image["uri"])

    def _strided(self, where: dict[str, Any], kind: np.dtype, count: int, width: int) -> NDArray:
        view = self.table("bufferViews")[where["bufferView"]]
        first = view.get("byteOffset", 0) + where.get("byteOffset", 0)
        row = kind.itemsize * width
        step = view.get("byteStride", row)
        end = view.get("byteOffset", 0) + view["byteLength"]
        data = self._buffer(view["buffer"])
        if count < 0 or first < 0 or end > len(data) or first + step * (count - 1) + row > end:
            raise ValueError
        return np.ndarray((count, width), kind, data, first, (step, kind.itemsize))

    def _buffer(self, number: int) -> bytes:
        buffer = self.table("buffers")[number]
        return self._bytes(buffer["uri"]) if "uri" in buffer else self.chunk

    def _bytes(self, uri: str) -> bytes:
        if uri.startswith("data:"):
            head, _, data = uri.partition(",")
            return base64.b64decode(data) if head.endswith(";base64") else unquote_to_bytes(data)
        file = self.path.parent / unquote(uri)
        if not os.path.isfile(file):
            raise FileNotFoundError(f"{self.path}: names {unquote(uri)}, which is missing")
        return file.read_bytes()
