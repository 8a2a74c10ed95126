"""
A light meter on a desk
=======================

Twenty readings of a light meter, in lux, on a desk of 1.6 × 0.75 m say where the lamp above it
hangs. They also leave things open, which the answer names.
"""

import matplotlib.pyplot as plt
import numpy as np

import lightloc

x, y = np.meshgrid(np.linspace(0, 1.6, 5), np.linspace(0, 0.75, 4))
desk = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)])
up = np.tile([0.0, 0.0, 1.0], (len(desk), 1))
meter = lightloc.Observations(
    positions=desk,
    normals=up,
    radiance=np.zeros(len(desk)),
    material=lightloc.Irradiance(),
    intensity_unit="cd",
)
lamp = lightloc.PointLights([[0.45, 0.6, 0.7]], [120.0])
exact = lightloc.radiance(meter, lamp)
lux = exact * np.random.default_rng(4).normal(1, 0.02, exact.shape)

found = lightloc.localize(meter.with_radiance(lux, 0.02 * lux))
print(found)
for assumption in found.assumed:
    print("taken for granted:", assumption.value)

# %%
# From above, each reading is a disc.

figure, axes = plt.subplots(figsize=(6, 3.6))
shown = axes.scatter(*desk[:, :2].T, c=lux[:, 0], cmap="cividis", s=300)
figure.colorbar(shown, label="reading (lx)")
axes.plot(*lamp.positions[0, :2], "ko", ms=14, mfc="none", mew=2, label="true lamp")
axes.plot(*found.lights.positions[0, :2], "C1x", ms=9, mew=3, label="found")
axes.set(xlim=(-0.1, 1.7), ylim=(-0.1, 0.85), aspect="equal")
axes.set(xlabel="x (m)", ylabel="y (m)")
figure.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=2)
plt.show()

# %%
# From the side, with the lamp's errors of 95 %. A lamp that shines mostly downwards would bring
# nearly the same lux from another height, and so would two lamps that are as far apart as the
# circle is wide. Five more readings, 30 cm above the desk, tell: with them the height is known to
# 4 mm.

# sphinx_gallery_thumbnail_number = 2
(x, _, z), (ex, _, ez) = found.lights.positions[0], 1.96 * found.position_error[0]
dashed = dict(ec="#0072B2", ls="--", lw=2, fc="none")
circle = plt.Circle((x, z), found.resolution[0] / 2, **dashed)

figure, axes = plt.subplots(figsize=(6, 5.2))
axes.plot([0, 1.6], [0, 0], color="0.5", lw=8, solid_capstyle="butt")
axes.text(1.6, -0.06, "desk", ha="right", va="top")
axes.errorbar(x, z, ez, ex, color="#D55E00", capsize=5, lw=2)
axes.add_patch(circle)
axes.plot(*lamp.positions[0, [0, 2]], "ko", ms=14, mfc="none", mew=2, label="true lamp")
axes.plot(x, z, "x", color="#D55E00", ms=9, mew=3, label="found, with 95 %")
axes.plot([], [], "--", color="#0072B2", lw=2, label="two lamps?")
axes.set(xlabel="x (m)", ylabel="height over the desk (m)")
axes.set(ylim=(-0.2, 1.2), aspect="equal")
axes.legend(loc="upper right")
plt.show()
