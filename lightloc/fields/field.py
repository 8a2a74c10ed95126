"""The scene transforms: I(q,p), the intensity-distance field D(p) and the limiter L(p)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import drjit as dr
import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc.backend import types
from lightloc.brdf import Bounded, Ceiling
from lightloc.checks import array
from lightloc.fields.by_pairs import by_pairs
from lightloc.fields.clusters import Clusters
from lightloc.fields.grid import Grid
from lightloc.fields.lanes import Lanes, blocks_of, rows_of
from lightloc.fields.limiters import Found, Seeds, any_of, nothing, search, without
from lightloc.fields.ranking import DARKEST, NO_LIMITER, Ranking
from lightloc.given import Geometry, Observations
from lightloc.optics import Surfels, shading, surfels

RUN = 8  # grid points on a lane (measured: 4 and 16 take 15 to 25 % longer)
REGISTERS = 48  # (grid point, radiance) pairs on a lane, at most: more spill (measured)
COLUMNS = 10  # radiances at once: with six numbers of the surfel they fill a record of 16
WORTH = 64  # observations: fewer are not worth clusters
COARSER = {2: 8, 3: 4}  # cells along an axis to one of the grid that seeds are taken from
FEW_PAIRS = 1 << 26  # are searched without seeds: another launch would cost more


def intensity(
    q: Observations, positions: ArrayLike, geometry: Geometry | None = None
) -> NDArray[np.float64]:
    """Intensity I(q, p) = B(q) / S(q, p) of Eq. 3 that a lone light at p would have.

    Parameters
    ----------
    q : Observations
        The n observations.
    positions : (k, 3) array_like
        Positions p of the light, in the unit of length.
    geometry : Geometry, optional
        What occludes; nothing does where None.

    Returns
    -------
    (n, k, c) array
        I in W/sr; infinite where S = 0.

    Raises
    ------
    ValueError
        If the positions have another shape, or are not finite.

    Examples
    --------
    At the true position every observation names the same intensity, the true one:

    >>> import numpy as np
    >>> from lightloc import Lambert, Observations, PointLights, intensity, radiance
    >>> floor, up = [[0, 0, 0], [1, 0, 0], [0, 2, 0]], [[0, 0, 1]] * 3
    >>> dark = Observations(positions=floor, normals=up, directions=up, radiance=[0, 0, 0],
    ...                     material=Lambert(albedo=0.5))
    >>> q = dark.with_radiance(radiance(dark, PointLights([[0, 0, 1]], [7.0])), sigma=0)
    >>> intensity(q, [[0, 0, 1]])[:, 0, 0].round(4).tolist()
    [7.0, 7.0, 7.0]
    """
    S = shading(q, positions, geometry)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(S > 0, q.radiance[:, None, :] / S, np.inf)


def intensity_distance(
    q: Observations,
    positions: ArrayLike | Grid,
    geometry: Geometry | None = None,
    margin: float = 0.0,
) -> tuple[NDArray[np.float64], NDArray[np.uint32]]:
    """Intensity-distance field D(p) = min_q I(q, p) and limiter field L(p), Eq. 6 and 7.

    What is the brightest that a light can be at p? D is an upper bound on the intensity of a light
    at p, for any number of lights. All observations are taken into account: nothing is
    approximated.

    Parameters
    ----------
    q : Observations
        The n observations.
    positions : (g, 3) array_like or Grid
        Positions p, in the unit of length. A grid is many times as fast as its points.
    geometry : Geometry, optional
        What occludes; nothing does where None.
    margin : float
        Standard errors that B is raised by first, so that the bound holds under noise with that
        confidence.

    Returns
    -------
    D : (g, c) array
        Upper bound in W/sr; infinite where nothing limits.
    L : (g, c) array of uint32
        Index into ``q`` of the observation that limits; 2^32 - 1 where none does.

    Raises
    ------
    ValueError
        If the positions have another shape, or are not finite.

    Examples
    --------
    Above a point with f = 1 and B = 2, a light can be no brighter than B d^2; below it, it may have
    any intensity:

    >>> import numpy as np
    >>> from lightloc import Lambert, Observations, intensity_distance
    >>> q = Observations(positions=[[0, 0, 0]], normals=[[0, 0, 1]], directions=[[0, 0, 1]],
    ...                  radiance=[2.0], material=Lambert(albedo=np.pi))
    >>> D, L = intensity_distance(q, [[0, 0, 3], [0, 0, -3]])
    >>> D[:, 0].round(4).tolist(), L[0, 0].item(), L[1, 0].item() == 2**32 - 1
    ([18.0, inf], 0, True)
    """
    B = np.maximum(q.radiance + (margin * q.known_sigma if margin else 0.0), 0.0)
    return limits(surfels(q, geometry), B, positions, geometry)


def limits(
    s: Surfels, B: ArrayLike, where: ArrayLike | Grid, geometry: Geometry | None = None
) -> tuple[NDArray[np.float64], NDArray[np.uint32]]:
    """D and L for k radiances over the same surfels at once, Eq. 6 and 7.

    Whoever has many of them, one after another, keeps a `Field`.

    Parameters
    ----------
    s
        The n surfels.
    B : (n, k) array_like
        Radiances, at least 0; a material of three channels needs k = 3.
    where : (g, 3) array_like or Grid
        Positions, in the unit of length.
    geometry
        What occludes; nothing does where None.

    Returns
    -------
    D : (g, k) array
        As in `intensity_distance`, W/sr.
    L : (g, k) array
        As in `intensity_distance`.

    Raises
    ------
    ValueError
        If B has another shape, is below 0 or not finite.
    """
    D, L = Field.over(s, where, geometry).limits(B)
    return D.astype(np.float64), L


@dataclass(frozen=True, eq=False)
class Field:
    """Surfels and positions, ready for D and L of one radiance after another.

    Made by `Field.over`. On a `Grid`, observations that cannot be limiters are left out by
    clusters, where the material says how bright it can be; the result is the same.

    Examples
    --------
    >>> from lightloc import Lambert
    >>> q = Observations(positions=[[0, 0, 0]], normals=[[0, 0, 1]], directions=[[0, 0, 1]],
    ...                  radiance=[2.0], material=Lambert(albedo=np.pi))
    >>> field = Field.over(surfels(q), Grid([-1, -1, 2], [1, 1, 4], (1, 1, 1)))
    >>> [field.limits([[B]])[0].round(4).tolist() for B in (1.0, 2.0)]
    [[[9.0]], [[18.0]]]
    """

    surfels: Surfels
    surface: NDArray[np.float32]  # (n, 6) positions and normals
    where: Grid | NDArray[np.float32]
    geometry: Geometry | None
    ceiling: Ceiling | None
    clusters: Clusters | None = None
    coarser: Field | None = None
    kept: dict[int, Lanes] = field(default_factory=dict)  # by the length of their runs

    @staticmethod
    def over(
        s: Surfels,
        where: ArrayLike | Grid,
        geometry: Geometry | None = None,
        *,
        cull: bool = True,
    ) -> Field:
        """Prepare; ``where`` is a `Grid` or (g, 3) positions in the unit of length.

        With ``cull`` off every pair is evaluated, as a yardstick.
        """
        x, n, w = (np.array(v).T for v in (s.x, s.normal, s.w))
        top = None
        if isinstance(s.material, Bounded):
            top = s.material.ceiling((n * w).sum(axis=1, keepdims=True, dtype=np.float64))
        surface = np.concatenate([x, n], axis=1)
        if not isinstance(where, Grid):
            points = array("positions", where, (None, 3)).astype(np.float32)
            return Field(s, surface, points, geometry, top)
        if not cull or top is None or s.n < WORTH:
            return Field(s, surface, where, geometry, top)
        ends = np.concatenate([x, [where.lower, where.upper]])
        clusters = Clusters.of(x, n, float(np.linalg.norm(np.ptp(ends, axis=0))))
        result = None
        for grid in reversed(ever_coarser(where, s.n)):
            result = Field(s, surface, grid, geometry, top, clusters, result)
        assert result is not None
        return result

    def __len__(self) -> int:
        return int(np.prod(self.where.shape)) if isinstance(self.where, Grid) else len(self.where)

    def limits(self, B: ArrayLike) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
        """D (g, k) and L (g, k) of (n, k) radiances, as `limits` but as computed, in float32."""
        B = array("B", B, (self.surfels.n, None), least=0.0)
        g, k = len(self), B.shape[1]
        material = self.surfels.material
        if material is not None and material.channels == 3 != k:
            raise ValueError(f"B has {k} columns; expected 3, as the material has")
        if not self.surfels.traced:
            points = self.where.points if isinstance(self.where, Grid) else self.where
            return by_pairs(self.surfels, B, points, self.geometry)
        D, L = np.zeros((k, g), np.float32), np.zeros((k, g), np.uint32)
        for first in range(0, k if g else 0, COLUMNS):
            some = slice(first, first + COLUMNS)
            d, i = self._limits(B[:, some])
            D[some], L[some] = np.array(d).reshape(-1, g), np.array(i).reshape(-1, g)
        return D.T, L.T

    def _limits(self, B: NDArray[np.float64]) -> tuple[Any, Any]:
        """D and L as Dr.Jit arrays, one radiance after another."""
        f = types()
        self._prepare(B.shape[1])
        q = Ranking.of(self.surfels, self.surface, B, self.ceiling, self.clusters)
        dark = f.Bool((DARKEST >= B).T.ravel())

        def finish(most: Any, who: Any, column: Any) -> tuple[Any, Any]:
            found = who != NO_LIMITER
            i = dr.select(found, dr.gather(f.UInt32, q.index, who, found), NO_LIMITER)
            zero = dr.gather(f.Bool, dark, column * self.surfels.n + i, found)
            return dr.select(zero, 0, 1 / most), i

        if self._occludes:
            found = self._search(q, ask=True)
            column = dr.arange(f.UInt32, len(self) * q.k) // dr.opaque(f.UInt32, len(self))
            result = finish(found.most, found.who, column)
            dr.eval(result)
            return result
        lanes = self._lanes(q.k)
        best = search(q, lanes, nothing(lanes, q.k), self._seeds(q))
        ends = [finish(m, w, case % q.k) for case, (m, w) in enumerate(zip(*best, strict=True))]
        found = Found.empty(len(self), q.k)
        found.put(lanes, ([D for D, _ in ends], [L for _, L in ends]))
        dr.eval(found.most, found.who)
        return found.most, found.who

    @property
    def _occludes(self) -> bool:
        return self.geometry is not None or not self.surfels.flat

    def _search(self, q: Ranking, ask: bool) -> Found:
        """The largest S / B and its observation, for all points and radiances.

        They are found first as if nothing occluded. Only lanes with a point that does not see
        what was found search again, and ask each time; without ``ask`` none do.
        """
        seeds, lanes = self._seeds(q), self._lanes(q.k)
        found = Found.empty(len(self), q.k)
        best = search(q, lanes, nothing(lanes, q.k), seeds)
        if ask and self._occludes:
            hidden = q.hidden(lanes, best[1], self.geometry)
            again = any_of(hidden)
            found.put(lanes, without(best, hidden))
            dr.eval(found.most, found.who, again)
            chosen = dr.compress(again)
            if not dr.width(chosen):
                return found
            lanes = self._lanes(q.k, chosen)
            best = search(q, lanes, found.take(lanes), seeds, q.seen(lanes, self.geometry))
        found.put(lanes, best)
        dr.eval(found.most, found.who)
        return found

    def _seeds(self, q: Ranking) -> Seeds | None:
        """What limits the cells of the coarser field, to begin with."""
        if self.coarser is None:
            return None
        shape = self.coarser.where.shape
        ask = min(shape) > 1  # in a plane that costs more than it saves (measured)
        return Seeds(self.coarser._search(q, ask), shape)

    def _prepare(self, k: int) -> None:
        """Make all lanes before the first kernel that uses them, so that the next is the same."""
        if self.coarser is not None:
            self.coarser._prepare(k)
        self._lanes(k)

    def _lanes(self, k: int, chosen: Any = None) -> Lanes:
        run = RUN if k * RUN <= REGISTERS else RUN // 2
        if chosen is None and run in self.kept:
            return self.kept[run]
        if isinstance(self.where, Grid):
            lanes = blocks_of(self.where, run, chosen)
        else:
            lanes = rows_of(self.where, run, chosen)
        if chosen is None:
            self.kept[run] = lanes
        return lanes


def ever_coarser(grid: Grid, n: int) -> list[Grid]:
    """The grid, and coarser ones over the same region until one has few pairs with n observations.

    Examples
    --------
    >>> [g.shape for g in ever_coarser(Grid([0, 0, 0], [1, 1, 1], (100, 50, 50)), 10_000)]
    [(100, 50, 50), (25, 13, 13)]
    """
    grids = [grid]
    factor = COARSER[2 if min(grid.shape) == 1 else 3]
    while np.prod(grids[-1].shape) * n > FEW_PAIRS:
        x, y, z = (-(-m // factor) for m in grids[-1].shape)
        grids.append(Grid(grid.lower, grid.upper, (x, y, z)))
    return grids
