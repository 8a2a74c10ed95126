"""Within the child: an input is taken in, and what was taken in is what its type promises.

``python -m fuzz.judge QUESTIONS ANSWERS SECONDS`` reads folders from the first file descriptor, a
line each, and writes an answer for each to the second.
"""

from __future__ import annotations

import contextlib
import faulthandler
import io
import json
import os
import re
import sys
import tempfile
import time
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np

from fuzz.inputs import RECIPE

LONGEST = 400  # characters of a refusal beside its paths
INNER = re.compile(r"\.cpp|\.h:\d|Traceback|0x[0-9a-f]{12}|<class '|object at")  # nobody's words
CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f\u2028\u2029]")
POINTS = 16


def scene(path: str, again: Path) -> None:
    """A scene: its lights, its files, and B at a few points of its surfaces."""
    import render

    room = render.load(path)
    assert np.isfinite(room.lights.positions).all() and (room.lights.intensities >= 0).all()
    assert np.isfinite(room.bounds).all(), f"bounds {room.bounds.tolist()}"
    assert Path(path) in render.files_of(path)
    q = render.observe(room, points=POINTS, spp=2, transport="direct")
    assert len(q) == POINTS
    observed(q, again)
    render.observe(room, points=POINTS, spp=2)


def observed(q: Any, again: Path) -> None:
    """Observations: finite, of unit vectors, and the same after a round through a file."""
    from lightloc import Observations

    assert np.isfinite(q.positions).all() and np.isfinite(q.radiance).all()
    for name in ("normals", "directions", "facets"):
        np.testing.assert_allclose(np.linalg.norm(getattr(q, name), axis=1), 1, atol=1e-6)
    q.save(again / "whole.npz")
    same(Observations.load(again / "whole.npz"), q)


def same(a: Any, b: Any) -> None:
    """Of two values with the same fields, all are equal."""
    for name, value in vars(a).items():
        if isinstance(value, np.ndarray):
            if value.dtype.kind == "f":  # unit vectors are made so again, which rounds
                np.testing.assert_allclose(value, getattr(b, name), rtol=1e-14, err_msg=name)
            else:
                np.testing.assert_array_equal(value, getattr(b, name), name)
        elif isinstance(value, (str, float, bool, tuple)) and not name.startswith("_"):
            assert repr(value) == repr(getattr(b, name)), name


def observations(path: str, again: Path) -> None:
    from lightloc import Observations

    observed(Observations.load(path), again)


def answer(path: str, again: Path) -> None:
    """What `Localization.save` wrote."""
    from lightloc import Localization

    found = Localization.load(path)
    str(found)
    json.dumps(found.to_dict(), allow_nan=False)
    found.save(again / "whole.npz")
    same(Localization.load(again / "whole.npz"), found)


def view(path: str, again: Path) -> None:
    """A camera's view, and the observations that its pixels are."""
    import render

    seen = render.read_exr(path)
    render.write_exr(seen, again / "whole.exr")
    assert render.read_exr(again / "whole.exr") == seen
    observed(render.observe_view(path), again)


def lights(path: str, again: Path) -> None:
    from lightloc import PointLights
    from validation.judge import compare

    found = PointLights.load(path)
    assert np.isfinite(found.positions).all() and not (found.intensities < 0).any()
    found.save(again / "whole.json")
    same(PointLights.load(again / "whole.json"), found)
    str(compare(found, found))


def readings(path: str, again: Path) -> None:
    """A light meter's table."""
    from lightloc import read_readings

    observed(read_readings(path, albedo=0.5), again)


def picture(path: str, again: Path) -> None:
    """A picture with layers, and the observations that its pixels are."""
    import render

    said = str(render.read_picture(path))
    assert "\n" not in said
    observed(render.observe_picture(path, camera=[2, 1.5, 1]), again)


def suite(path: str, again: Path) -> None:
    """A suite: each case is one that JSON can hold."""
    from validation.suite import read_suite

    name, cases = read_suite(path)
    assert isinstance(name, str) and cases
    for case in cases:
        said = case.model_dump_json()
        assert type(case).model_validate_json(said).model_dump_json() == said


def results(path: str, again: Path) -> None:
    """A JSON file of results."""
    from validation.jobs import read_json

    json.dumps(read_json(Path(path)), allow_nan=False)


READERS: dict[str, Callable[[str, Path], None]] = {
    each.__name__: each
    for each in (
        *(scene, observations, readings, answer, view, picture),
        *(lights, suite, results),
    )
}
"""By the kind of input. A new format needs its reader here and its inputs in `fuzz.kinds`."""


def command(arguments: list[str], folder: Path) -> tuple[str, str]:
    """The command line within a folder: 0 or 1, or 2 and one sentence."""
    from validation.cli import main

    out, err = io.StringIO(), io.StringIO()
    streams = contextlib.redirect_stdout(out), contextlib.redirect_stderr(err)
    argv = mock.patch.object(sys, "argv", ["lightloc", *arguments])
    with contextlib.chdir(folder), streams[0], streams[1], argv:
        try:
            main()
        except SystemExit as ended:
            code = ended.code or 0
    if code != 2:
        return ("loaded", "") if code in (0, 1, 3) else ("exit code", str(code))
    return refusal(err.getvalue().removesuffix("\n"), "lightloc: ")


def refusal(said: str, name: str) -> tuple[str, str]:
    """Whether it is one sentence, and says which file."""
    if name not in said:
        return "nameless", said
    rest = said.replace(name, "")  # a name may hold anything
    plain = len(rest.splitlines()) <= 1 and not CONTROL.search(rest) and not INNER.search(rest)
    short = sum(len(word) for word in rest.split() if "/" not in word) <= LONGEST
    return ("refused" if plain and short else "message"), said


def planted(how: str, path: str) -> None:
    """Faults on purpose: each must be seen."""
    if how == "traceback":
        [][0]
    elif how == "wrong":
        raise AssertionError("not what was written")
    elif how == "lines":
        raise ValueError(f"{path}: nothing\nnowhere")
    elif how == "nameless":
        raise ValueError("no such file")
    elif how == "crash":
        os.abort()
    elif how == "memory":
        keep = []
        while True:
            keep.append(np.ones(1 << 22))
    elif how == "hang":
        while True:
            time.sleep(1)


def judged(folder: Path) -> tuple[str, str]:
    """What becomes of an input, and what was said."""
    recipe = json.loads((folder / RECIPE).read_text())
    kind, arguments = recipe["kind"], [a.replace("{}", str(folder)) for a in recipe["arguments"]]
    path = str(folder / recipe["files"][0]) if recipe["files"] else arguments[0]
    with tempfile.TemporaryDirectory() as again:
        try:
            if kind == "command":
                return command(arguments, folder)
            if kind == "planted":
                planted(arguments[0], path)
            else:
                READERS[kind](path, Path(again))
            return "loaded", ""
        except AssertionError:
            return "wrong", traceback.format_exc()
        except ValueError as error:
            said = str(error)
            what, said = refusal(said, path if path in said else str(Path(path)))
            return what, said if what == "refused" else f"{said}\n{traceback.format_exc()}"
        except BaseException as error:
            return f"traceback ({type(error).__name__})", traceback.format_exc()[-20_000:]


def main() -> None:
    import lightloc  # noqa: F401 - before mitsuba
    import render  # noqa: F401

    questions, answers = os.fdopen(int(sys.argv[1])), os.fdopen(int(sys.argv[2]), "w")
    seconds = float(sys.argv[3])

    def answered(what: str, said: str) -> None:
        answers.write(json.dumps({"what": what, "said": said}) + "\n")
        answers.flush()

    answered("ready", "")
    before = dict(os.environ)
    for line in questions:
        faulthandler.dump_traceback_later(0.9 * seconds)
        what, said = judged(Path(line.rstrip("\n")))
        faulthandler.cancel_dump_traceback_later()
        os.environ.clear()
        os.environ.update(before)
        answered(what, said)


if __name__ == "__main__":
    main()
