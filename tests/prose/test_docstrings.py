"""Docstrings in NumPy's style: what a public name takes, returns and raises, and an example.

numpydoc's own checks say whether sections are there, complete and in order. What it can't know is
checked here: that arrays have a shape, and lengths and light a unit; that what is raised is named,
and the paper's equation; that an example runs where a reader pastes it, with nothing imported.
"""

from __future__ import annotations

import ast
import doctest
import importlib
import inspect
import re
import textwrap
from collections.abc import Iterator
from enum import Enum
from pathlib import Path
from types import FunctionType
from typing import Any

import pytest
from numpydoc.docscrape import get_doc_object
from numpydoc.validate import validate
from test_prose import FLAGS, METHOD, PACKAGES, ROOT, symbols

from lightloc import BRDF, Geometry, Interreflecting, OtherwiseLit, PointLights, Surface
from lightloc.brdf import Bounded, Sloped
from render import triangles

NOT_ASKED = {
    "ES01": "an extended summary, where a sentence says it all",
    "SA01": "a list of what to see also",
    "SS05": "a verb first: what returns a quantity may begin with its name",
}
"""numpydoc's codes that are not asked for."""

OF_A_SENTENCE = {"GL01", "GL02", "GL03", "GL05", "GL08", "SS01", "SS02", "SS03", "SS04", "SS06"}
"""Those that are asked of a property."""

OF_A_CALL = {"PR01", "PR02", "PR03"}
"""Those that are not asked of a class that nobody calls."""

LENGTHS = ("position", "positions", "bounds", "step", "blur", "diagonal", "reach")
UNITS = dict.fromkeys(LENGTHS, r"metres|unit of length") | {
    "intensities": r"W/sr",
    "radiance": r"W sr\^-1 m\^-2",
    "step": r"metres|unit of length|W sr\^-1 m\^-2",  # of a difference, or between quantized values
}
"""What belongs to a parameter of this name."""

CHECKS = {"array", "numbers", "unit_vectors", "in_plane", "check_radiance", "check_length"}
"""Functions that refuse a value with a ValueError."""

GOOGLE = re.compile(r"^ *(?:(?:Keyword )?Args|Arguments|Returns|Raises|Yields|Attributes):$", re.M)
EXAMPLES = re.compile(r"^ *Examples\n *-{8}$", re.M)
SHAPE = re.compile(r"\((?:\w[\w*+/ ]*|\.\.\.)(?:,[^()]*)?\)|\bshape\b")
PLACE = re.compile(r"eq\. \d(?: and \d)?|section \d\.\d|footnote \d")
OURS = tuple(package.__name__ for package in PACKAGES)


def function_of(thing: Any) -> Any:
    """The function behind a method or a property; None where there is none."""
    found = thing.fget if isinstance(thing, property) else getattr(thing, "__func__", thing)
    return found if isinstance(found, FunctionType) else None


def is_ours(thing: Any) -> bool:
    """Whether it is a function of a file of ours, and none that `dataclass` made."""
    code = getattr(thing, "__code__", None)
    return bool(code and thing.__module__.startswith(OURS) and Path(code.co_filename).is_file())


def members(thing: type) -> Iterator[tuple[str, Any]]:
    """The public methods and properties of a class."""
    for name in dir(thing):
        value = inspect.getattr_static(thing, name)
        if not name.startswith("_") and is_ours(function_of(value)):
            yield name, value if isinstance(value, property) else getattr(thing, name)


PROTOCOLS = (BRDF, Bounded, Sloped, Geometry, Interreflecting, OtherwiseLit, Surface)


def is_asked_for(thing: type, name: str) -> bool:
    """Whether a protocol, which says all of it, asks for a method of a class that fulfils it."""
    return any(
        protocol is not thing
        and name in dict(members(protocol))
        and {member for member, _ in members(protocol)}
        <= {*dir(thing), *getattr(thing, "__dataclass_fields__", ())}
        for protocol in PROTOCOLS
    )


def public() -> dict[str, Any]:
    """All public names, and the public methods and properties of the classes among them."""
    found = {f"lightloc.brdf.{protocol.__name__}": protocol for protocol in (Bounded, Sloped)}
    for package in PACKAGES:
        for name in package.__all__:
            thing, full = getattr(package, name), f"{package.__name__}.{name}"
            found[full] = thing
            if isinstance(thing, type) and not issubclass(thing, Enum):
                found |= {f"{full}.{member}": value for member, value in members(thing)}
    return found


PUBLIC = public()


def in_a_sentence(name: str) -> bool:
    """Whether a sentence does: of a property, and of what a protocol says all of."""
    owner, _, member = name.rpartition(".")
    of = PUBLIC.get(owner)
    asked = isinstance(of, type) and is_asked_for(of, member)
    return isinstance(PUBLIC[name], property) or asked


IN_SECTIONS = {name: thing for name, thing in PUBLIC.items() if not in_a_sentence(name)}


def faults(thing: Any, sentence: bool = False) -> list[str]:
    """What numpydoc finds wrong with a docstring, of what is asked for."""
    ignored = set(NOT_ASKED)
    if isinstance(thing, type) and (issubclass(thing, Enum) or getattr(thing, "_is_protocol", 0)):
        ignored |= OF_A_CALL
    errors = validate(get_doc_object(thing))["errors"]
    if sentence:
        errors = [(code, said) for code, said in errors if code in OF_A_SENTENCE]
    return [f"{code}: {said}" for code, said in errors if code not in ignored]


def annotations(thing: Any) -> dict[str, str]:
    """Of each parameter, and of what is returned."""
    function = function_of(thing.__init__ if isinstance(thing, type) else thing)
    found = {name: str(note) for name, note in inspect.get_annotations(function).items()}
    return {n: note for n, note in found.items() if n != "return" or not isinstance(thing, type)}


def is_array(annotation: str) -> bool:
    return "NDArray" in annotation or "ArrayLike" in annotation or "np.ndarray" in annotation


def sections(thing: Any) -> dict[str, str]:
    """What a docstring says of each parameter, and of what is returned."""
    doc, said = get_doc_object(thing), {}
    for row in doc["Parameters"]:
        for name in row.name.replace("*", "").split(","):
            said[name.strip()] = " ".join([row.type, *row.desc])
    said["return"] = " ".join(" ".join([row.name, row.type, *row.desc]) for row in doc["Returns"])
    return said


def without_shape(thing: Any) -> list[str]:
    """The arrays that come in or out of which no shape is said."""
    arrays = [name for name, note in annotations(thing).items() if is_array(note)]
    doc = thing.__doc__ or ""
    said = {"return": doc} if isinstance(thing, property) else sections(thing)
    return [name for name in arrays if not SHAPE.search(said.get(name, ""))]


def without_unit(thing: Any) -> list[str]:
    """The parameters whose name has a unit that is not said."""
    said = sections(thing)
    named = [(name, unit) for name, unit in UNITS.items() if name in said]
    return [name for name, unit in named if not re.search(unit, said[name])]


def raised(thing: Any) -> set[str]:
    """The errors that a function's own lines raise; of a class, those that check its values."""
    if isinstance(thing, type):
        made = (vars(thing).get(name) for name in ("__init__", "__post_init__"))
        return set().union(*(raised(one) for one in made if is_ours(one)))
    found = set()
    for node in ast.walk(ast.parse(textwrap.dedent(inspect.getsource(thing)))):
        if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call):
            found.add(ast.unparse(node.exc.func))
        called = ast.unparse(node.func) if isinstance(node, ast.Call) else ""
        if called != "np.array" and called.rpartition(".")[2] in CHECKS:
            found.add("ValueError")
    return found


def unnamed(thing: Any) -> set[str]:
    """The errors that it raises and does not name."""
    return raised(thing) - {row.type for row in get_doc_object(thing)["Raises"]}


def failures(thing: Any) -> int | None:
    """How many examples fail in an empty namespace; None where there is no example."""
    test = doctest.DocTestParser().get_doctest(inspect.getdoc(thing) or "", {}, "", None, 0)
    if not test.examples:
        return None
    runner = doctest.DocTestRunner(verbose=False, optionflags=FLAGS)
    return runner.run(test).failed


def out_of_style(text: str) -> list[str]:
    """The docstrings of a file with Google's sections, or with examples under no heading."""
    wrong = []
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            doc = ast.get_docstring(node) or ""
            if GOOGLE.search(doc) or (">>> " in doc and not EXAMPLES.search(doc)):
                wrong.append(node.name)
    return wrong


FILES = [file for top in (*OURS, "docs", "tests") for file in sorted((ROOT / top).rglob("*.py"))]


def offered() -> dict[str, Any]:
    """The functions at the doors of rooms."""
    found = {}
    for package in OURS:
        for door in sorted((ROOT / package).glob("*/__init__.py")):
            room = importlib.import_module(f"{package}.{door.parent.name}")
            things = ((name, getattr(room, name)) for name in getattr(room, "__all__", ()))
            found |= {f"{room.__name__}.{name}": one for name, one in things if is_ours(one)}
    return found


OFFERED = offered()


@pytest.mark.parametrize("name", PUBLIC)
def test_numpydoc_finds_no_fault(name):
    """Sections are there, complete and in order."""
    assert not faults(PUBLIC[name], sentence=in_a_sentence(name))


@pytest.mark.parametrize("name", IN_SECTIONS)
def test_arrays_have_a_shape(name):
    assert not without_shape(IN_SECTIONS[name])


@pytest.mark.parametrize("name", IN_SECTIONS)
def test_lengths_and_light_have_a_unit(name):
    assert not without_unit(IN_SECTIONS[name])


@pytest.mark.parametrize("name", IN_SECTIONS)
def test_what_is_raised_is_named(name):
    assert not unnamed(IN_SECTIONS[name])


@pytest.mark.parametrize("name", IN_SECTIONS)
def test_an_example_runs_as_it_stands(name):
    """In an empty namespace, as where a reader pastes it."""
    assert failures(IN_SECTIONS[name]) == 0


@pytest.mark.parametrize(
    ("letter", "name"), [row[:2] for row in symbols(METHOD) if f"lightloc.{row[1]}" in PUBLIC]
)
def test_the_papers_place_is_named(letter, name):
    """The equation or section that the table of symbols has for it."""
    doc = PUBLIC[f"lightloc.{name}"].__doc__.lower().replace("sections", "section")
    assert not [place for place in PLACE.findall(letter.lower()) if place not in doc]


@pytest.mark.parametrize("file", FILES, ids=lambda file: str(file.relative_to(ROOT)))
def test_one_style_everywhere(file):
    assert not out_of_style(file.read_text())


@pytest.mark.parametrize("name", OFFERED)
def test_doors_say_the_shapes_of_arrays(name):
    """What crosses between rooms: in a sentence, where sections would be too much."""
    thing = OFFERED[name]
    arrays = any(is_array(note) for note in annotations(thing).values())
    assert not arrays or SHAPE.search(thing.__doc__ or "")


def fall(positions: NDArray, times: int = 1) -> float:  # noqa: F821
    """Return how far the lowest of some places is up.

    Parameters
    ----------
    positions : (n, 3) array
        The places, metres.
    times : int
        Factor on the result.

    Returns
    -------
    float
        Its height, metres.

    Raises
    ------
    ValueError
        If there is no place.

    Examples
    --------
    >>> min([3.0, 1.0])
    1.0
    """
    if not len(positions):
        raise ValueError("positions are empty")
    return times * min(z for _, _, z in positions)


# Python 3.13 takes the indentation away
first, *rest = inspect.cleandoc(fall.__doc__).split("\n")
fall.__doc__ = "\n".join([first, *(f"    {line}" if line else "" for line in rest), "    "])


def with_(before: str, after: str) -> Any:
    """The function above with another docstring."""
    copy = FunctionType(fall.__code__, globals(), fall.__name__, fall.__defaults__)
    copy.__annotations__, copy.__doc__ = fall.__annotations__, fall.__doc__.replace(before, after)
    assert copy.__doc__ != fall.__doc__
    return copy


def section(name: str) -> str:
    """A section of its docstring, with the empty line after it."""
    return re.search(rf"    {name}\n    -+\n(?:    .*\n)+\n?", fall.__doc__)[0]


def test_a_complete_docstring_has_no_fault():
    assert not faults(fall)
    assert not without_shape(fall)
    assert not without_unit(fall)
    assert not unnamed(fall)
    assert failures(fall) == 0


@pytest.mark.parametrize(
    ("code", "before", "after"),
    [
        ("PR01", "    times : int\n        Factor on the result.\n", ""),
        ("PR02", "times :", "count :"),
        ("PR04", "times : int", "times"),
        ("PR07", "        Factor on the result.\n", ""),
        ("RT01", section("Returns"), ""),
        ("EX01", section("Examples"), ""),
        ("GL03", "Raises", "\n    Raises"),
        ("GL08", fall.__doc__, ""),
        ("SS06", "some places", "some\n    places"),
    ],
)
def test_what_numpydoc_must_find(code, before, after):
    """Negative control: a parameter, a section or an example that is missing is seen."""
    found = faults(with_(before, after))
    assert code in {fault[:4] for fault in found}, found


def test_what_numpydoc_can_not_find():
    """Negative control of the other tests."""
    assert without_shape(with_("(n, 3) array", "array")) == ["positions"]
    assert without_unit(with_("The places, metres.", "The places.")) == ["positions"]
    assert unnamed(with_(section("Raises"), "")) == {"ValueError"}
    assert raised(PointLights) == {"ValueError"}  # by `array`
    assert not raised(triangles)  # np.array refuses nothing of ours
    assert failures(with_("min(", "np.min(")) == 1
    assert failures(with_(section("Examples"), "")) is None
    text = 'def f():\n    """Do.\n\n    {}\n    """\n'
    assert out_of_style(text.format("Args:\n        x: a number.")) == ["f"]
    assert out_of_style(text.format(">>> 1\n    1")) == ["f"]
    assert not out_of_style(text.format("Examples\n    --------\n    >>> 1\n    1"))
    assert not out_of_style(text.format("Example: lightloc study many"))
