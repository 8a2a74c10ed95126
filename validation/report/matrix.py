"""The matrix of cases: a row per scene and BRDF, a column per condition (transport and noise)."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

from validation.records import Result
from validation.report.words import material

TRANSPORTS = {"direct": "direct light", "full": "with indirect light"}


@dataclass(frozen=True)
class Row:
    """A scene in one material; `cells` holds its cases by column, often one and sometimes none."""

    scene: str
    material: str
    cells: list[list[Result]]


@dataclass(frozen=True)
class Matrix:
    """Rows and columns in the suite's order; `groups` are the transports and their widths."""

    groups: list[tuple[str, int]]
    noises: list[float]
    starts: list[bool]
    rows: list[Row]


def matrix(results: Sequence[Result]) -> Matrix:
    """Lay the results out: columns by transport and noise, rows as they first come."""
    columns = sorted(
        {(result.transport, result.noise) for result in results},
        key=lambda column: (column[0] != "direct", column[0], column[1]),
    )
    rows: dict[tuple[str, str], list[list[Result]]] = {}
    for result in results:
        key = (result.scene, material(result))
        cells = rows.setdefault(key, [[] for _ in columns])
        cells[columns.index((result.transport, result.noise))].append(result)
    groups = [
        (TRANSPORTS.get(transport, transport), len(list(members)))
        for transport, members in groupby(columns, key=lambda column: column[0])
    ]
    before = [None, *(transport for transport, _ in columns[:-1])]
    starts = [old != new for old, (new, _) in zip(before, columns, strict=True)]
    return Matrix(
        groups=groups,
        noises=[noise for _, noise in columns],
        starts=starts,
        rows=[Row(scene, name, cells) for (scene, name), cells in rows.items()],
    )
