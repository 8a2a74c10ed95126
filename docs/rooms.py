"""The rooms of lightloc, read from where they are laid down: contracts, doors, imports.

Floors are the `layers` of the import contract in pyproject.toml, sentences the first of each
room's docstring, arrows what its files really import. `drawing` makes a picture of them.
"""

from __future__ import annotations

import ast
import re
import tomllib
from dataclasses import dataclass
from pathlib import Path

import drawing
import grimp
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

ROOT = Path(__file__).parents[1]
PACKAGE = "lightloc"
Arrow = tuple[str, str]


@dataclass(frozen=True)
class House:
    """What the page shows.

    Parameters
    ----------
    floors
        Names of the rooms, from the top floor down.
    doors
        Each room's docstring.
    arrows
        (room, room that it imports from).
    """

    floors: tuple[tuple[str, ...], ...]
    doors: dict[str, str]
    arrows: tuple[Arrow, ...]

    @staticmethod
    def read() -> House:
        floors = floors_in((ROOT / "pyproject.toml").read_text())
        rooms = [room for floor in floors for room in floor]
        graph = grimp.build_graph(PACKAGE, cache_dir=None)
        arrows = [
            (a, b)
            for a in rooms
            for b in rooms
            if a != b
            and graph.direct_import_exists(
                importer=f"{PACKAGE}.{a}", imported=f"{PACKAGE}.{b}", as_packages=True
            )
        ]
        return House(floors, {room: door(room) for room in rooms}, tuple(arrows))

    @property
    def level(self) -> dict[str, int]:
        """The floor of each room, the lowest being 1."""
        upwards = enumerate(reversed(self.floors), start=1)
        return {room: number for number, floor in upwards for room in floor}

    def sentence(self, room: str) -> str:
        """What the room is."""
        return re.split(r"\n\s*\n", self.doors[room])[0].replace("\n", " ").strip()

    def offers(self, room: str) -> list[str]:
        """The lines of its door, one for each name that others may use."""
        return re.findall(r"^- `\w+`: .*\.$", self.doors[room], re.MULTILINE)


def floors_in(contracts: str) -> tuple[tuple[str, ...], ...]:
    r"""The layers within lightloc, from the top down.

    Examples
    --------
    >>> one = 'type = "layers"\ncontainers = ["lightloc"]\nlayers = ["a", "b | c"]'
    >>> floors_in("[[tool.importlinter.contracts]]\n" + one)
    (('a',), ('b', 'c'))
    """
    for contract in tomllib.loads(contracts)["tool"]["importlinter"]["contracts"]:
        if contract["type"] == "layers" and contract.get("containers") == [PACKAGE]:
            return tuple(tuple(layer.split(" | ")) for layer in contract["layers"])
    raise ValueError(f"no contract lays out the rooms of {PACKAGE}")


def door(room: str) -> str:
    """The docstring of a room, be it a folder or a file."""
    folder = ROOT / PACKAGE / room
    file = folder / "__init__.py" if folder.is_dir() else folder.with_suffix(".py")
    return ast.get_docstring(ast.parse(file.read_text())) or ""


class Picture(SphinxDirective):
    """``{rooms}``: the rooms as boxes by floor, and arrows between them."""

    def run(self) -> list[nodes.Node]:
        house = House.read()
        captions = {room: re.split("[:;,(]| and ", house.sentence(room))[0] for room in house.doors}
        svg = drawing.picture(house.floors, captions, house.arrows)
        return [nodes.raw("", f'<figure class="rooms">{svg}</figure>', format="html")]


class Floors(SphinxDirective):
    """``{floors}``: what each room is, from the top floor down."""

    def run(self) -> list[nodes.Node]:
        house = House.read()
        rows = ["| floor | room | what it is |", "| ---: | --- | --- |"]
        for floor in house.floors:
            for room in floor:
                number = house.level[room] if room == floor[0] else ""
                rows.append(f"| {number} | {room} | {house.sentence(room)} |")
        return self.parse_text_to_nodes("\n".join(rows))


class Doors(SphinxDirective):
    """``{doors}``: what each room offers to others."""

    def run(self) -> list[nodes.Node]:
        house, said = House.read(), []
        for room in house.doors:
            if offered := house.offers(room):
                said.append(f"(room-{room})=\n**{room}**\n\n" + "\n".join(offered))
        return self.parse_text_to_nodes("\n\n".join(said))


def setup(app: Sphinx) -> dict[str, bool]:
    for name, directive in {"rooms": Picture, "floors": Floors, "doors": Doors}.items():
        app.add_directive(name, directive)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
