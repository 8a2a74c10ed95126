"""Observations: what is known of the scene's surfaces, and how bright they look."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc import brdf
from lightloc.checks import (
    array,
    check_radiance,
    number,
    numbers,
    printable,
    unit_vectors,
    unit_word,
)
from lightloc.files import archive, whole
from lightloc.reprs import short

FORMAT = "lightloc-observations-2"
OLD_FORMATS = ("lightloc-observations-1",)  # had no field that may not be left out today


@dataclass(frozen=True, eq=False)
class Observations:
    """Points on surfaces, and how bright each looks from one direction.

    All arguments are keywords. Arrays are kept as read-only copies.

    Parameters
    ----------
    positions : (n, 3) array_like
        Points x on surfaces, in the unit of length.
    normals : (n, 3) array_like
        Shading normals n(x) on the side that is seen; normalized on entry.
    directions : (n, 3) array_like, optional
        Directions omega from the surface to the viewer; normalized on entry. Only where the
        material is `Irradiance` may they be left out.
    radiance : (n, c) or (n,) array_like
        B(q), W sr^-1 m^-2, or irradiance, W m^-2, where the material is `Irradiance`; c = 1 or 3
        (linear RGB). Kept as (n, c). Values below zero, which noise and the subtraction of light
        leave, are kept as they are, but refused where ``sigma`` is 0.
    sigma : float, (n,) or (n, c) array_like, optional
        Standard error of ``radiance``, in its unit. 0 where a value is exact; None where nobody
        knows it: `localize` then estimates it together with the lights. Kept as (n, c), or None.
    material : BRDF
        The BRDF f at each point: a `Lambert`, `Conductor`, `Plastic`, `Mixed` or `Sum`, an
        `Irradiance`, or any object that is a `BRDF`.
    facets : (n, 3) array_like, optional
        Geometric normals, where they differ from the shading normals, as on a mesh with smooth
        shading: light from below a facet does not reach it. Normalized on entry; ``normals`` where
        None.
    interreflected : bool
        Whether ``radiance`` holds interreflected light too, as a camera's does; `localize` then
        removes it.
    regions : (n,) array_like of int, optional
        The region of each point, an index into ``region_names``; 0 for all where None. Points of
        one region have one material.
    region_names : sequence of str
        Names of the regions.
    saturated : (n,) array_like of bool, optional
        Where the sensor clipped, so that the true value is at least ``radiance``; `localize` leaves
        these out. False for all where None.
    step : float
        Spacing of the values of ``radiance``, W sr^-1 m^-2, where they are quantized; 0 where they
        are not. `localize` adds the error of the rounding to ``sigma``.
    floor : float, optional
        Least radiance that the sensor tells from none; `localize` leaves out what is not above it
        in some channel. 0 where values of 0 are what they say. Where None, and sigma is unknown,
        the values themselves tell.
    unit : str
        The unit of length, a word for prints and files: no result depends on it.
    relative_sigma : bool
        Whether ``sigma`` is right but for one factor, which `localize` then estimates, as with
        ``Options(noise="scaled")``.
    intensity_unit : str
        The unit of intensities, a word too: "cd" where ``radiance`` is luminance or illuminance.
        Where empty, it is that of ``radiance`` times the square of ``unit``.
    max_depth : int, optional
        Length of the longest paths of the light in ``radiance``, as renderers count that end them:
        2 is direct light, 3 has bounced once more. Where None, they go on until they carry nothing,
        as all light does that was not rendered.

    Raises
    ------
    ValueError
        If there is no observation at all, a shape does not fit, a value is not finite, ``sigma``,
        ``step`` or ``floor`` is negative, ``max_depth`` is below 2, a radiance is negative and
        exact, a vector has length zero, a region has no name, directions are missing, ``material``
        is no BRDF or has other points or more channels, or a unit is no word.

    Notes
    -----
    The set Q of section 3.1 with its B(q), which the paper takes to be direct light alone; footnote
    1 says how to get that from what a camera sees. Any unit of length serves: intensities come out
    in the unit of radiance times its square, which is W/sr for metres.

    Examples
    --------
    >>> from lightloc import Lambert, Observations
    >>> q = Observations(positions=[[0, 0, 0]], normals=[[0, 0, 1]], directions=[[0, 0, 1]],
    ...                  radiance=[0.3], sigma=0.0, material=Lambert(albedo=0.5))
    >>> len(q), q.channels, q.quantity
    (1, 1, 'radiance')
    """

    positions: NDArray[np.float64]
    normals: NDArray[np.float64]
    directions: NDArray[np.float64]
    radiance: NDArray[np.float64]
    sigma: NDArray[np.float64] | None
    material: brdf.BRDF
    facets: NDArray[np.float64]
    interreflected: bool
    regions: NDArray[np.intp]
    region_names: tuple[str, ...]
    saturated: NDArray[np.bool_]
    step: float
    floor: float | None
    unit: str
    relative_sigma: bool
    intensity_unit: str
    max_depth: int | None

    __repr__ = short

    def __init__(
        self,
        *,
        positions: ArrayLike,
        normals: ArrayLike,
        directions: ArrayLike | None = None,
        radiance: ArrayLike,
        sigma: ArrayLike | None = None,
        material: brdf.BRDF,
        facets: ArrayLike | None = None,
        interreflected: bool = False,
        regions: ArrayLike | None = None,
        region_names: Sequence[str] = ("",),
        saturated: ArrayLike | None = None,
        step: float = 0.0,
        floor: float | None = None,
        unit: str = "m",
        relative_sigma: bool = False,
        intensity_unit: str = "",
        max_depth: int | None = None,
    ) -> None:
        x = array("Observations.positions", positions, (None, 3))
        n = len(x)
        if n == 0:
            raise ValueError("Observations are empty; expected at least one observed point")
        if not brdf.is_brdf(material):
            said = (
                "a class; give an instance"
                if isinstance(material, type)
                else type(material).__name__
            )
            raise ValueError(f"Observations.material is {said}; expected a BRDF")
        if directions is None:
            if not isinstance(material, brdf.Irradiance):
                raise ValueError(
                    "Observations.directions are missing; give the directions towards the viewer"
                )
            directions = normals
        put = object.__setattr__
        put(self, "positions", x)
        put(self, "normals", unit_vectors("Observations.normals", normals, n))
        put(self, "directions", unit_vectors("Observations.directions", directions, n))
        put(self, "radiance", _per_channel("Observations.radiance", radiance, n, None, None))
        put(self, "sigma", _sigma(sigma, self.radiance))
        if material.channels > self.channels:
            raise ValueError("Observations.radiance has 1 channel but the material has 3")
        if isinstance(material, (brdf.Parts, brdf.Parameters)):
            material.check_length(n)
        put(self, "material", material)
        facets = self.normals if facets is None else facets
        put(self, "facets", unit_vectors("Observations.facets", facets, n))
        if not isinstance(np.asarray(interreflected).item(), bool):
            raise ValueError(f"Observations.interreflected is {interreflected!r}; expected a bool")
        put(self, "interreflected", bool(interreflected))
        names = np.asarray(region_names)
        if names.ndim != 1 or not names.size or names.dtype.kind != "U":
            raise ValueError("Observations.region_names are no list of words")
        put(self, "region_names", tuple(str(name) for name in names))
        most = len(self.region_names) - 1
        put(self, "regions", _whole_numbers("Observations.regions", regions, n, most))
        clipped = _whole_numbers("Observations.saturated", saturated, n, 1) > 0
        clipped.setflags(write=False)
        put(self, "saturated", clipped)
        put(self, "step", float(array("Observations.step", step, (), least=0.0)))
        if floor is not None:
            floor = float(array("Observations.floor", floor, (), least=0.0))
        put(self, "floor", floor)
        put(self, "unit", unit_word("Observations.unit", unit))
        if not isinstance(relative_sigma, bool | np.bool_):
            raise ValueError(f"Observations.relative_sigma is {relative_sigma!r}; expected a bool")
        put(self, "relative_sigma", bool(relative_sigma))
        if not isinstance(intensity_unit, str) or not intensity_unit.isprintable():
            raise ValueError("Observations.intensity_unit is no word; expected one, as 'cd'")
        put(self, "intensity_unit", intensity_unit)
        if max_depth is not None:
            number("Observations.max_depth", max_depth, 2, whole=True)
        put(self, "max_depth", max_depth)

    def __len__(self) -> int:
        return len(self.positions)

    @property
    def channels(self) -> int:
        """The number of channels of ``radiance``: 1, or 3 for linear RGB."""
        return self.radiance.shape[1]

    @property
    def bounds(self) -> NDArray[np.float64]:
        """(2, 3) lower and upper corner of the observed points, in the unit of length."""
        return np.array([self.positions.min(axis=0), self.positions.max(axis=0)])

    @property
    def diagonal(self) -> float:
        """Length of that box's diagonal, in the unit of length."""
        return float(np.linalg.norm(np.diff(self.bounds, axis=0)))

    @property
    def quantity(self) -> Literal["radiance", "irradiance"]:
        """What ``radiance`` holds, which is irradiance where the material is `Irradiance`."""
        return "irradiance" if isinstance(self.material, brdf.Irradiance) else "radiance"

    @property
    def known_sigma(self) -> NDArray[np.float64]:
        """(n, c) ``sigma``; refused with a ValueError where nobody knows it."""
        if self.sigma is None:
            raise ValueError("Observations.sigma is unknown; give it (0 where B is exact)")
        return self.sigma

    def with_radiance(
        self, radiance: ArrayLike, sigma: ArrayLike | None, interreflected: bool | None = None
    ) -> Observations:
        """Give the same points another B(q) and its standard error.

        Parameters
        ----------
        radiance : float, (n,) or (n, c) array_like
            B(q), W sr^-1 m^-2.
        sigma : float, (n,) or (n, c) array_like, or None
            Its standard error, in its unit; None where nobody knows it.
        interreflected : bool, optional
            Whether it holds interreflected light; as before where None.

        Returns
        -------
        Observations
            The new ones; all else is as it was.

        Raises
        ------
        ValueError
            If a shape does not fit, a value is not finite, ``sigma`` is negative, or a radiance is
            negative and exact.

        Examples
        --------
        >>> from lightloc import Lambert, Observations
        >>> q = Observations(positions=[[0, 0, 0]], normals=[[0, 0, 1]], directions=[[0, 0, 1]],
        ...                  radiance=[0.3], material=Lambert(albedo=0.5))
        >>> q.with_radiance(0.2, 0.01).radiance.tolist()
        [[0.2]]
        """
        n, c = self.radiance.shape
        B = _per_channel("Observations.radiance", radiance, n, c, None)
        both = self.interreflected if interreflected is None else interreflected
        return replace(self, radiance=B, sigma=_sigma(sigma, B), interreflected=both)

    def at(self, rows: ArrayLike) -> Observations:
        """Take some of the observations.

        Parameters
        ----------
        rows : (m,) array_like of int, or (n,) array_like of bool
            Their indices, in any order, or which of the n they are.

        Returns
        -------
        Observations
            The m that were taken, in the order of ``rows``.

        Raises
        ------
        ValueError
            If none is taken.
        IndexError
            If an index is out of range, or ``rows`` is neither of the two.

        Examples
        --------
        >>> from lightloc import Irradiance, Observations
        >>> q = Observations(positions=[[0, 0, 0], [1, 0, 0]], normals=[[0, 0, 1]] * 2,
        ...                  radiance=[0.3, 0.2], material=Irradiance())
        >>> q.at([False, True]).radiance.tolist()
        [[0.2]]
        """
        picked = np.asarray(rows)
        some = np.arange(len(self))[picked if picked.size else picked.astype(int)]
        if some.ndim != 1:
            raise ValueError(f"rows have shape {picked.shape}; expected (m,)")
        named = ("positions", "normals", "directions", "radiance", "facets")
        return replace(
            self,
            **{name: getattr(self, name)[some] for name in (*named, "regions", "saturated")},
            sigma=None if self.sigma is None else self.sigma[some],
            material=brdf.rows_of(self.material, some, len(self)),
        )

    def save(self, path: str | Path) -> None:
        """Write one ``.npz``, whole or not at all: same observations, same bytes.

        Parameters
        ----------
        path : str or Path
            The file to be written.

        Raises
        ------
        OSError
            If the folder is missing or can't be written to.

        Notes
        -----
        The file's keys are

        - ``format``, the name of the format and its version;
        - ``positions``, ``normals``, ``directions``, ``radiance`` and ``sigma``, float64 with the
          shapes that `Observations` keeps; ``sigma`` is empty where nobody knows it;
        - ``interreflected``, bool;
        - ``material``, the name of its type, and each parameter as ``material.NAME``; of a
          `Mixed`, ``material.index``, and of that and a `Sum` the parts as ``material.0``,
          ``material.1`` and so on;
        - ``facets``, ``regions``, ``region_names``, ``saturated``, ``step``, ``floor``, ``unit``,
          ``relative_sigma``, ``intensity_unit`` and ``max_depth``, which a file need not have.

        Examples
        --------
        >>> import tempfile
        >>> from lightloc import Lambert, Observations
        >>> q = Observations(positions=[[0, 0, 0]], normals=[[0, 0, 1]], directions=[[0, 0, 1]],
        ...                  radiance=[0.3], material=Lambert(albedo=0.5), unit="cm")
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     q.save(f"{folder}/seen.npz")
        ...     Observations.load(f"{folder}/seen.npz").unit
        'cm'
        """
        keys: dict[str, Any] = {"format": np.array(FORMAT)}
        said = {name: getattr(self, name) for name in STORED}
        keys |= {name: np.asarray(value) for name, value in said.items() if value is not None}
        if self.sigma is None:
            keys["sigma"] = np.zeros(0)
        keys |= brdf.stored("material", self.material)
        with whole(path) as part, open(part, "wb") as file:
            np.savez_compressed(file, **keys)

    @staticmethod
    def load(path: str | Path) -> Observations:
        """Read what `save` wrote, now or in a former version.

        Parameters
        ----------
        path : str or Path
            The file.

        Returns
        -------
        Observations
            What was saved. In place of a BSDF that ``lightloc`` does not model there is a
            ``SceneMaterial``, which can't be evaluated; `render.attach` puts the scene's own BSDF
            back.

        Raises
        ------
        ValueError
            If there is no such file, it is broken or of another format, a field is missing, or its
            values are none that `Observations` takes; the message names the file.

        Examples
        --------
        >>> from lightloc import Observations
        >>> Observations.load("nowhere.npz")
        Traceback (most recent call last):
            ...
        ValueError: nowhere.npz: no such file
        """
        keys = archive(path, "observations", (FORMAT, *OLD_FORMATS))
        try:
            given: dict[str, Any] = {name: keys[name] for name in STORED if name in keys}
            given |= {name: given[name].item() for name in WORDS if name in given}
            for name in NEEDED:
                keys[name]  # or it is missing
            if not keys["sigma"].size:
                given["sigma"] = None
            return Observations(material=brdf.restored("material", keys), **given)
        except KeyError as missing:
            raise ValueError(f"{path}: field {missing} is missing") from None
        except (TypeError, ValueError, OverflowError) as error:
            raise ValueError(f"{path}: {printable(str(error))}") from None


STORED = (
    *("positions", "normals", "directions", "radiance", "sigma", "facets", "interreflected"),
    *("regions", "region_names", "saturated", "step", "floor", "unit"),
    *("relative_sigma", "intensity_unit", "max_depth"),
)
"""Fields that a file holds beside the material."""

WORDS = ("step", "floor", "unit", "relative_sigma", "intensity_unit", "max_depth")
"""Those that are no arrays."""

NEEDED = ("positions", "normals", "directions", "radiance", "sigma", "interreflected")
"""Those that it can't do without."""


def _per_channel(
    name: str, value: ArrayLike, n: int, c: int | None, least: float | None
) -> NDArray[np.float64]:
    result = numbers(name, value)
    if result.ndim == 0 and c is not None:
        result = np.broadcast_to(result, (n, c))
    elif result.ndim == 1:
        result = result[:, None]
    if c is not None and result.ndim == 2 and result.shape[1] == 1:
        result = np.broadcast_to(result, (len(result), c))
    result = array(name, result, (n, c), least=least)
    if result.shape[1] not in (1, 3):
        raise ValueError(f"{name} has {result.shape[1]} channels; expected 1 or 3")
    return result


def _sigma(sigma: ArrayLike | None, radiance: NDArray[np.float64]) -> NDArray[np.float64] | None:
    if sigma is None:
        return None
    n, c = radiance.shape
    error = _per_channel("Observations.sigma", sigma, n, c, 0.0)
    check_radiance("Observations.radiance", radiance, error)
    return error


def _whole_numbers(name: str, value: ArrayLike | None, n: int, most: int) -> NDArray[np.intp]:
    given = array(name, np.zeros(n) if value is None else value, (n,), least=0.0, most=most)
    result = given.astype(np.intp)
    if (given != result).any():
        raise ValueError(f"{name} holds a value that is no whole number")
    result.setflags(write=False)
    return result
