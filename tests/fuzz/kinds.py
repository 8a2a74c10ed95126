"""The kinds of inputs, and some of each: the same seed, the same inputs."""

from __future__ import annotations

import hypothesis
from hypothesis import HealthCheck, Phase
from hypothesis import strategies as st

from fuzz import archives, assets, commands, corpus, hostile, odd, parts, texts, trees
from fuzz.inputs import Input


def _views() -> st.SearchStrategy[Input]:
    good = corpus.written()["view.exr"]
    return odd.changed(good).map(lambda content: Input("view", {"view.exr": content}))


def _pictures() -> st.SearchStrategy[Input]:
    good = [corpus.written()[name] for name in ("view.exr", "plain.exr")]
    return odd.changed(*good).map(lambda content: Input("picture", {"picture.exr": content}))


def _devices() -> st.SearchStrategy[Input]:
    """Names of files that are none, read as each kind; a FIFO that nobody writes to."""
    kinds = st.sampled_from(
        (
            *("scene", "observations", "readings", "answer", "view", "picture"),
            *("lights", "suite", "results"),
        )
    )
    named = st.builds(lambda kind, name: Input(kind, {}, (name,)), kinds, odd.files)
    return named | kinds.map(lambda kind: Input(kind, {"pipe.xml": None}))


KINDS = {  # share of the inputs, and what makes them
    "scenes": (24, trees.scenes),
    "hostile scenes": (4, hostile.scenes),
    "meshes": (
        12,
        lambda: assets.with_file(parts.MESHES[:4], text=True) | assets.with_file(parts.MESHES),
    ),
    "serialized meshes": (4, assets.packed),
    "pictures": (10, lambda: assets.with_file(assets.BITMAPS)),
    "spectra and hair": (3, lambda: assets.with_file(("grey.spd", "hair.txt"), text=True)),
    "volumes": (3, lambda: assets.volumes() | assets.with_file(("grid.vol",))),
    "observations (npz)": (10, lambda: archives.inputs("observations", "seen.npz", "readings.npz")),
    "mixed materials (npz)": (2, archives.indexed),
    "readings (CSV)": (6, texts.readings),
    "pictures by others (EXR)": (5, _pictures),
    "answers (npz)": (6, lambda: archives.inputs("answer", "found.npz")),
    "views (EXR)": (7, _views),
    "lights (JSON)": (4, lambda: texts.lights("lights")),
    "results (JSON)": (2, lambda: texts.lights("results")),
    "suites (TOML)": (4, texts.suites),
    "devices": (2, _devices),
    "commands": (13, commands.lines),
}


def some(kind: str, count: int, seed: int) -> list[Input]:
    """That many inputs of a kind."""
    found: list[Input] = []

    @hypothesis.seed(seed)
    @hypothesis.settings(
        max_examples=count,
        database=None,
        deadline=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @hypothesis.given(KINDS[kind][1]())
    def take(one: Input) -> None:
        found.append(one)

    take()
    return found[:count]


def shares(count: int) -> dict[str, int]:
    """How many inputs there are of each kind, of so many in all."""
    whole = sum(share for share, _ in KINDS.values())
    return {kind: max(1, round(count * share / whole)) for kind, (share, _) in KINDS.items()}
