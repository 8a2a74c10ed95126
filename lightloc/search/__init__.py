"""Our search: a climb from darkness to the lights that explain B (docs/solver.md).

For other rooms, in pipeline order:

- `Region`: the box that may hold lights, and which of its sides are open.
- `Ground`: the sample of observations and the grid, independent of B.
- `Ladder`: the best fit of each count of lights so far.
- `climbed`: adds lights, one by one.
- `resumed`: continues from given lights.
- `by_law`: searches on by the law of the noise that is left.
- `emptied`: exchanges lights until exact data leave nothing.
- `settled`: the final refinement on all observations.
- `above_rounding`: without lights that are no brighter than rounding.
- `concluded`: the search's answer.
- `strengths`: the answer where the lights' places are known.
- `widened`: looks further out where an open side stops a light.
- `bordered`: says where a light lies at an open side in the end.
- `best_one`: the light that explains most, where none explain what is lit.
- `sharpened`: refines one hypothesis to its end.
"""

from lightloc.search.climb import climbed, resumed
from lightloc.search.conclude import concluded
from lightloc.search.exact import emptied
from lightloc.search.ground import Ground
from lightloc.search.held import strengths
from lightloc.search.ladder import Ladder
from lightloc.search.lawful import by_law
from lightloc.search.polish import sharpened
from lightloc.search.region import Region, bordered, widened
from lightloc.search.settle import above_rounding, settled
from lightloc.search.single import best_one

__all__ = [
    "Region",
    "Ground",
    "Ladder",
    "climbed",
    "resumed",
    "by_law",
    "emptied",
    "settled",
    "above_rounding",
    "concluded",
    "strengths",
    "widened",
    "bordered",
    "best_one",
    "sharpened",
]
