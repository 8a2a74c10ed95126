"""Materials that are made of other materials."""

from __future__ import annotations

from dataclasses import dataclass

from lightloc.brdf.parameters import Parameters
from lightloc.brdf.protocol import BRDF, is_brdf


@dataclass(frozen=True, eq=False)
class Parts:
    """Checks and channel count for materials that are made of others."""

    brdfs: tuple[BRDF, ...]

    def _check(self) -> None:
        name = type(self).__name__
        if is_brdf(self.brdfs) or not all(is_brdf(brdf) for brdf in self.brdfs):
            raise ValueError(f"{name}.brdfs is not a sequence of BRDFs")
        object.__setattr__(self, "brdfs", tuple(self.brdfs))

    @property
    def channels(self) -> int:
        """The number of channels: 3 where a part has 3, else 1."""
        return max(brdf.channels for brdf in self.brdfs)

    def check_length(self, n: int) -> None:
        """Check that every part fits n observations.

        Parameters
        ----------
        n : int
            Number of observations.

        Raises
        ------
        ValueError
            If a parameter of a part has neither 1 row nor n, or an index has not n.

        Examples
        --------
        >>> from lightloc import Lambert, Sum
        >>> Sum([Lambert(albedo=0.5), Lambert(albedo=[0.1, 0.2])]).check_length(3)
        Traceback (most recent call last):
            ...
        ValueError: Lambert.albedo has 2 rows; expected 1 or 3
        """
        for brdf in self.brdfs:
            if isinstance(brdf, (Parts, Parameters)):
                brdf.check_length(n)
