"""
What a budget of time buys
==========================

A search adds one light after another, and ends when what is left is noise. With ``seconds=`` it
ends earlier, with the best lights so far and the reason OUT_OF_TIME. Here are seven lights.
"""

import time

import matplotlib.pyplot as plt
import numpy as np

import lightloc
import render

room = render.load("box_three")
rng = np.random.default_rng(3)
low, high = room.bounds
places = low + (high - low) * rng.uniform(0.12, 0.88, (7, 3))
room = render.relight(room, lightloc.PointLights(places, rng.uniform(5, 30, 7)))
seen = render.observe(room, points=3000, transport="direct", noise=0.01)
lightloc.localize(seen, room.geometry, seconds=0.1)  # compile the kernels

steps = []


def watch(step):
    steps.append((time.perf_counter() - began, step.lights, step.chi2))


began = time.perf_counter()
whole = lightloc.localize(seen, room.geometry, watch=watch)
ended = time.perf_counter() - began
print(f"no budget: {len(whole.lights)} lights, {whole.reason.name}, {ended:.1f} s")

answers = []
for seconds in (0.15 * ended, 0.4 * ended):
    began = time.perf_counter()
    found = lightloc.localize(seen, room.geometry, seconds=seconds)
    spent = time.perf_counter() - began
    answers.append((spent, found.chi2))
    print(f"{seconds:.1f} s: {len(found.lights)} lights, {found.reason.name}, {spent:.1f} s")

# %%
# Chi-square falls with each light. What comes after the last one is the question whether the model
# is right, and how many lights there may be; an answer that was cut short has not asked it.

figure, axes = plt.subplots(figsize=(6, 4.8))
at, lights, chi2 = zip(*steps, strict=True)
curve = [*at, ended], [*chi2, whole.chi2]
axes.step(*curve, where="post", lw=2, label="search without a budget")
for t, count, value in steps:
    axes.annotate(count, (t, value), xytext=(3, 4), textcoords="offset points")
said = f"its answer: {whole.reason.name}"
axes.plot(ended, whole.chi2, "o", ms=9, color="#009E73", label=said)
said = "answers of a budget: OUT_OF_TIME"
axes.plot(*zip(*answers, strict=True), "D", ms=9, color="#D55E00", label=said)
axes.axhline(1, color="0.6", ls=":", zorder=0)
axes.set(yscale="log", xlim=0, ylim=(0.5, 150))
axes.set(xlabel="time (s)", ylabel="χ² per residual")
axes.set_yticks([1, 10, 100], ["1", "10", "100"])
axes.legend(fontsize=11)
plt.show()
