"""What a solver gave, checked, and as the answer that all the harness knows."""

from __future__ import annotations

import inspect
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lightloc import (
    Geometry,
    Limits,
    Localization,
    Noise,
    NoiseLaw,
    Observations,
    PointLights,
    Reason,
    radiance,
)
from validation.methods.named import Method, function

MOST_LIGHTS = 200
"""That are judged: of more, no user could look at each."""

FIELDS = ("lights", "positions", "intensities", "position_error", "intensity_error", "reason")
"""Of an answer that is a mapping or an object."""


def taken(given: Any, channels: int) -> dict[str, Any]:
    """The fields of what a solver returned, checked.

    It is a pair of (k, 3) positions and (k, c) or (k,) intensities, `PointLights`, or a mapping or
    an object that has some of `FIELDS`.

    Raises
    ------
    ValueError
        If it is none, a shape is wrong, a value is not finite, an intensity is negative, or there
        are more than `MOST_LIGHTS` lights.

    Examples
    --------
    >>> sorted(taken(([[0, 0, 1]], [5]), channels=1))
    ['intensities', 'intensity_error', 'position_error', 'positions', 'reason']
    >>> taken(([[0, 0, 1]], [5, 6]), channels=1)
    Traceback (most recent call last):
        ...
    ValueError: its intensities have the shape (2,); expected (1, 1) or (1,)
    """
    own = fields_of(given)
    if isinstance(own.get("lights"), PointLights):
        own |= {name: getattr(own["lights"], name) for name in ("positions", "intensities")}
    if "positions" not in own or "intensities" not in own:
        raise ValueError(
            f"it returned a {type(given).__name__}; expected positions (k, 3) and intensities "
            f"(k, {channels})"
        )
    positions = numbers("positions", own["positions"])
    if not positions.size:
        positions = np.zeros((0, 3))
    if positions.ndim != 2 or positions.shape[1] != 3:
        raise ValueError(f"its positions have the shape {positions.shape}; expected (k, 3)")
    k = len(positions)
    if k > MOST_LIGHTS:
        raise ValueError(f"it returned {k} lights; at most {MOST_LIGHTS} are judged")
    intensities = shaped("intensities", own["intensities"], k, channels)
    for name, values in (("positions", positions), ("intensities", intensities)):
        if not np.isfinite(values).all():
            raise ValueError(f"its {name} are not all finite")
    if (intensities < 0).any():
        raise ValueError(f"light {int((intensities < 0).any(axis=1).argmax()) + 1} is negative")
    reason = own.get("reason")
    reason = getattr(reason, "name", reason)
    if reason is not None and reason not in Reason.__members__:
        raise ValueError(
            f"its reason is {reason!r}; expected one of {', '.join(Reason.__members__)}"
        )
    errors = {
        "position_error": shaped("position errors", own.get("position_error"), k, 3),
        "intensity_error": shaped("intensity errors", own.get("intensity_error"), k, channels),
    }
    return {"positions": positions, "intensities": intensities, "reason": reason, **errors}


def fields_of(given: Any) -> dict[str, Any]:
    """Whatever was returned, by the names of `FIELDS`."""
    if isinstance(given, PointLights):
        return {"lights": given}
    if isinstance(given, dict):
        return {name: given[name] for name in FIELDS if name in given}
    if isinstance(given, (tuple, list)):
        return dict(zip(FIELDS[1:], given, strict=False)) if len(given) > 1 else {}
    return {name: getattr(given, name) for name in FIELDS if hasattr(given, name)}


def numbers(name: str, given: Any) -> NDArray[np.float64]:
    """An array of numbers, or a sentence."""
    try:
        return np.asarray(given, float)
    except (TypeError, ValueError):
        raise ValueError(f"its {name} are no array of numbers") from None


def shaped(name: str, given: Any, k: int, c: int) -> NDArray[np.float64]:
    """(k, c) of that or of (k,); NaN where nothing is given."""
    if given is None:
        return np.full((k, c), np.nan)
    values = numbers(name, given)
    if not k and not values.size:
        return np.zeros((0, c))
    if values.shape == (k,):
        values = np.repeat(values[:, None], c, axis=1)
    if values.shape != (k, c):
        raise ValueError(f"its {name} have the shape {values.shape}; expected {(k, c)} or {(k,)}")
    return values


def answered(q: Observations, fields: dict[str, Any], geometry: Geometry | None) -> Localization:
    """The answer with what its lights leave of direct light; nothing else is known of it."""
    order = np.argsort(-fields["intensities"].sum(axis=1), kind="stable")
    own = {name: v[order] for name, v in fields.items() if name != "reason"}
    lights = PointLights(own["positions"], own["intensities"], q.unit, q.intensity_unit)
    k, (n, c) = len(lights), q.radiance.shape
    sigma = np.full((n, c), np.nan) if q.sigma is None else q.known_sigma
    with np.errstate(divide="ignore", invalid="ignore"):
        model = radiance(q, lights, geometry) if not q.interreflected else np.nan
        residual = np.where(sigma > 0, (q.radiance - model) / sigma, np.nan)
    told = np.isfinite(residual)
    nothing, unknown = np.zeros(n, bool), np.full(c, np.nan)
    return Localization(
        lights=lights,
        position_error=own["position_error"],
        intensity_error=own["intensity_error"],
        covariance=np.full((k * (3 + c), k * (3 + c)), np.nan),
        bound=np.full((k, c), np.nan),
        residual=residual,
        direct=q.radiance,
        sigma=sigma,
        inseparable=(),
        resolution=np.full(k, np.nan),
        width=np.zeros(k),
        certificate=np.nan,
        ambient=np.zeros(c),
        verdicts=(),
        chi2=float(np.square(residual[told]).mean()) if told.any() else np.nan,
        reason=Reason[fields["reason"] or Reason.TAKEN.name],
        history=(),
        noise=Noise(
            NoiseLaw.GIVEN, np.ones(c), np.zeros(c), np.zeros((n, c), bool), 0.0, *[unknown] * 6
        ),
        limits=Limits(nothing, nothing),
    )


def called(
    method: Method, q: Observations, geometry: Geometry | None, **offered: Any
) -> Localization:
    """What a solver finds, in this process; of what is offered it gets what it has names for.

    Raises ValueError where it raises, or returns no lights.
    """
    solve = function(method)
    try:
        given = solve(q, geometry, **asked(solve, **offered))
    except Exception as error:  # whatever it is
        raise ValueError(sentence(error, str(method.file or method.module))) from error
    return answered(q, taken(given, q.channels), geometry)


def sentence(error: BaseException, own: str) -> str:
    """What a solver raised, and where in its own file."""
    text = " ".join(str(error).split()) or "no message"
    where = [f for f in traceback.extract_tb(error.__traceback__) if f.filename == own]
    place = f" ({Path(where[-1].filename).name}, line {where[-1].lineno})" if where else ""
    said = f"{type(error).__name__}: {text}{place}"
    return text if isinstance(error, ValueError) and not where else said


def asked(solve: Callable[..., Any], **offered: Any) -> dict[str, Any]:
    """What of this a solver has a parameter for, by its name."""
    try:
        names = inspect.signature(solve).parameters
    except (TypeError, ValueError):
        return {}
    return {name: value for name, value in offered.items() if name in names}


def no_answer(q: Observations) -> Localization:
    """That of a solver that gave none: no lights."""
    return answered(q, taken((np.zeros((0, 3)), np.zeros((0, q.channels))), q.channels), None)
