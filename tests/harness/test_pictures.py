"""Pictures by other programs: layers by their names, windows, colours, and what is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from scipy.ndimage import correlate1d
from scipy.spatial import cKDTree

import render
from render.neighbours import BOX, FLOOR, Filter, at_centres, noise_of, smooth
from render.variant import use_mitsuba

HEIGHT, WIDTH = 30, 40
AP1 = (0.713, 0.293, 0.165, 0.83, 0.128, 0.044, 0.32168, 0.33767)
FLOATS = {"chromaticities": "float[8]", "worldToCamera": "matrix"}


def write(path: Path, *parts, window=None, kind=oiio.FLOAT, **attributes) -> Path:
    """Write an EXR of parts, each a dict from a channel's name to (h, w) values.

    ``window`` is (left, top, width, height): where the pixels lie on a larger picture.
    """
    specs = []
    for part, channels in enumerate(parts):
        h, w = np.shape(next(iter(channels.values())))
        spec = oiio.ImageSpec(w, h, len(channels), kind)
        spec.channelnames = list(channels)
        if window:
            spec.x, spec.y, spec.full_width, spec.full_height = window
        if len(parts) > 1:
            spec.attribute("oiio:subimagename", f"part{part}")
        for name, value in attributes.items():
            if name in FLOATS:
                spec.attribute(name, oiio.TypeDesc(FLOATS[name]), tuple(map(float, value)))
            else:
                spec.attribute(name.replace("__", ":"), value)
        specs.append(spec)
    out = oiio.ImageOutput.create(str(path))
    assert out.open(str(path), tuple(specs) if len(specs) > 1 else specs[0]), out.geterror()
    for part, channels in enumerate(parts):
        if part:
            assert out.open(str(path), specs[part], "AppendSubimage")
        assert out.write_image(np.stack(list(channels.values()), axis=-1).astype(np.float32))
    assert out.close()
    return path


def layer(name: str, pixels: np.ndarray, letters: str = "RGB") -> dict[str, np.ndarray]:
    stem = f"{name}." if name else ""
    return {stem + letter: pixels[..., k] for k, letter in enumerate(letters)}


@pytest.fixture(scope="module")
def room():
    return render.load("box_two")


@pytest.fixture(scope="module")
def view(room):
    """Direct light through box_two's camera, grey."""
    return render.photograph(room, width=WIDTH, height=HEIGHT, transport="direct")


@pytest.fixture
def pixels(rng):
    return rng.random((HEIGHT, WIDTH, 3)).astype(np.float16).astype(np.float32)


@pytest.mark.parametrize(
    "name", ["", "beauty", "ViewLayer.Combined", "RenderLayer.Key.RGBA", "my_light", "Image"]
)
@pytest.mark.parametrize("kind", [oiio.FLOAT, oiio.HALF])
def test_the_picture_among_layers(name, kind, pixels, tmp_path):
    """R, G and B are found under any of their layer's names; alpha, depth, ids are not used."""
    other = layer("normal", pixels[::-1], "XYZ") | layer("ViewLayer.Depth", pixels, "Z")
    stem = f"{name}." if name else ""
    channels = {**other, **layer(name, pixels), stem + "A": 0 * pixels[..., 0]}
    picture = render.read_picture(write(tmp_path / "a.exr", channels, kind=kind))
    np.testing.assert_array_equal(picture.radiance, pixels)
    assert picture.sigma is None and picture.albedo is None


def test_parts(pixels, tmp_path):
    """Of a file with several parts, the one that holds the picture, wherever it stands."""
    path = write(tmp_path / "a.exr", layer("normal", -pixels, "XYZ"), layer("", pixels))
    picture = render.read_picture(path)
    np.testing.assert_array_equal(picture.radiance, pixels)
    np.testing.assert_array_equal(picture.normal, -pixels)


def test_grey(pixels, tmp_path):
    """Y alone is one channel."""
    picture = render.read_picture(write(tmp_path / "a.exr", {"Y": pixels[..., 1]}))
    np.testing.assert_array_equal(picture.radiance, pixels[..., 1:2])
    assert str(picture) == "40 x 30 pixels; colours: grey"


def test_what_is_said(pixels, tmp_path):
    """Values that are none are left out, those below zero kept; both are counted."""
    pixels[3, 4, 1], pixels[5, 6, 0], pixels[7, 8, 2] = np.nan, np.inf, -0.1
    channels = layer("", pixels) | layer("variance", np.ones_like(pixels))
    path = write(tmp_path / "a.exr", channels, chromaticities=AP1)
    picture = render.read_picture(path)
    assert str(picture) == (
        "40 x 30 pixels, 2 without a finite value (left out), 1 below zero (kept); colours: ACEScg"
    )
    assert not picture.known[3, 4] and not picture.known[5, 6] and picture.known.sum() == 1198
    assert np.nanmax(picture.sigma) == 1


@pytest.mark.parametrize(
    ("name", "value"), [("variance", 0.25), ("Variance", 0.25), ("sigma", 0.5)]
)
def test_errors(name, value, pixels, tmp_path):
    """A layer of variances or of standard deviations is the error."""
    channels = layer("", pixels) | layer(name, value + 0 * pixels)
    picture = render.read_picture(write(tmp_path / "a.exr", channels))
    np.testing.assert_array_equal(picture.sigma, 0.5)


def test_pictures_that_are_refused(pixels, tmp_path, refuses):
    """No picture, two of them, chroma, encoded values, layers of another size, damage."""
    path = tmp_path / "a.exr"
    for channels, said in (
        (layer("normal", pixels, "XYZ"), "has no picture"),
        (
            layer("one", pixels) | layer("two", pixels),
            "which layer is the picture? (it has one, two",
        ),
        ({n: pixels[..., 0] for n in ("Y", "RY", "BY")}, "holds luminance and chroma"),
    ):
        write(path, channels)
        with refuses(f"{path}: {said}"):
            render.read_picture(path)
    write(path, layer("", pixels), oiio__ColorSpace="srgb_rec709_scene")
    with refuses(f"{path}: attribute "):
        render.read_picture(path)
    small = write(tmp_path / "normal.exr", layer("", pixels[1:]))
    whole = write(tmp_path / "b.exr", layer("", pixels))
    with refuses(f"{small}: normal has 40 x 29 pixels; the picture has 40 x 30"):
        render.read_picture(whole, small)
    with refuses(f"{tmp_path / 'none.exr'}: no such file"):
        render.read_picture(whole, tmp_path / "none.exr")
    data = whole.read_bytes()
    whole.write_bytes(data[: len(data) // 2])
    with refuses(f"{whole}: "):
        render.read_picture(whole)
    with refuses("read_picture expects at least one file"):
        render.read_picture()


def test_a_view_names_the_way_to_read_pictures(pixels, tmp_path, refuses):
    path = write(tmp_path / "a.exr", layer("", pixels))
    assert not render.is_view(path)
    with refuses(f"{path}: lightloc:format is ''; expected lightloc-view-1 (observe_picture"):
        render.observe_view(path)


def test_pixels_lie_where_rays_through_their_centres_hit(room, view, tmp_path):
    """A picture of positions finds itself, in a window too, and not a pixel further."""
    whole = layer("", view.position)
    q = render.observe_picture(write(tmp_path / "a.exr", whole), room, transport="direct")
    assert len(q) > 0.6 * WIDTH * HEIGHT and q.unit == "m" and q.channels == 3
    used = view.used
    far = np.linalg.norm(q.positions - q.radiance, axis=1)
    near_size = (
        2 * np.linalg.norm(q.positions - view.camera, axis=1) / WIDTH
    )  # of a pixel, at least
    assert (far < 0.1 * near_size).mean() > 0.9 and used.sum() >= len(q)
    cut = {name: value[6:22, 9:31] for name, value in whole.items()}
    window = write(tmp_path / "b.exr", cut, window=(9, 6, WIDTH, HEIGHT))
    part = render.observe_picture(window, room, transport="direct")
    both = (part.positions[:, None] == q.positions).all(axis=2)
    assert both.any(axis=1).mean() > 0.85 and len(part) > 100
    moved = write(tmp_path / "c.exr", cut, window=(10, 6, WIDTH, HEIGHT))
    off = render.observe_picture(moved, room, transport="direct")  # negative control
    assert (np.linalg.norm(off.positions - off.radiance, axis=1) > 0.02).mean() > 0.9


def test_scaled_and_other_shapes(room, pixels, tmp_path, refuses):
    """A picture twice as large shows the same; one of another shape is refused."""
    large = write(tmp_path / "a.exr", layer("", np.repeat(np.repeat(pixels, 2, 0), 2, 1)))
    q = render.observe_picture(large, room)
    assert q.interreflected and len(q) > 0.7 * 4 * WIDTH * HEIGHT
    for shape in (pixels[:, :30], pixels[:20]):
        path = write(tmp_path / "b.exr", layer("", shape))
        with refuses(f"{path}: has {shape.shape[1]} x {shape.shape[0]} pixels; expected the shape"):
            render.observe_picture(path, room)
    with refuses(f"{room.path}: has no sensor 3 (it has 1)"):
        render.observe_picture(large, room, sensor=3)


def test_colours_come_as_rec_709(room, view, tmp_path):
    """A picture in ACEScg is the same light; taken for Rec. 709 it is not."""
    rng = np.random.default_rng(5)
    B = view.radiance * rng.uniform(0.5, 1.5, 3)
    from_ap1 = np.array(
        [[1.70505, -0.62179, -0.08326], [-0.13026, 1.1408, -0.01055], [-0.024, -0.12897, 1.15297]]
    )
    other = layer("", B @ np.linalg.inv(from_ap1).T)
    plain = render.observe_picture(write(tmp_path / "a.exr", layer("", B)), room)
    aces = render.observe_picture(write(tmp_path / "b.exr", other, chromaticities=AP1), room)
    wrong = render.observe_picture(write(tmp_path / "c.exr", other), room)
    scale = plain.radiance.max()
    np.testing.assert_allclose(aces.radiance, plain.radiance, atol=3e-5 * scale)
    assert np.abs(wrong.radiance - plain.radiance).max() > 0.01 * scale  # negative control


def test_grey_pictures_of_coloured_rooms(view, tmp_path, refuses, load):
    path = write(tmp_path / "a.exr", {"Y": view.radiance[..., 0]})
    with refuses(f"{path}: is grey, but the surfaces of "):
        render.observe_picture(path, load("box_colored"))


STACKS = {  # a name for the picture, the position, the normal and the albedo, with their letters
    "Mitsuba": ("", "pp", "nn", "albedo", "RGB", "XYZ"),
    "Blender": ("V.Combined", "V.Position", "V.Normal", "V.DiffCol", "RGB", "XYZ"),
    "pbrt": ("", "P", "Ns", "Albedo", "RGB", "XYZ"),
    "Arnold": ("RGBA", "P", "N", "diffuse_albedo", "RGB", "XYZ"),
    "by colours": ("beauty", "WorldPosition", "WorldNormal", "albedo", "RGB", "RGB"),
}  # fmt: skip


@pytest.mark.parametrize("names", STACKS.values(), ids=STACKS)
def test_stacks(names, view, tmp_path):
    """Layers by any renderer's names are the view's own observations, on the side that is seen."""
    rgb, vector = names[4:]
    channels = layer(names[0], view.radiance, rgb)
    channels |= layer(names[1], view.position, vector) | layer(names[2], -view.normal, vector)
    channels |= layer(names[3], view.albedo, rgb)
    path = write(tmp_path / "a.exr", channels)
    q = render.observe_picture(path, camera=view.camera, transport="direct", unit="m")
    expected = render.observe_view(view)
    far, rows = cKDTree(expected.positions).query(q.positions)
    assert far.max() < 0.02 and len(q) > 0.75 * len(expected)  # a twelfth of perspective's bend
    assert ((expected.normals[rows] * q.normals).sum(axis=1) > 1 - 1e-6).all()
    np.testing.assert_allclose(q.material.albedo, expected.material.albedo[rows])
    assert (q.channels, q.unit, q.interreflected) == (1, "m", False)


def test_a_stack_of_files(view, tmp_path):
    """One file a layer, told by its name where its channels have none."""
    files = [
        write(tmp_path / "hall.0001.exr", layer("", view.radiance)),
        write(tmp_path / "hall_position.0001.exr", layer("", view.position, "XYZ")),
        write(tmp_path / "hall_shading_normal.exr", layer("", view.normal)),
        write(tmp_path / "hall-albedo.exr", layer("", view.albedo)),
    ]
    picture = render.read_picture(*files)
    for name in ("radiance", "position", "normal", "albedo"):
        np.testing.assert_array_equal(getattr(picture, name), getattr(view, name))
    assert str(picture).startswith("40 x 30 pixels with position, normal, albedo; ")


@pytest.mark.parametrize("rows", [True, False])
def test_cameras_in_files(rows, view, tmp_path, rng):
    """``worldToCamera`` for vectors that are rows, as the format wants, or columns."""
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    m = np.eye(4)
    m[:3, :3], m[3, :3] = turn, -view.camera @ turn
    matrix = (m if rows else m.T).ravel()
    picture = render.read_picture(
        write(tmp_path / "a.exr", layer("", view.radiance), worldToCamera=matrix)
    )
    np.testing.assert_allclose(picture.camera, view.camera, atol=1e-5)


def test_stacks_that_are_refused(view, room, tmp_path, refuses):
    """No layers, no camera, a matrix of no camera, both a room and a camera."""
    plain = write(tmp_path / "a.exr", layer("", view.radiance))
    with refuses(f"{plain}: does not say what its pixels show (no position, normal, albedo)"):
        render.observe_picture(plain)
    channels = layer("", view.radiance) | layer("P", view.position, "XYZ")
    channels |= layer("N", view.normal, "XYZ") | layer("albedo", view.albedo)
    path = write(tmp_path / "b.exr", channels)
    with refuses(f"{path}: does not say where it was taken from"):
        render.observe_picture(path)
    with refuses("camera has shape (2,)"):
        render.observe_picture(path, camera=[0, 1])
    with refuses("observe_picture takes a room, whose sensor is the camera, or a camera"):
        render.observe_picture(path, room, camera=[0, 0, 1])
    with refuses("observe_picture expects transport"):
        render.observe_picture(path, room, transport="some")
    write(path, channels, worldToCamera=np.ones(16))
    with refuses(f"{path}: attribute worldToCamera is no matrix of a camera"):
        render.observe_picture(path)
    write(path, channels | layer("N", 0 * view.normal, "XYZ"))
    with refuses(f"{path}: no pixel shows one smooth surface"):
        render.observe_picture(path, camera=view.camera)


def test_edges_are_left_out():
    """Two walls that meet, one before the other, and where nothing counts: a pixel around each."""
    h = w = 12
    column, row = np.meshgrid(np.arange(w, dtype=float), np.arange(h, dtype=float))
    flat, up = np.stack([column, row, 0 * row], axis=-1), np.tile([0.0, 0.0, 1.0], (h, w, 1))
    there = np.ones((h, w), bool)
    assert smooth(flat, up, there).all()
    wall, turned = flat.copy(), up.copy()
    wall[:, 6:] = np.stack([5.5 + 0 * row, row, column - 5.5], axis=-1)[:, 6:]
    turned[:, 6:] = [-1, 0, 0]
    raised = flat + np.where(column >= 6, 0.5, 0)[..., None] * [0, 0, 1]
    expected = (column < 5) | (column > 6)
    for x, n in ((wall, turned), (raised, up)):
        assert (smooth(x, n, there) == expected).all()
    there[4, 4] = False
    assert (~smooth(flat, up, there)).sum() == 9
    assert (smooth(flat, up, there | True, (column >= 6).astype(int)) == expected).all()


GAUSSIAN = Filter(0.25, (1.0, float(np.exp(-1)), float(np.exp(-4))))


def test_centres_of_averages(rng):
    """A filter's average over a quadratic is undone exactly; a border stays as it is."""
    column, row = np.meshgrid(np.arange(9.0), np.arange(7.0))
    a, b, c, d, e, f = rng.normal(size=6)
    B = a + b * column + c * row + d * column**2 + e * column * row + f * row**2
    for film in (BOX, GAUSSIAN):
        mean = (B + film.variance * (d + f))[..., None]
        used = np.ones(B.shape, bool)
        got = at_centres(mean, used, film).reshape(B.shape)
        size = np.abs(B).max()
        np.testing.assert_allclose(got[1:-1, 1:-1], B[1:-1, 1:-1], atol=1e-13 * size)
        np.testing.assert_array_equal(got[0], mean[0, :, 0])
        assert np.abs(mean[..., 0] - B).max() > 1e-3  # negative control


def test_filters():
    """Of a box a twelfth; of Mitsuba's Gaussian, of deviation 1/2, what its formula says, but for
    its end at four deviations."""
    use_mitsuba()
    import mitsuba as mi

    for name, expected in (("box", BOX), ("gaussian", GAUSSIAN)):
        film = mi.load_dict({"type": "hdrfilm", "rfilter": {"type": name}})
        got = Filter.of(mi.load_dict({"type": "perspective", "fov": 40.0, "film": film}))
        assert got.variance == pytest.approx(expected.variance, abs=0.01)
        assert got.alike == pytest.approx(expected.alike, abs=0.01)


def test_a_filter_without_a_radius_is_refused(tmp_path, pixels, refuses):
    """Mitsuba makes no picture with it."""
    text = render.files_of("box_two")[0].read_text()
    none = '<rfilter type="tent"><float name="radius" value="0"/></rfilter>'
    (tmp_path / "room.xml").write_text(
        text.replace('<rfilter type="box" id="pixel_filter"/>', none)
    )
    room = render.load(tmp_path / "room.xml")
    path = write(tmp_path / "a.exr", layer("", pixels))
    with refuses(f"{room.path}: the film's filter has radius 0"):
        render.observe_picture(path, room)


@pytest.mark.parametrize(("name", "apart"), [("box", 1), ("tent", 2), ("gaussian", 2)])
def test_of_a_wide_filter_pixels_with_noise_of_their_own_are_used(name, apart, tmp_path):
    """Those of every row and column, or of every second; of all, errors would be too small."""
    text = render.files_of("box_two")[0].read_text()
    file = tmp_path / "room.xml"
    file.write_text(text.replace('"box" id="pixel_filter"', f'"{name}" id="pixel_filter"'))
    room = render.load(file)
    column, row = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    where = np.stack([column, row, 0 * row], axis=2) + 1
    path = write(tmp_path / "a.exr", layer("", where.astype(float)))
    q = render.observe_picture(path, room, transport="direct")
    pixel = np.rint(q.radiance[:, :2]).astype(int) - 1
    assert (pixel % apart == 0).all()
    assert len(q) > 0.6 * WIDTH * HEIGHT / apart**2


@pytest.mark.parametrize("film", [BOX, GAUSSIAN], ids=["box", "gaussian"])
def test_noise_is_told_by_neighbours(film, rng):
    """Over a bent B with noise, it is that of what `at_centres` returns; of none, the file's."""
    column, row = np.meshgrid(np.linspace(0, 1, 300), np.linspace(0, 1, 200))
    B = (1 + column + 2 * row**2)[..., None]
    used = np.zeros(B.shape[:2], bool)
    used[4:-4, 4:-4] = True
    fine = np.arange(-10, 11) / 5
    weight = np.exp(-2 * fine**2) if film is GAUSSIAN else (np.abs(fine) < 0.5) * 1.0
    samples = rng.normal(size=(1000, 1500))
    noise = correlate1d(correlate1d(samples, weight, 0), weight, 1)[2::5, 2::5, None]
    noisy = B + 0.05 * noise / noise.std()
    off = at_centres(noisy, used, film) - at_centres(B, used, film)
    z = off / noise_of(noisy, used, film, None)
    # of 60 000 pixels a tenth are independent: 1 %; an error that is told by 72 pixels, a sixth of
    # them independent, is off by a fifth, and z spreads by 3/2 of that squared: 6 %
    assert z.std() == pytest.approx(1, abs=0.06)
    none, bend = noise_of(B, used, film, None), film.variance / 2 * 4 / 199**2
    assert (none < 4 * FLOOR * B.max() + bend).all() and (none > 0).all()


def test_errors_are_pooled(pixels, tmp_path):
    """Known errors around a pixel are averaged as squares, over used pixels that have one.

    Those beside it are left out, as they are where errors are told by neighbours; one that is alone
    keeps its own.
    """
    path = write(tmp_path / "a.exr", layer("", pixels) | layer("sigma", pixels))
    picture = render.read_picture(path)
    sigma, used = np.array(picture.sigma), np.zeros((HEIGHT, WIDTH), bool)
    used[8:13, 8:13] = used[0, 0] = True
    sigma[9, 9] = np.nan
    plain = Filter(0.0, (1.0, 0.0, 0.0))
    got = noise_of(picture.radiance, used, plain, sigma)
    floor = FLOOR * (picture.radiance[used] + picture.radiance[used].mean())
    around = np.array(sigma[8:13, 8:13])
    around[1:4, 1:4] = np.nan
    mean = np.nanmean(around**2, axis=(0, 1))
    np.testing.assert_allclose(got[0] ** 2 - floor[0] ** 2, sigma[0, 0] ** 2, rtol=1e-6)
    np.testing.assert_allclose(got[13] ** 2 - floor[13] ** 2, mean, rtol=1e-6)


@pytest.mark.parametrize("film", [BOX, GAUSSIAN], ids=["box", "gaussian"])
def test_no_error_depends_on_its_own_value(film, rng):
    """Else a fit would trust what noise made low; it shows in the errors of those around."""
    B = 1 + 0.05 * rng.normal(size=(20, 20, 1))
    used = np.ones(B.shape[:2], bool)
    before = noise_of(B, used, film, None).reshape(20, 20)
    B[10, 10] *= 1.5
    after = noise_of(B, used, film, None).reshape(20, 20)
    assert abs(after[10, 10] - before[10, 10]) < 1e-3 * before[10, 10]  # but for the file's own
    assert after[10, 12] > 1.3 * before[10, 12]


@pytest.mark.parametrize("film", [BOX, GAUSSIAN], ids=["box", "gaussian"])
def test_skewed_noise_makes_no_value_low(film, rng):
    """The mean that such errors weight is the plain one, of noise as a path tracer's."""
    noise = rng.gamma(0.3, size=(200, 200, 1))
    B = 1 + 0.3 * (noise - 0.3) / 0.3**0.5
    used = np.ones(B.shape[:2], bool)
    weight = noise_of(B, used, film, None) ** -2
    value = at_centres(B, used, film)
    off = (weight * value).sum() / weight.sum() - value.mean()
    error = value.std() * np.sqrt((weight**2).sum()) / weight.sum()
    assert abs(off) < 3 * error


@pytest.mark.parametrize("kind", [oiio.FLOAT, oiio.HALF])
def test_clipped_pixels_are_saturated(kind, room, view, tmp_path):
    """Where a picture was cut off at a maximum, and beside that; else nothing is."""
    B = view.radiance[..., :1].repeat(3, axis=2)
    top = float(np.float16(np.quantile(B, 0.95)))
    whole = write(tmp_path / "a.exr", layer("", B), kind=kind)
    assert not render.observe_picture(whole, room, transport="direct").saturated.any()
    cut = write(tmp_path / "b.exr", layer("", np.minimum(B, top)), kind=kind)
    q = render.observe_picture(cut, room, transport="direct")
    untouched = render.observe_picture(whole, room, transport="direct")
    same = np.isclose(q.radiance, untouched.radiance, rtol=1e-6).all(axis=1)
    assert 0.02 < q.saturated.mean() < 0.2 and same[~q.saturated].all()
    assert (~same).sum() > 0.5 * q.saturated.sum()  # most of what is left out was changed
