"""Study: the position error beside the Cramér-Rao bound as noise grows."""

from validation.studies import scenes
from validation.studies.efficiency import study

STUDY = study(
    "noise",
    "More and more noise",
    "How near does the position error come to the Cramér-Rao bound as noise grows? Two and three "
    "lights in the square room, 400 observations. The ratio should stay below 1.2 where the "
    "answer says that it converged.",
    "k of the noise, k √B",
    scenes.NOISES,
    "k",
    scenes.noise,
)
