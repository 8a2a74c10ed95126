"""Draw the README's picture from a validated case: python docs/picture.py CASE_FOLDER OUT.png"""

import json
import sys
from pathlib import Path

import numpy as np

from validation import draw

folder, out = Path(sys.argv[1]), Path(sys.argv[2])
case = json.loads((folder / "result.json").read_text())
fields, view = np.load(folder / "fields.npz"), np.load(folder / "view.npz")
true = np.array([light["position"] for light in case["lights"]["true"]])
found = np.array([light["position"] for light in case["lights"]["found"]])

figure = draw.canvas(12, 3.6, "")
seen, bound, limiter = figure.subplots(1, 3, width_ratios=(1, 1.15, 0.9))
picture = view["rendered"]
seen.imshow(np.clip(picture / np.quantile(picture, 0.97), 0, 1) ** (1 / 2.2))
seen.set_title("What is seen: a room, its lights unseen")
seen.axis("off")
extent = fields["extent"]
draw.logarithmic(bound, fields["D"], extent, "D in W/sr")
bound.set_title("D(p): how bright can a light here be?")
hue = fields["limiter"]
low, high = np.nanmin(hue, axis=(0, 1)), np.nanmax(hue, axis=(0, 1))
limiter.imshow(np.nan_to_num((hue - low) / (high - low + 1e-9)), extent=extent, origin="lower")
limiter.set_title("L(p): which surface says so?")
for axes in (bound, limiter):
    draw.true(axes, true)
    draw.found(axes, found)
    axes.set_xlabel("x in m")
draw.legend(figure, bound)
out.write_bytes(draw.written(figure, "png"))
