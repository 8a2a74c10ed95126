"""Views on disk: every bit comes back, and a file that is not whole is refused in a sentence."""

from __future__ import annotations

from dataclasses import fields

import drjit as dr
import mitsuba as mi
import numpy as np
import OpenImageIO as oiio
import pytest

from render import View, read_exr, write_exr
from render.exr import CHANNELS
from render.variant import two_threads, use_mitsuba

HEIGHT, WIDTH = 5, 7
NAMES = [name for channels in CHANNELS.values() for name in channels]


@pytest.fixture
def parts(rng) -> dict:
    """The arguments of a view whose values fill float32 to the last bit."""
    colour, scalar = (HEIGHT, WIDTH, 3), (HEIGHT, WIDTH)
    colours = ("radiance", "variance", "position", "normal", "facet", "albedo", "film")
    return {
        **{name: rng.random(colour) for name in colours},
        "roughness": rng.random(scalar),
        "shape": rng.integers(-1, 1 << 20, scalar),
        "pure": rng.integers(0, 2, scalar),
        "camera": rng.normal(size=3),
        "interreflected": True,
    }


@pytest.fixture
def written(parts, tmp_path):
    """A file with that view in it."""
    path = tmp_path / "view.exr"
    write_exr(View(**parts), path)
    return path


def rewrite(path, change=None, drop=(), attributes=None) -> None:
    """Write the file again as another program might: pixels changed, channels or names gone."""
    file = oiio.ImageInput.open(str(path))
    pixels, old = file.read_image(0, 0, 0, file.spec().nchannels, oiio.FLOAT), file.spec()
    file.close()
    kept = [name for name in old.channelnames if name not in drop]
    pixels = np.stack([pixels[..., old.channelnames.index(name)] for name in kept], axis=-1)
    if change:
        change(dict(zip(kept, np.moveaxis(pixels, -1, 0), strict=True)))
    spec = oiio.ImageSpec(old.width, old.height, len(kept), oiio.FLOAT)
    spec.channelnames = kept
    values = {
        "format": old.getattribute("lightloc:format"),
        "transport": old.getattribute("lightloc:transport"),
        "camera": old.getattribute("lightloc:camera"),
    } | (attributes or {})
    for name, value in values.items():
        if isinstance(value, str):
            spec.attribute(f"lightloc:{name}", value)
        elif value is not None:
            spec.attribute(f"lightloc:{name}", oiio.TypeDesc("float[3]"), value)
    out = oiio.ImageOutput.create(str(path))
    assert out.open(str(path), spec) and out.write_image(pixels) and out.close()


def test_every_bit_comes_back(parts, written):
    """What is read is what was written, exactly, type by type."""
    view, again = View(**parts), read_exr(written)
    assert again == view
    for field in fields(View):
        mine, theirs = (np.asarray(getattr(v, field.name)) for v in (view, again))
        assert mine.dtype == theirs.dtype
        np.testing.assert_array_equal(mine, theirs)
    parts["film"] = parts["film"] + 1e-6
    assert View(**parts) != again  # negative control
    assert not read_exr(written).radiance.flags.writeable


def test_same_view_same_bytes(parts, written, tmp_path):
    """The bytes hold no time and no name; nothing but the file is left behind."""
    other = tmp_path / "other.EXR"
    write_exr(View(**parts), other)
    assert other.read_bytes() == written.read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["other.EXR", "view.exr"]


def test_other_programs_see_layers(written):
    """The file is one float32 EXR image whose first channels are R, G, B, without half floats."""
    file = oiio.ImageInput.open(str(written))
    spec = file.spec()
    assert spec.channelnames[:3] == ("R", "G", "B")
    assert set(spec.channelnames) == set(NAMES)
    assert (spec.width, spec.height, str(spec.format)) == (WIDTH, HEIGHT, "float")
    file.close()


def test_written_by_another_program(parts, written):
    """A file in the documented format without a checksum is read as well."""
    rewrite(written)
    assert read_exr(written) == View(**parts)


def test_a_view_that_was_read_is_written_again(written, tmp_path):
    """However its arrays lie in memory: the same bytes."""
    write_exr(read_exr(written), tmp_path / "again.exr")
    assert (tmp_path / "again.exr").read_bytes() == written.read_bytes()


def test_a_name_that_is_no_text(written, refuses):
    """In the file, and so in what OpenImageIO says of it."""
    whole = written.read_bytes()
    for name in (b"lightloc:camera", b"channels\0chlist"):
        written.write_bytes(whole.replace(name, b"\xff" * len(name)))
        with refuses(f"{written}: "):
            read_exr(written)


def test_cut_files(written, refuses):
    """A file cut short anywhere is refused."""
    whole = written.read_bytes()
    for length in [*range(0, len(whole), 61), len(whole) - 1]:
        written.write_bytes(whole[:length])
        with refuses(f"{written}: "):
            read_exr(written)


def test_damaged_files(written, parts, refuses, rng):
    """A flipped bit is refused, unless it changes nothing that a view holds."""
    whole, view = written.read_bytes(), View(**parts)
    refused = 0
    places = rng.permutation(len(whole))[:400]
    for place in places:
        damaged = bytearray(whole)
        damaged[place] ^= 1 << int(rng.integers(8))
        written.write_bytes(bytes(damaged))
        try:
            assert read_exr(written) == view
        except ValueError as error:
            refused += 1
            assert str(error).startswith(f"{written}: ")
            assert "\n" not in str(error)
    assert refused > len(places) / 2


@pytest.mark.parametrize("name", NAMES)
def test_missing_channel(name, written, refuses):
    """Each channel is named where it is missing."""
    rewrite(written, drop=[name])
    with refuses(f"{written}: channel {name} is missing"):
        read_exr(written)


def test_radiance_below_zero(written, refuses):
    """A denoiser's radiance may be below zero and stays; one of variance 0 is refused."""

    def darker(layers) -> None:
        layers["B"][2, 3] = -0.5

    def exact(layers) -> None:
        layers["variance.B"][2, 3] = 0.0

    rewrite(written, darker)
    assert read_exr(written).radiance[2, 3, 2] == -0.5
    rewrite(written, exact)
    with refuses(f"{written}: View.radiance[2][3][2] is -0.5; expected at least 0 where"):
        read_exr(written)


@pytest.mark.parametrize(
    ("channel", "value", "complaint"),
    [
        ("R", np.nan, "View.radiance[2][3][0] is nan"),
        ("G", np.inf, "View.radiance[2][3][1] is inf"),
        ("variance.G", -1.0, "View.variance[2][3][1] is -1"),
        ("variance.G", np.nan, "View.variance[2][3][1] is nan"),
        ("position.Z", -np.inf, "View.position[2][3][2] is -inf"),
        ("normal.X", 2.0, "View.normal[2][3][0] is 2"),
        ("facet.Y", np.nan, "View.facet[2][3][1] is nan"),
        ("albedo.B", -0.1, "View.albedo[2][3][2] is -0.1"),
        ("roughness.Y", -2.0, "View.roughness[2][3] is -2"),
        ("shape.I", 0.5, "View.shape holds fractions"),
        ("shape.I", -2.0, "View.shape[2][3] is -2"),
        ("pure.I", 2.0, "View.pure[2][3] is 2"),
        ("film.R", np.nan, "View.film[2][3][0] is nan"),
    ],
)
def test_bad_values(channel, value, complaint, written, refuses):
    """A value that is not finite or out of range is refused, by field and pixel."""

    def change(layers) -> None:
        layers[channel][2, 3] = value

    rewrite(written, change)
    with refuses(f"{written}: {complaint}"):
        read_exr(written)


@pytest.mark.parametrize(
    ("attributes", "complaint"),
    [
        ({"format": None}, "lightloc:format is ''"),
        ({"format": "lightloc-view-9"}, "lightloc:format is 'lightloc-view-9'"),
        ({"transport": None}, "lightloc:transport is ''"),
        ({"camera": None}, "attribute lightloc:camera is missing"),
        ({"camera": "here"}, "attribute lightloc:camera is missing"),
        ({"camera": (0.0, np.nan, 0.0)}, "View.camera[1] is nan"),
        ({"crc32": "00000000"}, "is damaged"),
    ],
)
def test_bad_attributes(attributes, complaint, written, refuses):
    """An attribute that is missing or wrong is named."""
    rewrite(written, attributes=attributes)
    with refuses(f"{written}: {complaint}"):
        read_exr(written)


def test_no_exr(tmp_path, refuses):
    """A missing file, a folder, an empty file and a text file are refused."""
    text, empty = tmp_path / "text.exr", tmp_path / "empty.exr"
    text.write_text("not an image")
    empty.touch()
    with refuses(f"{tmp_path / 'none.exr'}: no such file"):
        read_exr(tmp_path / "none.exr")
    with refuses(f"{tmp_path}: can't be read"):
        read_exr(tmp_path)
    for path in (text, empty):
        with refuses(f"{path}: not an EXR file"):
            read_exr(path)


def test_cannot_be_written(parts, written, tmp_path, refuses):
    """Where a file can't be written there is a sentence, and what stood there stays."""
    view = View(**parts)
    (tmp_path / "folder.exr").mkdir()
    for path, complaint in (
        (tmp_path / "view.png", "a view is written as EXR"),
        (tmp_path / "none" / "view.exr", "can't be written"),
        (written / "view.exr", "can't be written"),
        (tmp_path / "folder.exr", "can't be written"),
    ):
        with refuses(f"{path}: {complaint}"):
            write_exr(view, path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["folder.exr", "view.exr"]
    assert read_exr(written) == view


@pytest.mark.parametrize("name", ["variance", "position", "roughness", "shape", "pure", "film"])
def test_layers_of_other_sizes(name, parts, refuses):
    """A layer of another size than the radiance is refused."""
    parts[name] = parts[name][1:]
    with refuses(f"View.{name} has shape"):
        View(**parts)


def test_channels_hold_what_their_names_say(parts, written):
    """Another program finds each layer under the names that are documented, part by part."""
    file = oiio.ImageInput.open(str(written))
    names, pixels = file.spec().channelnames, file.read_image(0, 0, 0, len(NAMES), oiio.FLOAT)
    file.close()
    view = View(**parts)
    for layer, prefix, letters in (
        ("radiance", "", "RGB"),
        ("variance", "variance.", "RGB"),
        ("position", "position.", "XYZ"),
        ("normal", "normal.", "XYZ"),
        ("facet", "facet.", "XYZ"),
        ("albedo", "albedo.", "RGB"),
        ("film", "film.", "RGB"),
    ):
        for part, letter in enumerate(letters):
            there = pixels[..., names.index(prefix + letter)]
            np.testing.assert_array_equal(there, getattr(view, layer)[..., part])


def test_a_camera_that_was_moved_is_noticed(parts, written, refuses):
    """The checksum is of the viewpoint too."""
    file = oiio.ImageInput.open(str(written))
    checksum = file.spec().getattribute("lightloc:crc32")
    file.close()
    camera = tuple(float(a) for a in View(**parts).camera)
    rewrite(written, attributes={"crc32": checksum, "camera": camera})
    assert read_exr(written) == View(**parts)
    rewrite(written, attributes={"crc32": checksum, "camera": (camera[0] + 1e-3, *camera[1:])})
    with refuses(f"{written}: is damaged"):
        read_exr(written)


def test_what_was_recorded_is_computed_before_threads_change():
    """A sum that one thread was to compute is right where two threads may read a file meanwhile.

    Dr.Jit gives each thread its own copy of what is summed up, as many as there are when it is
    recorded; computed by more of them, a third of these sums came out too small.
    """
    use_mitsuba()
    n, bins = 1 << 18, 1000
    before = dr.thread_count()
    dr.set_thread_count(1)
    try:
        for _ in range(8):
            total = dr.zeros(mi.Float, bins) + 0
            dr.eval(total)
            dr.scatter_add(total, mi.Float(1), dr.arange(mi.UInt32, n) % bins)
            with two_threads():
                got = np.array(total)
            np.testing.assert_array_equal(got, np.bincount(np.arange(n) % bins))
    finally:
        dr.set_thread_count(before)
