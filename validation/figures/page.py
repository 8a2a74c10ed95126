"""The figures on one page, each beside what the paper's shows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import Any

from matplotlib.figure import Figure

STYLE = """
body { font: 16px/1.5 system-ui, sans-serif; color: #1a1a1a; background: #fff;
       max-width: 72rem; margin: 2rem auto; padding: 0 1rem; }
figure { margin: 0 0 1rem; } img { max-width: 100%; height: auto; border: 1px solid #ddd; }
dl { display: grid; grid-template-columns: max-content 1fr; gap: .3rem 1rem; }
dt { font-weight: 600; } dd { margin: 0; } section { margin-bottom: 3rem; }
footer { color: #555; font-size: .9rem; }
"""
MARKS = (
    "The paper's figures, drawn from our own scenes and fields. In Figure 1, as in the paper, the "
    "light is green and the observed point x0 red; in all others true lights are filled and red, "
    "what was found is an open green circle, and a candidate a dashed one. Around a 2D room stand "
    "B(q) and, next to the wall, the colour of each of its points in L(p)."
)


@dataclass(frozen=True, eq=False)
class Drawing:
    """A figure of the paper's number, our title, what the paper's shows, and what ours shows."""

    number: int
    title: str
    paper: str
    ours: str
    figure: Figure

    @property
    def name(self) -> str:
        return f"figure{self.number}"


def page(drawings: Sequence[Drawing], made: dict[str, Any]) -> str:
    """HTML without scripts or outside files; it shows the files beside it."""
    parts = "\n".join(_section(each) for each in drawings)
    return f"""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Figures 1 to 6</title>
<style>{STYLE}</style>
</head>
<body>
<h1>Figures 1 to 6</h1>
<p>{escape(MARKS)}</p>
{parts}
<footer>Made {escape(made["date"])} from commit {escape(made["commit"] or "unknown")},
lightloc {escape(made["versions"]["lightloc"])}.</footer>
</body>
</html>
"""


def _section(drawing: Drawing) -> str:
    title = f"Figure {drawing.number}. {drawing.title}"
    return f"""<section id="{drawing.name}">
<h2>{escape(title)}</h2>
<figure><a href="{drawing.name}.svg"><img src="{drawing.name}.png" alt="{escape(title)}"></a>
</figure>
<dl>
<dt>The paper's</dt><dd>{escape(drawing.paper)}</dd>
<dt>Ours</dt><dd>{escape(drawing.ours)}</dd>
</dl>
</section>"""
