"""The book in docs/: it builds without a warning, opens without a network, and shows what is."""

from __future__ import annotations

import importlib
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest

import lightloc
import render
import validation

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PACKAGES = {"lightloc": lightloc, "render": render, "validation": validation}
LOADS = re.compile(
    r"<(?:script|img|iframe|source|use)\b[^>]*?(?:src|href)\s*=\s*[\"']?((?:https?:)?//[^\"'\s>]+)"
    r"|<link\b[^>]*?href\s*=\s*[\"']?((?:https?:)?//[^\"'\s>]+)"
    r"|(?:url\(|@import)\s*[\"']?((?:https?:)?//[^\"')\s;]+)",
    re.IGNORECASE,
)
PATHS = re.compile(r'<path class="arrow[^>]*data-from="(\w+)" data-to="(\w+)"')


def built(source: Path, out: Path) -> subprocess.CompletedProcess[str]:
    """What `make docs` runs, into a folder of its own; the gallery's scripts run in any case."""
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html"]
    command += ["-D", "sphinx_gallery_conf.run_stale_examples=True"]
    return subprocess.run(
        [*command, source, out], cwd=ROOT, capture_output=True, text=True, timeout=300
    )


def loads(text: str) -> list[str]:
    """What a page or a style sheet fetches from another host; links that are clicked do not."""
    return ["".join(found) for found in LOADS.findall(text)]


def upward(floors: tuple[tuple[str, ...], ...], arrows: list[tuple[str, str]]) -> list:
    """Arrows that lead to no lower floor."""
    row = {room: i for i, floor in enumerate(floors) for room in floor}
    return [(a, b) for a, b in arrows if row[b] <= row[a]]


@pytest.fixture(scope="module")
def book(tmp_path_factory) -> Path:
    """The book as HTML."""
    out = tmp_path_factory.mktemp("book")
    done = built(DOCS, out)
    assert done.returncode == 0, done.stderr
    return out


@pytest.fixture
def rooms(monkeypatch) -> Iterator[ModuleType]:
    """docs/rooms.py, which reads what the picture shows."""
    kept = {name: sys.modules.pop(name, None) for name in ("rooms", "drawing")}
    monkeypatch.syspath_prepend(str(DOCS))
    yield importlib.import_module("rooms")
    for name, module in kept.items():
        del sys.modules[name]
        if module is not None:
            sys.modules[name] = module


@pytest.mark.parametrize("name", ["names", "rooms"])
def test_docstring_examples(name):
    """What makes the book has examples too."""
    done = subprocess.run(
        [sys.executable, "-m", "doctest", DOCS / f"{name}.py"], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert ">>> " in (DOCS / f"{name}.py").read_text()


def test_a_warning_ends_the_build(tmp_path):
    """Negative control: a page that leads nowhere is noticed."""
    for file in DOCS.glob("*.py"):
        shutil.copy(file, tmp_path)
    shutil.copytree(DOCS / "_static", tmp_path / "_static")
    (tmp_path / "gallery").mkdir()
    shutil.copy(DOCS / "gallery" / "GALLERY_HEADER.rst", tmp_path / "gallery")
    (tmp_path / "index.md").write_text("# Index\n\n[gone](gone.md)\n")
    done = built(tmp_path, tmp_path / "_build")
    assert done.returncode != 0
    assert "gone" in done.stderr


@pytest.mark.parametrize("script", sorted((DOCS / "gallery").glob("*.py")), ids=lambda s: s.stem)
def test_a_script_of_the_gallery_makes_a_picture(book, script):
    """Each has a page with what it draws, and no other file to download than itself."""
    page = (book / "drawn" / f"{script.stem}.html").read_text()
    assert "sphx-glr-single-img" in page
    assert f"{script.name}</span>" in page
    assert not re.search(r"\.zip|\.ipynb|binder\.org|running time", page)


@pytest.mark.parametrize("package", PACKAGES)
def test_public_names_are_in_the_reference(book, package):
    """Each has its place, and lightloc's are in the order of its `__all__`."""
    page = (book / "api.html").read_text()
    placed = re.findall(rf'id="{package}\.(\w+)"', page)
    assert sorted(placed) == sorted(PACKAGES[package].__all__)
    if package == "lightloc":
        assert placed == lightloc.__all__


def test_names_in_pages_are_links(book):
    """A public name in code type leads to the reference; what is not public does not."""
    page = (book / "method.html").read_text()
    assert 'href="api.html#lightloc.intensity_distance"' in page
    assert 'href="api.html#render.interreflected"' in page
    assert "visible_about" in page
    assert "#lightloc.visible_about" not in page


def test_equations_have_the_papers_numbers(book):
    """Eq. 1 to 8 in order, each drawn, and none cut short by what draws them."""
    page = (book / "method.html").read_text()
    numbers = re.findall(r'<div class="equation" id="equation-eq-(\d)">.*?\((\d)\)</span>', page)
    assert numbers == [(str(n), str(n)) for n in range(1, 9)]
    assert page.count('<svg class="formula"') > 50


def test_the_picture_shows_the_house(book, rooms):
    """Every room is on the floor of the contract, every import is an arrow, and all lead down."""
    page = (book / "architecture.html").read_text()
    shown, arrows = re.findall(r'data-room="(\w+)"', page), PATHS.findall(page)
    folder = ROOT / "lightloc"
    files = {path.stem for path in folder.glob("*.py")} - {"__init__"}
    assert sorted(shown) == sorted(files | {path.parent.name for path in folder.glob("*/*.py")})
    house = rooms.House.read()
    assert sorted(arrows) == sorted(house.arrows)
    assert ("localize", "search") in arrows
    assert ("search", "backend") not in arrows
    assert not upward(house.floors, arrows)


def test_an_arrow_upwards_is_seen(rooms):
    """Negative control: the house upside down, and two rooms of one floor."""
    house = rooms.House.read()
    assert len(upward(house.floors[::-1], list(house.arrows))) == len(house.arrows)
    assert upward(house.floors, [("search", "paper")]) == [("search", "paper")]


def test_nothing_is_fetched_from_another_host(book):
    """No script, style, font or picture: the book opens from disk, on a machine of its own."""
    files = [path for kind in ("html", "css") for path in book.rglob(f"*.{kind}")]
    assert len(files) > 20
    assert not {str(path): found for path in files if (found := loads(path.read_text()))}
    assert not list(book.rglob("*mathjax*"))


@pytest.mark.parametrize(
    "text",
    [
        '<script async="async" src="https://cdn.example/mathjax.js"></script>',
        "<link rel='stylesheet' href='//fonts.example/css'>",
        '<img alt="" src=http://example/a.png>',
        "@font-face { src: url(https://fonts.example/a.woff2) }",
        '@import "https://example/a.css";',
    ],
)
def test_a_fetch_is_seen(text):
    """Negative control; a link to follow is none."""
    assert len(loads(text)) == 1
    assert not loads(f'<a href="https://example">{text[:0]}</a>')
