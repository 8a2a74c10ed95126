"""The answer: lights, how sure they are, what can't be told, and why it ended.

For other rooms, in pipeline order:

- `Way`: how interreflected light was treated.
- `Assumption`: what an answer takes for granted.
- `NoiseLaw`: where standard errors came from.
- `Noise`: what was taken for noise.
- `Count`: the best lights of one number of lights.
- `Step`: one step of a search.
- `Reason`: why a search stopped.
- `Kind`: what sort of thing can't be told.
- `Verdict`: one thing that the data can't decide.
- `Departed`: what was fitted beside the lights.
- `too_few`: fewer lit observations than unknowns.
- `mirrored`: a light's mirror image would look the same.
- `hidden`: a part of the region that nothing observed sees.
- `spread_out`: lights that have a width.
- `uncounted`: several numbers of lights are allowed.
- `unexplained`: what is left is more than noise.
- `Where`: a sort of places in which outliers lie.
- `Outliers`: those of one sort.
- `outliers_of`: where they lie.
- `Localization`: the whole answer.
- `among`: an answer over all observations, some of which were left out.
- `in_the_unit`: an answer whose lights say their unit of length.
- `MARGIN`: standard errors added to B when computing the bound D.
- `localization`: builds a `Localization` from a fit.
- `noise_by`: what was taken for noise, by an estimated law.
- `judged`: an answer with the verdicts that follow from its errors.
- `with_unknowns`: an answer without the intensities that nothing tells.
- `hardly_gathered`: an answer for which footnote 1 did not apply.
- `out_of_time`: the answer of a search that was not finished.
- `at_border`: an answer some of whose lights lie at the border of the region.
"""

from lightloc.answer.basis import Assumption, Count, Noise, NoiseLaw, Way
from lightloc.answer.departed import Departed
from lightloc.answer.judge import (
    MARGIN,
    at_border,
    hardly_gathered,
    judged,
    localization,
    noise_by,
    out_of_time,
    with_unknowns,
)
from lightloc.answer.outliers import Outliers, Where, outliers_of
from lightloc.answer.result import Localization, Reason, Step, among, in_the_unit
from lightloc.answer.verdicts import (
    Kind,
    Verdict,
    hidden,
    mirrored,
    spread_out,
    too_few,
    uncounted,
    unexplained,
)

__all__ = [
    "Way",
    "Assumption",
    "NoiseLaw",
    "Noise",
    "Count",
    "Step",
    "Reason",
    "Kind",
    "Verdict",
    "Departed",
    "too_few",
    "mirrored",
    "hidden",
    "spread_out",
    "uncounted",
    "unexplained",
    "Where",
    "Outliers",
    "outliers_of",
    "Localization",
    "among",
    "in_the_unit",
    "MARGIN",
    "localization",
    "noise_by",
    "judged",
    "with_unknowns",
    "hardly_gathered",
    "out_of_time",
    "at_border",
]
