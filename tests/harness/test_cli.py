"""The command line, as a user meets it: bad input ends with one plain sentence and exit code 2."""

from __future__ import annotations

import contextlib
import io
import json
import os
import re
import struct
import subprocess
import sys
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np
import pytest

import lightloc
import render
from lightloc import PointLights
from render.variant import two_threads
from validation.cli import main

LIGHTLOC = Path(sys.executable).with_name("lightloc")
ROOM = render.room.find_file("box_one").read_text()
LIGHT = re.search(r"<emitter.*?</emitter>", ROOM, re.S).group(0)
SMALL = ("--points", "32", "--transport", "direct", "-o", "seen.npz")
OLD_LLVM = sorted(
    {file.resolve() for file in Path("/usr/lib/x86_64-linux-gnu").glob("libLLVM-1[456]*.so*")}
)
CORNERS = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
ROW = '[[case]]\nname="a"\nscene="box_one"\nclaim="A."\nbrdf="diffuse"\nposition_percent=1\n'
GOOD_ROW = ROW + "intensity_percent=5\n"


def lightloc_command(*arguments: Any, cwd: Path, **environment: str) -> Any:
    """Run the console script as a user would."""
    return subprocess.run(
        [LIGHTLOC, *map(str, arguments)],
        cwd=cwd,
        env=os.environ | environment,
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )


def within(*arguments: Any, cwd: Path) -> Any:
    """The same in this process, which has all that a new one would take a second to import."""
    out, err, code = io.StringIO(), io.StringIO(), 0
    with contextlib.ExitStack() as stack:
        stack.enter_context(contextlib.chdir(cwd))
        stack.enter_context(contextlib.redirect_stdout(out))
        stack.enter_context(contextlib.redirect_stderr(err))
        stack.enter_context(mock.patch.dict(os.environ))
        stack.enter_context(mock.patch.object(sys, "argv", ["lightloc", *map(str, arguments)]))
        try:
            main()
        except SystemExit as ended:
            code = ended.code or 0
    return subprocess.CompletedProcess(arguments, code, out.getvalue(), err.getvalue())


def contents(folder: Path) -> set[Path]:
    return set(folder.rglob("*"))


def assert_refused(folder: Path, arguments: tuple[str, ...], *said: str, **environment: str):
    """Exit code 2, one line on stderr with all of ``said``, and the folder as it was."""
    before = contents(folder)
    run = lightloc_command if environment else within
    done = run(*arguments, cwd=folder, **environment)
    assert done.returncode == 2, (done.returncode, done.stdout, done.stderr)
    (line,) = done.stderr.splitlines()
    assert line.startswith("lightloc: "), line
    for words in said:
        assert words in line, line
    assert not done.stdout
    assert contents(folder) == before


def lit(**attributes: str) -> str:
    """The room with its light's intensity or position replaced."""
    light = LIGHT
    for name, value in attributes.items():
        light = re.sub(rf'(name="{name}" (?:value|x)=")[^"]*', rf"\g<1>{value}", light)
    assert light != LIGHT
    return ROOM.replace(LIGHT, light)


def with_shape(shape: str) -> str:
    return ROOM.replace("</scene>", f"{shape}</scene>")


SCENES = {
    "not XML": ("hello", "room.xml", "XML"),
    "empty": ("", "room.xml", "XML"),
    "cut short": (ROOM[: len(ROOM) // 2], "room.xml", "mismatch"),
    "fog": (
        with_shape('<shape type="cube"><medium type="homogeneous" name="interior"/></shape>'),
        *("room.xml: line ", "participating medium"),
    ),
    "property that none has": (
        with_shape('<shape type="cube"><float name="bevel" value="1"/></shape>'),
        *("room.xml: line ", "'cube' has no property 'bevel'"),
    ),
    "value that is missing": (lit(intensity="$watts"), "room.xml: line ", "$watts"),
    "no surface": (re.sub(r"<shape.*?</shape>", "", ROOM, flags=re.S), "room.xml", "no surface"),
    "unknown BSDF": (ROOM.replace('"diffuse"', '"velvet"', 1), "room.xml", "velvet", "bsdf"),
    "unknown shape": (ROOM.replace('"rectangle"', '"oval"', 1), "room.xml", "oval", "shape"),
    "nan intensity": (lit(intensity="nan"), "room.xml", "intensity is no number"),
    "infinite intensity": (lit(intensity="inf"), "room.xml", "intensities", "inf", "finite"),
    "negative intensity": (lit(intensity="-3"), "room.xml", "intensities", "-3", "at least 0"),
    "nan position": (lit(position="nan"), "room.xml", "positions", "nan", "finite"),
    "intensity in words": (lit(intensity="bright"), "room.xml", "bright"),
}


@pytest.mark.parametrize("case", SCENES)
def test_bad_scene_is_refused(case, tmp_path):
    """A scene that can't be used is named, with what is wrong."""
    text, *said = SCENES[case]
    (tmp_path / "room.xml").write_text(text)
    assert_refused(tmp_path, ("render", "room.xml", *SMALL), *said)


def ascii_ply(corners: Any = CORNERS, face: Any = (0, 1, 2)) -> bytes:
    """A PLY file of one triangle, as text."""
    points = "".join(" ".join(map(str, corner)) + "\n" for corner in corners)
    return (header("ascii", len(corners)) + points + "3 {} {} {}\n".format(*face)).encode()


def binary_ply(corners: Any = CORNERS, face: Any = (0, 1, 2), order: str = "<") -> bytes:
    """The same in bytes, of either byte order."""
    kind = "binary_little_endian" if order == "<" else "binary_big_endian"
    points = np.array(corners, f"{order}f4").tobytes()
    return header(kind, len(corners)).encode() + points + struct.pack(f"{order}B3I", 3, *face)


def header(kind: str, count: int) -> str:
    return (
        f"ply\nformat {kind} 1.0\nelement vertex {count}\n"
        "property float x\nproperty float y\nproperty float z\n"
        "element face 1\nproperty list uchar uint vertex_indices\nend_header\n"
    )


FAR, NAN = (0, 1, 2_000_000_000), [[0, 0, float("nan")], *CORNERS[1:]]
OBJ = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
MESHES = {
    "index out of range": ("m.ply", binary_ply(face=FAR), "face 0", "2000000000", "below 3"),
    "index one too far": ("m.ply", binary_ply(face=(0, 1, 3)), "vertex 3", "below 3"),
    "big-endian": ("m.ply", binary_ply(face=FAR, order=">"), "face 0", "below 3"),
    "index out of range in text": ("m.ply", ascii_ply(face=(0, 1, 7)), "vertex 7", "below 3"),
    "nan corner": ("m.ply", binary_ply(NAN), "invalid vertex"),
    "cut short": ("m.ply", binary_ply()[:-3], "13 bytes"),
    "no mesh": ("m.ply", b"hello", "header"),
    "missing": ("m.ply", None, "no such file"),
    "obj index out of range": ("m.obj", (OBJ + "f 1 2 9\n").encode(), "vertex 9"),
    "obj nan corner": ("m.obj", (OBJ.replace("1", "nan") + "f 1 2 3\n").encode(), "invalid"),
    "obj without faces": ("m.obj", OBJ.encode(), "no face"),
}


def mesh_scene(folder: Path, name: str, content: bytes | None) -> None:
    """room.xml with the mesh file in a folder beside it."""
    (folder / "meshes").mkdir()
    if content is not None:
        (folder / "meshes" / name).write_bytes(content)
    file = f'<string name="filename" value="meshes/{name}"/>'
    (folder / "room.xml").write_text(
        with_shape(f'<shape type="{name.split(".")[-1]}">{file}</shape>')
    )


@pytest.mark.parametrize("case", MESHES)
def test_bad_mesh_is_refused(case, tmp_path):
    """A broken mesh is named and refused before Mitsuba builds a scene on it, which crashes."""
    name, content, *said = MESHES[case]
    mesh_scene(tmp_path, name, content)
    assert_refused(tmp_path, ("render", "room.xml", *SMALL), "room.xml", name, *said)


@pytest.mark.parametrize("content", [ascii_ply(), binary_ply(), binary_ply(order=">")])
def test_whole_mesh_is_taken(content, tmp_path):
    """The control: the same meshes with indices in range are loaded."""
    mesh_scene(tmp_path, "m.ply", content)
    assert len(render.load(tmp_path / "room.xml").scene.shapes()) == 7


RENDER = {
    "missing scene": (("nope.xml",), "nope.xml", "no such scene file"),
    "unknown parameter": (("box_one", "--set", "shade=3"), "'shade'", "max_depth"),
    "alpha in words": (("box_conductor", "--set", "alpha=abc"), "box_conductor", "abc"),
    "alpha negative": (("box_conductor", "--set", "alpha=-1"), "alpha", "-1"),
    "alpha nan": (("box_plastic", "--set", "alpha=nan"), "alpha", "nan"),
    "alpha empty": (("box_conductor", "--set", "alpha="), "alpha", "NAME=VALUE"),
    "no value": (("box_conductor", "--set", "alpha"), "alpha", "NAME=VALUE"),
    "no points": (("box_one", "--points", "0"), "--points", "equal to 1"),
    "points in words": (("box_one", "--points", "many"), "--points", "integer"),
    "points beyond memory": (("box_one", "--points", "1000000000000"), "--points", "10000000"),
    "noise 2": (("box_one", "--noise", "2"), "noise < 1", "2"),
    "noise nan": (("box_one", "--noise", "nan"), "noise < 1", "nan"),
    "one sample": (("box_one", "--spp", "1"), "--spp", "equal to 2"),
    "negative seed": (("box_one", "--seed", "-1"), "--seed", "0"),
    "transport": (("box_one", "--transport", "some"), "--transport", "'direct', 'full'"),
    "option": (("box_one", "--zork"), "--zork"),
    "no scene": ((), "scene"),
    "output is a folder": (("box_one", "-o", "."), ".: is a folder"),
    "output under a file": (("box_one", "-o", "file/seen.npz"), "file/seen.npz"),
    "output under /proc": (("box_one", "-o", "/proc/x/seen.npz"), "/proc/x/seen.npz"),
    "lights in a folder": (("box_one", "--lights", "."), ".: is a folder"),
    "new folder, no scene": (("nope", "-o", "new/folder/seen.npz"), "nope"),
}


@pytest.mark.parametrize("case", RENDER)
def test_bad_option_of_render_is_refused(case, tmp_path):
    """A value out of range is named, with the range."""
    arguments, *said = RENDER[case]
    (tmp_path / "file").write_text("a file")
    own = SMALL if "-o" not in arguments else SMALL[:-2]
    own = own[2:] if "--points" in arguments else own
    own = (
        tuple(a for a in own if a not in ("--transport", "direct")) if "some" in arguments else own
    )
    assert_refused(tmp_path, ("render", *arguments, *own), *said)


@pytest.fixture(scope="module")
def arrays(load) -> dict[str, Any]:
    """The arrays of a good observations file."""
    seen = render.observe(load("box_one"), points=32, transport="direct")
    names = ("positions", "normals", "directions", "radiance", "sigma", "interreflected")
    return {
        "format": "lightloc-observations-1",
        **{name: getattr(seen, name) for name in names},
        "material": "Lambert",
        "material.albedo": np.array(0.5),
    }


def first(value: float) -> Any:
    """Put a value in an array's first row."""

    def change(array: np.ndarray) -> np.ndarray:
        return np.concatenate([np.full_like(array[:1], value), array[1:]])

    return change


OBSERVATIONS = {
    "nan radiance": ({"radiance": first(np.nan)}, "radiance[0][0]", "nan", "finite"),
    "infinite radiance": ({"radiance": first(np.inf)}, "radiance[0][0]", "inf", "finite"),
    "exact negative radiance": ({"radiance": first(-1.0)}, "radiance[0][0]", "-1", "exact"),
    "nan position": ({"positions": first(np.nan)}, "positions[0][0]", "nan", "finite"),
    "zero normal": ({"normals": first(0.0)}, "normals[0]", "zero", "unit"),
    "negative sigma": ({"sigma": first(-1.0)}, "sigma[0][0]", "-1", "at least 0"),
    "fewer normals": ({"normals": lambda a: a[1:]}, "normals", "(31, 3)", "(32, 3)"),
    "fewer radiances": ({"radiance": lambda a: a[1:]}, "radiance", "(31, 1)", "(32, any)"),
    "no points": (
        {n: lambda a: a[:0] for n in ("positions", "normals", "directions", "radiance", "sigma")},
        "empty",
    ),
    "another format": ({"format": lambda a: "else"}, "format", "else"),
    "albedo -1": ({"material.albedo": lambda a: np.array(-1.0)}, "albedo", "-1", "at least 0"),
    "unknown material": ({"material": lambda a: "Velvet"}, "material", "Velvet"),
    "interreflected, no scene": ({"interreflected": lambda a: True}, "geometry"),
}


@pytest.mark.parametrize("case", OBSERVATIONS)
def test_bad_observations_are_refused(case, arrays, tmp_path):
    """The file and the field are named; nothing is searched."""
    changes, *said = OBSERVATIONS[case]
    changed = {name: change(arrays[name]) for name, change in changes.items()}
    np.savez(tmp_path / "seen.npz", **{**arrays, **changed})
    file = () if case.startswith("interreflected") else ("seen.npz",)
    assert_refused(tmp_path, ("localize", "seen.npz"), *file, *said)


def test_negative_radiance_is_taken_within_noise(arrays, tmp_path):
    """Noise and the removal of indirect light leave B below zero, so a file may hold it."""
    B = arrays["radiance"] - 1e-3
    np.savez(tmp_path / "seen.npz", **{**arrays, "radiance": B, "sigma": np.full_like(B, 1e-2)})
    assert (lightloc.Observations.load(tmp_path / "seen.npz").radiance == B).all()


def test_unreadable_observations_are_refused(arrays, tmp_path):
    """Missing, text, empty, cut short: the file is named, and no library's words are."""
    assert_refused(tmp_path, ("localize", "gone.npz"), "gone.npz", "no such file")
    np.savez(tmp_path / "seen.npz", **arrays)
    whole = (tmp_path / "seen.npz").read_bytes()
    for content in (b"hello", b"", whole[: len(whole) // 2]):
        (tmp_path / "seen.npz").write_bytes(content)
        assert_refused(tmp_path, ("localize", "seen.npz"), "seen.npz", "not a file of observations")


LIGHTS = {
    "broken": b'{"lights": [',
    "empty": b"",
    "bytes": bytes(range(128, 256)),
    "a list": b"[]",
    "no intensity": b'{"lights": [{"position": [0, 0, 0]}]}',
    "nan": b'{"lights": [{"position": [0, 0, NaN], "intensity": [1]}]}',
    "in 2D": b'{"lights": [{"position": [0, 0], "intensity": [1]}]}',
}


@pytest.mark.parametrize("case", LIGHTS)
def test_bad_lights_are_refused(case, tmp_path):
    """A lights file that is none is named."""
    (tmp_path / "found.json").write_bytes(LIGHTS[case])
    assert_refused(tmp_path, ("compare", "found.json", "found.json"), "found.json")


SUITES = {
    "missing": (None, "suite.toml", "no such suite"),
    "broken": ("[[case", "suite.toml", "Expected ']]'"),
    "no case": ('name = "a"', "suite.toml", "[[case]]"),
    "cases are numbers": ("case = [1, 2]", "suite.toml", "[[case]]"),
    "defaults are a number": ("defaults = 3\n" + GOOD_ROW, "suite.toml", "defaults"),
    "unknown key": (GOOD_ROW + "colour = 3\n", "suite.toml", "'a'", "colour"),
    "wrong type": (GOOD_ROW + 'points = "many"\n', "suite.toml", "'a'", "points", "integer"),
    "no limit": (ROW, "suite.toml", "'a'", "intensity_percent", "required"),
    "out of range": (GOOD_ROW + "noise = 2\n", "suite.toml", "'a'", "noise", "less than 1"),
    "same name twice": (GOOD_ROW + GOOD_ROW, "suite.toml", "two cases", "'a'"),
    "name that is a path": (GOOD_ROW.replace('"a"', '"../a"'), "suite.toml", "'../a'", "name"),
    "name that is the folder above": (GOOD_ROW.replace('"a"', '".."'), "suite.toml", "name"),
}


@pytest.mark.parametrize("case", SUITES)
def test_bad_suite_is_refused(case, tmp_path):
    """The file, the case and the field are named before anything runs."""
    text, *said = SUITES[case]
    if text is not None:
        (tmp_path / "suite.toml").write_text(text)
    assert_refused(tmp_path, ("validate", "--suite", "suite.toml", "-o", "run"), *said)


def test_other_bad_commands_are_refused(tmp_path):
    """An unknown case or command, a report on nothing, an impossible number of jobs."""
    assert_refused(tmp_path, ("validate", "--case", "nope"), "standard", "--case nope")
    assert_refused(tmp_path, ("validate", "--jobs", "-1"), "--jobs", "0")
    assert_refused(tmp_path, ("report", "."), "suite.json is missing")
    assert_refused(tmp_path, ("report", "gone"), "gone/suite.json is missing")
    assert_refused(tmp_path, ("frobnicate",), "frobnicate")


def test_debug_shows_the_traceback(tmp_path):
    """What a developer needs is one option away."""
    done = lightloc_command("--debug", "render", "nope.xml", cwd=tmp_path)
    assert done.returncode != 0
    assert "Traceback" in done.stderr
    assert "ValueError: nope.xml: no such scene file" in done.stderr


def test_help_loads_nothing_heavy(tmp_path):
    """--help answers before the renderer, the solver or the drawing could have loaded."""
    done = subprocess.run(
        [sys.executable, "-X", "importtime", LIGHTLOC, "--help"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
    )
    loaded = {line.rsplit("|", 1)[-1].strip().split(".")[0] for line in done.stderr.splitlines()}
    assert {"typer", "validation"} <= loaded  # the control: the list is read right
    heavy = {
        "mitsuba",
        "drjit",
        "scipy",
        "numpy",
        "matplotlib",
        "plotly",
        "pydantic",
        "OpenImageIO",
    }
    assert not loaded & heavy
    for command in (*("render", "localize", "compare", "validate", "report", "study", "doctor"),):
        assert command in done.stdout
    assert lightloc_command(cwd=tmp_path).stdout == done.stdout


def test_the_version_is_said_in_one_place(tmp_path):
    """The command, the package and the citation agree."""
    done = lightloc_command("--version", cwd=tmp_path)
    assert done.returncode == 0 and done.stdout == f"lightloc {lightloc.__version__}\n"
    assert (
        f"\nversion: {lightloc.__version__}\n"
        in (Path(__file__).parents[2] / "CITATION.cff").read_text()
    )


def test_doctor_says_what_runs(tmp_path):
    """doctor prints the LLVM version and that a tiny render works."""
    done = lightloc_command("doctor", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    rows = dict(re.split(r"\s{2,}", line, maxsplit=1) for line in done.stdout.splitlines())
    version = lightloc.backend.llvm_version()
    assert rows["LLVM"] == ".".join(map(str, version))
    assert rows["lightloc"] == lightloc.__version__
    assert "works" in done.stdout


@pytest.mark.parametrize("library", [*OLD_LLVM[:1], "/no/such/libLLVM.so"], ids=str)
def test_llvm_that_would_abort_is_refused(library, tmp_path):
    """An LLVM that Dr.Jit aborts on, or none, ends each command with one sentence of ours.

    Dr.Jit's own lines about the library may stand before it.
    """
    (tmp_path / "suite.toml").write_text(GOOD_ROW)
    for arguments in (
        ("render", "box_one", *SMALL),
        ("validate", "--suite", "suite.toml"),
        ("doctor",),
    ):
        before = contents(tmp_path)
        done = lightloc_command(*arguments, cwd=tmp_path, DRJIT_LIBLLVM_PATH=str(library))
        assert done.returncode == 2, (done.returncode, done.stderr)
        *theirs, ours = done.stderr.splitlines()
        assert ours.startswith("lightloc: Dr.Jit needs libLLVM")
        assert str(library) in ours
        assert all(line.startswith("jit") for line in theirs)
        assert contents(tmp_path) == before


def test_round_trip(tmp_path):
    """render, localize, compare: 0 for the room that was rendered, 1 for another."""
    found = ("found.json", "--within", "0.1", "--intensity", "0.5")
    points = ("--points", "512", "--transport", "direct")
    for arguments, code, said in (
        (("render", "box_two", *points, "-o", "new/seen.npz"), 0, "512 observations of box_two"),
        (("localize", "new/seen.npz", "--scene", "box_two", "-o", "found.json"), 0, "2 lights"),
        (("compare", found[0], "box_two", *found[1:]), 0, "precision 1.00, recall 1.00"),
        (("compare", found[0], "box_three", *found[1:]), 1, "2 found, 3 true"),
    ):
        done = lightloc_command(*arguments, cwd=tmp_path)
        assert done.returncode == code, (arguments, done.stdout, done.stderr)
        assert said in done.stdout
        assert not done.stderr
        sure = "No other number of lights is possible (95 %)." in done.stdout
        assert sure is (arguments[0] == "localize")
    files = sorted(str(file.relative_to(tmp_path)) for file in contents(tmp_path))
    assert files == ["found.json", "new", "new/seen.npz"]


def test_the_answer_is_written_with_its_errors(tmp_path):
    """The file has each light's errors and the verdicts, and `compare` reads it."""
    room = render.relight(
        render.load("box_two"), PointLights([[1.0, 1.0, 1.5], [1.05, 1.0, 1.5]], [9.0, 9.0])
    )
    render.observe(room, points=300, seed=0, transport="direct", noise=0.2).save(tmp_path / "s.npz")
    done = lightloc_command("localize", "s.npz", "--scene", "box_two", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    answer = json.loads((tmp_path / "lights.json").read_text())
    lights = PointLights.load(tmp_path / "lights.json")
    assert len(answer["lights"]) == len(lights) > 0
    for light in answer["lights"]:
        assert len(light["position_error"]) == 3
        assert min(light["position_error"]) > 0
        assert light["intensity_error"][0] > 0
        assert light["bound"][0] > 0
    assert {verdict["kind"] for verdict in answer["verdicts"]} & {"CLUSTER", "UNCERTAIN"}
    assert answer["reason"] in lightloc.Reason.__members__
    assert 0 < answer["chi2"] < 2


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--indirect", "64"), ("--indirect", "--scene")),
        (("--method", "paper", "--ambient"), ("--method paper", "--ambient")),
        (("--method", "paper", "--noise", "estimate"), ("--method paper", "--noise")),
        (("--indirect", "-1"), ("--indirect -1", "expected a number from 2", "gathered")),
        (("--indirect", "often"), ("--indirect often", "expected a number from 2", "gathered")),
        (("--method", "paper", "--indirect", "64", "--scene", "box_one"), ("--method paper",)),
        (("--noise", "maybe"), ("--noise", "maybe", "scaled", "estimate")),
        (("--method", "paper", "--noise", "scaled"), ("--method paper", "--noise scaled")),
        (("--method", "paper", "--free", "gamma"), ("--method paper", "--free")),
        (("--method", "paper", "--false-alarm", "0.01"), ("--method paper", "--false-alarm")),
        (("--free", "albedo,roughness"), ("--free albedo,roughness", "albedo, ambient, gamma")),
        (("--free", ""), ("--free", "expected some of")),
        (("--false-alarm", "0"), ("--false-alarm is 0", "above 0")),
        (("--false-alarm", "1"), ("--false-alarm is 1", "less than 1")),
        (("--floor", "-1"), ("--floor is -1", "at least 0")),
        (("--saturated", "0"), ("--saturated is 0", "above 0")),
        (("--step", "nan"), ("--step is nan", "at least 0")),
    ],
)
def test_options_that_do_not_go_together_are_refused(options, said, arrays, tmp_path):
    np.savez(tmp_path / "seen.npz", **arrays)
    assert_refused(tmp_path, ("localize", "seen.npz", *options), *said)


METER = "x (cm),y (cm),z (cm),nx,ny,nz,lux"


def desk() -> tuple[np.ndarray, np.ndarray]:
    """(200, 3) points on a desk, m, and what a meter reads there, lux."""
    x = np.random.default_rng(2).uniform(-2, 2, (200, 3)) * [1, 1, 0]
    meter = lightloc.Observations(
        positions=x,
        normals=[[0, 0, 1]] * 200,
        radiance=np.zeros(200),
        material=lightloc.Irradiance(),
    )
    return x, lightloc.radiance(meter, PointLights([[0.3, 0.2, 1.5]], [50.0]))[:, 0]


def test_what_noise_is_and_what_a_meter_tells_from_the_command_line(tmp_path):
    """Noise by a factor or by a law, and a meter with a floor, a maximum and steps that are named.

    The answer says how large noise is and what was left out; the file, which counts are possible.
    """
    x, lux = desk()
    read = np.round(lux * np.random.default_rng(3).normal(1, 0.02, 200) / 0.05) * 0.05
    both = zip(x, read, 0.01 * lux, strict=True)
    rows = [f"{100 * a},{100 * b},0,0,0,1,{E:.2f},{error}" for (a, b, _), E, error in both]
    (tmp_path / "r.csv").write_text("\n".join([f"{METER},error", *rows]))
    low, high = np.quantile(read, [0.2, 0.9]) + 0.02  # between two steps
    left = int((read <= low).sum()), int((read >= high).sum())
    limits = ("--floor", low, "--saturated", high, "--step", 0.05)
    for options, law, said in (
        (("--noise", "scaled", "--false-alarm", 0.01), "SCALED", "Noise, estimated: "),
        (("--noise", "estimate", *limits), "ESTIMATED", "{1} clipped, {0} at the".format(*left)),
    ):
        done = within("localize", "r.csv", *options, "-o", "found.json", cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        assert said in done.stdout, done.stdout
        found = json.loads((tmp_path / "found.json").read_text())
        assert found["noise"]["law"] == law and found["possible"] == [1]
        np.testing.assert_allclose(found["lights"][0]["intensity"], [50], rtol=0.03)
    assert (found["limits"]["clipped"], found["limits"]["floored"]) == left[::-1]
    assert found["limits"]["step"] == pytest.approx(0.05 / 100**2)  # lux by the square of a cm


def test_what_is_free_from_the_command_line(arrays, tmp_path):
    """What is set free is told with its errors."""
    np.savez(tmp_path / "s.npz", **{**arrays, "sigma": np.full_like(arrays["sigma"], 1e-3)})
    done = within("localize", "s.npz", "--free", "ambient,gamma", cwd=tmp_path)
    assert done.returncode == 3, done.stderr
    assert "Fitted too: the power of radiance that values are: " in done.stdout
    told = json.loads((tmp_path / "lights.json").read_text())["departures"]
    assert [one["kind"] for one in told] == ["INDIRECT", "ENCODING"]
    assert_refused(tmp_path, ("localize", "s.npz", "--free", "albedo"), "no two regions")


def test_readings_from_the_command_line(tmp_path):
    """A CSV file gives lights in cd, and what was read is said; options of pictures are refused."""
    x, lux = desk()
    rows = [f"{100 * a},{100 * b},0,0,0,1,{E},1" for (a, b, _), E in zip(x, lux, strict=True)]
    header = f"{METER},error [%]"
    (tmp_path / "r.csv").write_text("\n".join([header, *rows]))
    done = lightloc_command("localize", "r.csv", "-o", "found.json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    first, _, head = done.stdout.splitlines()[:3]
    assert first == "r.csv: 200 readings of irradiance, lengths in cm, errors given"
    assert "position (cm)" in head and head.endswith("intensity (cd)")
    found = json.loads((tmp_path / "found.json").read_text())
    assert found["intensity_unit"] == "cd"
    np.testing.assert_allclose(found["lights"][0]["intensity"], [50], rtol=0.01)
    assert_refused(tmp_path, ("localize", "r.csv", "--sensor", "0"), "--sensor", "r.csv")
    assert_refused(tmp_path, ("localize", "r.csv", "--unit", "m"), "r.csv", "is cm, not m")
    (tmp_path / "r.csv").write_text(f"{header}\n0,0,0,0,0,1,dark,1\n")
    assert_refused(tmp_path, ("localize", "r.csv"), "r.csv: line 2, column lux: 'dark' is not a")


def test_pictures_from_the_command_line(tmp_path):
    """What a picture needs is said, in one sentence; with its scene its lights are found."""
    room = render.load("box_one")
    import mitsuba as mi

    sensor = room.scene.sensors()[0]
    values = mi.traverse(sensor)
    values["film.size"] = [64, 48]
    values.update()
    path = mi.load_dict({"type": "path", "max_depth": 2})
    mi.render(room.scene, sensor=sensor, integrator=path, spp=64)
    with two_threads():
        sensor.film().write(str(tmp_path / "a.exr"))
    scene = ("--scene", "box_one", "--transport", "direct")
    done = lightloc_command("localize", "a.exr", *scene, "-o", "found.json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("a.exr: 64 x 48 pixels; colours: linear Rec. 709 (assumed); "), (
        done.stdout
    )
    judged = lightloc_command("compare", "found.json", "box_one", cwd=tmp_path)
    assert judged.returncode == 0, judged.stdout
    ended = ("--scene", "box_one", "--max-depth", "2")  # the same said otherwise
    done = lightloc_command("localize", "a.exr", *ended, "-o", "again.json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "again.json").read_bytes() == (tmp_path / "found.json").read_bytes()
    for options, *said in (
        ((), "a.exr: does not say what its pixels show", "lightloc render --view"),
        (("--scene", "box_one", "--camera", "1,2,3"), "--camera: does not belong to a.exr"),
        (("--scene", "box_one", "--floor", "0.1"), "--floor: does not belong to a.exr"),
        (("--scene", "box_one", "--max-depth", "1"), "max_depth is 1; expected a whole number"),
    ):
        assert_refused(tmp_path, ("localize", "a.exr", *options), *said)
    readings = tmp_path / "lux.csv"
    readings.write_text("x,y,z,lux\n0,0,0,1\n")
    refused = ("--max-depth", "3"), "--max-depth: does not belong to lux.csv"
    assert_refused(tmp_path, ("localize", "lux.csv", *refused[0]), refused[1])
    (tmp_path / "a.png").write_bytes(b"")
    assert_refused(tmp_path, ("localize", "a.png"), "a.png: holds values encoded for display")


def test_rendered_indirect_light(tmp_path):
    """Among metal walls, rendering what was found brings every intensity to within 4 %."""
    metal = ("--set", "alpha=0.3")
    scene = ("--scene", "box_conductor", *metal)
    steps = (
        ("render", "box_conductor", *metal, "--points", "1000", "-o", "s.npz"),
        ("localize", "s.npz", *scene, "--indirect", "256", "-o", "found.json"),
        ("compare", "found.json", "box_conductor", *metal, "--within", "1.5", "--intensity", "4"),
    )
    for arguments in steps:
        done = lightloc_command(*arguments, cwd=tmp_path)
        unsure = arguments[0] == "localize"  # a light may be several
        assert done.returncode == (3 if unsure else 0), (arguments, done.stdout, done.stderr)


def test_known_light_is_said(tmp_path):
    """What was subtracted of the observations, and what of the scene was not observed."""
    spot = '<emitter type="spot"><rgb name="intensity" value="3"/></emitter>'
    glass = '<shape type="sphere" id="ball"><point name="center" x="2" y="2" z="1"/>'
    glass += '<float name="radius" value="0.3"/><bsdf type="dielectric"/></shape>'
    (tmp_path / "room.xml").write_text(with_shape(glass + spot))
    done = within("render", "room.xml", *SMALL, cwd=tmp_path)
    assert done.stdout.splitlines()[1] == "not observed: shape 'ball' is glass"
    done = within("localize", "seen.npz", "--scene", "room.xml", cwd=tmp_path)
    assert done.returncode == 0
    assert done.stdout.startswith("known light: 1 emitter(s), rendered and subtracted\n")


def test_every_command_prints_json_or_nothing(tmp_path):
    """As asked: JSON that can be read, or no letter; lights are numbered from 1 there."""

    def ran(*words: str) -> str:
        done = within(*words, cwd=tmp_path)
        assert done.returncode in (0, 1), (words, done.stdout, done.stderr)
        assert not done.stderr
        return done.stdout

    seen = ("render", "box_one", "--points", "64", "--transport", "direct", "-o", "s.npz")
    for words in (
        (*seen, "--lights", "true.json"),
        ("localize", "s.npz", "--scene", "box_one", "-o", "found.json"),
        ("compare", "found.json", "true.json"),
        ("validate", "--case", "box_one-direct", "--dry-run"),
        ("compare", "true.json", "box_one"),
    ):
        assert ran(*words, "--quiet") == ""
        told = json.loads(ran(*words, "--json"))
        assert told
    pairs = json.loads(ran("compare", "found.json", "true.json", "--json"))["pairs"]
    assert [(pair["true"], pair["found"]) for pair in pairs] == [(1, 1)]


def test_compare_says_which_limit_is_missed_and_of_which_diagonal(tmp_path):
    """The same of a scene and of the file of its lights: the room's diagonal."""
    seen = ("render", "box_two", "--points", "32", "--transport", "direct", "-o", "s.npz")
    within(*seen, "--lights", "true.json", cwd=tmp_path)
    truth = json.loads((tmp_path / "true.json").read_text())
    truth["lights"][0]["position"][0] += 0.2
    truth["lights"][0]["intensity"][0] *= 1.5
    (tmp_path / "off.json").write_text(json.dumps(truth))
    said = [within("compare", "off.json", one, cwd=tmp_path) for one in ("true.json", "box_two")]
    for done in said:
        assert done.returncode == 1
        position, intensity = done.stdout.splitlines()[-2:]
        assert position.startswith("The worst position is off by ")
        assert f" % of the diagonal of {truth['diagonal']:.4g} m; allowed is 1 %." in position
        assert intensity == "The worst intensity is off by 50 %; allowed is 5 %."
    assert said[0].stdout == said[1].stdout


def test_compare_counts_in_the_errors_that_a_file_states(tmp_path):
    """In any unit; nothing where it states none, and a sentence where they are no numbers."""
    true = {"unit": "m", "lights": [{"position": [1.0, 2.0, 3.0], "intensity": [10.0]}]}
    stated = {"position_error": [0.2, 0.1, None], "intensity_error": [4.0e4]}
    light = {"position": [102.0, 200.0, 300.5], "intensity": [12.0e4], **stated}
    (tmp_path / "true.json").write_text(json.dumps(true))

    def said(light: dict[str, Any]) -> subprocess.CompletedProcess[str]:
        found = {"unit": "cm", "lights": [light]}
        (tmp_path / "found.json").write_text(json.dumps(found))
        return within("compare", "found.json", "true.json", "--intensity", "30", cwd=tmp_path)

    done = said({**light, "position_error": [2.5, 0.1, None]})
    assert "At most 0.8 of the stated standard errors off.\n" in done.stdout
    assert said(light).stdout.count("At most 10 of the stated standard errors off.") == 1
    plain = {"position": light["position"], "intensity": light["intensity"]}
    assert "stated" not in said(plain).stdout
    wrong = said({**light, "position_error": "small"})
    assert wrong.returncode == 2
    assert "found.json: position_error of light 1: expected 3 number(s)" in wrong.stderr
