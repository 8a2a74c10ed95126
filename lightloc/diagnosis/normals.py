"""Normals: surfaces that are tilted, as a whole, against what was given."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lightloc.answer import Kind
from lightloc.diagnosis.departure import Array, Departure, Lit, Modelled, fixed
from lightloc.diagnosis.groups import sides_of
from lightloc.optics import Surfels, surfels

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
    times = q.at(np.tile(np.arange(n), 1 + ways))
    steps = np.concatenate([np.zeros((1, ways)), DELTA * np.eye(ways)])

    def turned(u: Array) -> Surfels:
        """The observations with normals that lean by so much along their tangents.

        Once as they are, then a step further each way.
        """
        each = np.concatenate([u.reshape(-1, ways), np.zeros((1, ways))])[which]
        tilt = np.tan(each + steps[:, None])  # 1 + ways, n, ways
        leaning = q.normals + (tilt[..., None] * along).sum(axis=2)
        leaning /= np.linalg.norm(leaning, axis=2, keepdims=True)
        there = replace(times, normals=leaning.reshape(-1, 3), facets=times.facets)
        return surfels(there, evidence.geometry, double=evidence.problem.surfels.double)

    def model(lit: Lit, u: Array) -> Modelled:
        S, slope = lit.through(turned(u))
        each = np.einsum("nkc,kc->nc", S, lit.lights.intensities).reshape(1 + ways, n, -1)
        by_way = (each[1:] - each[0]) / DELTA
        columns = np.zeros((n, q.channels, len(u)))
        for way in range(ways):
            for i in range(len(groups)):
                columns[which == i, :, i * ways + way] = by_way[way, which == i]
        return lit.summed(S[:n], slope[:n], columns)

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
            lambda lit, u: model(lit, u).by_unknowns,
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
