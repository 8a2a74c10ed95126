"""The paper's own Table 1: its eight rows, success rates and runtimes as printed.

Columns as the text defines them: Full counts low-error solutions, Solved those that are the true
lighting, so Solved is never above Full. Runtimes in seconds on an i7-7700HQ with a GTX 1060.
"""

from __future__ import annotations

COLUMNS = ("Random", "V(p)", "Full", "Solved", "Median", "Max")
ROWS = {
    "noiseless-2": (0.77, 0.96, 1.00, 1.00, 2, 64),
    "noiseless-3": (0.52, 0.73, 1.00, 1.00, 3, 105),
    "noiseless-4": (0.29, 0.35, 1.00, 1.00, 29, 250),
    "noiseless-5": (0.26, 0.15, 0.97, 0.94, 85, 442),
    "noisy-2": (0.80, 0.83, 0.99, 0.78, 2, 52),
    "noisy-3": (0.53, 0.66, 0.98, 0.73, 13, 492),
    "noisy-4": (0.32, 0.41, 0.95, 0.64, 34, 301),
    "noisy-5": (0.23, 0.21, 0.84, 0.38, 80, 378),
}


def figure(row: str, column: str | None) -> float | None:
    """The paper's figure; None where it has no such row or column.

    Examples
    --------
    >>> figure("noisy-5", "Solved")
    0.38
    """
    if column not in COLUMNS or row not in ROWS:
        return None
    return ROWS[row][COLUMNS.index(column)]
