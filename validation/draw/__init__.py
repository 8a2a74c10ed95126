"""The one room that draws: Plotly figures for pages, matplotlib figures for print, pictures.

For other rooms, in pipeline order. On pages:

- `Light`: a light to be marked, and whether it was found.
- `room`: a room in 3D, from room.npz.
- `slices`: D, L and V on a plane, from fields.npz.
- `search_curve`: a search's chi-square, step by step.
- `study_curve`: what a study measured.
- `unfolded`: values on the walls of a room, laid flat.
- `embedded`: a figure as JSON that a page holds.
- `script`: plotly.js, which draws it there.
- `developed`: a camera's view as a picture.
- `difference`: the difference of two views.
- `DIFFERENCE`: the colours of that one, for a bar.

In print:

- `canvas`: an empty figure.
- `plane`: axes of a 2D room.
- `outline_colours`: the colours of an outline's places.
- `field`: D or I over a grid.
- `logarithmic`: the same over any rectangle.
- `limiters`: L over a grid.
- `votes`: V over a grid.
- `walls`: B along the walls.
- `space`: axes of a 3D room.
- `cloud`: V on the medial axis.
- `radiance_points`: B at the points of the far walls.
- `RED`: the colour of what is true.
- `GREEN`: the colour of what was found.
- `BLUE`: the colour of what is new.
- `true`: true lights, marked.
- `found`: found ones, marked.
- `frame`: a square about a place.
- `legend`: an entry a mark.
- `written`: a figure as PNG or SVG.
"""

from validation.draw.curves import search_curve, study_curve
from validation.draw.fields import field, limiters, logarithmic, outline_colours, votes, walls
from validation.draw.flat import unfolded
from validation.draw.marks import BLUE, GREEN, RED, Light
from validation.draw.page import embedded, script
from validation.draw.planes import slices
from validation.draw.prints import canvas, found, frame, legend, plane, true, written
from validation.draw.room3d import room
from validation.draw.solid import cloud, radiance_points, space
from validation.draw.views import DIFFERENCE, developed, difference

__all__ = [
    "Light",
    "room",
    "slices",
    "search_curve",
    "study_curve",
    "unfolded",
    "embedded",
    "script",
    "developed",
    "difference",
    "DIFFERENCE",
    "canvas",
    "plane",
    "outline_colours",
    "field",
    "logarithmic",
    "limiters",
    "votes",
    "walls",
    "space",
    "cloud",
    "radiance_points",
    "RED",
    "GREEN",
    "BLUE",
    "true",
    "found",
    "frame",
    "legend",
    "written",
]
