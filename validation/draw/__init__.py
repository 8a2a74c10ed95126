"""How figures and pages are drawn.

For other rooms, in pipeline order:

- `oklch`: linear sRGB of a colour in lightness, chroma and hue.
- `srgb`: linear values as sRGB bytes.
- `css`: three bytes as CSS writes a colour.
- `stops`: a colour map as a few colours of CSS.
- `place`: places of a room as colours.
- `paint`: values as an image, by a colour map.
- `png`: an image as the bytes of a PNG file.
"""

from validation.draw.colours import css, oklch, paint, place, png, srgb, stops

__all__ = [
    "oklch",
    "srgb",
    "css",
    "stops",
    "place",
    "paint",
    "png",
]
