"""On disk: every bit comes back, the same values are the same bytes, and a file that is not whole
is refused in a sentence that names it."""

from __future__ import annotations

import io
import os
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lightloc import (
    Conductor,
    Irradiance,
    Lambert,
    Localization,
    Mixed,
    Observations,
    Plastic,
    PointLights,
    Sum,
    radiance,
)
from lightloc.brdf.protocol import BRDF
from render import read_exr

ARRAYS = ("positions", "normals", "directions", "radiance", "sigma", "facets")


MATERIALS: dict[str, BRDF] = {
    "lambert": Lambert(albedo=0.5),
    "lambert_rgb": Lambert(albedo=[0.5, 0.4, 0.3]),
    "lambert_per_point": Lambert(albedo=[[0.5], [0.4], [0.3], [0.2]]),
    "lambert_rgb_per_point": Lambert(albedo=np.linspace(0, 1, 12).reshape(4, 3)),
    "mirror": Conductor(alpha=0.3),
    "metal": Conductor(alpha=[0.1, 0.2, 0.3, 0.4], eta=1.2, k=[7.0, 6.0, 5.0], specular=0.9),
    "plastic": Plastic(alpha=0.2, diffuse=[0.8, 0.5, 0.1], ior=1.3, specular=0.7, nonlinear=True),
    "mixed": Mixed(
        (Lambert(albedo=[[0.5], [0.4], [0.3], [0.2]]), Conductor(alpha=0.3)), [0, 1, 1, 0]
    ),
    "mixed_in_mixed": Mixed(
        (Mixed((Lambert(albedo=0.1), Lambert(albedo=0.2)), [0, 1, 0, 1]), Plastic(alpha=0.2)),
        [0, 0, 0, 0],
    ),
    "eleven_parts": Mixed([Lambert(albedo=a / 11) for a in range(11)], [10, 9, 1, 0]),
    "sum": Sum((Lambert(albedo=[[0.5], [0.4], [0.3], [0.2]]), Conductor(alpha=0.3))),
    "mixed_with_sum": Mixed(
        (
            Sum([Lambert(albedo=0.1), Mixed([Lambert(albedo=0.2)], [0, 0, 0, 0])]),
            Plastic(alpha=0.2),
        ),
        [0, 1, 1, 0],
    ),
}


def four(material: BRDF, rng: np.random.Generator) -> Observations:
    """Four observations of no special place, two of them a little below zero."""
    v = rng.normal(size=(3, 4, 3))
    q = Observations(
        positions=v[0],
        normals=v[1],
        directions=v[2],
        radiance=np.zeros((4, 3)),
        material=material,
        facets=v[1][::-1],
    )
    return q.with_radiance(rng.normal(size=(4, 3)), 1 + rng.random((4, 3)))


def same_material(one: BRDF, other: BRDF) -> None:
    assert type(one) is type(other)
    if isinstance(one, Mixed | Sum):
        if isinstance(one, Mixed):
            np.testing.assert_array_equal(one.index, other.index)
        for mine, theirs in zip(one.brdfs, other.brdfs, strict=True):
            same_material(mine, theirs)
        return
    assert one.parameters().keys() == other.parameters().keys()
    for name, value in one.parameters().items():
        np.testing.assert_array_equal(value, other.parameters()[name])


@pytest.mark.parametrize("name", MATERIALS)
def test_file_brings_back_every_bit(name, tmp_path, rng):
    """Saved and loaded, observations are equal to the bit, whatever their material."""
    q = four(MATERIALS[name], rng)
    q.save(tmp_path / "q.npz")
    read = Observations.load(tmp_path / "q.npz")
    for key in (*ARRAYS, "interreflected"):
        np.testing.assert_array_equal(getattr(read, key), getattr(q, key))
    same_material(read.material, q.material)


def test_interreflected_is_remembered(tmp_path, rng):
    """The file says whether B holds interreflected light."""
    for both in (False, True):
        q = four(Lambert(albedo=0.5), rng)
        q.with_radiance(q.radiance, q.sigma, both).save(tmp_path / "q.npz")
        assert Observations.load(tmp_path / "q.npz").interreflected is both


def test_what_is_known_beside_radiance(tmp_path, rng):
    """Regions, clipped values, steps and the unit come back too; an unknown sigma stays unknown."""
    q = four(MATERIALS["lambert"], rng).with_radiance(np.ones((4, 3)), None)
    told = {
        "regions": np.array([1, 0, 1, 1]),
        "region_names": ("wall", "floor"),
        "saturated": np.array([True, False, False, True]),
        "step": 0.125,
        "floor": 0.25,
        "unit": "cm",
    }
    replace(q, **told).save(tmp_path / "q.npz")
    read = Observations.load(tmp_path / "q.npz")
    assert read.sigma is None
    q.save(tmp_path / "none.npz")
    assert Observations.load(tmp_path / "none.npz").floor is None
    for name, value in told.items():
        np.testing.assert_array_equal(getattr(read, name), value)
        assert type(getattr(read, name)) is type(value)


def test_irradiance_in_a_file(tmp_path):
    """A meter's readings stay readings."""
    E = Observations(
        positions=np.eye(3), normals=np.eye(3), radiance=[1, 2, 3], material=Irradiance()
    )
    E.save(tmp_path / "E.npz")
    assert Observations.load(tmp_path / "E.npz").quantity == "irradiance"


def test_the_first_format(tmp_path):
    """A file of the first format is read, with what it could not say at its default, and saved in
    the present one."""
    old = Path(__file__).parent / "old" / "observations-1.npz"
    assert str(np.load(old)["format"]) == "lightloc-observations-1"
    q = Observations.load(old)
    assert (len(q), q.channels, q.interreflected, q.unit, q.step) == (8, 3, True, "m", 0.0)
    assert not q.saturated.any()
    light = PointLights([[0, 0, 1]], [[1, 2, 3]])
    np.testing.assert_allclose(radiance(q, light), q.radiance, rtol=1e-6)
    q.save(tmp_path / "new.npz")
    assert str(np.load(tmp_path / "new.npz")["format"]) == "lightloc-observations-2"
    np.testing.assert_array_equal(Observations.load(tmp_path / "new.npz").radiance, q.radiance)


def test_same_observations_same_bytes(tmp_path, rng):
    """Saved twice, under two names or over itself, the file is the same; nothing else is left."""
    q = four(MATERIALS["mixed"], rng)
    for name in ("a.npz", "b.npz", "b.npz"):
        q.save(tmp_path / name)
    Observations.load(tmp_path / "a.npz").save(tmp_path / "c.npz")
    a, b, c = ((tmp_path / f"{name}.npz").read_bytes() for name in "abc")
    assert a == b == c
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.npz", "b.npz", "c.npz"]
    q.with_radiance(q.radiance + 1e-12, q.sigma).save(tmp_path / "a.npz")
    assert (tmp_path / "a.npz").read_bytes() != b  # negative control


def test_a_changed_byte_is_never_believed(tmp_path, rng):
    """Any byte of the file changed, it loads as it was (padding, dates) or is refused.

    Every fifth byte is tried, with one bit turned and with all.
    """
    q, path = four(MATERIALS["mixed"], rng), tmp_path / "q.npz"
    q.save(path)
    whole = path.read_bytes()
    refused = 0
    for i in range(0, len(whole), 5):
        for turn in (0x01, 0xFF):
            path.write_bytes(whole[:i] + bytes([whole[i] ^ turn]) + whole[i + 1 :])
            try:
                read = Observations.load(path)
            except ValueError as error:
                assert str(error).startswith(f"{path}: ")
                refused += 1
            else:
                for key in ARRAYS:
                    np.testing.assert_array_equal(getattr(read, key), getattr(q, key))
                same_material(read.material, q.material)
    assert refused > len(whole) / 5  # more than half of the changes


def test_a_shortened_file_is_refused(tmp_path, rng):
    """A file cut anywhere, empty included, is refused by name."""
    path = tmp_path / "q.npz"
    four(MATERIALS["mixed"], rng).save(path)
    whole = path.read_bytes()
    for length in range(0, len(whole), 7):
        path.write_bytes(whole[:length])
        with pytest.raises(ValueError) as error:
            Observations.load(path)
        assert str(error.value).startswith(f"{path}: ")


def test_other_files_are_refused(tmp_path, refuses):
    """No file, a folder, a text, another array, an array of objects: all refused by name."""
    (tmp_path / "text.npz").write_text("positions: here")
    with open(tmp_path / "array.npz", "wb") as file:
        np.save(file, np.zeros((4, 3)))
    np.savez(tmp_path / "other.npz", a=np.zeros(3))
    np.savez(tmp_path / "objects.npz", format=np.array([{}], object))
    (tmp_path / "folder.npz").mkdir()
    for name in ("none", "text", "array", "other", "objects", "folder"):
        path = tmp_path / f"{name}.npz"
        with refuses(f"{path}: "):
            Observations.load(path)


def member(descr: str = "'<f8'", shape: object = (4, 3)) -> bytes:
    """An .npy whose header claims more than its 64 bytes hold."""
    head = f"{{'descr': {descr}, 'fortran_order': False, 'shape': {shape!r}, }}\n".encode()
    return b"\x93NUMPY\1\0" + len(head).to_bytes(2, "little") + head + bytes(64)


MEMBERS = {
    "as good": None,
    "no array": ("positions", b"4 points"),
    "no header": ("positions", b"\x93NUMPY\1\0\3\0{[("),
    "a claim of terabytes": ("positions", member(shape=(10**12, 3))),
    "a claim beyond integers": ("positions", member(shape=(2**62, 2**62))),
    "objects": ("positions", member(descr="'|O'")),
    "no text": ("unit", member(descr="'<U2'", shape=()).replace(bytes(8), b"\xff" * 8)),
    "a format of lines": ("format", np.zeros((3, 3))),
    "a material of lines": ("material", np.array("a\nb")),
    "a huge index": ("material.index", np.full(4, 2**62)),
    "an infinite index": ("material.index", np.full(4, np.inf)),
    "an imaginary position": ("positions", np.ones((4, 3)) * 1j),
}


@pytest.mark.parametrize("case", MEMBERS)
def test_crafted_members_are_refused(case, tmp_path, rng, refuses):
    """Whatever NumPy or Python say of them: one sentence with the file's name."""
    path = tmp_path / "q.npz"
    four(MATERIALS["mixed"], rng).save(path)
    with zipfile.ZipFile(path) as file:
        members = {name: file.read(name) for name in file.namelist()}
    if MEMBERS[case]:
        name, value = MEMBERS[case]
        stream = io.BytesIO()
        np.save(stream, value) if isinstance(value, np.ndarray) else stream.write(value)
        members[f"{name}.npy"] = stream.getvalue()
    with zipfile.ZipFile(path, "w") as file:
        for name, content in members.items():
            file.writestr(name, content)
    if case == "as good":
        assert len(Observations.load(path)) == 4
    else:
        with refuses(f"{path}: "):
            Observations.load(path)


def test_an_archive_that_unpacks_to_anything_is_refused(tmp_path, rng, refuses):
    """By what it says of its members, before they are unpacked."""
    path = tmp_path / "q.npz"
    four(Lambert(albedo=0.5), rng).save(path)
    content, sizes = bytearray(path.read_bytes()), 0
    while (sizes := content.find(b"PK\1\2", sizes) + 24) > 24:
        content[sizes : sizes + 4] = b"\xff\xff\xff\x7f"
    path.write_bytes(bytes(content))
    with refuses(f"{path}: unpacks to "):
        Observations.load(path)


def test_mixed_in_mixed(tmp_path, rng, refuses):
    """To a depth of eight; a kernel is made of all of it."""
    path, material = tmp_path / "q.npz", Lambert(albedo=0.5)
    for depth in range(1, 10):
        material = Mixed((material,), [0] * 4)
        four(material, rng).save(path)
        if depth <= 8:
            same_material(Observations.load(path).material, material)
        else:
            with refuses(f"{path}: material is Mixed in others, more than 8 deep"):
                Observations.load(path)


@pytest.mark.parametrize(
    "reader", [Observations.load, PointLights.load, Localization.load, read_exr]
)
def test_what_never_ends_is_refused(reader, tmp_path, refuses):
    """A pipe that nobody writes to, a device, and a name that is none."""
    os.mkfifo(tmp_path / "pipe")
    for path in (tmp_path / "pipe", "/dev/zero", "/dev/full"):
        with refuses(f"{path}: can't be read (it is a device or a pipe)"):
            reader(path)
    for path in ("", "a" * 5000, "a\0b", f"{__file__}/a"):
        with pytest.raises(ValueError):
            reader(path)


WRONG_KEYS = {
    "format": "lightloc-observations-0",
    "positions": [[0.0, 0.0, np.nan]] * 4,
    "normals": np.zeros((4, 3)),
    "directions": [[0.0, 0.0, 1.0]],
    "radiance": np.full((4, 3), np.nan),
    "sigma": np.full((4, 3), -1.0),
    "material": "Velvet",
    "material.albedo": [[-0.5]],
}


@pytest.mark.parametrize("key", WRONG_KEYS)
@pytest.mark.parametrize("how", ["missing", "wrong", "words"])
def test_fields_of_a_file_are_checked(key, how, tmp_path, rng, refuses):
    """A file whose archive is whole but whose field is missing or wrong names file and field."""
    path = tmp_path / "q.npz"
    four(Lambert(albedo=0.5), rng).save(path)
    with np.load(path) as file:
        keys = dict(file)
    if how == "missing":
        del keys[key]
    else:
        keys[key] = np.array(WRONG_KEYS[key] if how == "wrong" else ["not", "numbers"])
    with open(path, "wb") as file:
        np.savez_compressed(file, **keys)
    with refuses(f"{path}: ") as error:
        Observations.load(path)
    assert key.split(".")[-1] in str(error.value)


@pytest.mark.parametrize("channels", [1, 3])
@pytest.mark.parametrize("k", [0, 1, 7])
def test_lights_come_back_to_the_bit(k, channels, tmp_path, rng):
    """PointLights saved and loaded are equal to the bit, and saved again the file is the same."""
    lights = PointLights(rng.normal(size=(k, 3)), rng.random((k, channels)))
    lights.save(tmp_path / "a.json")
    read = PointLights.load(tmp_path / "a.json")
    np.testing.assert_array_equal(read.positions, lights.positions)
    if k:
        np.testing.assert_array_equal(read.intensities, lights.intensities)
    read.save(tmp_path / "b.json")
    assert (tmp_path / "a.json").read_bytes() == (tmp_path / "b.json").read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.json", "b.json"]


def test_lights_of_no_format(tmp_path):
    """The first files named none; one of a later format is refused."""
    path = tmp_path / "lights.json"
    path.write_text('{"lights": [{"position": [0, 0, 2], "intensity": [10]}]}')
    assert PointLights.load(path).intensities.tolist() == [[10.0]]


BROKEN_LIGHTS = {
    "another format": '{"format": "lightloc-lights-9", "lights": []}',
    "a format of lines": '{"format": "a\\nb", "lights": []}',
    "a number beyond floats": f'{{"lights": [{{"position": [0, 0, 1{"0" * 400}]'
    ', "intensity": [1]}]}',
    "a text": '{"lights": "none"}',
    "nested": '{"lights": ' + "[" * 100_000,
    "empty": "",
    "cut short": '{"lights": [{"position": [0, 0',
    "another thing": "[1, 2, 3]",
    "no list": '{"lights": 5}',
    "no position": '{"lights": [{"intensity": [1]}]}',
    "no intensity": '{"lights": [{"position": [0, 0, 0]}]}',
    "nan": '{"lights": [{"position": [0, 0, NaN], "intensity": [1]}]}',
    "negative": '{"lights": [{"position": [0, 0, 0], "intensity": [-1]}]}',
    "in words": '{"lights": [{"position": ["here", 0, 0], "intensity": [1]}]}',
    "in 2D": '{"lights": [{"position": [0, 0], "intensity": [1]}]}',
    "mixed channels": '{"lights": [{"position": [0, 0, 0], "intensity": [1]},'
    ' {"position": [0, 0, 0], "intensity": [1, 2, 3]}]}',
}


@pytest.mark.parametrize("case", BROKEN_LIGHTS)
def test_broken_lights_are_refused(case, tmp_path, refuses):
    """A lights file that is not whole, or holds what PointLights refuses, is refused by name."""
    path = tmp_path / "lights.json"
    path.write_text(BROKEN_LIGHTS[case])
    with refuses(f"{path}: "):
        PointLights.load(path)
    with refuses(f"{tmp_path / 'none.json'}: "):
        PointLights.load(tmp_path / "none.json")
