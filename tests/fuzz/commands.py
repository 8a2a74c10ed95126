"""Command lines: good ones with arguments left out, doubled, replaced by odd ones, or moved."""

from __future__ import annotations

from hypothesis import strategies as st

from fuzz import corpus, odd
from fuzz.inputs import Input

FEW = ("--points", "8", "--spp", "2")
GOOD = (
    ("render", "box_one", *FEW, "-o", "{}/o.npz", "--transport", "direct", "--noise", "0.01"),
    ("render", "box_plastic", *FEW, "-o", "{}/o.npz", "--set", "alpha=0.3", "--seed", "3"),
    ("render", "{}/room.xml", *FEW, "-o", "{}/o.npz", "--lights", "{}/l.json"),
    ("localize", "{}/readings.npz", "-o", "{}/f.json", "--bounds", "-1,-1,0.1,1,1,1"),
    ("localize", "{}/seen.npz", "--scene", "{}/gone.xml", "-o", "{}/f.json", "--indirect", "4"),
    ("localize", "{}/view.exr", "-o", "{}/f.json", "--method", "paper", "--seed", "1"),
    ("compare", "{}/lights.json", "{}/lights.json", "--within", "1", "--intensity", "5"),
    ("compare", "{}/lights.json", "box_one", "--set", "alpha=0.2"),
    ("compare", "{}/answer.json", "{}/lights.json"),
    ("validate", "--dry-run", "--suite", "{}/suite.toml", "-o", "{}/report"),
    ("validate", "--dry-run", "--case", "box_one-direct", "--jobs", "1"),
    ("report", "{}/report"),
    ("paired", "{}/a", "{}/b"),
    ("study", "gone", "--scenes", "1", "--row", "a", "--jobs", "1", "-o", "{}/s"),
    ("figures", "--only", "7", "-o", "{}/g"),
    ("--version",),
    ("--help",),
)
SLOW = {"study": 2, "figures": 3, "validate": 2}  # words that keep each from hours of work
FILES = ("readings.npz", "seen.npz", "view.exr", "lights.json", "answer.json")
OPTIONS = sorted(
    {word for line in GOOD for word in line if word.startswith("-")} | {"--debug", "-h"}
)


@st.composite
def lines(draw: st.DrawFn) -> Input:
    """A command line with one to three changes."""
    words = list(draw(st.sampled_from(GOOD)))
    for _ in range(draw(st.sampled_from((1, 1, 1, 2, 3)))):
        i = draw(st.integers(0, len(words) - 1)) if words else 0
        first = SLOW.get(words[0], 0) if words else 0
        how = draw(st.sampled_from(("odd", "odd", "odd", "number", "out", "twice", "option")))
        if how == "odd" and i >= first:
            words[i : i + 1] = [draw(odd.anything)]
        elif how == "number" and i >= first:
            numbers = [j for j, word in enumerate(words) if j >= first and word[:1].isdigit()]
            if numbers:
                words[draw(st.sampled_from(numbers))] = draw(odd.numbers)
        elif how == "out" and i >= first and words and words[0] not in SLOW:
            del words[i]
        elif how == "twice" and words:
            words.insert(i, words[i])
        elif how == "option":
            words[i:i] = [draw(st.sampled_from(OPTIONS)), draw(odd.anything)]
    files = {name: corpus.written()[name] for name in FILES if any(name in w for w in words)}
    return Input("command", {"suite.toml": corpus.SUITE, **files}, tuple(map(_confined, words)))


def _confined(word: str) -> str:
    """As a shell gives it, without NUL, and no path out of the folder: a command writes files."""
    word = word.replace("\0", "").replace("~", "")[:200]
    inside = word.startswith("{}/") or not ("/" in word or ".." in word)
    return word if inside else "{}/" + word.replace("..", "")
