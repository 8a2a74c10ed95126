"""What was fitted beside the lights: one way in which the model is, or may be, another."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lightloc.answer.verdicts import Kind
from lightloc.reprs import short


@dataclass(frozen=True, eq=False)
class Departed:
    """A departure from the model, fitted together with the lights.

    Parameters
    ----------
    kind : Kind
        What sort of thing departs.
    name : str
        What it is, as "the albedo of 'floor'".
    values : (u,) array
        Its unknowns: factors, exponents, or shares of the mean radiance.
    errors : (u,) array
        Their standard errors.
    share : float
        How much it explains of what as many lights alone leave beyond noise, 0 to 1.
    sentence : str
        What a user reads.

    Examples
    --------
    >>> from lightloc import Departed, Kind
    >>> gamma = Departed(Kind.ENCODING, "the encoding", values=[0.455], errors=[0.001], share=0.99,
    ...                  sentence="values are radiance to the power of 0.455 ± 0.001")
    >>> gamma.kind.name
    'ENCODING'
    """

    kind: Kind
    name: str
    values: NDArray[np.float64]
    errors: NDArray[np.float64]
    share: float
    sentence: str

    __repr__ = short
