"""Births: a light that a grid steps over is found alone, without the shadows that hide it."""

from __future__ import annotations

import numpy as np
import pytest

from lightloc import Lambert, Observations, Options, PointLights, radiance
from lightloc.fields.grid import Grid
from lightloc.fit.criterion import Criterion
from lightloc.fit.levenberg import Descents
from lightloc.fit.problem import Problem, residuals
from lightloc.search import births
from lightloc.search.births import alone, places
from lightloc.search.dictionary import Dictionary, Left, gains_at
from lightloc.search.view import Stage
from validation.rooms.plane import rooms

HIDDEN = 0.02  # of the side: how far the light is from the wall that hides it
NEAR = 0.005  # of the side: as near as a start need come
ERROR = 0.2  # of B


class Shelf:
    """A plate at z = 0.5 over x > 0.5, which nothing sees through."""

    def visible(self, x, p, active=True):
        t = (0.5 - x.z) / (p.z - x.z)
        at = x.x + t * (p.x - x.x)
        return ~((t > 0) & (t < 1) & (at > 0.5)) & active


def floor(n: int = 600) -> Observations:
    """A floor and a ceiling of a unit cube, evenly at random."""
    rng = np.random.default_rng(3)
    x = rng.uniform(0, 1, (n, 3))
    up = np.zeros((n, 3))
    up[:, 2] = np.where(np.arange(n) % 2, 1.0, -1.0)
    x[:, 2] = np.where(np.arange(n) % 2, 0.0, 1.0)
    return Observations(
        positions=x, normals=up, directions=up, radiance=np.zeros(n), material=Lambert(albedo=0.8)
    )


@pytest.fixture
def shelf() -> tuple[Problem, PointLights]:
    """A light just under a shelf: only the floor sees it, and nothing above the shelf does."""
    light = PointLights([[0.8, 0.4, 0.5 - HIDDEN]], [3.0])
    q, geometry = floor(), Shelf()
    B = radiance(q, light, geometry)
    sigma = ERROR * (B + 0.4 * B.mean())
    box = np.array([[0, 0, 0], [1, 1, 1.0]])
    return Problem.of(q.with_radiance(B, sigma), sigma, geometry, box), light


def test_alone_comes_from_behind_a_shelf(shelf):
    """Starts above the shelf, from where no ray reaches what is lit, come to the light below it."""
    problem, light = shelf
    starts = np.random.default_rng(0).uniform([0.55, 0.1, 0.6], [0.95, 0.9, 0.9], (20, 3))
    z = problem.radiance / problem.sigma
    there = alone(problem, starts, z, 5.0)
    off = np.linalg.norm(there - light.positions, axis=1)
    assert (off < NEAR).mean() > 0.8


def test_a_dark_residual_moves_nothing(shelf):
    """Nothing is lit: starts stay where they are."""
    problem, _ = shelf
    starts = np.full((2, 3), 0.3)
    assert (alone(problem, starts, np.zeros_like(problem.radiance), 5.0) == starts).all()


def staged(problem: Problem, dictionary: Dictionary) -> Stage:
    """The problem as it is."""
    return Stage(problem, dictionary, 0.0, Criterion.of(Options()))


NONE = Descents.of(np.zeros((1, 0, 3)), np.zeros((1, 0, 1)))


def test_a_place_is_precise_where_the_grid_is_coarse(shelf, monkeypatch):
    """From a grid of 4 x 4 x 4 positions, one comes within 1 % of the side, by way of `alone`."""
    problem, light = shelf
    dictionary = Dictionary.over(problem, Grid.over(problem.bounds, 64))

    def nearest() -> float:
        z = problem.radiance / problem.sigma
        found = places(staged(problem, dictionary), NONE, z, np.inf, 4)
        return float(np.linalg.norm(found - light.positions, axis=1).min())

    grid = np.linalg.norm(dictionary.points - light.positions, axis=1).min()
    assert nearest() < 0.01 < grid
    monkeypatch.setattr(births, "STEPS", 0)
    assert nearest() > 0.01


@pytest.fixture
def pair() -> tuple[Problem, PointLights]:
    """Two lights far apart in a square room."""
    q = rooms(2, count=1)[0].observe()
    lights = PointLights([[0.25, 0.25, 0], [0.75, 0.7, 0]], [2.0, 2.0])
    B = radiance(q, lights)
    sigma = ERROR * (B + 0.4 * B.mean())
    return Problem.of(q.with_radiance(B, 0.0), sigma, None, q.bounds), lights


def test_two_lights_have_a_place_each(pair):
    """Both are among the places, though each pulls at the other's."""
    problem, lights = pair
    dictionary = Dictionary.over(problem, Grid.over(problem.bounds, 400))
    z = problem.radiance / problem.sigma
    found = places(staged(problem, dictionary), NONE, z, np.inf, 4)
    apart = np.linalg.norm(lights.positions[:, None] - found, axis=2)
    assert (apart.min(axis=1) < 0.15).all()
    assert len(set(apart.argmin(axis=1))) == 2


def test_lights_that_are_there_are_no_place_again(pair):
    """What the lights' own derivatives can take up gains nothing: a light a little off is moved."""
    problem, lights = pair
    off = PointLights([[0.26, 0.25, 0]], [2.1])
    z = residuals(problem, off)
    here = np.stack([off.positions[0], lights.positions[1]])
    gains = gains_at(problem, here, Left.beside(problem, off, z, np.ones_like(z)))
    assert gains[0] < 1e-6 * gains[1]
