"""Rooms in centimetres, millimetres and other units, and far from the origin."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from strangers.scene import TWO, stranger
from strangers.words import ball, block, bsdf, number, room
from strangers.world import World


def furnished(w: World) -> list[str]:
    metal = bsdf("roughconductor", number("alpha", 0.4))
    return [room(w), block(w), ball(w, (3, 2.2, 0.4), 0.4, metal)]


@stranger(lights=TWO, world=lambda w: w.in_units(125))
def of_500_centimetres(w: World, folder: Path) -> list[str]:
    return furnished(w)


@stranger(lights=TWO, world=lambda w: w.in_units(1000))
def of_4000_millimetres(w: World, folder: Path) -> list[str]:
    return furnished(w)


@stranger(lights=TWO, world=lambda w: w.in_units(1e-5), no_paths=("too small", "smaller unit"))
def of_hundred_kilometres(w: World, folder: Path) -> list[str]:
    """Too small for Mitsuba's paths, and not for direct light."""
    return furnished(w)


@stranger(lights=TWO, world=lambda w: w.in_units(1e-2))
def of_hectometres(w: World, folder: Path) -> list[str]:
    return furnished(w)


@stranger(lights=TWO, world=lambda w: w.in_units(2.0**10))
def of_a_power_of_two(w: World, folder: Path) -> list[str]:
    return furnished(w)


@stranger(lights=TWO, world=lambda w: replace(w, at=(40.0, -30.0, 20.0)))
def ten_rooms_away(w: World, folder: Path) -> list[str]:
    return furnished(w)


@stranger(lights=TWO, world=lambda w: replace(w, at=(4000.0, -3000.0, 0.0)))
def a_thousand_rooms_away(w: World, folder: Path) -> list[str]:
    return furnished(w)
