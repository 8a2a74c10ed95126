"""
The fields D(p) and L(p)
========================

An observation bounds what a light at p can be: a brighter one would make that surface look brighter
than it does. D(p) is the least of these bounds, and L(p) is the observation that sets it (Eq. 6 and
7). A room in two dimensions, with a pillar and three lights, shows both whole.
"""

import matplotlib.pyplot as plt
import numpy as np

import lightloc

room = lightloc.Outline.polygon([[0, 0], [5, 0], [5, 4], [0, 4]])
room = room.with_occluders(room.disc([2.5, 2.0], 0.5))
lights = lightloc.PointLights([[1, 3, 0], [2.8, 0.6, 0], [4.4, 3.4, 0]], [3, 2, 1])

x, normals = room.sample(600)
dark = lightloc.Observations(
    positions=x,
    normals=normals,
    directions=normals,
    radiance=np.zeros(len(x)),
    material=lightloc.Lambert(albedo=0.5),
)
seen = dark.with_radiance(lightloc.radiance(dark, lights, room), sigma=0)
found = lightloc.localize(seen, room)
print(found)
print("D at the lights:", found.bound[:, 0].round(2), "W/sr")

# %%
# At a light, D is at least the light's intensity. Here it is just that, since each light has some
# surface to itself.

grid = lightloc.Grid([0, 0, 0], [5, 4, 0], (500, 400, 1))
D, L = lightloc.intensity_distance(seen, grid, room)
free = room.inside(grid.points)


def draw(values, **how):
    """A field in free space, with the lights."""
    picture = np.where(free, values[:, 0], np.nan).reshape(500, 400).T
    figure, axes = plt.subplots(figsize=(6, 4.7))
    box = dict(extent=(0, 5, 0, 4), origin="lower", interpolation="nearest")
    shown = axes.imshow(picture, **box, **how)
    ring = dict(ms=14, mfc="none", mec="w", mew=2.5)
    axes.plot(*lights.positions[:, :2].T, "o", label="true", **ring)
    axes.plot(*found.lights.positions[:, :2].T, "kx", ms=9, mew=2, label="found")
    axes.set(xlabel="x (m)", ylabel="y (m)")
    below = dict(loc="outside lower center", ncols=2, facecolor="0.7", frameon=True)
    figure.legend(*axes.get_legend_handles_labels(), **below)
    return figure, axes, shown


figure, axes, shown = draw(D, cmap="cividis", norm="log", vmin=0.1, vmax=5)
axes.set_title("D(p): the brightest that a light here can be")
bar = figure.colorbar(shown, label="D (W/sr)", extend="both")
bar.set_ticks([0.1, 0.3, 1, 3], labels=["0.1", "0.3", "1", "3"])
plt.show()

# %%
# Regions of L meet at a light: there, surfaces on several sides set the same bound. The colour of a
# place is that of the wall which limits it; the pillar's are the light browns.

figure, axes, shown = draw(L, cmap="twilight", vmin=0, vmax=len(x))
along = dict(c=np.arange(len(x)), cmap="twilight", clip_on=False, zorder=3)
axes.scatter(*x[:, :2].T, s=12, **along)
axes.set_title("L(p): which observation says so")
figure.colorbar(shown, label="observation, along the walls")
plt.show()
