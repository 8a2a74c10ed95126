"""
Noise that nobody knows
=======================

Where sigma is left out, the law of the noise is estimated together with the lights: B has the
variance read² + shot B + (relative B)². Here a sensor has read noise and a relative error, and one
reading in fifty is an outlier.
"""

import matplotlib.pyplot as plt
import numpy as np

import lightloc
import render

READ, SHOT, RELATIVE = 0.03, 0.0, 0.03  # read noise in W/(sr m²), and 3 % of B


def deviation(B, read, shot, relative):
    return np.sqrt(read**2 + shot * B + (relative * B) ** 2)


room = render.load("box_three")
exact = render.observe(room, points=3000, transport="direct")
rng = np.random.default_rng(0)
B = rng.normal(exact.radiance, deviation(exact.radiance, READ, SHOT, RELATIVE))
B *= np.where(rng.random(B.shape) < 0.02, rng.uniform(1.4, 3, B.shape), 1)
found = lightloc.localize(exact.with_radiance(B, sigma=None), room.geometry)
print(found)

# %%
# Dots are how far each observation is from what the lights that were found bring. Outliers neither
# widen the law nor become lights.

noise = found.noise
model = lightloc.radiance(exact, found.lights, room.geometry)[:, 0]
off = np.abs(B[:, 0] - model)
outlier = noise.outliers[:, 0]
along = np.geomspace(*np.quantile(model, [0.005, 1]), 200)

law = noise.read[0], noise.shot[0], noise.relative[0]
print("read, shot, relative:", *(f"{value:.2g}" for value in law))

figure, axes = plt.subplots(figsize=(6, 5.2))
axes.loglog(model[~outlier], off[~outlier], ".", color="0.7", ms=3)
told = dict(color="#D55E00", ms=5, label="told as outliers")
axes.loglog(model[outlier], off[outlier], "x", **told)
true = deviation(along, READ, SHOT, RELATIVE)
axes.plot(along, true, "k", lw=6, alpha=0.4, label="true law")
axes.plot(along, deviation(along, *law), "C0--", lw=2, label="estimated law")
axes.set(xlabel="B of the model (W sr⁻¹ m⁻²)", ylabel="|B − model| and its deviation")
axes.set_ylim(1e-4, 10)
axes.legend(loc="lower right", markerscale=1.5)
plt.show()
