"""Draw the README's picture from a validated case: python docs/picture.py CASE_FOLDER OUT.png"""

import json
import sys
from pathlib import Path

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

folder, out = Path(sys.argv[1]), Path(sys.argv[2])
case = json.loads((folder / "result.json").read_text())
fields, view = np.load(folder / "fields.npz"), np.load(folder / "view.npz")
true = np.array([light["position"] for light in case["lights"]["true"]])
found = np.array([light["position"] for light in case["lights"]["found"]])

figure = Figure(figsize=(12, 3.4), layout="constrained")
seen, bound, votes = figure.subplots(1, 3)
picture = view["rendered"]
seen.imshow(np.clip(picture / np.quantile(picture, 0.97), 0, 1) ** (1 / 2.2))
seen.set_title("What is seen: a room, its lights unseen")
seen.axis("off")
extent = fields["extent"]
D = np.where(np.isfinite(fields["D"]) & (fields["D"] > 0), fields["D"], np.nan)
bound.imshow(D, extent=extent, origin="lower", norm=LogNorm(), cmap="viridis")
bound.set_title("D(p): how bright can a light here be?")
hue = fields["limiter"]
low, high = np.nanmin(hue, axis=(0, 1)), np.nanmax(hue, axis=(0, 1))
votes.imshow(np.nan_to_num((hue - low) / (high - low + 1e-9)), extent=extent, origin="lower")
votes.set_title("L(p): which surface says so?")
for axes in (bound, votes):
    axes.scatter(*true[:, :2].T, s=90, facecolors="none", edgecolors="white", label="true")
    axes.scatter(*found[:, :2].T, s=40, c="red", marker="x", label="found")
    axes.set_xlabel("x in m")
bound.legend(loc="upper right")
figure.savefig(out, dpi=110)
