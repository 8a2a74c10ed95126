"""The published method: votes in D and L (section 4), and their optimization (5).

For other rooms, in pipeline order:

- `Surface`: distances along the observed surface (section 4.2).
- `Perimeter`: along the walls of a 2D scene.
- `Geodesic`: shortest paths over neighbouring observations.
- `SolidAngle`: the paper's own approximation in 3D.
- `DISCONTINUITY`: T of Eq. 8.
- `Votes`: V(p) over a grid and its peaks.
- `vote`: V(p) of Eq. 8.
- `Paper`: the method's parameters.
- `LOWERING_OF_NOISE`: the lowering of H, without noise and with it.
- `RADIUS_OF_NOISE`: the radius of the votes, without noise and with it.
- `State`: the state after a step.
- `grid_over`: the grid that is voted over.
- `rendered`: S of the grid's positions.
- `votes_of`: the votes of several radiances.
- `peaks_of`: the peaks that count.
- `optimize`: intensities, then Levenberg-Marquardt (section 5.2).
- `iterate`: section 5, step by step.
- `published`: runs it to its end and returns an answer.
"""

from lightloc.paper.geodesic import Geodesic
from lightloc.paper.method import published
from lightloc.paper.optimization import (
    LOWERING_OF_NOISE,
    RADIUS_OF_NOISE,
    Paper,
    State,
    grid_over,
    iterate,
    optimize,
    peaks_of,
    rendered,
    votes_of,
)
from lightloc.paper.surface import Perimeter, SolidAngle, Surface
from lightloc.paper.voting import DISCONTINUITY, Votes, vote

__all__ = [
    "Surface",
    "Perimeter",
    "Geodesic",
    "SolidAngle",
    "DISCONTINUITY",
    "Votes",
    "vote",
    "Paper",
    "LOWERING_OF_NOISE",
    "RADIUS_OF_NOISE",
    "State",
    "grid_over",
    "rendered",
    "votes_of",
    "peaks_of",
    "optimize",
    "iterate",
    "published",
]
