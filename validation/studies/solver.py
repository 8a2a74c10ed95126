"""Who finds the lights of a study: our search, or a solver that the command line names."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextvars import ContextVar
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from lightloc import Geometry, Localization, Observations, localize
from validation.methods import Method, called
from validation.studies.study import Study

BY_ANY = ("many", "occluders", "coverage", "noise", "points", "wrong", "hard", "brdf")
"""Studies that any solver may be asked in."""


@dataclass(frozen=True)
class By:
    """Runs a study's scenes with a solver in place of our search.

    Parameters
    ----------
    one
        The study's own function.
    method
        What finds the lights.
    """

    one: Callable[[str], Any]
    method: Method

    def __call__(self, name: str) -> Any:
        before = _METHOD.set(self.method)
        try:
            return self.one(name)
        finally:
            _METHOD.reset(before)

    def given(self, name: str) -> Iterator[str | Path]:
        """What decides a record beside the study's code: the solver."""
        yield self.method.said
        if self.method.file:
            yield self.method.file


def by(study: Study, method: Method) -> Study:
    """The study of a solver, beside that of ours.

    Raises ValueError where a study asks what our own answers say.
    """
    if not study.solvers:
        raise ValueError(
            f"--method: the study {study.name} is of our own search alone; expected one of "
            f"{', '.join(BY_ANY)}"
        )
    return replace(
        study,
        name=f"{study.name}--{method.label}",
        title=f"{study.title}, by {method.label}",
        one=By(study.one, method),
    )


def found(
    q: Observations,
    geometry: Geometry | None = None,
    *,
    bounds: ArrayLike | None = None,
    seed: int = 0,
) -> Localization:
    """The lights, by whom the study asks."""
    method = _METHOD.get()
    if method is None:
        return localize(q, geometry, bounds=bounds, seed=seed)
    if method.name == "paper":
        return localize(q, geometry, method="paper", bounds=bounds, seed=seed)
    return called(method, q, geometry, bounds=bounds, seed=seed)


_METHOD: ContextVar[Method | None] = ContextVar("method", default=None)
