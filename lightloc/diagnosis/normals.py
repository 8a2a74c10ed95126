"""Normals: surfaces that are tilted, as a whole, against what was given."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lightloc.answer import Kind
from lightloc.diagnosis.departure import Array, Departure, Lit, Modelled, fixed
from lightloc.diagnosis.groups import sides_of
from lightloc.optics import Surfels, shading, surfels

MOST = np.radians(20.0)
"""Of a tilt."""

DELTA = 1e-3
"""Radians: the step of differences."""


def normals(lit: Lit) -> list[Departure]:
    """Each group of observations tilted about two axes of its own; about one in the plane."""
    evidence = lit.evidence
    q, n = evidence.q, len(evidence.q)
    groups = sides_of(q)
    if not groups:
        return []
    flat = len(evidence.problem.axes) == 2
    ways = 1 if flat else 2
    which = np.full(n, -1)
    for i, (_, on) in enumerate(groups):
        which[on] = i
    along = tangents(q.normals, flat)  # n, ways, 3

    def turned(u: Array) -> Surfels:
        """The observations with normals that lean by so much along their tangents."""
        each = np.concatenate([u.reshape(-1, ways), np.zeros((1, ways))])[which]
        leaning = q.normals + (np.tan(each)[:, :, None] * along).sum(axis=1)
        leaning /= np.linalg.norm(leaning, axis=1, keepdims=True)
        there = replace(q, normals=leaning, facets=q.facets)
        return surfels(there, evidence.geometry, double=evidence.problem.surfels.double)

    def columns(lit: Lit, u: Array) -> Array:
        result, here = np.zeros((n, q.channels, len(u))), bright(lit, u)
        for way in range(ways):
            step = np.where(np.arange(len(u)) % ways == way, DELTA, 0.0)
            slope = (bright(lit, u + step) - here) / DELTA
            for i in range(len(groups)):
                result[which == i, :, i * ways + way] = slope[which == i]
        return result

    def bright(lit: Lit, u: Array) -> Array:
        """(n, c) B of observations that lean."""
        if not len(lit.lights):
            return np.zeros((n, q.channels))
        S = shading(turned(u), lit.lights.positions, None) * lit.seen.T[:, :, None]
        return np.einsum("nkc,kc->nc", S, lit.lights.intensities)

    def model(lit: Lit, u: Array) -> Modelled:
        return lit.summed(*lit.through(turned(u)), columns(lit, u))

    def said(u: Array, e: Array) -> str:
        tilt = np.degrees(np.linalg.norm(u.reshape(-1, ways), axis=1))
        error = np.degrees(np.linalg.norm(e.reshape(-1, ways), axis=1)) / np.sqrt(ways)
        most = int(np.argmax(tilt))
        return (
            f"normals lean by up to {tilt[most]:.2g} ± {error[most]:.1g} degrees against what was "
            f"given, most of all those of {groups[most][0]}"
        )

    size = len(groups) * ways
    return [
        Departure(
            Kind.GEOMETRY,
            "the normals",
            model,
            columns,
            fixed(np.zeros((1, size))),
            said,
            "other normals",
            fixed(np.tile([[-MOST], [MOST]], size)),
        )
    ]


def tangents(normal: Array, flat: bool) -> Array:
    """(n, 1 or 2, 3) directions across (n, 3) normals; in the plane where all is ``flat``."""
    if flat:
        return np.stack([-normal[:, 1], normal[:, 0], 0 * normal[:, 0]], axis=1)[:, None]
    least = np.eye(3)[np.abs(normal).argmin(axis=1)]
    first = np.cross(normal, least)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(normal, first)], axis=1)
