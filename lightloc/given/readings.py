"""Readings of an instrument, from a table in a text file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from lightloc.brdf import BRDF, Irradiance, Lambert
from lightloc.checks import array
from lightloc.given.columns import METRES, UNKNOWN, Columns
from lightloc.given.observations import Observations
from lightloc.given.table import Table

TINY = 1e-12  # below this a direction is lost in rounding


@dataclass(frozen=True)
class Quantity:
    """What readings may be.

    Parameters
    ----------
    names
        Of its column.
    units
        Spellings of its unit; the first is for messages.
    intensity
        The unit of intensities where lengths are in metres.
    unknown
        Its unit times the square of a unit of length that nobody says.
    arrives
        Whether it arrives at the surface, whatever that reflects.
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    intensity: str
    unknown: str
    arrives: bool


QUANTITIES = {
    "lux": Quantity(
        ("lux", "lx", "illuminance"), ("lx", "lux", "lm/m2", "lmm-2"), "cd", "lx unit^2", True
    ),
    "irradiance": Quantity(("irradiance",), ("W/m2", "wm-2"), "W/sr", "W m^-2 unit^2", True),
    "luminance": Quantity(
        ("luminance", "cdm2", "nits"),
        ("cd/m2", "cdm-2", "nit", "nits"),
        "cd",
        "cd m^-2 unit^2",
        False,
    ),
    "radiance": Quantity(
        ("radiance", ""),
        ("W/(m2 sr)", "w/m2/sr", "w/sr/m2", "w/m2sr", "w/srm2", "wm-2sr-1", "wsr-1m-2"),
        "W/sr",
        "W sr^-1 m^-2 unit^2",
        False,
    ),
}
ERRORS = ("error", "err", "sigma", "std", "stddev", "stderr", "standarderror", "uncertainty")
ALBEDOS = ("albedo", "reflectance")


def read_readings(
    path: str | Path,
    *,
    albedo: ArrayLike | None = None,
    material: BRDF | None = None,
    interreflected: bool = False,
    unit: str | None = None,
    floor: float | None = None,
    saturated: float | None = None,
    step: float = 0.0,
) -> Observations:
    """Read what an instrument measured from a table: CSV, with a header that names the columns.

    Case, spaces and points in the names do not matter, nor does the order; other columns are
    ignored. The separator is a comma, a semicolon or a tab, with the two last of which numbers may
    have decimal commas. Blank lines and lines that begin with ``#`` are left out.

    ====================== ======================================================================
    columns                hold
    ====================== ======================================================================
    x, y, z                the point, in the unit of the header, as in ``x [mm]`` or ``x (cm)``
    nx, ny, nz             the normal there: the way in which a light meter looks
    lux or irradiance      what arrives there, in lx or in W m^-2
    luminance or radiance  what leaves it, in cd m^-2 or in W sr^-1 m^-2; also as R, G, B
    error                  the standard error of that, in its unit or in %; need not be there
    albedo                 of a diffuse surface, where luminance or radiance is read
    dx, dy, dz             the way towards the instrument, for surfaces that are not diffuse
    ====================== ======================================================================

    Values in colours have three columns, as ``irradiance R``, ``irradiance G``, ``irradiance B``;
    so may error and albedo.

    Parameters
    ----------
    path : str or Path
        The file, UTF-8.
    albedo : float, (3,), (n, 1) or (n, 3) array_like, optional
        Where luminance or radiance is read from a diffuse surface, and no column says it.
    material : BRDF, optional
        The surface's, in place of an albedo.
    interreflected : bool
        Whether the values hold interreflected light, as those of a room do. `localize` removes it;
        from what a light meter reads with ``indirect`` alone.
    unit : str, optional
        The unit of length where the header has none: "m", "cm", "mm" or another.
    floor, saturated : float, optional
        What the instrument can't tell, in the unit of the readings: what is not above the one, and
        what is at least the other, `localize` leaves out.
    step : float
        Spacing of the readings, in their unit, as lx or W sr^-1 m^-2; 0 where they have none.

    Returns
    -------
    Observations
        The n readings, in the header's unit of length. Values are by the square of that unit, so
        that intensities come out in cd where light was measured as an eye sees it, and in W/sr
        elsewhere, as ``intensity_unit`` says. Where nobody says the unit of length it is "unit",
        and values stay as they are. ``sigma`` is None where there is no error.

    Raises
    ------
    ValueError
        In one sentence with the file, and the line and the column where there are any: if a column
        is missing, stands twice or has an unknown unit, a cell is no finite number, a normal has
        length zero, an error is negative, a row has another number of cells than the header, the
        file is no table, or ``floor`` or ``step`` is negative.

    Examples
    --------
    >>> import tempfile
    >>> from pathlib import Path
    >>> from lightloc import read_readings
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "meter.csv")
    ...     lines = ["x [mm],y [mm],z [mm],nx,ny,nz,lux,error [%]", "0,0,0,0,0,1,250,2"]
    ...     _ = path.write_text("\\n".join(lines))
    ...     q = read_readings(path)
    >>> q.unit, q.quantity, q.intensity_unit, round(q.radiance.item() * 1000**2, 6)
    ('mm', 'irradiance', 'cd', 250.0)
    """
    table = Table.read(path)
    columns = Columns.of(table)
    if material is not None and albedo is not None:
        raise ValueError("read_readings takes an albedo or a material, not both")
    length = columns.length(unit)
    x = table.numbers(columns.vector("position"))
    normals, directions = _unit(table, columns, "normal"), None
    quantity, values, B = _values(table, columns)
    if quantity.arrives and (material is not None or albedo is not None):
        raise ValueError(
            f"{path}: column {table.header[values[0]]} is what arrives at the surface, whatever "
            "its albedo or material"
        )
    surface = material or (
        Irradiance() if quantity.arrives else _diffuse(table, columns, values, albedo)
    )
    if not quantity.arrives and (columns.has("direction") or not isinstance(surface, Lambert)):
        directions = _unit(table, columns, "direction")
    scale = METRES.get(length, 1.0) ** 2
    try:
        return Observations(
            positions=x,
            normals=normals,
            directions=normals if directions is None else directions,
            radiance=B * scale,
            sigma=_sigma(table, columns, quantity, values, B, scale),
            material=surface,
            interreflected=interreflected,
            saturated=None if saturated is None else (saturated <= B).any(axis=1),
            floor=None if floor is None else floor * scale,
            step=step * scale,
            unit=length,
            intensity_unit=quantity.unknown if length == UNKNOWN else quantity.intensity,
        )
    except ValueError as error:
        said = str(error)
        raise ValueError(said if said.startswith(f"{path}: ") else f"{path}: {said}") from None


def _unit(table: Table, columns: Columns, vector: str) -> NDArray[np.float64]:
    """(n, 3) the normals or directions; refuses one of length zero."""
    where = columns.vector(vector)
    vectors = table.numbers(where)
    zero = np.linalg.norm(vectors, axis=1) < TINY
    if zero.any():
        raise ValueError(
            f"{table.path}: line {table.lines[int(np.argmax(zero))]}, columns "
            f"{columns.said(where)}: the {vector} has length zero"
        )
    return vectors


def _values(table: Table, columns: Columns) -> tuple[Quantity, list[int], NDArray[np.float64]]:
    """What was read, its columns, and (n, c) its values."""
    found = [(q, columns.some(q.names)) for q in QUANTITIES.values()]
    found = [(q, where) for q, where in found if where]
    if len(found) != 1:
        some = " and ".join(columns.said(where) for _, where in found)
        what = f"columns {some} are both readings" if found else "has no column of readings"
        raise ValueError(f"{table.path}: {what}; expected one of {', '.join(QUANTITIES)}")
    quantity, where = found[0]
    if quantity.arrives and columns.units[where[0]].lower() in ("lx", "lux"):  # irradiance [lx]
        quantity = QUANTITIES["lux"]
    columns.unit(where, quantity.units)
    return quantity, where, table.numbers(where)


def _diffuse(
    table: Table, columns: Columns, values: Sequence[int], albedo: ArrayLike | None
) -> Lambert:
    """The surface whose radiance was read."""
    where = columns.some(ALBEDOS)
    if bool(where) == (albedo is not None):
        what = "has an albedo in the table too" if where else "needs an albedo"
        raise ValueError(
            f"{table.path}: column {table.header[values[0]]} {what}; expected a column albedo or "
            "the argument albedo"
        )
    share = 0.01 if columns.unit(where, (), percent=True) else 1.0
    if not where:
        try:
            value = np.asarray(albedo)
            return Lambert(albedo=array("albedo", value, (None,) * value.ndim, 0.0, 1.0))
        except ValueError as error:
            raise ValueError(f"{table.path}: {error}") from None
    given = share * table.numbers(where)
    for k, column in enumerate(where):
        bad = (given[:, k] < 0) | (given[:, k] > 1)
        if bad.any():
            raise table.refused(int(np.argmax(bad)), column, "is no albedo, from 0 to 1")
    return Lambert(albedo=given)


def _sigma(
    table: Table,
    columns: Columns,
    quantity: Quantity,
    values: Sequence[int],
    B: NDArray[np.float64],
    scale: float,
) -> NDArray[np.float64] | None:
    """(n, c) standard errors times ``scale``; None where nobody says them."""
    names = [f"{name}{error}" for error in ERRORS for name in ("", *quantity.names)]
    where = columns.some(list(dict.fromkeys(names)))
    if not where:
        return None
    relative = columns.unit(where, quantity.units, percent=True) == "%"
    error = table.numbers(where)
    for k, column in enumerate(where):
        bad = error[:, k] < 0
        if bad.any():
            raise table.refused(int(np.argmax(bad)), column, "is no standard error, at least 0")
    if error.shape[1] > B.shape[1]:
        raise ValueError(
            f"{table.path}: columns {columns.said(where)} are errors of colours, but "
            f"{columns.said(values)} has none"
        )
    sigma = np.broadcast_to(error * np.abs(B) / 100 if relative else error, B.shape)
    exact = (sigma == 0) & (B < 0)
    if exact.any():
        row, k = divmod(int(np.argmax(exact)), exact.shape[1])
        raise table.refused(row, values[k], "is below 0, and exact (its error is 0)")
    return sigma * scale
