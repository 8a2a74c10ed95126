"""The standard error that observations carry is the real one, on every material."""

import numpy as np
import pytest

import render
from lightloc import Lambert, Mixed

POINTS, FEW, MANY = 1024, 32, 512  # samples per point: the measurement's, the reference's
LIMIT = 4  # standard errors


def groups(material, n: int) -> dict[str, np.ndarray]:
    """The points of each BRDF; of a diffuse texture, the points of each albedo."""
    parts = material.brdfs if isinstance(material, Mixed) else (material,)
    index = material.index if isinstance(material, Mixed) else np.zeros(n, int)
    found = {}
    for b, part in enumerate(parts):
        mine = index == b
        if isinstance(part, Lambert) and len(part.albedo) > 1:
            for albedo in np.unique(part.albedo[mine]):
                found[f"Lambert {albedo:.2f}"] = mine & (part.albedo[:, 0] == albedo)
        else:
            found[type(part).__name__] = mine
    return found


@pytest.mark.parametrize("name", ["box_mixed", "box_conductor"])
def test_sigma_is_the_standard_error(name, load):
    """z-scores against a render of 16 times as many samples have mean 0 and deviation 1.

    For each material by itself, as a sigma too large on one and too small on another would weigh
    a fit wrongly. Limits: four standard errors of mean and deviation, and 5 % that neighbours of
    another brightness are allowed to add.
    """
    room = load(name)
    few, many = (
        render.observe(room, points=POINTS, spp=spp, seed=1, transport="full")
        for spp in (FEW, MANY)
    )
    np.testing.assert_array_equal(few.positions, many.positions)
    z = (few.radiance - many.radiance)[:, 0] / few.sigma[:, 0] / np.sqrt(1 + FEW / MANY)
    for label, mine in groups(few.material, POINTS).items():
        n = mine.sum()
        assert n > 50
        assert abs(z[mine].mean()) < LIMIT / np.sqrt(n), label
        assert abs(z[mine].std() - 1) < LIMIT / np.sqrt(2 * n) + 0.05, label


def test_sigma_falls_with_the_root_of_the_samples(load):
    """Sixteen times the samples, a quarter of the standard error, within 5 % on the average."""
    room = load("box_conductor")
    few, many = (
        render.observe(room, points=POINTS, spp=spp, seed=1, transport="full")
        for spp in (FEW, MANY)
    )
    ratio = np.sqrt((few.sigma**2).mean() / (many.sigma**2).mean())
    assert ratio == pytest.approx(4, rel=0.05)


def test_direct_light_is_exact(load):
    """Direct light is evaluated, not sampled: its sigma is 0."""
    q = render.observe(load("box_mixed"), points=64, seed=1, transport="direct")
    assert not q.sigma.any()
    assert not q.interreflected


def test_the_error_of_two_samples_is_not_too_small(load):
    """With two samples a point, what another seed changes is as large as both errors say.

    A mean of squares is known to the standard error of that mean, four of which are allowed;
    divided by the samples, and not by one fewer, the errors' squares would be half as large.
    """
    room = load("box_mixed")
    q = render.observe(room, points=POINTS, spp=2, seed=1, transport="full")
    one, other = (render.remeasure(room, q, spp=2, seed=seed) for seed in (2, 3))
    changed = np.square(one.radiance - other.radiance)
    stated = np.square(one.sigma) + np.square(other.sigma)
    off = changed.mean() / stated.mean() - 1
    known = changed.std() / np.sqrt(POINTS) / stated.mean()
    assert known < 0.1
    assert abs(off) < LIMIT * known
