"""
A wrong BRDF, and what the answer says
======================================

All walls of this room are of a measured cloth, which reflects back to where light comes from. A
camera sees it, and the search is told that the walls are diffuse. It says that the model does not
explain what is seen.
"""

import matplotlib.pyplot as plt
import numpy as np

import lightloc
import render
import validation

room = render.load("box_kinds", material="measured")
view = render.photograph(room, width=320, transport="direct")

figure, axes = plt.subplots(figsize=(6, 4.8))
axes.imshow(np.clip(view.film / np.quantile(view.film, 0.98), 0, 1) ** (1 / 2.2))
axes.set_title("what the camera sees")
axes.set(xticks=[], yticks=[], frame_on=False)
plt.show()

# %%
# The right BRDF first. In ``render.observe_view``, ``material=`` stands in
# place of the scene's own.

view = render.photograph(room, width=48, transport="direct")
cloth = render.observe_view(view, room)
paint = render.observe_view(view, material=lightloc.Lambert(albedo=0.5))
sigma = 0.01 * np.sqrt(cloth.radiance * cloth.radiance.mean())
B = cloth.radiance + sigma * np.random.default_rng(0).normal(size=sigma.shape)

right = lightloc.localize(cloth.with_radiance(B, sigma), room.geometry)
print(right)
print(validation.compare(right.lights, room.lights, room.diagonal))

# %%
# What is left, pixel by pixel, is noise of deviation 1. Pixels that see two walls are left out.


def draw(found, title):
    """The residual of an answer, as the camera sees it."""
    picture = np.full(view.used.shape, np.nan)
    picture[view.used] = found.residual[:, 0]
    figure, axes = plt.subplots(figsize=(6, 5.8))
    shown = axes.imshow(picture, cmap="PuOr", vmin=-15, vmax=15)
    axes.set_title(title)
    axes.set(xticks=[], yticks=[], frame_on=False)
    bar = dict(orientation="horizontal", extend="both", fraction=0.06)
    figure.colorbar(shown, label="residual (standard errors)", **bar)
    plt.show()


draw(right, "residual, believed to be measured cloth")

# %%
# With the wrong BRDF the residual has a shape. The lights are half a metre off, and their stated
# errors are far smaller than that: an answer that ends with NO_GAIN is a warning, no measurement.
# What its verdicts say is what the residual is most like; none of it explains all.

wrong = lightloc.localize(paint.with_radiance(B, sigma), room.geometry)
print(wrong.reason.name, "-", wrong.reason.value)
for verdict in wrong.verdicts:
    print(f"{verdict.kind.name}: {verdict.sentence}")
print(validation.compare(wrong.lights, room.lights, room.diagonal, radius=1))

# sphinx_gallery_thumbnail_number = 3
draw(wrong, "residual, believed to be diffuse")
