"""
An answer's errors beside the truth
===================================

Each light comes with standard errors and a covariance. Here one room is seen twelve times, each
time with new noise of 5 %: an ellipse is where an answer says that the light is, with 95 %.
"""

import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Ellipse

import lightloc
import render

room = render.load("box_two")
exact = render.observe(room, points=500, transport="direct")
sigma = 0.05 * np.sqrt(exact.radiance * exact.radiance.mean())
rng = np.random.default_rng(0)

answers = []
for _ in range(12):
    B = exact.radiance + sigma * rng.normal(size=sigma.shape)
    answers.append(lightloc.localize(exact.with_radiance(B, sigma), room.geometry))
assert all(len(found.lights) == 2 for found in answers)

# %%
# The fainter of the two lights, seen from above, in mm around where it truly is. An ellipse should
# miss that once in twenty times.

INSIDE = 5.99  # chi-square of two degrees of freedom: 95 %
light = 1
true = room.lights.positions[light, :2]

figure, axes = plt.subplots(figsize=(6, 5.6))
held = 0
for found in answers:
    xy = slice(3 * light, 3 * light + 2)
    covariance = found.covariance[xy, xy]
    off = found.lights.positions[light, :2] - true
    holds = off @ np.linalg.solve(covariance, off) < INSIDE
    held += holds
    (short, long), ways = np.linalg.eigh(covariance)
    axes.add_patch(
        Ellipse(
            1e3 * off,
            2e3 * np.sqrt(INSIDE * long),
            2e3 * np.sqrt(INSIDE * short),
            angle=np.degrees(np.arctan2(*ways[::-1, 1])),
            fc="none",
            ec="#0072B2" if holds else "#D55E00",
            lw=1.5,
        )
    )
    axes.plot(*(1e3 * off), ".", color="#0072B2" if holds else "#D55E00", ms=9)
axes.plot(0, 0, "k+", ms=18, mew=3)
axes.set(xlabel="found x − true x (mm)", ylabel="found y − true y (mm)")
axes.set_aspect("equal")
axes.set_title(f"{held} of {len(answers)} ellipses hold the true place")
plt.show()

# %%
# Over all coordinates and intensities, errors divided by their stated standard errors should be
# spread as a Gaussian of deviation 1.


def values(lights):
    return np.concatenate([lights.positions.ravel(), lights.intensities.ravel()])


z = [
    (values(found.lights) - values(room.lights)) / np.sqrt(np.diag(found.covariance))
    for found in answers
]
print(f"{np.size(z)} errors: mean {np.mean(z):.2f}, deviation {np.std(z):.2f}")

figure, axes = plt.subplots(figsize=(6, 4))
bins = np.arange(-4, 4.5, 0.5)
axes.hist(np.ravel(z), bins=bins, density=True, color="#56B4E9", ec="w")
t = np.linspace(-4, 4, 200)
axes.plot(t, np.exp(-(t**2) / 2) / np.sqrt(2 * np.pi), "k", lw=2, label="Gaussian")
axes.set(xlabel="error / stated standard error", ylabel="density")
axes.legend()
plt.show()
