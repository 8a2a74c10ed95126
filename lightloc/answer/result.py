"""Localization: the answer, how sure it is, and why the search stopped."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lightloc.answer.basis import Assumption, Count, Noise, Way
from lightloc.answer.departed import Departed
from lightloc.answer.noise_said import noise_said
from lightloc.answer.outliers import Outliers, outliers_said
from lightloc.answer.printed import columns, html, text
from lightloc.answer.stored import plain, read, write
from lightloc.answer.verdicts import Kind, Verdict
from lightloc.checks import printable
from lightloc.given import Limits, Observations, PointLights


class Reason(Enum):
    """Why a search stopped; the value is the sentence that a user reads.

    Examples
    --------
    >>> from lightloc import Reason
    >>> Reason.NO_VOTES.value
    'The published method failed: no position has a vote.'
    """

    CONVERGED = "The lights explain every observation to within its error."
    UNDECIDED = "The observations can't decide all that was asked; the verdicts say what."
    EXTENDED = (
        "Every observation is explained, by lights of which one is wide, or several close together."
    )
    NO_GAIN = (
        "The model does not explain the data: a residual is left that no further light reduces."
    )
    MISFIT = "The lights at the given positions do not explain the data."
    MOST_LIGHTS = "The maximum number of lights was reached, and a residual is left."
    DARK = "No light explains these observations better than darkness, which explains them."
    DARKER = "The published method failed: brighter lights would leave less than no light (B' < 0)."
    NO_VOTES = "The published method failed: no position has a vote."
    OUT_OF_TIME = (
        "The time was up; these lights are the best so far, and nothing was asked further."
    )
    TAKEN = "Another solver found these lights; how sure they are, it does not say."


@dataclass(frozen=True)
class Step:
    """One step of the search.

    Parameters
    ----------
    action : str
        What was done, as a user reads it.
    lights : int
        How many lights there were then.
    chi2 : float
        Chi-square per residual; in steps of the published method its own measure, the mean squared
        error of B, (W sr^-1 m^-2)^2.
    turn : int, optional
        Number of the published method's iteration, or of the round of rendering; None of other
        steps.

    Examples
    --------
    >>> from lightloc import Step
    >>> Step("add", lights=2, chi2=1.03).lights
    2
    """

    action: str
    lights: int
    chi2: float
    turn: int | None = None


@dataclass(frozen=True, eq=False)
class Localization:
    """What `localize` found: the lights, how sure they are, and why the search stopped.

    Printed, it says that in sentences.

    Parameters
    ----------
    lights : PointLights
        The k lights, the brightest first. An intensity is NaN where nothing tells it: in a channel
        in which nothing is seen that the light reaches.
    position_error : (k, 3) array
        Standard errors of the positions, in the unit of length; 0 along an axis that is not free.
    intensity_error : (k, c) array
        Standard errors of the intensities, W/sr; NaN where one is unknown.
    covariance : (m, m) array
        Covariance of the free coordinates of each light, in the unit of length, then of the
        intensities, W/sr.
    bound : (k, c) array
        D(p) of Eq. 6 at each light, W/sr, with B raised by three standard errors: the most that a
        light there can have.
    residual : (n, c) array
        (B - model) / sigma at the n observations. Here and in ``direct`` and ``sigma``, NaN where
        `Observations.saturated` left one out.
    direct : (n, c) array
        Radiance without interreflected light, W sr^-1 m^-2.
    sigma : (n, c) array
        Standard errors of ``direct`` as used, W sr^-1 m^-2, those of the removal included.
    inseparable : tuple of (int, int)
        Pairs of lights that the data can't tell apart, by their indices.
    resolution : (k,) array
        Two lights nearer to each other than that would look like this one, in the unit of length;
        infinite where nothing tells. NaN where it was not computed, and for a light that has a
        width.
    width : (k,) array
        How wide each light is, in the unit of length; 0 for a point. A light of some width and
        several lights close together can't be told apart: two equal points so far apart look the
        same. ``residual`` is what lights of that width leave.
    certificate : float
        The largest normalized correlation of the residual with a further light anywhere in the
        region, in standard errors: about 4 by chance alone. NaN where it was not computed.
    ambient : (c,) array
        Radiance of the constant ambient term (section 6.3), W sr^-1 m^-2; 0 where none was fitted.
    verdicts : tuple of Verdict
        What the data can't decide.
    chi2 : float
        Robust chi-square per residual; about 1 where the model is right. Where the noise was
        estimated as a law, of the residuals that are no outliers by it.
    reason : Reason
        Why the search stopped.
    history : tuple of Step
        The steps of the search: each has an ``action``, a number of ``lights``, ``chi2`` per
        residual (of "paper", the mean squared error of B), and the ``turn`` of what goes in rounds.
    noise : Noise
        What was taken for noise.
    limits : Limits
        What was left out because the sensor could not tell it.
    outlying : tuple of Outliers
        Where the outliers lie, of lights that were found; nobody asks where time is up.
    counts : tuple of Count
        The best lights of each number that was tried, and how likely that number is.
    relative : bool
        Whether all intensities have a common unknown factor.
    assumed : tuple of Assumption
        What the answer takes for granted and the observations were not asked about.
    way : Way
        How interreflected light was treated.
    why : str
        Why so, a sentence; empty where it was asked for, or there is none.
    departures : tuple of Departed
        What was fitted together with the lights, the likeliest first; none where the model is right
        as far as can be seen.

    Examples
    --------
    >>> import numpy as np
    >>> from lightloc import Lambert, Observations, PointLights, localize, radiance
    >>> floor = np.random.default_rng(0).uniform(-1, 1, (100, 3)) * [1, 1, 0]
    >>> up = np.tile([0, 0, 1], (100, 1))
    >>> q = Observations(positions=floor, normals=up, directions=up, radiance=np.zeros(100),
    ...                  material=Lambert(albedo=0.5))
    >>> B = radiance(q, PointLights([[0.2, 0.1, 0.5]], [10.0]))
    >>> q = q.with_radiance(B, sigma=0.001 * B.max())
    >>> found = localize(q, bounds=[[-1, -1, 0.1], [1, 1, 1]])
    >>> print(found)
    1 light. The lights explain every observation to within its error.
      light  position (m)                                             intensity (W/sr)
      1      0.20000 ± 0.00016, 0.10000 ± 0.00018, 0.50000 ± 0.00024  10.0000 ± 0.0056
    """

    lights: PointLights
    position_error: NDArray[np.float64]
    intensity_error: NDArray[np.float64]
    covariance: NDArray[np.float64]
    bound: NDArray[np.float64]
    residual: NDArray[np.float64]
    direct: NDArray[np.float64]
    sigma: NDArray[np.float64]
    inseparable: tuple[tuple[int, int], ...]
    resolution: NDArray[np.float64]
    width: NDArray[np.float64]
    certificate: float
    ambient: NDArray[np.float64]
    verdicts: tuple[Verdict, ...]
    chi2: float
    reason: Reason
    history: tuple[Step, ...]
    noise: Noise
    limits: Limits
    outlying: tuple[Outliers, ...] = ()
    counts: tuple[Count, ...] = ()
    relative: bool = False
    assumed: tuple[Assumption, ...] = ()
    way: Way = Way.DIRECT
    why: str = ""
    departures: tuple[Departed, ...] = ()

    @property
    def unit(self) -> str:
        """The unit of length, a word: that of the observations."""
        return self.lights.unit

    @property
    def intensity_unit(self) -> str:
        """The unit of intensities, as "W/sr" or "cd"; empty where nobody knows it."""
        return self.lights.power

    @property
    def possible(self) -> tuple[int, ...]:
        """The numbers of lights that the observations allow, with a probability of 95 %.

        One more than are found where that is undecided and one of them may be several. None where
        the time was up: it was not asked.
        """
        if self.reason is Reason.OUT_OF_TIME:
            return ()
        explained = self.reason in (Reason.CONVERGED, Reason.UNDECIDED, Reason.EXTENDED)
        allowed = {len(count.lights) for count in self.counts if count.allowed and explained}
        allowed |= {len(self.lights)}
        several = any(verdict.kind is Kind.CLUSTER for verdict in self.verdicts)
        if self.reason is Reason.UNDECIDED and several:
            allowed.add(max(allowed) + 1)
        return tuple(sorted(allowed))

    @property
    def outliers(self) -> int:
        """The number of residuals that lie beyond `Options.outlier` standard errors."""
        return int(self.noise.outliers.sum())

    @property
    def remarks(self) -> tuple[str, ...]:
        """What it says of the observations, a sentence each: noise, outliers, what was left out."""
        said = (
            noise_said(self.noise, self.direct, self.sigma),
            outliers_said(self.outlying, int(np.isfinite(self.residual).all(axis=1).sum())),
            str(self.limits),
        )
        return tuple(sentence for sentence in said if sentence)

    def to_dict(self) -> dict[str, Any]:
        """Put the answer, but for what it says of each observation, into values that JSON has.

        Returns
        -------
        dict
            ``format``, ``unit``, ``intensity_unit``, ``lights`` (a dict each; `PointLights.load`
            reads them from a file), ``reason``, ``verdicts``, ``chi2``, ``certificate``,
            ``ambient``, ``noise``, ``limits``, ``outlying``, ``counts``, ``possible``,
            ``relative``, ``assumed``, ``way``, ``why`` and ``departures``. Members of enumerations
            go by their names. None stands for a number that is infinite or NaN.

        Examples
        --------
        >>> import numpy as np
        >>> from lightloc import Irradiance, Observations, PointLights, localize, radiance
        >>> x = np.random.default_rng(0).uniform(-1, 1, (100, 3)) * [1, 1, 0]
        >>> q = Observations(positions=x, normals=[[0, 0, 1]] * 100, radiance=np.zeros(100),
        ...                  material=Irradiance())
        >>> q = q.with_radiance(radiance(q, PointLights([[0.2, 0.1, 0.5]], [10.0])), sigma=0.01)
        >>> answer = localize(q, bounds=[[-1, -1, 0.1], [1, 1, 1]]).to_dict()
        >>> answer["reason"], len(answer["lights"]), answer["unit"]
        ('CONVERGED', 1, 'm')
        """
        return plain(vars(self)) | {"possible": list(self.possible)}

    def save(self, path: str | Path) -> None:
        """Write one ``.npz``, whole or not at all.

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
        >>> import numpy as np
        >>> from lightloc import Irradiance, Localization, Observations, localize
        >>> x = np.random.default_rng(0).uniform(-1, 1, (100, 3)) * [1, 1, 0]
        >>> q = Observations(positions=x, normals=[[0, 0, 1]] * 100, radiance=np.zeros(100),
        ...                  sigma=0.01, material=Irradiance())
        >>> found = localize(q, bounds=[[-1, -1, 0.1], [1, 1, 1]])
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     found.save(f"{folder}/found.npz")
        ...     print(Localization.load(f"{folder}/found.npz"))
        0 lights. No light explains these observations better than darkness, which explains them.
        """
        write(vars(self), path)

    @staticmethod
    def load(path: str | Path) -> Localization:
        """Read what `save` wrote.

        Parameters
        ----------
        path : str or Path
            The file.

        Returns
        -------
        Localization
            What was saved.

        Raises
        ------
        ValueError
            If there is no such file, it is broken or of another format, or a field is missing or
            unknown; the message names the file.

        Examples
        --------
        >>> from lightloc import Localization
        >>> Localization.load("nowhere.npz")
        Traceback (most recent call last):
            ...
        ValueError: nowhere.npz: no such file
        """
        try:
            fields = read(path)
            fields["reason"] = Reason[fields["reason"]]
            fields["history"] = tuple(Step(**step) for step in fields["history"])
            return Localization(**fields)
        except KeyError as missing:
            raise ValueError(f"{path}: field {missing} is missing or unknown") from None
        except (TypeError, AttributeError, IndexError, OverflowError, RecursionError) as error:
            raise ValueError(f"{path}: a field is broken: {printable(str(error))}") from None
        except ValueError as error:
            said = str(error).removeprefix(f"{path}: ")
            raise ValueError(f"{path}: {printable(said)}") from None

    def to_frame(self) -> Any:
        """Put the lights into a data frame of pandas, which has to be installed.

        Returns
        -------
        pandas.DataFrame
            A row for each light, numbered from 1: ``x``, ``y``, ``z`` and ``intensity`` (or
            ``intensity_r`` and so on), each with its standard error (``x_error``), ``width``, and
            the kinds of the ``verdicts`` on it.

        Raises
        ------
        ValueError
            If pandas is not installed.

        Examples
        --------
        >>> import numpy as np
        >>> from lightloc import Irradiance, Observations, localize
        >>> x = np.random.default_rng(0).uniform(-1, 1, (100, 3)) * [1, 1, 0]
        >>> q = Observations(positions=x, normals=[[0, 0, 1]] * 100, radiance=np.zeros(100),
        ...                  sigma=0.01, material=Irradiance())
        >>> found = localize(q, bounds=[[-1, -1, 0.1], [1, 1, 1]])
        >>> list(found.to_frame().columns)[:4]  # doctest: +SKIP
        ['x', 'x_error', 'y', 'y_error']
        """
        try:
            import pandas
        except ImportError:
            raise ValueError("a data frame needs pandas: pip install pandas") from None
        numbers = pandas.RangeIndex(1, len(self.lights) + 1, name="light")
        return pandas.DataFrame(columns(self), index=numbers)

    def __str__(self) -> str:
        return text(self)

    def __repr__(self) -> str:
        return f"Localization(lights={self.lights!r}, reason={self.reason.name})"

    def _repr_html_(self) -> str:
        return html(self)


def in_the_unit(found: Localization, q: Observations) -> Localization:
    """The answer with lights that say the units of the observations."""

    def said(lights: PointLights) -> PointLights:
        return replace(lights, unit=q.unit, intensity_unit=q.intensity_unit)

    counts = tuple(replace(count, lights=said(count.lights)) for count in found.counts)
    return replace(found, lights=said(found.lights), counts=counts)


def among(found: Localization, used: NDArray[np.bool_]) -> Localization:
    """The answer over (n,) observations of which only those ``used`` were looked at.

    Its arrays over the observations have NaN where one was not.
    """
    if used.all():
        return found

    def spread(value: NDArray[Any], rest: float) -> NDArray[Any]:
        rows = np.full((len(used), value.shape[1]), rest, value.dtype)
        rows[used] = value
        return rows

    return replace(
        found,
        residual=spread(found.residual, np.nan),
        direct=spread(found.direct, np.nan),
        sigma=spread(found.sigma, np.nan),
        noise=replace(found.noise, outliers=spread(found.noise.outliers, False)),
        outlying=tuple(
            replace(group, observations=np.flatnonzero(used)[group.observations])
            for group in found.outlying
        ),
    )
