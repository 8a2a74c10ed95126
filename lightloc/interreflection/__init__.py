"""Indirect light: removed by footnote 1, or rendered, subtracted, and found again.

For other rooms, in pipeline order:

- `remove_indirect`: B without indirect light, gathered from the observations themselves.
- `Split`: B as the direct and the indirect light of some lights.
- `straight`: the direct part at intensity 1.
- `spread`: the lights' standard errors from both parts together.
- `Indirect`: renders the indirect light of a light of intensity 1.
- `rendering`: makes one of a geometry that can render.
- `less_background`: a first guess at the direct part of a light meter's readings.
- `rounds`: searches, renders, subtracts, and searches again.
"""

from lightloc.interreflection.all_light import Split, spread, straight
from lightloc.interreflection.footnote_1 import remove_indirect
from lightloc.interreflection.rendered import Indirect, less_background, rendering, rounds

__all__ = [
    "remove_indirect",
    "Split",
    "straight",
    "spread",
    "Indirect",
    "rendering",
    "less_background",
    "rounds",
]
