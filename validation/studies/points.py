"""Study: the position error beside the Cramér-Rao bound from few observations to many."""

from validation.studies import scenes
from validation.studies.efficiency import study

STUDY = study(
    "points",
    "Few observations and many",
    "How near does the position error come to the Cramér-Rao bound with few observations and with "
    "many? Two and three lights in the square room, noise of k = 0.05. The ratio should stay "
    "below 1.2 where the answer says that it converged.",
    "observations",
    scenes.COUNTS,
    "n",
    scenes.points,
)
