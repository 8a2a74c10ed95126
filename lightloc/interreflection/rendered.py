"""The indirect light of single lights, rendered: by a geometry, or by a user's function.

Transport is linear in intensity, so that it is rendered for intensity 1 and scaled; a light that
stays where it is keeps what was rendered for it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from lightloc.checks import number
from lightloc.deadline import in_time
from lightloc.given import Geometry, Interreflecting, Observations

Columns = tuple[NDArray[np.float64], NDArray[np.float64]]

Indirect = Callable[[NDArray[np.float64]], Columns]
"""From (k, 3) positions to H(q, p) and its standard error, each (n, k, c), m^-2 sr^-1."""

PATHS = 1 << 18
"""Of each light, over all observations, where no number is asked for: positions are then as sure
as with four times as many, in rooms seen by one camera (measured)."""

FEWEST, MOST = 64, 1024
"""Of these for each observation. With 16 a mean is skewed, and intensities from 70 000 pixels are 2
standard errors too high (measured)."""

GLANCED = 32
"""Paths for each observation at a first glance, at most."""


class Source(Protocol):
    """What renders H at some observations."""

    def columns(self, positions: NDArray[np.float64], which: NDArray[np.intp]) -> Columns:
        """H and its standard error of ``which`` of the lights at (k, 3) positions."""
        ...

    def glance(self, rows: NDArray[np.intp]) -> Source | None:
        """The same for some of the observations with fewer paths; None where that saves nothing."""
        ...


@dataclass(frozen=True, eq=False)
class Paths:
    """H traced by a geometry; a light's paths are its own, wherever it is.

    Parameters
    ----------
    room
        The geometry.
    seen
        The n observations.
    samples
        Paths for each observation and light.
    seed
        Of the paths.
    """

    room: Interreflecting
    seen: Observations
    samples: int
    seed: int

    def columns(self, positions: NDArray[np.float64], which: NDArray[np.intp]) -> Columns:
        parts = [self._of(int(i), positions[i]) for i in which]
        H, error = (np.concatenate(part, axis=1) for part in zip(*parts, strict=True))
        return H, error

    def glance(self, rows: NDArray[np.intp]) -> Paths | None:
        if len(rows) == len(self.seen) and self.samples <= GLANCED:
            return None
        return replace(self, seen=self.seen.at(rows), samples=min(self.samples, GLANCED))

    def _of(self, i: int, p: NDArray[np.float64]) -> Columns:
        in_time()
        seed = int(np.random.SeedSequence([self.seed, i]).generate_state(1)[0])
        return self.room.interreflection(p[None], self.seen, self.samples, seed)


@dataclass(frozen=True, eq=False)
class Function:
    """H by a user's function, which gives it at all observations, also those that are not used."""

    given: Indirect
    used: NDArray[np.bool_]

    def columns(self, positions: NDArray[np.float64], which: NDArray[np.intp]) -> Columns:
        H, error = self.given(positions)
        return H[self.used][:, which], error[self.used][:, which]

    def glance(self, rows: NDArray[np.intp]) -> None:
        return None


def rendering(
    indirect: Indirect | int | None,
    geometry: Geometry | None,
    seen: Observations,
    used: NDArray[np.bool_],
    seed: int,
) -> Source:
    """What renders H at the observations that are used.

    A function gives it at all n observations, of which the (n,) ``used`` are kept; the geometry is
    asked for those alone, which are ``seen``, with so many paths each, or as many as are enough.
    Raises ValueError where the geometry can't render.
    """
    if callable(indirect):
        return Function(indirect, used)
    if not isinstance(geometry, Interreflecting):
        raise ValueError("this geometry can't render interreflected light; give a function for it")
    if indirect is None:
        indirect = int(np.clip(PATHS // len(seen), FEWEST, MOST))
    number("indirect", indirect, 2, whole=True)
    return Paths(geometry, seen, indirect, seed)


@dataclass(frozen=True, eq=False)
class Rendered:
    """H of some lights, each where it was rendered last.

    Parameters
    ----------
    source
        Renders it.
    places : (k, 3) array
        Where.
    around, error : (n, k, c) array
        H and its standard error.
    """

    source: Source
    places: NDArray[np.float64]
    around: NDArray[np.float64]
    error: NDArray[np.float64]

    @staticmethod
    def at(source: Source, places: NDArray[np.float64]) -> Rendered:
        """Render for lights at (k, 3) places."""
        return Rendered(source, places, *source.columns(places, np.arange(len(places))))

    def moved(self, places: NDArray[np.float64], far: NDArray[np.bool_]) -> Rendered:
        """The same lights at (k, 3) places, rendered anew for the (k,) that are ``far``."""
        which = np.flatnonzero(far)
        if not len(which):
            return self
        now, around, error = self.places.copy(), self.around.copy(), self.error.copy()
        now[which] = places[which]
        around[:, which], error[:, which] = self.source.columns(now, which)
        return replace(self, places=now, around=around, error=error)
