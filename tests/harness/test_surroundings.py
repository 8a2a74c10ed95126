"""Where a command runs changes nothing: outputs that are no files, folders full of our names, no
home, streams that are closed, other threads."""

from __future__ import annotations

import json
import os
import resource
import shlex
import shutil
import stat
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from threadpoolctl import threadpool_info

import lightloc
import render
from lightloc.files import whole
from validation.jobs import write_bytes
from validation.suite import Cases, read_suite
from validation.suite.cases import Case

LIGHTLOC = Path(sys.executable).with_name("lightloc")
SCENES = Path(render.__file__).parents[1] / "scenes"
SMALL = ("--points", "32", "--transport", "direct")
OURS = ("render", "validation", "scenes", "lightloc", "numpy", "mitsuba", "drjit", "joblib")
THEIRS = ("random", "tempfile", "runpy", "pickle", "typing", "signal")  # what Python itself starts
ROW = """
[[case]]
name = "mine"
scene = "my/room.xml"
brdf = "diffuse"
claim = "The lights of the room beside the suite."
points = 256
position_percent = 0.1
intensity_percent = 0.5
"""


def with_whole(path: Path, content: bytes) -> None:
    with whole(path) as part:
        part.write_bytes(content)


WRITERS = {"whole": with_whole, "write_bytes": write_bytes}
Writer = Callable[[Path, bytes], Any]


@pytest.fixture(params=WRITERS)
def write(request) -> Writer:
    """Either of the two that write all our files."""
    return WRITERS[request.param]


def run(*arguments: Any, cwd: Path, **options: Any) -> subprocess.CompletedProcess[bytes]:
    command = [LIGHTLOC, *map(str, arguments)]
    streams = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "check": False}
    return subprocess.run(command, cwd=cwd, timeout=120, **{**streams, **options})


@contextmanager
def files_end_after(size: int) -> Iterator[None]:
    """As on a disk that is full."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def test_a_pipe_is_written_to(write, tmp_path):
    """What reads it gets all; it stays a pipe, and nothing is left beside it."""
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with ThreadPoolExecutor() as pool:
        got = pool.submit(pipe.read_bytes)
        write(pipe, b"all of it")
        assert got.result(10) == b"all of it"
    assert stat.S_ISFIFO(pipe.stat().st_mode)
    assert list(tmp_path.iterdir()) == [pipe]


def test_a_device_is_not_replaced(write, tmp_path):
    """As root, too: it stays the device that it was."""
    device = tmp_path / "null"
    try:
        os.mknod(device, 0o666 | stat.S_IFCHR, os.makedev(1, 3))
        device.open("wb").close()
    except OSError:
        pytest.skip("this user may make no device here")
    write(device, b"all of it")
    assert stat.S_ISCHR(device.stat().st_mode)


def test_a_link_stays_and_its_target_is_replaced(write, tmp_path):
    """Whether the target is there or not; a link to itself is refused by name."""
    (tmp_path / "there").mkdir()
    link, target = tmp_path / "link", tmp_path / "there" / "target"
    link.symlink_to(Path("there", "target"))
    for content in (b"once", b"again"):
        write(link, content)
        assert link.is_symlink() and target.read_bytes() == content
    loop = tmp_path / "loop"
    loop.symlink_to(loop)
    with pytest.raises(OSError) as error:
        write(loop, b"never")
    assert error.value.filename == str(loop) and loop.is_symlink()
    assert [file.name for file in target.parent.iterdir()] == ["target"]


def test_permissions_are_kept(write, tmp_path):
    """A new file has those that the user's mask leaves, one that is replaced those it had."""
    file = tmp_path / "file"
    before = os.umask(0o027)
    try:
        write(file, b"new")
        assert stat.S_IMODE(file.stat().st_mode) == 0o640
        file.chmod(0o604)
        write(file, b"replaced")
        assert stat.S_IMODE(file.stat().st_mode) == 0o604
    finally:
        os.umask(before)


def test_a_full_disk_leaves_what_was_there(write, tmp_path):
    """The error names the file; the control: less than the disk has is written."""
    file = tmp_path / "file"
    write(file, b"before")
    with files_end_after(1000):
        write(file, b"short")
        with pytest.raises(OSError) as error:
            write(file, b"long" * 1000)
    assert error.value.filename == str(file) and error.value.strerror
    assert file.read_bytes() == b"short" and list(tmp_path.iterdir()) == [file]


def test_any_name_that_a_file_may_have(write, tmp_path):
    """The longest, one with a line break, and one that is no UTF-8."""
    for name in (b"n" * 255, b"two\nlines.npz", b"\xff\xfe.npz"):
        file = tmp_path / os.fsdecode(name)
        write(file, name)
        assert file.read_bytes() == name
    with pytest.raises(OSError, match="too long"):
        write(tmp_path / ("n" * 256), b"never")


def test_writers_of_one_file_do_not_mix(write, tmp_path):
    """Threads that write at once: whoever reads, reads one of them whole."""
    file = tmp_path / "file"
    contents = [bytes([65 + i]) * 100_000 for i in range(3)]
    write(file, contents[0])
    with ThreadPoolExecutor() as pool:
        ends = [pool.submit(write, file, content) for content in contents * 20]
        while not all(end.done() for end in ends):
            assert file.read_bytes() in contents
        assert not [end.result() for end in ends if end.exception()]
    assert list(tmp_path.iterdir()) == [file]


def test_the_standard_output_is_an_output(tmp_path):
    """`-o /dev/stdout` gives the file alone, after what was there; our sentence goes elsewhere."""
    log = tmp_path / "log"
    log.write_bytes(b"before ")
    with log.open("ab") as stdout:
        done = run("render", "box_one", *SMALL, "-o", "/dev/stdout", cwd=tmp_path, stdout=stdout)
    assert done.returncode == 0 and b"32 observations of box_one" in done.stderr
    seen = tmp_path / "seen.npz"
    seen.write_bytes(log.read_bytes().removeprefix(b"before "))
    assert len(lightloc.Observations.load(seen)) == 32
    assert sorted(tmp_path.iterdir()) == [log, seen]


@pytest.fixture(scope="module")
def hostile(tmp_path_factory) -> Path:
    """A folder of the user's in which everything is called as something that we import."""
    folder = tmp_path_factory.mktemp("hostile")
    for name in OURS:
        (folder / name).mkdir()
        (folder / name / "__init__.py").write_text(f"raise SystemExit('{name} of the user')")
    for name in THEIRS:
        (folder / f"{name}.py").write_text(f"raise SystemExit('{name} of the user')")
    (folder / "my").mkdir()
    for decoy in ("standard", "box_one", "my/room.xml"):
        (folder / decoy).write_text("not what is meant")
    return folder


def test_doctor_in_a_folder_with_our_names(hostile):
    """Its child renders with the packages that are installed. The control: a child may go wrong."""
    done = run("doctor", cwd=hostile)
    assert done.returncode == 0 and b"works" in done.stdout, done.stdout
    plain = subprocess.run([sys.executable, "-c", "import random"], cwd=hostile, check=False)
    assert plain.returncode != 0


def test_a_suite_is_run_from_any_folder(hostile, tmp_path):
    """Scenes are found beside the suite, and what repeats a case does so from elsewhere."""
    folder = tmp_path / "a suite's"
    (folder / "my").mkdir(parents=True)
    shutil.copy(SCENES / "box_one.xml", folder / "my" / "room.xml")
    (folder / "suite.toml").write_text(ROW)
    suite = os.path.relpath(folder / "suite.toml", hostile)
    done = run("validate", "--suite", suite, "-o", tmp_path / "out", cwd=hostile)
    assert done.returncode == 0 and b"1 passed" in done.stdout, done.stderr
    result = json.loads((tmp_path / "out" / "cases" / "mine" / "result.json").read_text())
    assert result["scene"] == "my/room.xml"
    program, *arguments = shlex.split(result["command"])
    again = run(*arguments, "--dry-run", cwd=tmp_path)
    assert program == "lightloc" and again.stdout.startswith(b"mine ")


def test_scenes_of_two_suites_do_not_meet(tmp_path, monkeypatch):
    """One name in two folders is two files; a standard scene is one unless the suite has its own,
    whatever lies where the command runs."""
    monkeypatch.chdir(tmp_path)
    files = {}
    for name in ("one", "two"):
        folder = tmp_path / name
        folder.mkdir()
        for scene in ("room.xml", "box_two.xml", "box_one"):
            (tmp_path / scene).write_text("not what is meant")
        (folder / "room.xml").write_text(name)
        rows = (ROW.replace("mine", s).replace("my/room.xml", s) for s in ("room.xml", "box_one"))
        (folder / "suite.toml").write_text("".join(rows) + ROW.replace("my/room", "box_two"))
        files[name] = [case.scene_file.resolve() for case in read_suite(folder / "suite.toml")[1]]
        assert files[name][0] == folder / "room.xml"
        assert files[name][1:] == [SCENES / "box_one.xml", SCENES / "box_two.xml"]
    assert read_suite("standard")[0] == "standard"


def test_a_case_that_crashes_leaves_no_former_pictures(tmp_path):
    """What an earlier run of the case left is not shown as this one's."""

    def crash(case: Case, folder: Path, command: str) -> dict[str, Any]:
        raise ValueError("broken now")

    limits = {"position_percent": 1, "intensity_percent": 1}
    case = Case(name="a", scene="box_one", claim="A.", brdf="diffuse", **limits)
    cases = Cases([case], tmp_path, "own", crash)
    cases.folder("a").mkdir(parents=True)
    for former in ("room.npz", "view.npz", "result.json", "notes.txt"):
        (cases.folder("a") / former).touch()
    with pytest.raises(ValueError, match="broken now"):
        cases("a")
    assert [file.name for file in cases.folder("a").iterdir()] == ["notes.txt"]


def test_no_home_is_no_news(tmp_path):
    """Without a home that could keep kernels, the answer is the same and nothing is said."""
    own = {name: value for name, value in os.environ.items() if name != "DRJIT_CACHE_DIR"}
    temporary = tmp_path / "tmp"
    temporary.mkdir()
    env = {**own, "HOME": "", "TMPDIR": str(temporary)}
    done = run("render", "box_one", *SMALL, "-o", "s.npz", cwd=tmp_path, env=env)
    assert (done.returncode, done.stderr) == (0, b"")
    assert not list(temporary.iterdir())


def test_closed_streams_are_no_files(tmp_path):
    """No file takes the number of a stream that is closed, and nothing is printed into it."""
    script = "exec <&- >&- 2>&-; exec " + shlex.join([str(LIGHTLOC), "render", "box_one", *SMALL])
    done = subprocess.run(["sh", "-c", script], cwd=tmp_path, check=False)
    assert done.returncode == 0
    assert len(lightloc.Observations.load(tmp_path / "observations.npz")) == 32


def test_a_reader_that_leaves_is_no_error(tmp_path):
    """As `| head -1` does: quiet, with the shell's code. A full disk is one sentence."""
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, "wb") as stdout:
        done = run("validate", "--dry-run", cwd=tmp_path, stdout=stdout)
    assert (done.returncode, done.stderr) == (141, b"")
    with open("/dev/full", "wb") as stdout:
        done = run("validate", "--dry-run", cwd=tmp_path, stdout=stdout)
    assert (done.returncode, done.stderr) == (2, b"lightloc: No space left on device\n")


def test_few_letters_are_enough(tmp_path):
    """Where the output lacks a letter it is escaped: here one of a file's name."""
    env = {**os.environ, "PYTHONIOENCODING": "ascii"}
    done = run("report", "\u03b1 gone", cwd=tmp_path, env=env)
    assert done.returncode == 2 and done.stderr.startswith(b"lightloc: \\u03b1 gone/suite.json")


def rooms(folder: Path) -> list[Path]:
    """Two folders that hold other meshes by the same names."""
    pair = []
    for i, mesh in enumerate(("vase.ply", "torus.ply")):
        meshes = folder / str(i) / "meshes"
        shutil.copytree(SCENES / "meshes", meshes)
        shutil.copy(SCENES / "meshes" / mesh, meshes / "rounded_block.ply")
        pair.append(folder / str(i) / "furnished.xml")
        shutil.copy(SCENES / "furnished.xml", pair[-1])
    return pair


def test_threads_change_nothing(load, tmp_path):
    """Rooms loaded, observed, photographed and searched at once: the same to the bit."""
    room, pair = load("box_two"), rooms(tmp_path)
    seen = render.observe(room, points=64, seed=1, transport="direct")

    def searched() -> np.ndarray:
        return lightloc.localize(seen, room.geometry).lights.positions

    work: list[Callable[[], np.ndarray]] = [
        lambda: render.observe(room, points=64, spp=4, seed=1).radiance,
        lambda: render.photograph(room, spp=2, width=16).film,
        lambda: render.observe(render.load(pair[0]), points=64, spp=4).radiance,
        lambda: render.triangles(render.load(pair[1]))[0],
        searched,
    ]
    blas = {pool["filepath"]: pool["num_threads"] for pool in threadpool_info()}
    alone = [do() for do in work]
    assert not np.array_equal(alone[3], render.triangles(render.load(pair[0]))[0])  # the control
    together = threading.Barrier(2 * len(work))

    def begin(do: Callable[[], np.ndarray]) -> np.ndarray:
        together.wait(60)
        return do()

    with ThreadPoolExecutor(2 * len(work)) as pool:
        found = list(pool.map(begin, work * 2))
    for expected, got in zip(alone * 2, found, strict=True):
        np.testing.assert_array_equal(got, expected)
    assert {pool["filepath"]: pool["num_threads"] for pool in threadpool_info()} == blas
