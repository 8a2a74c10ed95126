"""Read glTF 2: meshes under their nodes' transforms, materials, lights and cameras."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from render.gltf_file import BROKEN, GltfFile
from render.part import Part, Parts, colour, linear, picture, texture

LIGHTS, STRENGTH = "KHR_lights_punctual", "KHR_materials_emissive_strength"
IOR, UNLIT, MOVED = "KHR_materials_ior", "KHR_materials_unlit", "KHR_texture_transform"
READ = {LIGHTS, STRENGTH, IOR, UNLIT, "KHR_mesh_quantization"}
MATERIALS = "_materials_"  # in the names of their extensions
INSTANCING = "EXT_mesh_gpu_instancing"
WRAPS = {33071: "clamp", 33648: "mirror", 10497: "repeat"}
STRIP, FAN, TRIANGLES = 5, 6, 4
ROWS = 576  # of a camera's film, which glTF does not have
DEEPEST = 200  # nodes in nodes
OPAQUE = 254.5 / 255


def read_gltf(path: Path, plain: bool) -> Parts:
    """The parts of a glTF file's scene, in metres; without paint where ``plain``.

    Raises ValueError, in one sentence, where a file can't be read or is missing, or something in it
    is not modelled.
    """
    file = GltfFile.read(path)
    for name in file.tree.get("extensionsRequired", []):
        if name not in READ and not (plain and (MATERIALS in name or name == MOVED)):
            raise ValueError(f"{path}: needs the extension {name}, which is not read")
    try:
        return _Reader(file, plain).parts()
    except FileNotFoundError as error:
        raise ValueError(str(error)) from None
    except _NotModelled as error:
        raise ValueError(f"{path}: {error}") from None
    except BROKEN:
        raise ValueError(f"{path}: is broken: something refers to what is not there") from None


def gltf_files(path: Path) -> list[Path]:
    """The buffers and pictures that a glTF file names."""
    return GltfFile.read(path).files()


class _NotModelled(Exception):
    """A sentence without its file."""


@dataclass(frozen=True)
class _Reader:
    file: GltfFile
    plain: bool

    def parts(self) -> Parts:
        parts: list[Part] = []
        others: list[dict[str, Any]] = []
        paints: dict[int, Any] = {}
        for node, to_world in self._nodes():
            name = node.get("name", "")
            if "mesh" in node:
                if "skin" in node:
                    raise _NotModelled(f"node '{name}' has a skin; skins are not read")
                if INSTANCING in node.get("extensions", {}):
                    raise _NotModelled(f"node '{name}' has {INSTANCING}, which is not read")
                mesh = self.file.table("meshes")[node["mesh"]]
                if np.any(node.get("weights", mesh.get("weights", 0))):
                    raise _NotModelled(f"node '{name}' is morphed; morph targets are not read")
                for piece in mesh["primitives"]:
                    part = self._part(name or mesh.get("name", ""), piece, to_world, paints)
                    parts += [part] if part else []
            if "camera" in node:
                camera = self.file.table("cameras")[node["camera"]]
                others += [_camera(camera, to_world)] if camera["type"] == "perspective" else []
            if LIGHTS in node.get("extensions", {}):
                lights = self.file.tree["extensions"][LIGHTS]["lights"]
                light = lights[node["extensions"][LIGHTS]["light"]]
                others.append(_light(light, to_world) | {"id": name or light.get("name", "")})
        return Parts(tuple(parts), tuple(others))

    def _nodes(self) -> Iterator[tuple[dict[str, Any], NDArray]]:
        """Each node of the scene, and the 4 x 4 matrix that takes it into the world."""
        nodes, scenes = self.file.table("nodes"), self.file.table("scenes")
        inner = {child for node in nodes for child in node.get("children", [])}
        roots = [number for number in range(len(nodes)) if number not in inner]
        if scenes:
            roots = scenes[self.file.tree.get("scene", 0)].get("nodes", [])
        waiting = [(number, np.eye(4), 0) for number in reversed(roots)]
        seen = 0
        while waiting:
            number, above, depth = waiting.pop()
            seen += 1
            if depth > DEEPEST or seen > len(nodes):
                raise _NotModelled("a node is within itself or in two places")
            to_world = above @ _matrix(nodes[number])
            yield nodes[number], to_world
            below = reversed(nodes[number].get("children", []))
            waiting += [(child, to_world, depth + 1) for child in below]

    def _part(
        self, name: str, piece: dict[str, Any], to_world: NDArray, paints: dict[int, Any]
    ) -> Part | None:
        if "KHR_draco_mesh_compression" in piece.get("extensions", {}):
            raise _NotModelled(f"mesh '{name}' has KHR_draco_mesh_compression, which is not read")
        own, mode = piece["attributes"], piece.get("mode", TRIANGLES)
        if mode not in (TRIANGLES, STRIP, FAN):
            return None
        vertices = self.file.array(own["POSITION"])
        index = np.arange(len(vertices))
        if "indices" in piece:
            index = self.file.array(piece["indices"])[:, 0].astype(int)
        if len(index) and index.max() >= len(vertices):
            raise _NotModelled(
                f"mesh '{name}' refers to vertex {index.max()}; expected an index "
                f"below {len(vertices)}"
            )
        faces = _triangles(index, mode)
        mirrored = np.linalg.det(to_world[:3, :3]) < 0
        normals = None
        if "NORMAL" in own:
            # by the transposed inverse, whatever its length
            turn = np.cross(np.roll(to_world[:3, :3], -1, 0), np.roll(to_world[:3, :3], -2, 0))
            normals = self.file.array(own["NORMAL"]) @ turn.T * (-1 if mirrored else 1)
        painted: dict[str, Any] = {}
        if "material" in piece:
            number = piece["material"]
            if number not in paints:
                paints[number] = self._material(self.file.table("materials")[number])
            painted = paints[number]
        colours = None if self.plain else self._colours(own, name, painted)
        uv = None
        if (place := painted.get("place")) is not None:
            if f"TEXCOORD_{place}" not in own:
                raise _NotModelled(f"mesh '{name}' has a texture and no TEXCOORD_{place}")
            uv = self.file.array(own[f"TEXCOORD_{place}"])
        return Part(
            name,
            vertices @ to_world[:3, :3].T + to_world[:3, 3],
            faces[:, ::-1] if mirrored else faces,
            normals,
            uv,
            colours,
            None if colours is not None else painted.get("paint"),
            painted.get("emission"),
        )

    def _colours(self, own: Any, name: str, painted: dict[str, Any]) -> NDArray | None:
        """The albedo at each vertex; None where the material alone says it."""
        if "COLOR_0" not in own:
            return None
        rgba = self.file.array(own["COLOR_0"])
        if painted.get("blends") and rgba.shape[1] == 4 and rgba[:, 3].min() < OPAQUE:
            raise _NotModelled(f"mesh '{name}' is partly see-through, which is not modelled")
        if painted.get("paint") and (rgba[:, :3] == 1).all():
            return None
        if not painted.get("tints", True):
            raise _NotModelled(
                f"mesh '{name}' has colours over a texture, or over what is not diffuse; "
                "pass albedo= to take all surfaces as diffuse"
            )
        return rgba[:, :3] * painted.get("factor", 1.0)

    def _material(self, material: dict[str, Any]) -> dict[str, Any]:
        """The BSDF and the emission of a material, and which texture coordinates they have."""
        own, name = material.get("extensions", {}), material.get("name", "")
        metal = material.get("pbrMetallicRoughness", {})
        emitted = np.array(material.get("emissiveFactor", [0, 0, 0]), float)
        emitted = emitted * own.get(STRENGTH, {}).get("emissiveStrength", 1.0)
        slots = [material.get("emissiveTexture") if emitted.any() else None]
        if not self.plain:
            for extension in own:
                if extension not in READ:
                    raise _NotModelled(
                        f"material '{name}' has {extension}, which is not read; pass albedo= to "
                        "take all surfaces as diffuse"
                    )
            slots += [metal.get("baseColorTexture"), metal.get("metallicRoughnessTexture")]
        used = [slot for slot in slots if slot]
        if any(MOVED in slot.get("extensions", {}) for slot in used):
            raise _NotModelled(f"material '{name}' has {MOVED}, which is not read; pass albedo=")
        places = {slot.get("texCoord", 0) for slot in used}
        if len(places) > 1:
            raise _NotModelled(f"material '{name}' has two sets of texture coordinates")
        found: dict[str, Any] = {"place": min(places, default=None)}
        if emitted.any():
            shown = self._texture(slots[0], lambda rgba: linear(rgba[:, :, :3]) * emitted)
            found["emission"] = shown or colour(emitted)
        if self.plain:
            return found
        return found | self._paint(material, metal, own, name)

    def _paint(
        self, material: dict[str, Any], metal: dict[str, Any], own: dict[str, Any], name: str
    ) -> dict[str, Any]:
        factor = np.array(metal.get("baseColorFactor", [1, 1, 1, 1]), float)
        base = metal.get("baseColorTexture")
        mode = material.get("alphaMode", "OPAQUE")
        if mode != "OPAQUE":
            least = OPAQUE if mode == "BLEND" else material.get("alphaCutoff", 0.5)
            alpha = factor[3] * (self._values(base)[:, :, 3].min() if base else 1.0)
            if alpha < least:
                raise _NotModelled(
                    f"material '{name}' is partly see-through, which is not modelled; pass albedo= "
                    "to take all surfaces as diffuse"
                )
        coloured = base is not None or "baseColorFactor" in metal
        if not coloured:
            return {"blends": mode != "OPAQUE", "factor": 1.0}
        reflectance = self._texture(base, lambda rgba: linear(rgba[:, :, :3]) * factor[:3])
        reflectance = reflectance or colour(factor[:3])
        rough = metal.get("metallicRoughnessTexture")
        m, r = metal.get("metallicFactor", 1.0), metal.get("roughnessFactor", 1.0)
        diffuse = UNLIT in own or (m == 0 and r == 1 and not rough)
        paint: dict[str, Any] = {"type": "diffuse", "reflectance": reflectance}
        if not diffuse:
            paint = {
                "type": "principled",
                "base_color": reflectance,
                "metallic": self._texture(rough, lambda rgba: rgba[:, :, 2:3] * m) or float(m),
                "roughness": self._texture(rough, lambda rgba: rgba[:, :, 1:2] * r) or float(r),
                "eta": float(own.get(IOR, {}).get("ior", 1.5)),
            }
        return {
            "paint": paint,
            "factor": factor[:3],
            "tints": base is None and diffuse,
            "blends": mode != "OPAQUE",
        }

    def _values(self, slot: dict[str, Any]) -> NDArray[np.float64]:
        entry = self.file.table("textures")[slot["index"]]
        if "source" not in entry:
            raise _NotModelled(f"texture {slot['index']} has no picture in PNG or JPEG")
        number = entry["source"]
        name = self.file.table("images")[number].get("name", f"image {number}")
        try:
            return picture(self.file.picture(number), name)
        except ValueError as error:
            raise _NotModelled(str(error)) from None

    def _texture(self, slot: dict[str, Any] | None, values: Any) -> dict[str, Any] | None:
        """What a function of the stored values of a picture gives, as a texture."""
        if slot is None:
            return None
        entry = self.file.table("textures")[slot["index"]]
        sampler = self.file.table("samplers")[entry["sampler"]] if "sampler" in entry else {}
        wraps = {sampler.get(f"wrap{axis}", 10497) for axis in "ST"}
        if len(wraps) > 1:
            raise _NotModelled(f"texture {slot['index']} is repeated in one direction alone")
        return texture(values(self._values(slot)), WRAPS[wraps.pop()])


def _triangles(index: NDArray, mode: int) -> NDArray[np.intp]:
    """(f, 3) vertices of triangles; their orientation is that of the first."""
    if mode == TRIANGLES:
        return index[: len(index) // 3 * 3].reshape(-1, 3)
    if mode == FAN:
        first = np.full(max(len(index) - 2, 0), index[0])
        return np.stack([first, index[1:-1], index[2:]], axis=1)
    faces = np.stack([index[:-2], index[1:-1], index[2:]], axis=1)
    faces[1::2] = faces[1::2, [1, 0, 2]]
    return faces


def _matrix(node: dict[str, Any]) -> NDArray[np.float64]:
    if "matrix" in node:
        return np.array(node["matrix"], float).reshape(4, 4).T
    x, y, z, w = np.array(node.get("rotation", [0, 0, 0, 1]), float)
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    matrix = np.eye(4)
    matrix[:3, :3] = turn * np.array(node.get("scale", [1, 1, 1]), float)
    matrix[:3, 3] = node.get("translation", [0, 0, 0])
    return matrix


def _frame(to_world: NDArray) -> Any:
    """A node's place and directions in Mitsuba's way: it looks along z, glTF along -z."""
    origin, ahead, up = to_world[:3, 3], -to_world[:3, 2], to_world[:3, 1]
    target = origin + ahead / np.linalg.norm(ahead)
    return mi.ScalarTransform4f().look_at(
        origin=origin.tolist(), target=target.tolist(), up=up.tolist()
    )


def _light(light: dict[str, Any], to_world: NDArray) -> dict[str, Any]:
    """A light: candela where Mitsuba has W/sr, lux where it has W/m^2."""
    strength = np.array(light.get("color", [1, 1, 1]), float) * light.get("intensity", 1.0)
    kind = light["type"]
    if kind == "point":
        place = [float(v) for v in to_world[:3, 3]]
        return {"type": "point", "position": place, "intensity": colour(strength)}
    if kind == "directional":
        along = [float(v) for v in -to_world[:3, 2]]
        return {"type": "directional", "direction": along, "irradiance": colour(strength)}
    if kind != "spot":
        raise _NotModelled(f"a light is of type '{kind}'; expected point, spot or directional")
    cone = light.get("spot", {})
    outer = np.degrees(cone.get("outerConeAngle", np.pi / 4))
    return {
        "type": "spot",
        "to_world": _frame(to_world),
        "intensity": colour(strength),
        "cutoff_angle": float(outer),
        "beam_width": float(min(np.degrees(cone.get("innerConeAngle", 0.0)), outer * 0.999)),
    }


def _camera(camera: dict[str, Any], to_world: NDArray) -> dict[str, Any]:
    own = camera["perspective"]
    columns = max(1, round(ROWS * own.get("aspectRatio", 4 / 3)))
    return {
        "type": "perspective",
        "to_world": _frame(to_world),
        "fov_axis": "y",
        "fov": float(np.degrees(own["yfov"])),
        "film": {"type": "hdrfilm", "width": columns, "height": ROWS},
        "id": camera.get("name", ""),
    }
