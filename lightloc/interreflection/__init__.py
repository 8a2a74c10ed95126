"""Indirect light: removed by footnote 1, or rendered, subtracted, and found again.

For other rooms, in pipeline order:

- `remove_indirect`: B without indirect light, gathered from the observations themselves.
- `removed`: the same with the errors that neighbours share.
- `with_shared`: an answer whose errors hold these.
- `Choice`: how interreflected light is treated, and why.
- `GATHERED`: asks for footnote 1.
- `may_gather`: whether footnote 1 may take its radiance from the observations.
- `treatment`: the choice, as asked, or as the observations allow.
- `guessed`: a first guess at the direct part.
- `Indirect`: renders the indirect light of a light of intensity 1.
- `Source`: the same for chosen lights, at all observations or at some.
- `rendering`: makes one of a geometry that can render, or of a function.
- `Split`: B as the direct and the indirect light of some lights.
- `straight`: the direct part at intensity 1.
- `spread`: the lights' standard errors from both parts together.
- `Room`: what rounds are made over.
- `glanced`: how many lights all light shows, over a sample.
- `rounds`: searches, renders, subtracts, and searches again.
"""

from lightloc.interreflection.all_light import Split, spread, straight
from lightloc.interreflection.choice import GATHERED, Choice, may_gather, treatment
from lightloc.interreflection.footnote_1 import remove_indirect, removed
from lightloc.interreflection.guess import guessed
from lightloc.interreflection.rendered import Indirect, Source, rendering
from lightloc.interreflection.settle import Room, glanced, rounds
from lightloc.interreflection.shared import with_shared

__all__ = [
    "remove_indirect",
    "removed",
    "with_shared",
    "Choice",
    "GATHERED",
    "may_gather",
    "treatment",
    "guessed",
    "Indirect",
    "Source",
    "rendering",
    "Split",
    "straight",
    "spread",
    "Room",
    "glanced",
    "rounds",
]
