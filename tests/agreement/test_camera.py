"""The camera's view: a pixel is an observation, and agrees with Eq. 4, probes, Mitsuba's film."""

from __future__ import annotations

from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest

import render
from lightloc import Lambert, PointLights, radiance
from render.film import borrow, smooth
from render.observe import observations
from render.transport import direct, probe
from render.view import DIFFUSE, NOTHING

WIDTH = 64  # pixels; the standard scenes' own 320 are five times as many
ROUNDING = 1e-4  # of B, as for probes in test_direct.py


@pytest.fixture(scope="module")
def view(load):
    """The view of a standard scene in direct light."""

    def make(name: str, **parameters) -> tuple[render.Room, render.View]:
        room = load(name, **parameters)
        return room, render.photograph(room, width=WIDTH, transport="direct")

    return make


@pytest.fixture(scope="module")
def stage():
    """Three places seen from above, 1 m apart: open, a face, a back (or a two-sided BSDF)."""
    render.load("box_one")  # sets the variant

    def make(back: dict) -> render.Room:
        turn, grey = mi.ScalarTransform4f(), {"type": "diffuse"}
        over = turn.rotate([1, 0, 0], 180)
        lights = PointLights([[0, 0, 1]], [1.0])
        parts = {
            "type": "scene",
            "face": {"type": "rectangle", "to_world": turn.scale([0.5, 0.5, 1]), "bsdf": grey},
            "back": {
                "type": "rectangle",
                "to_world": turn.translate([1, 0, 0]) @ over @ turn.scale([0.5, 0.5, 1]),
                "bsdf": back,
            },
            "camera": {
                "type": "perspective",
                "fov": 60,
                "to_world": turn.look_at([0, 0, 2], [0, 0, 0], [0, 1, 0]),
                "film": {"type": "hdrfilm", "width": 40, "height": 10},
            },
        }
        scene = mi.load_dict(parts, optimize=False)
        geometry = render.SceneGeometry(scene)
        return render.relight(
            render.Room("stage", Path("stage"), {}, scene, lights, geometry), lights
        )

    return make


@pytest.mark.parametrize("name", ["box_two", "box_mixed", "box_colored", "furnished"])
def test_every_pixel_obeys_eq_4(name, view):
    """Each pure pixel is a q whose radiance is that of the room's lights by Eq. 4.

    Noiseless direct light; shadow edges, textures and smooth meshes included. Negative control:
    a light 1 cm off disagrees.
    """
    room, seen = view(name)
    q = render.observe_view(seen, room)
    allowed = ROUNDING * (q.radiance + 0.01 * q.radiance.mean())
    p, I = room.lights.positions, room.lights.intensities
    assert not q.sigma.any()
    assert not q.interreflected
    assert (np.abs(radiance(q, room.lights, room.geometry) - q.radiance) <= allowed).all()
    moved = PointLights(p + np.array([0.01, 0, 0]), I)
    assert (np.abs(radiance(q, moved, room.geometry) - q.radiance) > allowed).mean() > 0.5


@pytest.mark.parametrize("name", ["box_mixed", "furnished"])
def test_pixels_are_what_probes_would_be(name, view):
    """Probes sent to the pixels' points from the camera make the same observations."""
    room, seen = view(name)
    q = render.observe_view(seen, room)
    si = probe(room.scene, q.positions, q.directions)
    p = observations(si, direct(room.scene, si), np.zeros((len(q), 3)), room)
    np.testing.assert_allclose(q.positions, p.positions, atol=1e-5)
    for field in ("normals", "facets", "directions"):
        np.testing.assert_allclose(getattr(q, field), getattr(p, field), atol=1e-4)
    np.testing.assert_array_equal(q.material.index, p.material.index)
    apart = np.abs(q.radiance - p.radiance) > ROUNDING * (p.radiance + p.radiance.mean())
    assert apart.mean() < 1e-3  # the float32 probe may miss by a rounding at a shadow's edge


@pytest.mark.parametrize("name", ["box_two", "box_mixed"])
def test_mixed_pixels_are_left_out(name, view):
    """All that a kept pixel's footprint shows is one shape, flat, of one albedo and roughness.

    Checked with the 8 x 8 pixels that a picture of eight times the size has in each pixel.
    """
    room, seen = view(name)
    fine = render.photograph(room, width=8 * WIDTH, transport="direct")

    def pieces(layer: np.ndarray) -> np.ndarray:
        """The 8 x 8 fine pixels in each pixel, (h, w, 64, ...)."""
        h, w = seen.shape.shape
        cut = layer.reshape(h, 8, w, 8, *layer.shape[2:]).swapaxes(1, 2)
        return cut.reshape(h, w, 64, *layer.shape[2:])

    varied = np.zeros(seen.shape.shape, bool)
    for field in ("shape", "roughness", "albedo", "normal"):
        spread = np.ptp(pieces(getattr(fine, field)), axis=2)
        varied |= (spread > 1e-4).any(axis=-1) if spread.ndim > 2 else spread > 1e-4
    assert varied.any()
    assert not (varied & seen.used).any()
    assert seen.used.mean() > 0.7
    assert len(render.observe_view(seen, room)) == seen.used.sum()


def test_backs_and_emptiness_are_left_out(stage):
    """A pixel that looks past everything, or at the dark back of a surface, is no observation.

    The back of a two-sided surface is one, with its normal turned towards the camera.
    """
    room = stage({"type": "diffuse"})
    one = render.photograph(room, transport="direct")
    middle = one.shape[5]
    assert middle[2] == NOTHING and middle[20] == 0 and middle[30] == 1
    assert one.used[5, 20] and not one.used[5, 30] and not one.used[5, 2]
    assert (
        not one.radiance[5, 2].any() and not one.film[5, 2].any() and not one.position[5, 2].any()
    )
    room = stage({"type": "twosided", "nested": {"type": "diffuse"}})
    two = render.photograph(room)
    assert two.used[5, 30] and not two.used[5, 2]
    np.testing.assert_allclose(two.normal[5, 30], [0, 0, 1], atol=1e-6)
    assert set(np.unique(render.observe_view(two, room).normals @ [0, 0, 1]).round(6)) == {1.0}


@pytest.mark.parametrize("transport", ["direct", "full"])
def test_film_is_mitsubas(transport, load):
    """`View.film` is the picture that Mitsuba's own integrator and film make.

    Averages over 5 x 5 of Mitsuba's pixels, 400 samples each. Limits: the mean to 1 %; the root
    mean square over pixels to 1 % for direct light, which with one lamp has no noise but that of
    placing rays at the walls' edges, and to 5 % for all light. Negative control: upside down.
    """
    room = load("box_one")
    film = render.photograph(room, width=WIDTH, transport=transport).film.astype(float)
    one = {"type": "path", "max_depth": 2 if transport == "direct" else -1, "rr_depth": 8}
    image = np.array(mi.render(room.scene, integrator=mi.load_dict(one), spp=16, seed=1), float)
    image = image.reshape(film.shape[0], 5, WIDTH, 5, 3).mean(axis=(1, 3))
    assert abs(film.mean() / image.mean() - 1) < 0.01

    def rms(a, b) -> float:
        return float(np.sqrt(np.square(a / b - 1).mean()))

    assert rms(film, image) < (0.01 if transport == "direct" else 0.05)
    assert rms(film[::-1], image) > 0.2


def test_variance_is_that_of_the_mean(load):
    """Two seeds differ by what their variances say: z-scores have standard deviation 1.

    Limits: 5 %, since a mean of 64 path samples is not quite normal.
    """
    room = load("box_two")
    a, b = (render.photograph(room, width=WIDTH, spp=64, seed=seed) for seed in (1, 2))
    assert render.observe_view(a, room).interreflected
    both = np.sqrt(a.variance + b.variance)[a.used][:, 0]
    z = (a.radiance - b.radiance)[a.used][:, 0] / both
    assert abs(z.mean()) < 4 / np.sqrt(len(z))
    assert abs(z.std() - 1) < 0.05


def test_same_seed_same_bytes(load, tmp_path):
    """The same seed gives the same file, byte for byte; another seed another."""
    room = load("box_two")
    for name, seed in (("a", 3), ("b", 3), ("c", 4)):
        view = render.photograph(room, width=24, spp=8, seed=seed)
        render.write_exr(view, tmp_path / f"{name}.exr")
    a, b, c = ((tmp_path / f"{name}.exr").read_bytes() for name in "abc")
    assert a == b
    assert a != c


def test_other_lights_same_surfaces(view):
    """A relit room photographed again shows the same surfaces, and Eq. 4 for the new lights."""
    room, seen = view("box_mixed")
    lights = PointLights([[2.0, 1.5, 1.1]], [[3.0, 4.0, 5.0]])
    lit = render.relight(room, lights)
    again = render.photograph(lit, width=WIDTH, transport="direct")
    for field in ("position", "normal", "albedo", "roughness", "shape", "pure", "camera"):
        np.testing.assert_array_equal(getattr(again, field), getattr(seen, field))
    q = render.observe_view(again, room)
    B = radiance(q, lights, room.geometry)
    np.testing.assert_allclose(q.radiance, B, rtol=ROUNDING, atol=ROUNDING * B.mean() / 100)
    dark = render.photograph(render.relight(room, PointLights([], [])), width=8, spp=2)
    assert not dark.film.any() and not dark.radiance.any()


def test_file_and_scene_make_the_same_observations(view, tmp_path):
    """A path serves as well as the view; where all is Lambert the file needs no scene."""
    room, seen = view("box_colored")
    render.write_exr(seen, tmp_path / "view.exr")
    a, b = render.observe_view(seen, room), render.observe_view(tmp_path / "view.exr")
    for field in ("positions", "normals", "directions", "radiance", "sigma"):
        np.testing.assert_array_equal(getattr(a, field), getattr(b, field))
    assert isinstance(b.material, Lambert)
    assert a.channels == b.channels == 3
    np.testing.assert_allclose(a.material.albedo, b.material.albedo, atol=1e-6)
    assert (seen.roughness == DIFFUSE).all()
    own = render.observe_view(seen, material=Lambert(albedo=0.3))
    assert own.material.albedo == 0.3


def test_shape_of_the_picture(load):
    """One side given keeps the proportions; both keep square pixels and the field of view."""
    room = load("box_two")
    whole = render.photograph(room, width=WIDTH, transport="direct")
    assert whole.size == (WIDTH, 48)
    assert render.photograph(room, height=48, transport="direct") == whole
    strip = render.photograph(room, width=WIDTH, height=24, transport="direct")
    np.testing.assert_allclose(strip.radiance, whole.radiance[12:36], rtol=1e-4)


def test_bad_arguments(load, workshop, refuses):
    """Each argument out of range is refused in a sentence."""
    room = load("box_two")
    for bad in ({"spp": 1}, {"transport": "some"}, {"width": 0}, {"height": -3}):
        with refuses("photograph expects"):
            render.photograph(room, **bad)
    for sensor in (1, -1):
        with refuses(f"{room.path}: has no sensor {sensor}"):
            render.photograph(room, sensor=sensor)
    with refuses("workshop: has no sensor 0"):
        render.photograph(workshop({"type": "diffuse"}))
    lens = mi.load_dict({"type": "thinlens", "aperture_radius": 0.1, "focus_distance": 1.0})
    scene = mi.load_dict({"type": "scene", "s": {"type": "sphere"}, "lens": lens})
    other = render.Room("lens", Path("lens"), {}, scene, room.lights, room.geometry)
    with refuses("lens: sensor 0 is a ThinLensCamera"):
        render.photograph(other)


def test_wrong_scenes(view, load, refuses):
    """A view of another room, or one made with other parameters, is refused."""
    _, seen = view("box_mixed")
    with refuses("the view: the surface in row"):
        render.observe_view(seen)
    with refuses("the view: does not show"):
        render.observe_view(seen, load("box_two"))
    with refuses("the view: does not show"):
        render.observe_view(seen, load("box_mixed", alpha=0.4))
    nothing = render.View(
        **{name: np.zeros((2, 2, 3)) for name in ("radiance", "variance", "position", "film")},
        **{name: np.zeros((2, 2, 3)) for name in ("normal", "facet", "albedo")},
        **{name: np.zeros((2, 2)) for name in ("roughness", "shape", "pure")},
        camera=np.zeros(3),
        interreflected=False,
    )
    with refuses("the view: no pixel shows one smooth surface"):
        render.observe_view(nothing)


def test_sigma_is_the_root_of_the_variance(load):
    """What a view has as variance, its observations have as standard error."""
    room = load("box_two")
    seen = render.photograph(room, width=24, spp=8, seed=3)
    q = render.observe_view(seen, room)
    variance = seen.variance[seen.used][:, : q.channels]
    assert (variance > 0).any()
    np.testing.assert_allclose(np.square(q.sigma), variance, rtol=1e-6)


def test_a_pixel_at_the_edge_borrows_from_its_neighbours_alone():
    """Light of the far edges of a picture is not lent, however alike the surfaces there are."""
    light, features = np.zeros((6, 5, 3)), np.zeros((6, 5, 1))
    light[-1], light[:, -1] = 1.0, 1.0
    features[-1], features[:, -1] = 7.0, 7.0
    corner, wanted = np.array([0]), np.full((1, 1, 1), 7.0)
    assert not borrow(light, features, corner, wanted, np.ones(1)).any()
    beside = np.array([4 * 5 + 3])  # one pixel off both edges
    assert borrow(light, features, beside, wanted, np.ones(1)).all()


def test_smoothing_favours_no_side(rng):
    """A picture turned upside down, or mirrored, is smoothed as it was, to a sum's rounding."""
    light, shape = rng.random((9, 12, 3)), rng.integers(0, 2, (9, 12))
    normal = np.tile([0.0, 0.0, 1.0], (9, 12, 1))
    layers = [light, shape, normal, np.ones((9, 12, 3)), np.zeros((9, 12))]
    plain = smooth(*layers)
    for turned in (np.flipud, np.fliplr):
        again = smooth(*(turned(layer) for layer in layers))
        np.testing.assert_allclose(again, turned(plain), rtol=1e-12)
    assert np.abs(plain - light).max() > 0.1
