"""Formulas drawn once, as outlines: they need no script and no font, and look alike everywhere."""

from __future__ import annotations

import html
import re
from typing import Any

import ziamath
from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util.math import get_node_equation_number

TEXT, SIZE = 16, 17.5
"""Pixels of an em of text, and of formulas beside it, whose letters are smaller."""

TALLEST = 10
"""Em: a formula that comes out taller was not understood."""


def drawn(tex: str, inline: bool) -> str:
    """SVG in the colour of the text around it, standing on its line."""
    if "&" in tex:
        tex = rf"\begin{{align*}}{tex}\end{{align*}}"
    svg = ziamath.Latex(tex, size=SIZE, color="currentColor", inline=inline).svg()
    pixels = re.search(r'width="([\d.]+)" height="([\d.]+)" viewBox="\S+ (\S+) [^"]*"', svg)
    assert pixels
    width, height, top = (float(number) / TEXT for number in pixels.groups())
    if height > TALLEST:
        raise ValueError(f"a formula is drawn {height:.0f} em tall: {tex}")
    place = f"width:{width:.3f}em;height:{height:.3f}em;vertical-align:{-height - top:.3f}em"
    label = html.escape(" ".join(tex.split()), quote=True)
    own = f'class="formula" role="img" aria-label="{label}" style="{place}"'
    return svg.replace("<svg ", f"<svg {own} ", 1)


def visit_inline(self: Any, node: nodes.math) -> None:
    self.body.append(drawn(node.astext(), inline=True))
    raise nodes.SkipNode


def visit_block(self: Any, node: nodes.math_block) -> None:
    number = get_node_equation_number(self, node) if node["number"] else ""
    place = f' id="{node["ids"][0]}"' if node["ids"] else ""
    said = f'<span class="number">({number})</span>' if number else ""
    self.body.append(f'<div class="equation"{place}>{drawn(node.astext(), False)}{said}</div>\n')
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, bool]:
    ziamath.config.svg2 = False  # each glyph in its place, for pages that show many formulas
    app.add_html_math_renderer("drawn", (visit_inline, None), (visit_block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}
