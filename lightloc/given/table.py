"""Tables in text files: columns of numbers by name, each complaint with its line."""

from __future__ import annotations

import codecs
import csv
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lightloc.checks import printable
from lightloc.files import regular

SEPARATORS = "\t;,"  # the first that a header has: a comma may also stand in its names and numbers
COMMENT = "#"
BLANK = ",; \t"  # a spreadsheet writes an empty row so
MARKS = {codecs.BOM_UTF16_LE: "utf-16", codecs.BOM_UTF16_BE: "utf-16"}  # else UTF-8
COMMA = re.compile(r"\s*[+-]?\d*,\d+([eE][+-]?\d+)?\s*")  # a number with a decimal comma
BLOCK = 4096  # rows that are held as rows
LONGEST = 40  # characters of a cell that a message repeats


@dataclass(frozen=True)
class Table:
    """A header and rows of cells, as text.

    Parameters
    ----------
    path
        The file.
    header
        The names of the columns, as they stand there.
    cells
        The text of each column, row by row.
    lines
        The line of the file that each row ends in.
    commas
        Whether numbers have decimal commas.
    """

    path: Path
    header: tuple[str, ...]
    cells: list[list[str]]
    lines: list[int]
    commas: bool

    @staticmethod
    def read(path: str | Path) -> Table:
        """Read one whose separator is a comma, a semicolon or a tab.

        Blank lines and lines that begin with ``#`` are left out. Raises ValueError naming the file,
        and the line where there is one.
        """
        path = Path(path)
        lines = _lines(path)
        first = next(_said(lines), None)
        if first is None:
            raise ValueError(f"{path}: is empty; expected a header and rows")
        start, head = first
        quoted = head.split('"')[::2]
        separator = next((s for s in SEPARATORS if any(s in part for part in quoted)), ",")
        read = [start]

        def text() -> Iterator[str]:
            for number, line in _said(lines):
                read[0] = number
                yield line

        header: list[str] = []
        cells: list[list[str]] = []
        block: list[list[str]] = []
        ends: list[int] = []

        def put_away() -> None:
            """Columns of text, unlike as many rows, cost the garbage collector nothing."""
            for column, more in zip(cells, zip(*block, strict=True), strict=False):
                column.extend(more)
            block.clear()

        try:
            for row in csv.reader(text(), delimiter=separator, strict=True):
                if not header:
                    header = [printable(name.strip()) for name in row]
                    cells = [[] for _ in header]
                    continue
                if len(row) > len(header) and not any(row[len(header) :]):
                    row = row[: len(header)]
                if len(row) != len(header):
                    raise ValueError(
                        f"{path}: line {read[0]} has {len(row)} cells; its header has {len(header)}"
                    )
                block.append(row)
                ends.append(read[0])
                if len(block) == BLOCK:
                    put_away()
            put_away()
        except csv.Error as error:
            raise ValueError(f"{path}: line {read[0]}: {printable(str(error))}") from None
        if not ends:
            raise ValueError(f"{path}: has no rows below its header in line {start}")
        commas = separator != "," and any(
            COMMA.fullmatch(cell) for column in cells for cell in column if "," in cell
        )
        return Table(path, tuple(header), cells, ends, commas)

    def numbers(self, columns: Sequence[int]) -> NDArray[np.float64]:
        """(n, k) the finite numbers of k columns, with decimal points or decimal commas.

        Raises ValueError naming the line and the column of the first cell that holds none.
        """
        cells = [self.cells[column] for column in columns]
        if self.commas:
            for column, texts in zip(columns, cells, strict=True):
                for row, text in enumerate(texts):
                    if "." in text:
                        raise self.refused(row, column, "has a decimal point; others have a comma")
            cells = [[text.replace(",", ".") for text in column] for column in cells]
        result = np.empty((len(self.lines), len(columns)))
        for k, (column, texts) in enumerate(zip(columns, cells, strict=True)):
            try:
                result[:, k] = list(map(float, texts))
            except ValueError:
                row = next(row for row, text in enumerate(texts) if not _is_number(text))
                raise self.refused(row, column, "is not a number") from None
            bad = ~np.isfinite(result[:, k])
            if bad.any():
                raise self.refused(int(np.argmax(bad)), column, "is not a finite number")
        return result

    def refused(self, row: int, column: int, why: str) -> ValueError:
        """What to raise of a cell."""
        cell = self.cells[column][row].strip()
        said = f"'{cell[:LONGEST]}'" if cell.isprintable() and cell else "an empty cell"
        return ValueError(
            f"{self.path}: line {self.lines[row]}, column {self.header[column]}: {said} {why}"
        )


def _lines(path: Path) -> list[str]:
    try:
        data = regular(path).read_bytes()
    except OSError as error:
        raise ValueError(f"{path}: can't be read ({error.strerror})") from None
    try:
        text = data.decode(MARKS.get(data[:2], "utf-8-sig"))
    except UnicodeDecodeError:
        raise ValueError(f"{path}: is no text in UTF-8") from None
    if "\0" in text:
        raise ValueError(f"{path}: is no text file")
    return text.replace("\r\n", "\n").replace("\r", "\n").split("\n")


def _said(lines: Sequence[str]) -> Iterator[tuple[int, str]]:
    """The lines that say something, with their numbers."""
    for number, line in enumerate(lines, start=1):
        text = line.strip(BLANK)
        if text and text[0] != COMMENT:
            yield number, line


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
