"""A suite of cases: rendered, localized, judged.

For other rooms, in pipeline order:

- `read_suite`: the rows of a TOML file.
- `by_methods`: the rows by other methods.
- `Cases`: the cases of a suite, by name.
- `run_case`: runs one: render, localize, judge.
- `run_cases`: runs those that have no result yet.
"""

from validation.suite.case import run_case
from validation.suite.cases import by_methods, read_suite
from validation.suite.run import Cases, run_cases

__all__ = [
    "read_suite",
    "by_methods",
    "Cases",
    "run_case",
    "run_cases",
]
