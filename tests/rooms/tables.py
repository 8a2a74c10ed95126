"""What `scenes/tables` holds: bumps, and a BRDF as a gonioreflectometer would have measured it.

``python -m rooms.tables`` in tests/ writes it again.
"""

from __future__ import annotations

import io
import struct
from pathlib import Path

import numpy as np
from matplotlib.image import imsave
from numpy.typing import NDArray

FOLDER = Path(__file__).parents[2] / "scenes" / "tables"

ELEVATIONS, CELLS = 12, 24  # of the viewer; along each side of a table of half vectors
BASE, BACK, WIDE = 0.3, 0.4, 0.5  # albedo; peak and width, in radians, of what is sent back

KINDS = {np.dtype(np.uint8): 1, np.dtype(np.float32): 10}  # Mitsuba's numbers of types


def bumps() -> bytes:
    """A PNG of one swell and one hollow each way, which repeats."""
    x = 2 * np.pi * (np.arange(64) + 0.5) / 64
    file = io.BytesIO()
    imsave(file, 0.5 + np.outer(np.sin(x), np.sin(x)) / 2, cmap="gray", vmin=0, vmax=1)
    return file.getvalue()


def cloth(wi: NDArray[np.float64], wo: NDArray[np.float64]) -> NDArray[np.float64]:
    """The BRDF: diffuse, and a lobe about where the light comes from. (..., 3) local directions."""
    apart = np.arccos(np.clip((wi * wo).sum(axis=-1), -1, 1))
    return BASE / np.pi + BACK * np.exp(-np.square(apart / WIDE))


def measured() -> bytes:
    """f (n . l)+ of `cloth`, in the format of Dupuy and Jakob (SIGGRAPH Asia 2018), in RGB.

    A table of half vectors for each elevation of the viewer: their elevation along the last axis,
    as sqrt(theta / (pi / 2)), and their azimuth, from that of the viewer, along the one before.
    """
    seen = np.linspace(0, np.pi / 2, ELEVATIONS)
    u = np.linspace(0, 1, CELLS)
    theta, phi = np.meshgrid(np.square(u) * np.pi / 2, (2 * u - 1) * np.pi)
    half = spherical(theta, phi)
    table = np.zeros((1, ELEVATIONS, 3, CELLS, CELLS), np.float32)
    for i, elevation in enumerate(seen):
        viewer = spherical(elevation, 0.0)
        light = 2 * (half @ viewer)[..., None] * half - viewer
        table[0, i] = cloth(viewer, light) * np.maximum(light[..., 2], 0)
    even = np.ones((1, ELEVATIONS, 2, 2), np.float32)  # half vectors are sampled evenly
    return tensors(
        description=np.frombuffer(b"a cloth that reflects back", np.uint8),
        theta_i=seen.astype(np.float32),
        phi_i=np.zeros(1, np.float32),
        ndf=even[0, 0],
        sigma=even[0, 0],
        vndf=even,
        luminance=np.ones((1, ELEVATIONS, CELLS, CELLS), np.float32),
        rgb=table,
        jacobian=np.zeros(1, np.uint8),
    )


def spherical(theta: NDArray | float, phi: NDArray | float) -> NDArray[np.float64]:
    """(..., 3) directions."""
    return np.stack(
        [np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta) + 0 * phi], axis=-1
    )


def tensors(**fields: NDArray) -> bytes:
    """A tensor file: for each field its name, rank, type, place and shape; then all values."""
    head = b"tensor_file\0\1\0" + struct.pack("<I", len(fields))
    at = len(head) + sum(13 + len(name) + 8 * field.ndim for name, field in fields.items())
    values = b""
    for name, field in fields.items():
        head += struct.pack("<H", len(name)) + name.encode()
        head += struct.pack("<HBQ", field.ndim, KINDS[field.dtype], at + len(values))
        head += struct.pack(f"<{field.ndim}Q", *field.shape)
        values += field.tobytes()
    return head + values


FILES = {"bumps.png": bumps, "cloth_rgb.bsdf": measured}

if __name__ == "__main__":
    for name, made in FILES.items():
        (FOLDER / name).write_bytes(made())
