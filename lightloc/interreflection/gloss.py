"""How far surfaces are from diffuse: what they reflect by direction, as a share of all."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lightloc.brdf import evaluate
from lightloc.given import Observations

PAIRS = 16
"""Of directions that are drawn for each point."""

POINTS = 256
"""Observations that are asked."""

FLOOR = 0.1
"""Quantile over the pairs that is taken for what goes everywhere alike."""


def glossiness(q: Observations, seed: int = 0) -> float:
    """The share of the light reflected that is not reflected alike in all directions, 0 to 1.

    Examples
    --------
    >>> from lightloc import Lambert, Observations, Plastic
    >>> up = [[0.0, 0.0, 1.0]] * 20
    >>> def floor(material):
    ...     return Observations(positions=[[x, 0, 0] for x in range(20)], normals=up,
    ...                         directions=up, radiance=[1.0] * 20, material=material)
    >>> glossiness(floor(Lambert(albedo=0.5))) < 1e-6
    True
    >>> 0.05 < glossiness(floor(Plastic(alpha=0.2, diffuse=0.5))) < 0.5
    True
    """
    if q.quantity == "irradiance":
        return 0.0
    rng = np.random.default_rng(seed)
    rows = np.sort(rng.permutation(len(q))[:POINTS])
    some = q.at(np.repeat(rows, PAIRS))
    l, w = (hemisphere(some.normals, rng) for _ in range(2))
    cosine = np.einsum("ni,ni->n", some.normals, l)
    f = evaluate(some.material, some.normals, l, w).mean(axis=1) / cosine
    f = f.reshape(len(rows), PAIRS)
    whole = f.mean(axis=1).sum()
    return float(1 - np.quantile(f, FLOOR, axis=1).sum() / whole) if whole > 0 else 0.0


def hemisphere(normals: NDArray[np.float64], rng: np.random.Generator) -> NDArray[np.float64]:
    """(n, 3) directions about (n, 3) normals, as many as the cosine says."""
    v = rng.normal(size=normals.shape)
    v = normals + v / np.linalg.norm(v, axis=1, keepdims=True)
    return np.asarray(v / np.linalg.norm(v, axis=1, keepdims=True))
