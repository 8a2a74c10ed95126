"""How figures and pages are drawn.

For other rooms, in pipeline order. On pages:

- `srgb`: linear values as sRGB bytes.
- `css`: three bytes as CSS writes a colour.
- `stops`: a colour map as a few colours of CSS.
- `place`: places of a room as colours.
- `paint`: values as an image, by a colour map.
- `png`: an image as the bytes of a PNG file.

In print, by matplotlib:

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

from validation.draw.colours import css, paint, place, png, srgb, stops
from validation.draw.fields import field, limiters, logarithmic, outline_colours, votes, walls
from validation.draw.marks import BLUE, GREEN, RED
from validation.draw.prints import canvas, found, frame, legend, plane, true, written
from validation.draw.solid import cloud, radiance_points, space

__all__ = [
    "srgb",
    "css",
    "stops",
    "place",
    "paint",
    "png",
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
