"""Materials read out of a scene: our models where they fit, Mitsuba's own BSDF elsewhere.

Each is seen in a small room with a block that casts a shadow, two lights, and one BSDF on the
floor; `radiance` must then give what Mitsuba's emitters, shadow rays and BSDFs give.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import mitsuba as mi
import numpy as np
import pytest

import render
from lightloc import Conductor, Lambert, Mixed, Observations, Plastic, radiance
from render.material import SceneBSDF
from render.variant import use_mitsuba

POINTS = 512
AGREEMENT = 1e-4  # of B: some twenty float32 roundings, with 1 / 0.01 for grazing light
IMAGE = np.random.default_rng(1).uniform(0.1, 0.9, (8, 8, 3)).astype(np.float32)
BUMPS = 0.02 * np.random.default_rng(2).random((16, 16, 1)).astype(np.float32)


def rgb(value) -> dict[str, Any]:
    return {"type": "rgb", "value": value}


def texture(image: np.ndarray) -> dict[str, Any]:
    """A bitmap made in memory, one value per pixel, no interpolation."""
    use_mitsuba()
    bitmap = mi.Bitmap(np.ascontiguousarray(image))
    return {"type": "bitmap", "bitmap": bitmap, "raw": True, "filter_type": "nearest"}


def tilted() -> np.ndarray:
    """A normal map: unit vectors within about 15 degrees of the surface's, packed into [0, 1]."""
    n = np.random.default_rng(3).uniform(-0.2, 0.2, (8, 8, 3))
    n[..., 2] = 1
    return (n / np.linalg.norm(n, axis=2, keepdims=True) / 2 + 0.5).astype(np.float32)


DIFFUSE = {"type": "diffuse", "reflectance": rgb([0.6, 0.4, 0.2])}
METAL = {"type": "roughconductor", "distribution": "ggx", "alpha": 0.3, "material": "Al"}
CHECKS = {"type": "checkerboard", "color0": rgb(0.2), "color1": rgb(0.7)}
MODELS = {
    "diffuse": (Lambert, lambda: DIFFUSE),
    "checkerboard": (Lambert, lambda: {"type": "diffuse", "reflectance": CHECKS}),
    "bitmap": (Lambert, lambda: {"type": "diffuse", "reflectance": texture(IMAGE)}),
    "metal": (Conductor, lambda: METAL),
    "mirror": (Conductor, lambda: {**METAL, "material": "none"}),
    "alpha_texture": (Conductor, lambda: {**METAL, "alpha": texture(IMAGE[..., :1])}),
    "tint_texture": (Conductor, lambda: {**METAL, "specular_reflectance": texture(IMAGE)}),
    "plastic": (
        Plastic,
        lambda: {
            "type": "roughplastic",
            "distribution": "ggx",
            "alpha": 0.3,
            "diffuse_reflectance": texture(IMAGE),
            "nonlinear": True,
        },
    ),
    "twosided": (Conductor, lambda: {"type": "twosided", "bsdf": METAL}),
}
OTHERS = {
    "principled": lambda: {
        "type": "principled",
        "base_color": rgb([0.5, 0.3, 0.2]),
        "roughness": 0.3,
        "metallic": 0.4,
        "anisotropic": 0.5,
        "clearcoat": 0.6,
        "sheen": 0.3,
    },
    "beckmann": lambda: {**METAL, "distribution": "beckmann"},
    "anisotropic": lambda: {
        "type": "roughconductor",
        "distribution": "ggx",
        "alpha_u": 0.1,
        "alpha_v": 0.4,
    },
    "pplastic": lambda: {
        "type": "pplastic",
        "alpha": 0.2,
        "diffuse_reflectance": rgb([0.1, 0.2, 0.6]),
    },
    "smooth_plastic": lambda: {"type": "plastic", "diffuse_reflectance": rgb([0.1, 0.2, 0.6])},
    "beckmann_plastic": lambda: {
        "type": "roughplastic",
        "distribution": "beckmann",
        "alpha": 0.3,
    },
    "two_sides": lambda: {"type": "twosided", "front": DIFFUSE, "back": METAL},
    "blend": lambda: {
        "type": "blendbsdf",
        "weight": texture(IMAGE[..., :1]),
        "one": DIFFUSE,
        "other": METAL,
    },
    "bumps": lambda: {"type": "bumpmap", "height": texture(BUMPS), "bsdf": DIFFUSE},
    "normal_map": lambda: {"type": "normalmap", "normalmap": texture(tilted()), "bsdf": METAL},
    "half_there": lambda: {"type": "mask", "opacity": 0.6, "bsdf": DIFFUSE},
}
EVERY = {**{name: make for name, (_, make) in MODELS.items()}, **OTHERS}


def observe(room: render.Room, shapes: list[str] | None = None) -> Observations:
    return render.observe(room, points=POINTS, seed=1, transport="direct", shapes=shapes)


def disagreement(q: Observations, room: render.Room) -> np.ndarray:
    """|radiance() - B| against B, dark points against a hundredth of the mean, (n,)."""
    B = q.radiance
    error = np.abs(radiance(q, room.lights, room.geometry) - B)
    return (error / (B + 0.01 * B.mean())).max(axis=1)


@pytest.mark.parametrize("name", EVERY)
def test_radiance_through_every_bsdf(name, workshop):
    """`radiance` is Mitsuba's direct light, whatever the floor is made of.

    One point in a thousand may lie so near a shadow's edge that rounding decides.
    """
    room = workshop(EVERY[name]())
    q = observe(room)
    assert (q.radiance > 0).mean() > 0.5
    assert np.quantile(disagreement(q, room), 0.999) < AGREEMENT


@pytest.mark.parametrize("name", EVERY)
def test_model_or_scene(name, workshop):
    """Diffuse, GGX metal and GGX plastic are read as our models, anything else stays Mitsuba's."""
    room = workshop(EVERY[name]())
    q = observe(room, ["floor"])
    assert type(q.material) is (MODELS[name][0] if name in MODELS else SceneBSDF)


def test_a_wrong_material_is_seen(workshop):
    """Negative control: the same points with 1 % more albedo, or rougher metal, disagree."""
    for name, wrong in (
        ("diffuse", Lambert(albedo=[0.606, 0.4, 0.2])),
        ("mirror", Conductor(0.303)),
    ):
        room = workshop(EVERY[name]())
        q = observe(room, ["floor"])
        assert np.quantile(disagreement(replace(q, material=wrong), room), 0.9) > 10 * AGREEMENT


def floor(workshop, bsdf) -> tuple[Observations, np.ndarray, np.ndarray]:
    """The floor observed, and (u, v) of each point: the floor is [-1, 1]^2."""
    q = observe(workshop(bsdf), ["floor"])
    assert not q.positions[:, 2].any()
    return q, *((q.positions[:, :2].T + 1) / 2)


def test_checkerboard_is_read_at_each_point(workshop):
    """Each point has the albedo of the square that it lies in."""
    q, u, v = floor(workshop, {"type": "diffuse", "reflectance": CHECKS})
    expected = np.where((u > 0.5) == (v > 0.5), 0.2, 0.7)
    np.testing.assert_allclose(q.material.albedo[:, 0], expected, rtol=1e-6)


def test_bitmap_is_read_at_each_point(workshop):
    """Each point has the colour of the pixel that it lies in, the image's first row at v = 0."""
    q, u, v = floor(workshop, {"type": "diffuse", "reflectance": texture(IMAGE)})
    expected = IMAGE[(8 * v).astype(int), (8 * u).astype(int)]
    np.testing.assert_allclose(q.material.albedo, expected, rtol=1e-6)


def test_roughness_is_read_at_each_point(workshop):
    """A roughness texture gives each point its own alpha."""
    q, u, v = floor(workshop, {**METAL, "alpha": texture(IMAGE[..., :1])})
    expected = IMAGE[(8 * v).astype(int), (8 * u).astype(int), :1]
    np.testing.assert_allclose(q.material.alpha, expected, rtol=1e-6)


RED, BLUE = (
    {"type": "diffuse", "reflectance": rgb(value)} for value in ([0.8, 0.1, 0.1], [0.1, 0.1, 0.8])
)


@pytest.mark.parametrize(
    "bsdf",
    [
        {"type": "twosided", "front": RED, "back": BLUE},
        {"type": "twosided", "front": METAL, "back": DIFFUSE},
        {"type": "twosided", "front": DIFFUSE},
        {"type": "twosided", "both": {"type": "principled", "base_color": rgb([0.5, 0.3, 0.2])}},
    ],
    ids=["two_paints", "metal_and_paint", "paint", "principled"],
)
def test_the_back_of_a_surface(bsdf, workshop):
    """A floor whose back faces the room shows its back, in colour."""
    room = workshop(bsdf, from_behind=True)
    q = observe(room, ["floor"])
    assert (q.normals[:, 2] > 0.99).all()
    assert q.channels == 3
    assert np.ptp(q.radiance, axis=1).max() > 0.1 * q.radiance.max()
    assert np.quantile(disagreement(q, room), 0.999) < AGREEMENT


def test_two_bitmaps_with_one_mean_are_two(workshop):
    """Front and back that differ only in where the pixels lie are not taken for one."""
    turned = IMAGE[::-1, ::-1]
    bsdf = {
        "type": "twosided",
        "front": {"type": "diffuse", "reflectance": texture(IMAGE)},
        "back": {"type": "diffuse", "reflectance": texture(turned)},
    }
    room = workshop(bsdf, from_behind=True)
    q = observe(room, ["floor"])
    assert np.quantile(disagreement(q, room), 0.999) < AGREEMENT


def test_a_scenes_bsdf_survives_the_file(workshop, tmp_path):
    """Observations of a foreign BSDF, saved and read, shade as before once `attach` is given the
    room; without the room they say so in a sentence."""
    room = workshop(OTHERS["principled"]())
    q = observe(room)
    assert isinstance(q.material, Mixed)
    q.save(tmp_path / "seen.npz")
    read = Observations.load(tmp_path / "seen.npz")
    with pytest.raises(ValueError, match="name the scene"):
        radiance(read, room.lights)
    again = render.attach(read, room)
    np.testing.assert_allclose(
        radiance(again, room.lights, room.geometry),
        radiance(q, room.lights, room.geometry),
        rtol=AGREEMENT,
        atol=AGREEMENT * q.radiance.mean(),
    )


def test_relit_room_keeps_its_names(load):
    """`relight` leaves the ids of shapes alone, in the new room and in the old one."""
    room = render.load("box_one")  # not the shared one
    names = [shape.id() for shape in room.scene.shapes()]
    relit = render.relight(room, room.lights)
    assert [shape.id() for shape in relit.scene.shapes()] == names
    assert [shape.id() for shape in room.scene.shapes()] == names
