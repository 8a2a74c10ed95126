"""How many lights, where something else explains about as well."""

from __future__ import annotations

from dataclasses import replace

import pytest

from lightloc import Reason
from validation.studies.counts_trial import counts
from validation.studies.crossing import crossed


@pytest.mark.parametrize("name", ["lights-8-004"])
def test_points_near_each_other_are_points(name):
    """Fewer that are wide explain nearly as well."""
    told = counts(name)
    assert told.found == told.lights and told.reason != Reason.EXTENDED.name


@pytest.mark.parametrize("name", ["c0.05-034", "shot-021"])
def test_a_moved_object_adds_and_takes_no_light(name):
    """The one had a ghost that lit the object alone; of the other a light was taken for it."""
    told = crossed(name)
    assert told.found == told.lights and not told.ghosts
    assert "GEOMETRY" in told.verdicts and told.reason == Reason.UNDECIDED.name


def test_what_is_explained_stays(monkeypatch):
    """A departure that a sample shows and the whole does not takes no answer's place."""
    monkeypatch.setattr(
        "lightloc.diagnosis.diagnose.told",
        lambda found, *_: replace(found, reason=Reason.NO_GAIN),
    )
    assert crossed("c0.05-034").reason == Reason.UNDECIDED.name
