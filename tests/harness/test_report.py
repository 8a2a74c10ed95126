"""The report: every page complete, every link alive, nothing fetched, nothing trusted."""

import csv
import json
import math
import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from urllib.parse import unquote
from xml.etree import ElementTree

import numpy as np
import pytest

from validation.report import write

HOSTILE = "</script><script>alert('x')</script> & <b>"
STRANGE = "a b%20#?<i>&'\""  # a folder's name may hold all of these
CONDITIONS = [("direct", 0.0), ("direct", 0.01), ("direct", 0.05), ("full", 0.0)]
BOX = np.array([[x, y, z] for x in (0, 4) for y in (0, 5) for z in (0, 3)], dtype=float)
QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
FACES = np.array([t for a, b, c, d in QUADS for t in ((a, b, c), (a, c, d))])


def a_result(name: str, outcome: str = "passed", **changes: Any) -> dict[str, Any]:
    result = {
        **{"schema": 1, "name": name, "scene": "box_one", "claim": f"{name} is found."},
        **{"brdf": "diffuse", "alpha": None, "transport": "direct", "noise": 0.0, "gated": True},
        **{"outcome": outcome, "why": [], "command": f"lightloc validate --case {name}"},
        "made": {"date": "2026-11-22T17:00:00Z", "commit": None, "versions": {"lightloc": "0.1.0"}},
    }
    if outcome == "crashed":
        return {**result, **changes}
    true = [{"position": [1, 2, z], "intensity": [10.0]} for z in (1.5, 2.9)]
    found = {**true[0], "bound": [10], "position_error": [0.001] * 3, "intensity_error": [None]}
    comparison = {
        **{"count_true": 2, "count_found": 1, "count_right": False, "precision": 1.0},
        **{"recall": 0.5, "missed": [1], "ghosts": [], "worst_position_percent": 0.014},
        "pairs": [{"true": 0, "found": 0, "distance": 0.001, "distance_percent": 0.014}],
        "worst_intensity_percent": None,
    }
    history = [{"step": "add", "lights": i, "chi2": 10.0**-i, "detail": "a peak"} for i in (1, 2)]
    return {
        **result,
        **{"points": 64, "spp": 4, "seed": 1, "parameters": {}, "diagonal": 7.07, "peak_mb": 70},
        "limits": {"position_percent": 0.1, "intensity_percent": 0.5, "radius_percent": 5.0},
        **{"lights": {"true": true, "found": [found]}, "comparison": comparison, "rerender": None},
        "search": {
            "reason": "converged",
            "history": history,
            "chi2_per_dof": math.nan,
            "remarks": ["Noise, estimated: 0.9 % of B.", HOSTILE],
        },
        "seconds": {"load": 0.5, "total": 2.5},
        **changes,
    }


def save_arrays(folder: Path) -> None:
    rng = np.random.default_rng(0)
    points, light, z = rng.uniform(0, 3, (64, 3)), rng.uniform(0, 1, (64, 3)), rng.normal(size=64)
    light[0], z[0] = 0, np.nan
    room = {"vertices": BOX, "faces": FACES, "points": points, "radiance": light, "residual": z}
    np.savez(folder / "room.npz", **room)
    D, L = rng.uniform(1, 9, (6, 5)), rng.integers(0, 64, (6, 5))
    D[0, 0], D[0, 1], D[0, 2] = np.inf, np.nan, 0
    fields = {"D": D, "L": L, "limiter": points[L], "V": L % 7, "height": 1.5}
    np.savez(folder / "fields.npz", **fields, extent=np.array([0.0, 4.0, 0.0, 5.0]))
    view = rng.uniform(0, 2, (6, 8, 3)).astype(np.float32)
    view[0, 0] = np.nan
    np.savez(folder / "view.npz", rendered=view, rerendered=view * 1.01)
    (folder / "view.exr").write_bytes(b"")


def save_run(out: Path, results: list[dict[str, Any]]) -> Path:
    counts = {kind: 0 for kind in ("failed", "passed", "shown", "crashed")}
    for result in results:
        folder = out / "cases" / result["name"]
        folder.mkdir(parents=True)
        (folder / "result.json").write_text(json.dumps(result))
        counts[result["outcome"]] += 1
        if result["outcome"] != "crashed":
            save_arrays(folder)
    names = [result["name"] for result in results]
    suite = {"schema": 1, "suite": "standard", "seconds": 9.0, "peak_mb": 70, "cases": names}
    (out / "suite.json").write_text(json.dumps({**suite, "started": "", **counts}))
    return out


@pytest.fixture
def run(tmp_path: Path) -> Path:
    results = [
        a_result(f"{scene}-{transport}-{noise}", scene=scene, transport=transport, noise=noise)
        for scene in ("box_one", "box_two")
        for transport, noise in CONDITIONS
    ]
    results[5] = a_result("lost", "failed", why=["A light was missed.", HOSTILE])
    hostile = {"claim": HOSTILE, "scene": HOSTILE, "parameters": {HOSTILE: HOSTILE}}
    dead = ["\x1b[31mLLVM ERROR\x1b[0m \x00 fminimum", HOSTILE]
    results += [a_result(STRANGE, "shown", **hostile), a_result("dead", "crashed", why=dead)]
    return save_run(tmp_path, results)


class Page(HTMLParser):
    """The links, loads, tags and words of a page."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.links: list[str] = []
        self.tags: list[str] = []
        self.outcomes: list[str] = []
        self.text = path.read_text(encoding="utf-8")
        self.feed(self.text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        for name, value in attrs:
            if name in ("href", "src", "xlink:href"):
                self.links.append(value or "")
            if name == "data-outcome":
                self.outcomes.append(value or "")


def pages(out: Path) -> list[Path]:
    return [out / "index.html", *sorted(out.glob("cases/*/index.html"))]


FIGURE = r'<script type="application/json" data-figure="([^"]+)">(.*?)</script>'
FIGURES = {"room", "slice-D", "slice-L", "slice-V", "curve"}


def figures(path: Path) -> dict[str, Any]:
    """The Plotly figures of a page; JSON without NaN, which browsers refuse."""

    def refuse(constant: str) -> None:
        raise AssertionError(f"{path} has {constant}")

    found = re.findall(FIGURE, path.read_text(encoding="utf-8"))
    for name, _ in found:
        assert f'id="{name}"' in path.read_text(encoding="utf-8")
    return {name: json.loads(text, parse_constant=refuse) for name, text in found}


def test_figures_are_of_this_page_alone_and_upload_nothing(run: Path) -> None:
    write(run)
    for path in pages(run):
        for name, figure in figures(path).items():
            text = json.dumps(figure)
            assert not re.search(r"(?i)https?:|uid", re.sub(r'"[^"]{200,}"', "", text)), name
            config = figure["config"]
            assert config["plotlyServerURL"] == "" and config["responsive"]
            assert not {"sendDataToCloud", "editInChartStudio"} & set(*config["modeBarButtons"])


def test_lights_near_the_slice_are_drawn_on_it(run: Path) -> None:
    """Of two true lights one lies in the slice at 1.5 m, with the found one; one 1.4 m above."""
    write(run)
    page = run / "cases/box_one-direct-0.0/index.html"
    drawn = figures(page)
    for name in FIGURES - {"room", "curve"}:
        named = {t["name"]: t for t in drawn[name]["data"] if "hovertext" in t}
        assert {k: (t["x"], t["y"]) for k, t in named.items()} == dict.fromkeys(
            ("true", "found"), ([1], [2])
        )
    assert "1 true or found lie farther off" in page.read_text()
    kinds = {t["name"] for t in drawn["room"]["data"] if "hovertext" in t}
    assert kinds == {"true", "found", "missed"}


def test_every_link_leads_to_a_file_and_nothing_is_fetched(run: Path) -> None:
    assert write(run) == run / "index.html"
    assert len(pages(run)) == 11
    for path in pages(run):
        for link in Page(path).links:
            assert not re.match(r"(?i)(https?:)?//", link), f"{path} loads {link}"
            if not link.startswith("data:"):
                assert (path.parent / unquote(link)).is_file(), f"{path} links to {link}"
    for asset in ("style.css", "report.js", "figures.js"):
        assert "//" not in re.sub(r"(?m)(^|\s)//.*$", "", (run / "assets" / asset).read_text())
    assert [path.parent.name for path in run.rglob("plotly.min.js")] == ["assets"]


def test_failed_cases_come_first(run: Path) -> None:
    outcomes = Page(write(run)).outcomes
    assert outcomes[:3] == ["failed", "crashed", "shown"]
    assert set(outcomes[3:]) == {"passed"} and len(outcomes) == 10


def test_what_a_case_says_is_text_and_never_markup(run: Path) -> None:
    write(run)
    for path in pages(run):
        page = Page(path)
        assert "alert" not in "".join(re.findall(r"<script[^>]*>(.*?)</script>", page.text, re.S))
        assert "</script><script>alert" not in page.text
        assert page.tags.count("html") == page.tags.count("body") == 1
        if "dead" not in str(path) and "cases" in str(path):
            assert "Noise, estimated: 0.9 % of B." in page.text
    dead = (run / "cases/dead/index.html").read_text()
    assert "LLVM ERROR" in dead and "\x1b" not in dead and "\x00" not in dead


def test_a_crashed_case_has_a_page_without_pictures(run: Path) -> None:
    write(run)
    page = Page(run / "cases/dead/index.html")
    assert "this case left no room.npz" in page.text and "img" not in page.tags
    assert "process died" in page.text and "plotly" not in page.text


@pytest.mark.parametrize("content", [None, b"", b"PK\x03\x04 torn"])
@pytest.mark.parametrize("file", ["room.npz", "fields.npz", "view.npz"])
def test_a_missing_or_broken_picture_is_said_and_the_rest_drawn(
    tmp_path: Path, file: str, content: bytes | None
) -> None:
    run = save_run(tmp_path, [a_result("one")])
    damaged = run / "cases/one" / file
    damaged.unlink() if content is None else damaged.write_bytes(content)
    write(run)
    text = (run / "cases/one/index.html").read_text()
    assert f"{file} is broken" in text or f"this case left no {file}" in text
    assert text.count("There is no picture") == 1


def test_numbers_that_are_not_finite_are_dashes(run: Path) -> None:
    text = (write(run).parent / "cases/box_one-full-0.0/index.html").read_text()
    said = re.sub(FIGURE, "", text)
    assert "NaN" not in said and ">nan" not in said and "None" not in said
    assert set(figures(run / "cases/box_one-full-0.0/index.html")) == FIGURES
    merged = (run / "report.json").read_text()
    assert "NaN" not in merged and json.loads(merged)["cases"][0]["search"]["chi2_per_dof"] is None


def test_other_programs_read_the_same_results(run: Path) -> None:
    write(run)
    merged = json.loads((run / "report.json").read_text())
    assert merged["schema"] == 1 and len(merged["cases"]) == 10
    with (run / "report.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["name"] for row in rows] == merged["suite"]["cases"]
    assert rows[0]["worst_position_percent"] == "0.014" and rows[0]["seconds"] == "2.5"
    suite = ElementTree.parse(run / "junit.xml").getroot()
    assert (suite.get("tests"), suite.get("failures"), suite.get("errors")) == ("10", "1", "1")
    kinds = {case.get("name"): [part.tag for part in case] for case in suite}
    assert kinds["lost"] == ["failure"] and kinds["dead"] == ["error"]
    assert kinds[STRANGE] == ["system-out"] and kinds["box_one-direct-0.0"] == []


def test_drawn_again_the_report_is_the_same(run: Path) -> None:
    def content() -> dict[Path, bytes]:
        return {path: path.read_bytes() for path in run.rglob("*") if path.is_file()}

    write(run)
    first = content()
    write(run)
    assert content() == first and not [path for path in first if path.suffix == ".part"]


WRONG = [("[1", "not valid JSON"), ("[]", "no JSON object"), ('{"schema": 2}', "schema 2")]
WRONG += [('{"schema": 1}', "broken at"), (json.dumps(a_result("other")), "another case")]
WRONG += [(json.dumps({**a_result("one"), "lights": {"true": [], "found": []}}), "does not list")]
WRONG += [(json.dumps({**a_result("one"), "lights": None}), "did not crash"), (None, "missing")]


@pytest.mark.parametrize(("content", "said"), WRONG)
def test_a_broken_result_is_named_in_one_sentence(
    tmp_path: Path, content: str | None, said: str
) -> None:
    path = save_run(tmp_path, [a_result("one")]) / "cases/one/result.json"
    path.unlink() if content is None else path.write_text(content)
    with pytest.raises(ValueError, match=said) as caught:
        write(tmp_path)
    assert str(path) in str(caught.value) and "\n" not in str(caught.value)


@pytest.mark.parametrize("names", [["../one"], ["one", "one"], [""], [3], None])
def test_a_missing_suite_or_impossible_names_are_refused(tmp_path: Path, names: Any) -> None:
    path = save_run(tmp_path, [a_result("one")]) / "suite.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), "cases": names}))
    with pytest.raises(ValueError, match=r"suite\.json is broken|suite\.json names"):
        write(tmp_path)
    path.unlink()
    with pytest.raises(ValueError, match=r"suite\.json is missing"):
        write(tmp_path)


def test_the_report_needs_no_renderer(run: Path) -> None:
    block = "import sys; sys.modules.update(dict.fromkeys(('mitsuba','drjit','lightloc','render')))"
    draw = "from pathlib import Path; from validation.report import write; write(Path(sys.argv[1]))"
    subprocess.run([sys.executable, "-c", f"{block}; {draw}", str(run)], check=True)
