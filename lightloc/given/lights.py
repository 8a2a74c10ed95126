"""PointLights: what hides in a scene, what a search finds, what the judge compares."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc import units
from lightloc.checks import array, numbers, unit_word
from lightloc.files import regular, whole
from lightloc.reprs import short

FORMAT = "lightloc-lights-1"
FORMATS = (FORMAT, "lightloc-localization-1")
"""Of files with lights in them; the first ones named none."""


@dataclass(frozen=True, eq=False)
class PointLights:
    """Isotropic point lights.

    Parameters
    ----------
    positions : (k, 3) array_like
        Positions p, in the unit of length.
    intensities : (k, c) or (k,) array_like
        Radiant intensities I, W/sr where that unit is the metre, at least 0; c = 1 or 3 (linear
        RGB). Kept as (k, c). NaN where one is unknown, as in a channel in which nothing is seen.
    unit : str
        The unit of length, a word; "unit" where nobody has said which it is.
    intensity_unit : str
        The unit of the intensities where it is not the one that follows from that, as "cd"; else
        empty.

    Raises
    ------
    ValueError
        If a shape is wrong, a position is not finite, an intensity is negative or infinite,
        ``unit`` is no word, or ``intensity_unit`` is no text.

    Notes
    -----
    The set L of section 3.1.

    Examples
    --------
    >>> from lightloc import PointLights
    >>> lights = PointLights(positions=[[0, 0, 2]], intensities=[10.0])
    >>> len(lights), lights.channels
    (1, 1)
    """

    positions: NDArray[np.float64]
    intensities: NDArray[np.float64]
    unit: str
    intensity_unit: str

    __repr__ = short

    def __init__(
        self,
        positions: ArrayLike,
        intensities: ArrayLike,
        unit: str = "m",
        intensity_unit: str = "",
    ) -> None:
        positions = numbers("PointLights.positions", positions)
        intensities = numbers("PointLights.intensities", intensities)
        if positions.size == 0:
            positions = positions.reshape(0, 3)
        if intensities.ndim == 1:
            intensities = intensities[:, None]
        k = len(positions) if positions.ndim else 0
        positions = array("PointLights.positions", positions, (k, 3))
        unknown = np.isnan(intensities)
        intensities[unknown] = 0.0
        intensities = array("PointLights.intensities", intensities, (k, None), least=0.0)
        if intensities.shape[1] not in (1, 3):
            raise ValueError(
                f"PointLights.intensities has {intensities.shape[1]} channels; expected 1 or 3"
            )
        if unknown.any():
            intensities = np.where(unknown, np.nan, intensities)
            intensities.setflags(write=False)
        object.__setattr__(self, "positions", positions)
        object.__setattr__(self, "intensities", intensities)
        object.__setattr__(self, "unit", unit_word("PointLights.unit", unit))
        if not isinstance(intensity_unit, str) or not intensity_unit.isprintable():
            raise ValueError("PointLights.intensity_unit is no text; expected a unit, as 'cd'")
        follows = intensity_unit == units.power(unit)
        object.__setattr__(self, "intensity_unit", "" if follows else intensity_unit)

    def __len__(self) -> int:
        return len(self.positions)

    @property
    def channels(self) -> int:
        """The number of channels: 1, or 3 for linear RGB."""
        return self.intensities.shape[1]

    @property
    def power(self) -> str:
        """The unit of intensities, as "W/sr"; empty where nobody has said the unit of length."""
        return self.intensity_unit or units.power(self.unit)

    @property
    def order(self) -> NDArray[np.intp]:
        """(k,) indices of the lights in falling order of their mean intensity, where known."""
        known = ~np.isnan(self.intensities)
        total = np.where(known, self.intensities, 0.0).sum(axis=1)
        return np.argsort(-total / np.maximum(known.sum(axis=1), 1), kind="stable")

    def brightest_first(self) -> PointLights:
        """Sort the lights by their mean intensity, the brightest first.

        Returns
        -------
        PointLights
            The same lights; of equal ones the first stays first.

        Examples
        --------
        >>> from lightloc import PointLights
        >>> PointLights([[0, 0, 2], [1, 0, 2]], [1.0, 10.0]).brightest_first().positions.tolist()
        [[1.0, 0.0, 2.0], [0.0, 0.0, 2.0]]
        """
        order = self.order
        return replace(self, positions=self.positions[order], intensities=self.intensities[order])

    def in_unit(self, unit: str) -> PointLights:
        """Say the same lights in another unit of length.

        Parameters
        ----------
        unit : str
            The other one: m, dm, cm, mm, um, km, in, ft or yd; or the lights' own.

        Returns
        -------
        PointLights
            The lights, with intensities that leave the same radiance.

        Raises
        ------
        ValueError
            If nobody has said how long one of the two units is.

        Examples
        --------
        >>> from lightloc import PointLights
        >>> lights = PointLights([[0, 0, 2]], [10.0]).in_unit("cm")
        >>> lights.positions.tolist(), lights.intensities.tolist()
        ([[0.0, 0.0, 200.0]], [[100000.0]])
        """
        scale = units.conversion(self.unit, unit_word("unit", unit))
        if scale is None:
            raise ValueError(
                f"the lights' unit of length is '{self.unit}', which can't be converted to '{unit}'"
            )
        return replace(
            self,
            positions=scale * self.positions,
            intensities=self.intensities if self.intensity_unit else scale**2 * self.intensities,
            unit=unit,
        )

    def to_dict(self) -> dict[str, Any]:
        """Put the lights into values that JSON has.

        Returns
        -------
        dict
            What `save` writes: ``format``, ``unit``, ``intensity_unit`` where the lights have one,
            and ``lights``.

        Examples
        --------
        >>> from lightloc import PointLights
        >>> PointLights([[0, 0, 2]], [10.0]).to_dict()["lights"]
        [{'position': [0.0, 0.0, 2.0], 'intensity': [10.0]}]
        """
        rows = [
            {"position": p.tolist(), "intensity": [None if a != a else a for a in I.tolist()]}
            for p, I in zip(self.positions, self.intensities, strict=True)
        ]
        own = {"intensity_unit": self.intensity_unit} if self.intensity_unit else {}
        return {"format": FORMAT, "unit": self.unit, **own, "lights": rows}

    def save(self, path: str | Path) -> None:
        """Write the lights as JSON, whole or not at all.

        The file holds ``format``, ``unit``, ``intensity_unit`` where the lights have one, and a
        list ``lights`` of ``{"position": [x, y, z], "intensity": [...]}``, where null stands for an
        intensity that is unknown.

        Parameters
        ----------
        path : str or Path
            The file to be written.

        Raises
        ------
        OSError
            If the folder is missing or can't be written to.

        Examples
        --------
        >>> import tempfile
        >>> from lightloc import PointLights
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     PointLights([[0, 0, 2]], [10.0]).save(f"{folder}/lights.json")
        ...     PointLights.load(f"{folder}/lights.json").intensities.tolist()
        [[10.0]]
        """
        with whole(path) as part:
            part.write_text(json.dumps(self.to_dict(), indent=1) + "\n")

    @staticmethod
    def load(path: str | Path) -> PointLights:
        """Read what `save` wrote, or the lights of an answer that was written as JSON.

        Parameters
        ----------
        path : str or Path
            The file.

        Returns
        -------
        PointLights
            The lights in the file's order. They are in metres where the file says no unit.

        Raises
        ------
        ValueError
            If there is no such file, it can't be read or holds no lights, it is of another format,
            or its values are none that `PointLights` takes; the message names the file.

        Examples
        --------
        >>> from lightloc import PointLights
        >>> PointLights.load("nowhere.json")
        Traceback (most recent call last):
            ...
        ValueError: nowhere.json: no such file
        """
        try:
            content = json.loads(regular(path).read_text("utf-8-sig"))
            rows, style = content["lights"], content.get("format", FORMAT)
            unit, power = content.get("unit", "m"), content.get("intensity_unit", "")
            positions = [row["position"] for row in rows]
            intensities = [row["intensity"] for row in rows]
        except (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
            if str(error).startswith(f"{path}: "):
                raise
            raise ValueError(
                f'{path}: not a lights file; expected {{"lights": [{{"position": ..., '
                '"intensity": ...}, ...]}'
            ) from None
        if style not in FORMATS:
            raise ValueError(f"{path}: its format is {str(style)[:40]!r}; expected {FORMAT}")
        try:
            return PointLights(positions, intensities, unit, power)
        except ValueError as error:
            raise ValueError(f"{path}: {error}") from None

    def __str__(self) -> str:
        if not len(self):
            return "no lights"
        rows = []
        for p, I in zip(self.positions, self.intensities, strict=True):
            where = [units.figure(a, self.unit) for a in p]
            bright = ["unknown" if np.isnan(a) else units.figure(a, self.unit) for a in I]
            rows.append(units.light(where, bright, self.unit, self.intensity_unit))
        return "\n".join(rows + units.explained(self.unit, self.intensity_unit))
