"""lightloc figures: the paper's Figures 1 to 6 from our own data, on one page."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from validation.commands.outputs import JSON, QUIET, tell, writable

MODULES = {  # number: module, and about how long it takes beside the others
    1: ("one_light", 2),
    2: ("four_lights", 8),
    3: ("cluster", 22),
    4: ("noise", 2),
    5: ("three_d", 25),
    6: ("wall_points", 20),
}
KINDS = ("png", "svg")


def figures_command(
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder of the figures.")] = Path(
        "figures"
    ),
    only: Annotated[list[int], typer.Option(help="Draw this figure only, as 1.")] = [],  # noqa: B006
    json: JSON = False,
    quiet: QUIET = False,
) -> None:
    """Draw the paper's Figures 1 to 6 from our own data: PNG, SVG and a page beside its captions.

    Example: lightloc figures -o figures --only 1 --only 4
    """
    for number in only:
        if number not in MODULES:
            raise ValueError(f"--only {number}: no such figure; expected 1 to {max(MODULES)}")
    chosen = sorted(set(only) or MODULES)
    if out.exists() and not out.is_dir():
        raise ValueError(f"{out}: is a file; expected a folder")
    names = [f"figure{number}.{kind}" for number in chosen for kind in KINDS]
    writable(*(out / name for name in (*names, "index.html")))

    from validation.commands.progress import Bar

    with Bar("figures", total=sum(MODULES[number][1] for number in chosen), quiet=quiet) as bar:
        page = draw_all(chosen, out, bar.to, bar.say)
    tell(page, {"page": str(page), "figures": chosen}, json, quiet)


def draw_all(
    chosen: Sequence[int],
    out: Path,
    to: Callable[[float], None] = lambda done: None,
    say: Callable[[str], None] = lambda what: None,
) -> Path:
    """Draw some figures into a folder; the page's path. Each file is written whole or not."""
    from importlib import import_module

    from validation.draw import written
    from validation.figures.page import page
    from validation.jobs import made, write_bytes, write_text

    done, drawings = 0.0, []
    for number in chosen:
        module, share = MODULES[number]
        say(f"figure {number}")
        watch = partial(_part, to, done, share)
        drawing = import_module(f"validation.figures.{module}").drawing(watch)
        for kind in KINDS:
            write_bytes(out / f"{drawing.name}.{kind}", written(drawing.figure, kind))
        drawings.append(drawing)
        done += share
        to(done)
    return write_text(out / "index.html", page(drawings, made()))


def _part(to: Callable[[float], None], start: float, share: float, part: float) -> None:
    to(start + share * part)
