"""What runs leave on disk: checked models that write a file and read it again.

For other rooms, in pipeline order:

- `SCHEMA`: the version of every file.
- `UNKNOWN`: a unit of length of which nobody has said which it is.
- `UNEXPLAINED`: reasons of answers that say that they do not explain the data, or were cut short.
- `Made`: when and with what something was made.
- `MadeOn`: the same, and on what machine.
- `TrueLight`: a light of the scene.
- `FoundLight`: a found light with its errors.
- `Lights`: both.
- `Pair`: the two that were matched.
- `Comparison`: the judge's verdict.
- `Step`: a step of the search.
- `Said`: what the data can't decide.
- `Search`: how the search went.
- `Rerender`: B of the found lights beside what was seen.
- `ClosedForm`: B beside the integrating sphere's closed form.
- `Limits`: what a case must keep to.
- `Result`: a case, result.json.
- `Suite`: a run of a suite, suite.json.
- `Cell`: a figure of a study's table and its goal.
- `Row`: a row of it.
- `Stroke`: how a line is drawn.
- `Line`: a line of its curve.
- `Curve`: the curve.
- `Tile`: a cell of a map of rows.
- `Heat`: the map.
- `Column`: a column.
- `Scene`: a scene that has ended.
- `Document`: a study, study.json.
- `read_suite`: reads and checks a suite.
- `read_result`: the same of a case.
- `read_checked`: the same of any record.
"""

from validation.records.part import SCHEMA, Made, MadeOn
from validation.records.reading import read_checked, read_result, read_suite
from validation.records.result import (
    UNEXPLAINED,
    UNKNOWN,
    ClosedForm,
    Comparison,
    FoundLight,
    Lights,
    Limits,
    Pair,
    Rerender,
    Result,
    Said,
    Search,
    Step,
    Suite,
    TrueLight,
)
from validation.records.study import (
    Cell,
    Column,
    Curve,
    Document,
    Heat,
    Line,
    Row,
    Scene,
    Stroke,
    Tile,
)

__all__ = [
    "SCHEMA",
    "UNKNOWN",
    "UNEXPLAINED",
    "Made",
    "MadeOn",
    "TrueLight",
    "FoundLight",
    "Lights",
    "Pair",
    "Comparison",
    "Step",
    "Said",
    "Search",
    "Rerender",
    "ClosedForm",
    "Limits",
    "Result",
    "Suite",
    "Cell",
    "Row",
    "Stroke",
    "Line",
    "Curve",
    "Tile",
    "Heat",
    "Column",
    "Scene",
    "Document",
    "read_suite",
    "read_result",
    "read_checked",
]
