"""Lights fitted to B: residuals, Levenberg-Marquardt, errors, and what is better.

For other rooms, in pipeline order:

- `is_exact`: whether observations claim to have no errors.
- `is_noise`: channels in which radiance is noise about 0.
- `without_black`: observations without noise where nothing reflects.
- `working_sigma`: standard errors with the arithmetic's own.
- `presumed`: observations with some sigma where nobody knows it.
- `level_of`: the standard deviation of residuals, outliers left out.
- `SPREAD`: how well that is known.
- `correlation`: whether neighbours among residuals are alike.
- `estimated_level`: the same where sigma is only presumed.
- `law_of`: sigma as a function of B, where it is one.
- `RATHER`: the probability of being noise that divides outliers from it.
- `MOST_OUTLIERS`: the largest share of outliers that is allowed.
- `Law`: how large the noise of B is, estimated.
- `law_left`: the law of what a model leaves.
- `arithmetic`: the standard errors that the arithmetic alone leaves.
- `outside`: which residuals are outliers, and what share.
- `cauchy`: Cauchy's loss, and the weight that it gives.
- `robust`: the sum of that loss.
- `Subtracted`: light that was in B, whose noise stays.
- `Problem`: what is fitted: B, its errors, the geometry and the region.
- `Fit`: lights with the residual that they leave.
- `no_lights`: the fit of darkness.
- `fit_of`: the fit of given lights, not moved.
- `residuals`: (B - model) / sigma.
- `whitened`: the columns of what is linear: S / sigma and the ambient term.
- `nonnegative`: least squares with x >= 0.
- `amounts`: non-negative intensities and the ambient term.
- `intensities`: non-negative intensities of lights at given positions.
- `Unknown`: what stands for an intensity among the unknowns.
- `Tie`: lights that move together.
- `Indirect`: indirect light that is held while lights move.
- `Descents`: several hypotheses, refined together.
- `descend`: Levenberg-Marquardt from all of them (section 5.2).
- `normal_equations`: J^T W J at one of them.
- `FIRST_DAMPING`: a first damping for starts from anywhere.
- `NEARBY`: for starts that are nearly there.
- `AT_HAND`: for a polish.
- `POLISH_FALL`: the fall of chi-square that ends a polish.
- `jacobian`: derivatives of the model over sigma.
- `covariance_of`: the covariance that follows from them.
- `Bound`: the least standard errors of any unbiased estimate.
- `cramer_rao`: that bound for given lights.
- `errors_at`: that bound for a `Problem`.
- `inseparable`: pairs of lights that can't be told apart.
- `resolution`: how near two lights may be and still look like one.
- `Likelihood`: how probable residuals are.
- `Chance`: what a light gains by chance.
- `Criterion`: decides which fit is better, and when it is enough.
"""

from lightloc.fit.batched import Indirect, Tie, Unknown
from lightloc.fit.criterion import Chance, Criterion, Likelihood
from lightloc.fit.information import (
    Bound,
    covariance_of,
    cramer_rao,
    errors_at,
    inseparable,
    jacobian,
    resolution,
)
from lightloc.fit.law import MOST_OUTLIERS, RATHER, Law, arithmetic, law_left, outside
from lightloc.fit.levenberg import (
    AT_HAND,
    FIRST_DAMPING,
    NEARBY,
    POLISH_FALL,
    Descents,
    descend,
    normal_equations,
)
from lightloc.fit.loss import cauchy, robust
from lightloc.fit.noise import (
    SPREAD,
    estimated_level,
    is_exact,
    is_noise,
    law_of,
    level_of,
    presumed,
    without_black,
    working_sigma,
)
from lightloc.fit.pattern import correlation
from lightloc.fit.problem import (
    Fit,
    Problem,
    amounts,
    fit_of,
    intensities,
    no_lights,
    nonnegative,
    residuals,
    whitened,
)
from lightloc.fit.subtracted import Subtracted

__all__ = [
    "is_exact",
    "is_noise",
    "without_black",
    "working_sigma",
    "presumed",
    "level_of",
    "SPREAD",
    "correlation",
    "estimated_level",
    "law_of",
    "RATHER",
    "MOST_OUTLIERS",
    "Law",
    "law_left",
    "arithmetic",
    "outside",
    "cauchy",
    "robust",
    "Subtracted",
    "Problem",
    "Fit",
    "no_lights",
    "fit_of",
    "residuals",
    "whitened",
    "nonnegative",
    "amounts",
    "intensities",
    "Unknown",
    "Tie",
    "Indirect",
    "Descents",
    "descend",
    "normal_equations",
    "FIRST_DAMPING",
    "NEARBY",
    "AT_HAND",
    "POLISH_FALL",
    "jacobian",
    "covariance_of",
    "Bound",
    "cramer_rao",
    "errors_at",
    "inseparable",
    "resolution",
    "Likelihood",
    "Chance",
    "Criterion",
]
