"""The ladder: which count of lights explains, and which only feeds an error of the model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lightloc import Options, PointLights
from lightloc.fields.grid import Grid
from lightloc.fit.criterion import Criterion
from lightloc.fit.problem import Fit, Problem
from lightloc.search.climb import VAIN
from lightloc.search.dictionary import Dictionary
from lightloc.search.ladder import STALLED, Ladder, adapted
from lightloc.search.view import View
from validation.rooms.plane import rooms

SIGMA = 0.01  # of B


@pytest.fixture(scope="module")
def view() -> View:
    """A square room; what its lights are plays no part."""
    q = rooms(3, count=1)[0].observe()
    problem = Problem.of(q, SIGMA * (q.radiance + q.radiance.mean()), None, q.bounds)
    dictionary = Dictionary.over(problem, Grid.over(problem.bounds, 64))
    return View(problem, problem, dictionary, False, 24, Criterion.of(Options()))


def rung(view: View, count: int, left: float) -> Fit:
    """A fit of so many lights that leaves so many squares a residual."""
    z = np.sqrt(left) * np.random.default_rng(0).normal(size=view.tight.radiance.shape)
    lights = PointLights(np.full((count, 3), 0.5), np.ones((count, 1)))
    return Fit(lights, z, float(np.square(z).sum()), view.tight)


def ladder(view: View, left: dict[int, float]) -> Ladder:
    """Rungs put on one by one."""
    found = Ladder.on(view)
    for count, squares in left.items():
        found = found.with_("add", rung(view, count, squares))
    return found


def test_lights_that_do_not_quarter_what_is_left_are_none(view):
    """Two lights explain all but an error of the model; six more feed it."""
    fed = {1: 90.0, 2: 12.0} | {k: 12.0 - 0.5 * (k - 2) for k in range(3, 9)}
    assert ladder(view, fed).most == 2
    assert len(ladder(view, fed).best) == 2
    assert ladder(view, fed).ended


def test_lights_that_are_there_go_on(view):
    """Negative control: each of eight halves what the others left."""
    found = {k: 200.0 / 2**k for k in range(1, 8)}
    assert ladder(view, found).most is None


def test_where_all_is_explained_nothing_is_fed(view):
    fed = {1: 90.0, 2: 0.9} | {k: 0.9 for k in range(3, 9)}
    assert ladder(view, fed).most is None
    assert len(ladder(view, fed).best) == 2


def test_a_guess_is_not_judged(view):
    """What footnote 1 leaves is no error of the model."""
    fits = tuple(rung(view, k, 12.0) for k in range(9))
    assert adapted(view, fits, STALLED) is not None
    assert adapted(replace(view, rough=True), fits, STALLED) is None


def test_less_in_vain_is_enough_once_a_search_has_ended(view):
    """Two lights in vain tell nothing while others are found, but when nothing more is."""
    fed = {1: 90.0, 2: 12.0, 3: 11.5, 4: 11.0}
    assert ladder(view, fed).most is None
    assert ladder(view, fed).judged(VAIN).most == 2


def test_a_lucky_light_among_lights_in_vain_is_none(view):
    """One light halves what the one before left, which was caught; two do not quarter it."""
    fed = {1: 90.0, 2: 12.0, 3: 11.5, 4: 11.0, 5: 11.0, 6: 5.0, 7: 4.9, 8: 4.8}
    assert ladder(view, fed).judged(VAIN).most == 2


def test_lights_in_vain_before_the_last_ones_tell_too(view):
    """Slowly, each a little: no six of them quarter what is left, whichever are looked at."""
    fed = {1: 90.0, 2: 40.0, 3: 16.0} | {3 + k: 16.0 * 0.82**k for k in range(1, 8)}
    assert ladder(view, fed).most == 3


def test_a_rung_keeps_the_better_fit(view):
    two = ladder(view, {2: 9.0, 1: 90.0})
    assert two.with_("add", rung(view, 2, 10.0)).fits[2] is two.fits[2]
    assert two.with_("add", rung(view, 2, 8.0)).fits[2] is not two.fits[2]
    assert [step.lights for step in two.history] == [2, 1]


def test_darkness_is_a_rung_like_any_other(view):
    """A fit of no light has length 0, which Python takes for false: it stands there once."""
    dark = Ladder.on(view).with_("start", view.darkness)
    assert [len(fit) for fit in dark.fits] == [0]
