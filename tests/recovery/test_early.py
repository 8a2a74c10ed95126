"""A wrong model is seen early, and lights that are still missing are not taken for one."""

import sys

import numpy as np
import pytest

from lightloc import Options, localize
from validation.studies import columns
from validation.studies.fault import SEED, noisy
from validation.studies.fault_models import MODELS

SIX = Options(most_lights=6)
WRONG = {"gamma": 1, "normals": 1, "window": 1}


def most(found):
    """The most lights that a search tried."""
    return max(step.lights for step in found.history)


def wrong(fault):
    number = WRONG[fault]
    rng = np.random.default_rng([SEED, list(MODELS).index(fault), number])
    room = MODELS[fault](number, rng)
    return room, noisy(room.q, rng.normal(size=room.q.radiance.shape), stated=False)


@pytest.mark.parametrize("fault", WRONG)
def test_a_wrong_model_ends_soon(fault):
    """Four lights are not more than enough: what few leave beside a departure is far less."""
    room, q = wrong(fault)
    found = localize(q, room.geometry, bounds=room.region)
    assert most(found) <= 4
    assert len(found.lights) == len(room.lights)


def test_else_it_goes_on(monkeypatch):
    """Negative control: unasked, the search adapts more and more lights."""
    room, q = wrong("gamma")
    monkeypatch.setattr(sys.modules["lightloc.localize"], "astray", lambda *given: False)
    assert most(localize(q, room.geometry, bounds=room.region, options=SIX)) == 6


@pytest.mark.parametrize("name", ["noisy-5-002", "noisy-6-004"])
@pytest.mark.parametrize("told", [True, False])
def test_missing_lights_are_no_wrong_model(name, told):
    """Two of these lights look like a wide one, while the others are missing."""
    room, q = columns.observed(name)
    found = localize(q if told else q.with_radiance(q.radiance, None))
    assert len(found.lights) == len(room.lights)
