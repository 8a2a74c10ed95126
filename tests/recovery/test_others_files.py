"""Lights from what others wrote: a light meter's table, pictures, and their layers."""

from __future__ import annotations

import numpy as np
import OpenImageIO as oiio
import pytest
from scipy.stats import chi2

import render
from lightloc import (
    Irradiance,
    Kind,
    Observations,
    PointLights,
    Reason,
    localize,
    radiance,
    read_readings,
)
from render.variant import two_threads
from validation.judge.match import compare

RARE = 1e-6  # a test by chance fails once in a million


def test_a_light_meter_in_millimetres(rng, tmp_path):
    """Two lamps above a table: 200 readings in lux, points in mm, 2 %: lights in cd, right
    within their errors. Over a table alone a lamp would look the same, which they cover."""
    true = PointLights([[1200, 2000, 2400], [3100, 800, 2200]], [200.0, 90.0])
    x = np.column_stack([rng.uniform(0, 4000, 200), rng.uniform(0, 3000, 200), np.full(200, 800.0)])
    up = np.tile([0.0, 0.0, 1.0], (200, 1))
    meter = Observations(positions=x, normals=up, radiance=np.zeros(200), material=Irradiance())
    lux = radiance(meter, true)[:, 0] * 1000**2 * rng.normal(1, 0.02, 200)  # E = I cos / d^2, in m
    rows = ["# desk", "x [mm];y [mm];z [mm];nx;ny;nz;lux;error [%]"]
    for point, value in zip(x, lux, strict=True):
        rows.append(";".join(f"{a:.7g}" for a in (*point, 0, 0, 1, value, 2)).replace(".", ","))
    path = tmp_path / "desk.csv"
    path.write_text("\n".join(rows))
    found = localize(read_readings(path))
    assert len(found.lights) == 2
    assert found.reason is Reason.UNDECIDED and found.verdicts[0].kind is Kind.ASSUMED
    off = found.lights.positions - true.positions
    order = [0, 1]
    z = np.concatenate(
        [
            (off[order] / found.position_error[order]).ravel(),
            ((found.lights.intensities - true.intensities) / found.intensity_error).ravel(),
        ]
    )
    # eight numbers, correlated light by light: no fewer than two are independent
    assert (z**2).max() < chi2.isf(RARE, 1)
    lines = str(found).splitlines()
    assert "position (mm)" in lines[1] and "intensity (cd)" in lines[1]
    assert found.to_dict()["intensity_unit"] == "cd"


def camera(width: int, height: int):
    """box_two's own camera, with a film of another size and the same filter."""
    import mitsuba as mi

    own = render.load("box_two").scene.sensors()[0].film().rfilter().class_name()
    assert own == "BoxFilter"
    look = mi.ScalarTransform4f().look_at([0.4, 0.35, 1.6], [3, 2.4, 1.2], [0, 0, 1])
    film = {"type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": "box"}}
    film["component_format"] = "float32"
    sampler = {"type": "multijitter", "sample_count": 64}
    parts = {"fov": 90.0, "to_world": look, "film": film, "sampler": sampler}
    return mi.load_dict({"type": "perspective", **parts})


@pytest.fixture(scope="module")
def picture(tmp_path_factory):
    """What Mitsuba's film writes of box_two with direct light alone: 128 x 96 pixels, layers."""
    import mitsuba as mi

    room, sensor = render.load("box_two"), camera(128, 96)
    layers = "position:position,normal:sh_normal,albedo:albedo"
    image = {"type": "path", "max_depth": 2}
    integrator = mi.load_dict({"type": "aov", "aovs": layers, "image": image})
    mi.render(room.scene, sensor=sensor, integrator=integrator, seed=1)
    path = tmp_path_factory.mktemp("pictures") / "picture.exr"
    with two_threads():
        sensor.film().write(str(path))
    return path


@pytest.mark.slow
@pytest.mark.parametrize("by", ["scene", "layers"])
def test_pictures_of_direct_light(by, picture):
    """By its scene, or by its own layers and the camera's place: both lights, within 0.5 % of the
    diagonal and 2 %."""
    room = render.load("box_two")
    if by == "scene":
        seen = render.observe_picture(picture, room, transport="direct")
    else:
        eye = np.array(room.scene.sensors()[0].world_transform().translation()).ravel()
        seen = render.observe_picture(picture, camera=eye, transport="direct", unit="m")
    assert len(seen) > 0.6 * 128 * 96 and seen.relative_sigma
    found = localize(seen, room.geometry)
    verdict = compare(found.lights, room.lights, room.diagonal)
    assert not verdict.missed and not verdict.ghosts, found
    assert verdict.worst_position_percent < 0.5 and verdict.worst_intensity_percent < 2


@pytest.mark.slow
def test_a_picture_of_all_light(tmp_path):
    """What a path tracer sees, 48 x 36 pixels in half floats: with the indirect light of what is
    found rendered, both lights within 1 % of the diagonal and 5 %, as the standard suite allows."""
    import mitsuba as mi

    room, sensor = render.load("box_two"), camera(48, 36)
    path = mi.load_dict({"type": "path", "max_depth": -1})
    image = np.array(mi.render(room.scene, sensor=sensor, integrator=path, spp=256, seed=3))
    spec = oiio.ImageSpec(48, 36, 3, oiio.HALF)
    spec.attribute("chromaticities", oiio.TypeDesc("float[8]"), REC_709)
    out = oiio.ImageOutput.create(str(tmp_path / "a.exr"))
    assert out.open(str(tmp_path / "a.exr"), spec)
    assert out.write_image(np.ascontiguousarray(image[..., :3], np.float32)) and out.close()
    seen = render.observe_picture(tmp_path / "a.exr", room)
    found = localize(seen, room.geometry, indirect=16)
    verdict = compare(found.lights, room.lights, room.diagonal)
    assert not verdict.missed and not verdict.ghosts, found
    assert verdict.worst_position_percent < 1 and verdict.worst_intensity_percent < 5


REC_709 = (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290)
