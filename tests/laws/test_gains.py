"""Gains: how much chi-square falls with one light more, all that is there adapting to it."""

from __future__ import annotations

import numpy as np
import pytest

from lightloc import Observations, PointLights
from lightloc.fields.grid import Grid
from lightloc.fit.information import jacobian
from lightloc.fit.problem import Problem, residuals
from lightloc.search.dictionary import Dictionary, Left, atoms_at, gains_at
from validation.rooms.plane import PlaneRoom, rooms

NONE = PointLights(np.zeros((0, 3)), np.zeros((0, 1)))
PLACES = np.random.default_rng(5).uniform(0.1, 0.9, (30, 3)) * [1, 1, 0]


@pytest.fixture
def room() -> PlaneRoom:
    return rooms(3, count=1)[0]


def posed(q: Observations, double: bool) -> Problem:
    sigma = 0.05 * (q.radiance + q.radiance.mean())
    return Problem.of(q, sigma, None, q.bounds, double=double)


def fallen(J: np.ndarray, atom: np.ndarray, z: np.ndarray) -> float:
    """By how much the squares of z fall when an atom joins J's columns; 0 for less light."""
    both = np.column_stack([J, atom])
    more, _, _, _ = np.linalg.lstsq(both, z)
    if more[-1] <= 0:
        return 0.0
    before = z - J @ np.linalg.lstsq(J, z)[0] if J.shape[1] else z
    return float(np.square(before).sum() - np.square(z - both @ more).sum())


@pytest.mark.parametrize("there", [0, 2])
def test_gains_are_the_fall_of_chi_square(there, room):
    """By least squares over the lights' own derivatives and the further light, place by place."""
    problem = posed(room.observe(), double=True)
    off = room.lights.positions[:there] + np.array([0.02, -0.01, 0])
    lights = PointLights(off, room.lights.intensities[:there]) if there else NONE
    z = residuals(problem, lights)
    J = jacobian(problem, lights)[0] if there else np.zeros((len(z), 0))
    left = Left.beside(problem, lights, z, np.ones_like(z))
    atoms = atoms_at(problem, PLACES)[0]
    expected = [fallen(J, atom, z[:, 0]) for atom in atoms]
    gains = gains_at(problem, PLACES, left)
    np.testing.assert_allclose(gains, expected, rtol=1e-6, atol=1e-9 * np.square(z).sum())
    assert (gains > 0).any()
    darker = Left.beside(problem, lights, -z, np.ones_like(z))
    expected = [fallen(J, atom, -z[:, 0]) for atom in atoms]
    np.testing.assert_allclose(
        gains_at(problem, PLACES, darker), expected, rtol=1e-6, atol=1e-9 * np.square(z).sum()
    )


def test_a_dictionary_under_other_errors(room, eps):
    """Its atoms are those that it would have been made of: float32, one quotient, one product."""
    q = room.observe()
    narrow, wide = (
        Problem.of(q, k * (q.radiance + q.radiance.mean()), None, q.bounds) for k in (0.01, 0.3)
    )
    grid = Grid.over(q.bounds, 64)
    moved = Dictionary.over(narrow, grid).under(narrow, wide)
    np.testing.assert_allclose(moved.atoms, Dictionary.over(wide, grid).atoms, rtol=3 * eps)
