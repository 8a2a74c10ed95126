"""A suite of cases: rendered, localized, judged, each in a process of its own.

For other rooms, in pipeline order:

- `Case`: a row: how a scene is observed, what must come out and how near.
- `read_suite`: the rows of a TOML file.
- `run`: runs them.
"""

from validation.suite.cases import Case, read_suite, run

__all__ = [
    "Case",
    "read_suite",
    "run",
]
