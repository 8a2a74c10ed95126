"""The judge of found lights. It knows nothing of how they were found.

For other rooms, in pipeline order:

- `RADIUS`: share of the diagonal within which a found light is a true one.
- `Pair`: a true light and the found one that it is.
- `Comparison`: found lights and true ones, matched.
- `compare`: matches them.
- `Tolerance`: how near counts as found.
- `is_solved`: whether all lights are found, and nothing else.
- `within`: how often the best unbiased estimate would be within tolerances.
- `judge_sphere`: B itself, against the integrating sphere's closed form.
"""

from validation.judge.ceiling import within
from validation.judge.match import RADIUS, Comparison, Pair, compare
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
    "judge_sphere",
]
