"""What departures there are, kind by kind."""

from __future__ import annotations

from lightloc.diagnosis.departure import Maker
from lightloc.diagnosis.emission import emission
from lightloc.diagnosis.encoding import encodings
from lightloc.diagnosis.geometry import shadows
from lightloc.diagnosis.indirect import indirect
from lightloc.diagnosis.material import materials
from lightloc.diagnosis.normals import normals
from lightloc.diagnosis.outside import outside
from lightloc.diagnosis.piece import pieces
from lightloc.diagnosis.wide import wide

GEOMETRY: tuple[Maker, ...] = (shadows, pieces)
"""Those of the geometry."""

MAKERS: tuple[Maker, ...] = (
    materials,
    encodings,
    indirect,
    outside,
    normals,
    emission,
    wide,
    *GEOMETRY,
)
"""Each gives the departures of its kind that are worth a question beside lights."""
