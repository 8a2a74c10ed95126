"""The columns of a table of readings, by their names, and the units that stand beside these."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from lightloc.given.table import Table

METRES = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "km": 1e3, "um": 1e-6, "in": 0.0254, "ft": 0.3048}
UNITS = {  # spellings
    **{name: name for name in METRES},
    **dict.fromkeys(("metre", "metres", "meter", "meters"), "m"),
    **dict.fromkeys(("µm", "μm"), "um"),
    **dict.fromkeys(("inch", "inches"), "in"),
    **dict.fromkeys(("foot", "feet"), "ft"),
}
UNKNOWN = "unit"  # of length
POWERS = str.maketrans("²⁻¹−", "2-1-")
VECTORS = {
    "position": ("{}", "p{}", "pos{}", "position{}", "{}pos", "{}position"),
    "normal": ("n{}", "normal{}", "{}normal"),
    "direction": ("d{}", "direction{}", "dir{}", "view{}", "w{}"),
}


@dataclass(frozen=True)
class Columns:
    """The columns of a table by their names, and the units that stand beside these."""

    table: Table
    place: Mapping[str, int]
    units: Sequence[str]

    @staticmethod
    def of(table: Table) -> Columns:
        place: dict[str, int] = {}
        units = []
        for column, header in enumerate(table.header):
            match = re.fullmatch(r"([^\[(]*)[\[(](.*)[\])]\s*", header)
            name, unit = match.groups() if match else (header, "")
            name = re.sub("[^a-z0-9]", "", name.lower().replace("²", "2"))
            units.append(unit.strip())
            if name and place.setdefault(name, column) != column:
                raise ValueError(f"{table.path}: column {header} stands twice")
        return Columns(table, place, units)

    def some(self, names: Sequence[str]) -> list[int]:
        """The columns of a value, one or three for R, G and B; empty where there are none."""
        found = [[self.place[name]] for name in names if name and name in self.place]
        for name in names:
            three = [self.place[name + a] for a in "rgb" if name + a in self.place]
            if name and 0 < len(three) < 3:
                raise ValueError(
                    f"{self.table.path}: has columns {self.said(three)}; expected R, G and B"
                )
            if len(three) == 3:
                found.append(three)
        if len(found) > 1:
            raise ValueError(
                f"{self.table.path}: columns {self.said(found[0])} and {self.said(found[1])} say "
                "the same; expected one of them"
            )
        return found[0] if found else []

    def said(self, columns: Sequence[int]) -> str:
        """Their names, as they stand in the file."""
        return ", ".join(self.table.header[column] for column in columns)

    def has(self, vector: str) -> bool:
        """Whether there is any of a vector's columns."""
        return any(form.format(a) in self.place for form in VECTORS[vector] for a in "xyz")

    def vector(self, vector: str) -> list[int]:
        """The columns of x, y and z."""
        found = []
        for axis in "xyz":
            names = [form.format(axis) for form in VECTORS[vector]]
            column = next((self.place[name] for name in names if name in self.place), None)
            if column is None:
                raise ValueError(
                    f"{self.table.path}: has no column {names[0]} (its header has "
                    f"{self.said(range(len(self.table.header)))[:80]})"
                )
            found.append(column)
        return found

    def length(self, unit: str | None) -> str:
        """The unit of length."""
        columns = self.vector("position")
        given = {self.units[column] for column in columns}
        if len(given) > 1:
            raise ValueError(
                f"{self.table.path}: columns {self.said(columns)} have different units of length"
            )
        named = given.pop()
        if named and unit is not None and UNITS.get(unit, unit) != UNITS.get(named, named):
            raise ValueError(f"{self.table.path}: its unit of length is {named}, not {unit}")
        word = (named or unit or "").lower()
        if not word:
            return UNKNOWN
        if word not in UNITS:
            raise ValueError(
                f"{self.table.path}: the unit of length is '{word}'; expected one of "
                f"{', '.join(METRES)}"
            )
        return UNITS[word]

    def unit(self, columns: Sequence[int], known: Sequence[str], percent: bool = False) -> str:
        """The unit of a value: "" where it has none, "%", or one of some that are known."""
        spelled = {_letters(name) for name in known} | ({"%"} if percent else set())
        for column in columns:
            word = _letters(self.units[column])
            if word and word not in spelled:
                allowed = [*known[:1], *(["%"] if percent else [])]
                expected = f"expected {' or '.join(allowed)}" if allowed else "it has none"
                raise ValueError(
                    f"{self.table.path}: column {self.table.header[column]} has the unit "
                    f"'{self.units[column]}'; {expected}"
                )
        return "%" if columns and self.units[columns[0]] == "%" else ""


def _letters(unit: str) -> str:
    """A unit without what is spelled in many ways.

    Examples
    --------
    >>> _letters("W m^-2"), _letters("W·m⁻²")
    ('wm-2', 'wm-2')
    """
    return re.sub(r"[\s^·*()]", "", unit.lower().translate(POWERS))
