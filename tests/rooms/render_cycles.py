"""What Blender Cycles sees of these rooms: the radiance of every light alone, in every pixel.

In an environment of its own, about 1 GB, from the folder above this one:

    python3.11 -m venv bpyenv
    bpyenv/bin/pip install bpy==4.5.15 openimageio "numpy<2"
    bpyenv/bin/python -m rooms.render_cycles arches stairs plants library clutter

Writes NAME.npz beside this page (no file here may be called ``cycles.py``: it would hide the
engine). Every pixel is one surface point:

    positions, normals (n, 3) float32      the normal on the side that is seen
    albedo (n,), direct (n, k) float32     direct: light that comes straight from each light
    total (n, k) float16                   with all interreflection; carries path noise
    origin (3,), width                     the camera's place; pixels are row by row from above
    light_positions (k, 3), light_intensities (k,), sha256 of the triangles

A light at a point is seen without noise by a single sample, if it is the only light; so each is
rendered alone.
"""

from __future__ import annotations

import importlib
import sys
import tempfile
from pathlib import Path

import bpy
import mathutils
import numpy as np
import OpenImageIO as oiio

from rooms.shapes import Design

WIDTH, HEIGHT = 100, 56
SAMPLES, BOUNCES = 256, 64  # for all light
ONE_POINT = 0.01  # pixels that the filter is wide: every sample of a pixel sees the same point


def settings() -> None:
    """An empty scene for Cycles, with nothing switched on that changes radiances."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    render, cycles = bpy.context.scene.render, bpy.context.scene.cycles
    render.engine, cycles.device = "CYCLES", "CPU"
    cycles.use_adaptive_sampling = cycles.use_denoising = cycles.use_light_tree = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    cycles.light_sampling_threshold = 0
    cycles.pixel_filter_type, cycles.filter_width = "BLACKMAN_HARRIS", ONE_POINT
    render.resolution_x, render.resolution_y = WIDTH, HEIGHT
    render.image_settings.file_format = "OPEN_EXR_MULTILAYER"
    render.image_settings.color_depth = "32"
    layer = bpy.context.scene.view_layers[0]
    layer.use_pass_position = layer.use_pass_normal = layer.use_pass_diffuse_color = True


def put(name: str, data: bpy.types.ID) -> bpy.types.Object:
    """A new object in the scene."""
    thing = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(thing)
    return thing


def diffuse(grey: float) -> bpy.types.Material:
    """A Lambertian material."""
    material = bpy.data.materials.new(f"{grey:.4f}")
    material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    bsdf, out = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeOutputMaterial")
    bsdf.inputs["Color"].default_value = (grey, grey, grey, 1)
    bsdf.inputs["Roughness"].default_value = 0
    material.node_tree.links.new(bsdf.outputs[0], out.inputs[0])
    return material


def surfaces(design: Design) -> None:
    """The triangles, a material for each grey."""
    mesh = bpy.data.meshes.new("room")
    mesh.from_pydata(design.vertices.tolist(), [], design.faces.tolist())
    greys, of_face = np.unique(design.albedo, return_inverse=True)
    for grey in greys:
        mesh.materials.append(diffuse(float(grey)))
    mesh.polygons.foreach_set("material_index", of_face.astype(np.int32))
    mesh.update()
    if len(mesh.polygons) != len(design.faces):
        raise ValueError("Blender dropped degenerate triangles")
    put("room", mesh)


def camera(design: Design) -> None:
    """The camera, upright."""
    lens = bpy.data.cameras.new("camera")
    lens.sensor_fit, lens.angle = "HORIZONTAL", np.radians(design.field_of_view)
    lens.clip_start = 1e-3
    origin, target = design.camera
    back = (origin - target) / np.linalg.norm(origin - target)
    right = np.cross((0, 0, 1), back)
    right /= np.linalg.norm(right)
    frame = np.eye(4)
    frame[:3] = np.stack([right, np.cross(back, right), back, origin], 1)
    thing = put("camera", lens)
    thing.matrix_world = mathutils.Matrix(frame.tolist())
    bpy.context.scene.camera = thing


def lights(design: Design) -> list[bpy.types.Object]:
    """The point lights; Cycles takes their power in watts, 4 pi I."""
    things = []
    for place, intensity in zip(design.positions, design.intensities, strict=True):
        light = bpy.data.lights.new("light", "POINT")
        light.shadow_soft_size, light.energy = 0, float(4 * np.pi * intensity)
        things.append(put("light", light))
        things[-1].location = place
    return things


def shoot(bounces: int, samples: int) -> dict[str, np.ndarray]:
    """One picture: its passes, (n, channels) each."""
    scene = bpy.context.scene
    scene.cycles.samples = samples
    scene.cycles.max_bounces = scene.cycles.diffuse_bounces = bounces
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = str(Path(folder) / "seen.exr")
        bpy.ops.render.render(write_still=True)
        image = oiio.ImageInput.open(scene.render.filepath)
        names, pixels = list(image.spec().channelnames), image.read_image("float")
        image.close()
    layer = scene.view_layers[0].name
    return {
        name: np.stack([pixels[..., names.index(f"{layer}.{name}.{c}")] for c in channels], -1)
        .reshape(-1, len(channels))
        .astype(np.float32)
        for name, channels in (
            ("Combined", "R"), ("Position", "XYZ"), ("Normal", "XYZ"), ("DiffCol", "R"),
        )
    }  # fmt: skip


def seen(design: Design) -> dict[str, np.ndarray]:
    """Everything that NAME.npz holds."""
    settings()
    surfaces(design)
    camera(design)
    things = lights(design)
    direct, total, first = [], [], None
    for thing in things:
        for other in things:
            other.hide_render = other is not thing
        picture = shoot(0, 1)
        first = picture if first is None else first
        if not np.array_equal(picture["Position"], first["Position"]):
            raise ValueError("two pictures see other points")
        direct.append(picture["Combined"][:, 0])
        total.append(shoot(BOUNCES, SAMPLES)["Combined"][:, 0])
    if not np.linalg.norm(first["Normal"], axis=1).min() > 0.5:
        raise ValueError("a pixel sees nothing: the room has a hole")
    origin = design.camera[0]
    away = np.einsum("ij,ij->i", first["Normal"], origin - first["Position"]) < 0
    return {
        "positions": first["Position"],
        "normals": np.where(away[:, None], -first["Normal"], first["Normal"]),
        "albedo": first["DiffCol"][:, 0],
        "direct": np.stack(direct, 1),
        "total": np.stack(total, 1).astype(np.float16),
        "origin": origin,
        "width": np.array(WIDTH),
        "light_positions": design.positions,
        "light_intensities": design.intensities,
        "sha256": np.array(design.sha256()),
    }


if __name__ == "__main__":
    for name in sys.argv[1:]:
        design = getattr(importlib.import_module(f"rooms.{name}"), name)()
        np.savez_compressed(Path(__file__).with_name(f"{name}.npz"), **seen(design))
