"""What crosses a border is checked there: PointLights, Observations and BRDFs refuse bad input.

Every refusal is a ValueError of one plain sentence that names the field.
"""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

from lightloc import (
    Conductor,
    Lambert,
    Mixed,
    Observations,
    Options,
    Paper,
    Plastic,
    PointLights,
    Sum,
    localize,
)

NAN, INF = float("nan"), float("inf")
UP = [[0.0, 0.0, 1.0], [0.0, 0.6, 0.8]]
GOOD: dict[str, Any] = {
    "positions": [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]],
    "normals": UP,
    "directions": UP,
    "radiance": [0.3, 0.2],
    "sigma": 0.0,
    "material": Lambert(albedo=0.5),
}
ARRAYS = ("positions", "normals", "directions", "radiance", "sigma")


BAD_LIGHTS = {
    "nan position": ("positions", [[0, 0, NAN]], [1]),
    "infinite position": ("positions", [[0, 0, -INF]], [1]),
    "position in 2D": ("positions", [[0, 0]], [1]),
    "one bare position": ("positions", [0, 0, 0], [1]),
    "ragged positions": ("positions", [[0, 0, 0], [1, 1]], [1, 2]),
    "position in words": ("positions", [["here", 0, 0]], [1]),
    "complex position": ("positions", [[1j, 0, 0]], [1]),
    "no position": ("positions", None, [1]),
    "negative intensity": ("intensities", [[0, 0, 0]], [-1]),
    "infinite intensity": ("intensities", [[0, 0, 0]], [INF]),
    "more intensities": ("intensities", [[0, 0, 0]], [1, 2]),
    "fewer intensities": ("intensities", [[0, 0, 0], [1, 1, 1]], [1]),
    "intensity without a light": ("intensities", [], [1]),
    "light without intensity": ("intensities", [[0, 0, 0]], []),
    "bare intensity": ("intensities", [[0, 0, 0]], 1.0),
    "two channels": ("intensities", [[0, 0, 0]], [[1, 2]]),
    "four channels": ("intensities", [[0, 0, 0]], [[1, 2, 3, 4]]),
    "three axes": ("intensities", [[0, 0, 0]], [[[1]]]),
    "ragged intensities": ("intensities", [[0, 0, 0], [1, 1, 1]], [[1, 2, 3], [1]]),
    "intensity in words": ("intensities", [[0, 0, 0]], ["bright"]),
    "no intensity": ("intensities", [[0, 0, 0]], None),
    "a mapping": ("intensities", [[0, 0, 0]], {}),
}


@pytest.mark.parametrize("case", BAD_LIGHTS)
def test_bad_lights_are_refused(case, refuses):
    """PointLights of wrong shape, channels or values say which field is wrong."""
    name, positions, intensities = BAD_LIGHTS[case]
    with refuses(f"PointLights.{name}"):
        PointLights(positions, intensities)


BAD_OBSERVATIONS = {
    "no point": ("Observations", {name: np.zeros((0, 3)) for name in ARRAYS[:3]}),
    "empty list": ("Observations", {"positions": []}),
    "nan position": ("Observations.positions[1][2]", {"positions": [[0, 0, 0], [0, 0, NAN]]}),
    "positions in 2D": ("Observations.positions", {"positions": [[0, 0], [1, 0]]}),
    "positions in words": ("Observations.positions", {"positions": "here"}),
    "ragged positions": ("Observations.positions", {"positions": [[0, 0, 0], [1]]}),
    "zero normal": ("Observations.normals[1]", {"normals": [[0, 0, 1], [0, 0, 0]]}),
    "nan normal": ("Observations.normals[0][1]", {"normals": [[0, NAN, 1], [0, 0, 1]]}),
    "fewer normals": ("Observations.normals", {"normals": [[0, 0, 1]]}),
    "normals in words": ("Observations.normals", {"normals": ["up", "up"]}),
    "zero direction": ("Observations.directions[0]", {"directions": [[0, 0, 0], [0, 0, 1]]}),
    "infinite direction": ("Observations.directions", {"directions": [[INF, 0, 1], [0, 0, 1]]}),
    "more directions": ("Observations.directions", {"directions": [[0, 0, 1]] * 3}),
    "nan radiance": ("Observations.radiance[0][0]", {"radiance": [NAN, 0]}),
    "infinite radiance": ("Observations.radiance[1][0]", {"radiance": [0, INF]}),
    "negative radiance": ("Observations.radiance[1][0]", {"radiance": [0.1, -0.1]}),
    "more radiances": ("Observations.radiance", {"radiance": [1, 2, 3]}),
    "two channels": ("Observations.radiance", {"radiance": [[1, 2], [1, 2]]}),
    "bare radiance": ("Observations.radiance", {"radiance": 1.0}),
    "ragged radiance": ("Observations.radiance", {"radiance": [[1], [1, 2, 3]]}),
    "radiance in words": ("Observations.radiance", {"radiance": "bright"}),
    "no radiance": ("Observations.radiance", {"radiance": None}),
    "negative sigma": ("Observations.sigma", {"sigma": -1.0}),
    "nan sigma": ("Observations.sigma", {"sigma": [0.0, NAN]}),
    "more sigmas": ("Observations.sigma", {"sigma": [1, 2, 3]}),
    "sigma in colour": ("Observations.sigma", {"sigma": [[1, 2, 3], [1, 2, 3]]}),
    "sigma in words": ("Observations.sigma", {"sigma": "small"}),
    "no material": ("Observations.material", {"material": None}),
    "albedo as material": ("Observations.material", {"material": 0.5}),
    "class as material": ("Observations.material", {"material": Lambert}),
    "coloured material": ("Observations.radiance", {"material": Lambert(albedo=[0.5, 0.4, 0.3])}),
    "material of more points": ("Lambert.albedo", {"material": Lambert(albedo=[0.5] * 4)}),
    "mixture of more points": (
        "Mixed.index",
        {"material": Mixed((Lambert(albedo=0.5),), [0, 0, 0, 0])},
    ),
    "part of more points": (
        "Conductor.alpha",
        {"material": Mixed((Conductor(alpha=[0.2] * 4),), [0, 0])},
    ),
    "part of more points, summed": (
        "Conductor.alpha",
        {"material": Sum((Lambert(albedo=0.5), Conductor(alpha=[0.2] * 4)))},
    ),
}


@pytest.mark.parametrize("case", BAD_OBSERVATIONS)
def test_bad_observations_are_refused(case, refuses):
    """Observations of wrong shape, length, channels or values say which field is wrong."""
    name, wrong = BAD_OBSERVATIONS[case]
    with refuses(name):
        Observations(**{**GOOD, **wrong})


BAD_BRDFS = {
    "negative albedo": ("Lambert.albedo", lambda: Lambert(albedo=-0.1)),
    "nan albedo": ("Lambert.albedo", lambda: Lambert(albedo=NAN)),
    "albedo in words": ("Lambert.albedo", lambda: Lambert(albedo="grey")),
    "no albedo": ("Lambert.albedo", lambda: Lambert(albedo=None)),
    "empty albedo": ("Lambert.albedo", lambda: Lambert(albedo=[])),
    "albedo of two channels": ("Lambert.albedo", lambda: Lambert(albedo=[[0.5, 0.5]])),
    "mirror": ("Conductor.alpha", lambda: Conductor(alpha=0.0)),
    "eta without k": ("Conductor", lambda: Conductor(alpha=0.3, eta=1.2)),
    "k without eta": ("Conductor", lambda: Conductor(alpha=0.3, k=7.0)),
    "negative eta": ("Conductor.eta", lambda: Conductor(alpha=0.3, eta=-1.0, k=7.0)),
    "nan k": ("Conductor.k", lambda: Conductor(alpha=0.3, eta=1.2, k=NAN)),
    "negative tint": ("Conductor.specular", lambda: Conductor(alpha=0.3, specular=-1.0)),
    "thin coat": ("Plastic.ior", lambda: Plastic(alpha=0.3, ior=0.9)),
    "nan base": ("Plastic.diffuse", lambda: Plastic(alpha=0.3, diffuse=NAN)),
    "twice nonlinear": ("Plastic.nonlinear", lambda: Plastic(alpha=0.3, nonlinear=2.0)),
    "coloured roughness": ("Plastic.alpha", lambda: Plastic(alpha=[0.1, 0.2, 0.3])),
    "no parts": ("Mixed", lambda: Mixed((), [0])),
    "one part, no tuple": ("Mixed", lambda: Mixed(Lambert(albedo=0.5), [0])),
    "part that is none": ("Mixed", lambda: Mixed((0.5,), [0])),
    "sum of nothing": ("Sum", lambda: Sum(())),
    "sum, no tuple": ("Sum.brdfs", lambda: Sum(Lambert(albedo=0.5))),
    "sum with a part that is none": ("Sum.brdfs", lambda: Sum((Lambert(albedo=0.5), 0.5))),
    "index past the end": ("Mixed.index", lambda: Mixed((Lambert(albedo=0.5),), [1])),
    "negative index": ("Mixed.index", lambda: Mixed((Lambert(albedo=0.5),), [-1])),
    "fractional index": ("Mixed", lambda: Mixed((Lambert(albedo=0.5),), [0.0])),
    "ragged index": ("Mixed.index", lambda: Mixed((Lambert(albedo=0.5),), [[0], [0, 0]])),
}


@pytest.mark.parametrize("case", BAD_BRDFS)
def test_bad_brdfs_are_refused(case, refuses):
    """A BRDF with an impossible parameter names the parameter."""
    name, make = BAD_BRDFS[case]
    with refuses(name):
        make()


BAD_OPTIONS: dict[str, tuple[type, str, Any]] = {
    "a word that is none": (Options, "noise", "estimated"),
    "no lights": (Options, "most_lights", 0),
    "lights by halves": (Options, "most_lights", 2.5),
    "a truth for a number": (Options, "sample", True),
    "a number in words": (Options, "cells", "many"),
    "nan": (Options, "outlier", NAN),
    "nothing": (Options, "unlikely", None),
    "below zero": (Options, "relative", -1e-6),
    "zero": (Options, "sure_position", 0.0),
    "no cells": (Paper, "cells", 0),
    "half a pixel": (Paper, "radius", 0.5),
    "a negative step": (Paper, "increment", -0.025),
}


@pytest.mark.parametrize("case", BAD_OPTIONS)
def test_bad_options_are_refused(case, refuses):
    """An option that no search could follow is refused by its name."""
    kind, name, value = BAD_OPTIONS[case]
    with refuses(f"{kind.__name__}.{name} is {value!r}; expected"):
        kind(**{name: value})
    kind(**{name: getattr(kind(), name)})


def test_what_belongs_elsewhere_is_refused(refuses):
    """A path where a geometry belongs, and the like."""
    q = Observations(**GOOD)
    with refuses("geometry is a str; expected"):
        localize(q, "room.xml")
    with refuses("observations are a dict; not Observations"):
        localize(GOOD)


def test_shorthand_is_spelled_out():
    """Lists become float64 columns, one sigma serves all, and directions are normalized."""
    q = Observations(**{**GOOD, "normals": [[0, 0, 3], [0, 3, 4]], "sigma": 0.1})
    assert q.radiance.shape == q.sigma.shape == (2, 1)
    np.testing.assert_array_equal(q.sigma, 0.1)
    np.testing.assert_allclose(q.normals, UP)
    coloured = Observations(**{**GOOD, "radiance": np.ones((2, 3)), "sigma": [0.1, 0.2]})
    np.testing.assert_array_equal(coloured.sigma, [[0.1] * 3, [0.2] * 3])
    lights = PointLights([[0, 0, 1], [1, 0, 1]], [5.0, 6.0])
    assert lights.intensities.shape == (2, 1)
    assert len(PointLights([], [])) == 0


def test_values_cannot_be_changed():
    """What was checked stays as checked: the caller's array is copied, ours is read-only."""
    theirs = np.array(GOOD["positions"])
    q = Observations(**{**GOOD, "positions": theirs})
    theirs[:] = NAN
    assert np.isfinite(q.positions).all()
    for name in ARRAYS:
        with pytest.raises(ValueError, match="read-only"):
            getattr(q, name)[0] = 0
    with pytest.raises(dataclasses.FrozenInstanceError):
        q.radiance = 0


def from_file(B, sigma, path) -> Observations:
    """`GOOD` with another radiance, read from a file."""
    Observations(**GOOD).save(path)
    with np.load(path) as file:
        keys = {name: file[name] for name in file.files}
    shape = keys["radiance"].shape
    keys["radiance"] = np.reshape(B, shape)
    keys["sigma"] = np.broadcast_to(np.reshape(sigma, (-1, 1)), shape)
    np.savez(path, **keys)
    return Observations.load(path)


WAYS = {
    "constructor": lambda B, sigma, path: Observations(**{**GOOD, "radiance": B, "sigma": sigma}),
    "with_radiance": lambda B, sigma, path: Observations(**GOOD).with_radiance(B, sigma),
    "file": from_file,
}


@pytest.mark.parametrize("way", WAYS)
def test_radiance_below_zero_is_taken_with_an_error_and_refused_without(way, refuses, tmp_path):
    """However observations are made: noise and subtraction leave B below zero, by any number of
    standard errors, and it stays as it is; a B that is exact is not below zero."""
    path = tmp_path / "seen.npz"
    for B, sigma in (([-0.1, 0.2], 0.2), ([-5.0, 0.2], [0.1, 0.0]), ([-1e-9, -1e9], 1e-12)):
        np.testing.assert_array_equal(WAYS[way](B, sigma, path).radiance[:, 0], B)
    within = f"{path}: " if way == "file" else ""
    for B, sigma in (([0.2, -0.1], 0.0), ([-0.1, -0.2], [0.1, 0.0]), ([0.1, -5e-324], [0.1, 0.0])):
        with refuses(f"{within}Observations.radiance[1][0] is {B[1]:g}; expected at least 0 where"):
            WAYS[way](B, sigma, path)


def test_with_radiance_refuses_what_is_no_radiance(refuses):
    """What the constructor refuses, of another radiance too."""
    q = Observations(**GOOD)
    for name, B, sigma in (
        ("radiance", NAN, 0.1),
        ("radiance", "bright", 0.1),
        ("radiance", [1, 2, 3], 0.1),
        ("sigma", 0.1, -1.0),
        ("sigma", 0.1, NAN),
    ):
        with refuses(f"Observations.{name}"):
            q.with_radiance(B, sigma)
