"""The judge of found lights. It knows nothing of how they were found.

For other rooms, in pipeline order:

- `RADIUS`: share of the diagonal within which a found light counts as a true one.
- `Pair`: a true light and the found one matched to it.
- `Comparison`: found lights and true ones, matched.
- `compare`: matches them.
- `Tolerance`: how near counts as found.
- `is_solved`: whether all lights are found, and nothing else.
- `within`: probability that the best unbiased estimate would be within tolerances.
- `countable`: probability that every light would stand out of the noise.
- `fitted`: makes one, from the truth as a rule.
- `Further`: where one light more could be, and what noise lets it gain.
- `judge_sphere`: B itself, against the integrating sphere's closed form.
"""

from validation.judge.ceiling import countable, within
from validation.judge.further import Further
from validation.judge.match import RADIUS, Comparison, Pair, compare
from validation.judge.oracle import fitted
from validation.judge.solved import Tolerance, is_solved
from validation.judge.sphere import judge_sphere

__all__ = [
    "RADIUS",
    "Pair",
    "Comparison",
    "compare",
    "Tolerance",
    "is_solved",
    "within",
    "countable",
    "fitted",
    "Further",
    "judge_sphere",
]
