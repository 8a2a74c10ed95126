"""A view's pixels as observations: each that shows one smooth surface is a q."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lightloc import BRDF, Lambert, Observations, units
from render.exr import read_exr
from render.material import is_grey, material_at, regions_at
from render.room import Room, check_same_unit
from render.transport import probe
from render.view import DIFFUSE, View, appearance

MATCH = 1e-4  # a pixel shows a room if the room's surface is this share of its diagonal away
SAME = 1e-3  # albedo and roughness of a view and its room may differ by this much


def observe_view(
    view: View | str | Path, room: Room | None = None, material: BRDF | None = None
) -> Observations:
    """Take the observations from a view: each pure pixel is a q, row by row.

    Parameters
    ----------
    view : View, str or Path
        From `photograph`, or the path of an EXR file that `write_exr` wrote.
    room : Room, optional
        The scene that it shows, whose BRDFs the observations get. Without it the view's own layers
        must do, which is enough where every surface is Lambert.
    material : BRDF, optional
        A BRDF to use for all pixels instead.

    Returns
    -------
    Observations
        Those of the pixels in `View.used`, with one channel where radiance and BRDFs are grey;
        radiance and its standard error in W sr^-1 m^-2, positions in the scene's unit of length.

    Raises
    ------
    ValueError
        If the file can't be read (see `read_exr`), no pixel is pure, the room is not the one that
        the view shows or is in another unit of length, or there is neither a room nor a material
        and a surface is not Lambert.

    Examples
    --------
    >>> from render import load, observe_view, photograph
    >>> room = load("box_one")
    >>> view = photograph(room, width=16, transport="direct")
    >>> q = observe_view(view)
    >>> bool(len(q) == view.used.sum()), q.channels, q.interreflected
    (True, 1, False)
    """
    name = "the view"
    if not isinstance(view, View):
        name, view = str(view), read_exr(view)
    used = view.used
    if not used.any():
        raise ValueError(f"{name}: no pixel shows one smooth surface; expected at least one")
    x, B = view.position[used].astype(float), view.radiance[used].astype(float)
    w = view.camera - x
    regions: tuple[NDArray[np.intp] | None, tuple[str, ...]] = (None, ("",))
    if room is not None:
        check_same_unit(room, view.unit, name)
    if material is None and room is not None:
        material, regions = _from_room(name, view, room, w)
    elif material is None:
        material = _from_layers(name, view)
    c = 1 if material.channels == 1 and is_grey(B) else 3
    return Observations(
        positions=x,
        normals=view.normal[used],
        facets=view.facet[used],
        directions=w,
        radiance=B[:, :c],
        sigma=np.sqrt(view.variance[used].astype(float))[:, :c],
        material=material,
        interreflected=view.interreflected,
        regions=regions[0],
        region_names=regions[1],
        unit=view.unit if room is None or room.unit == units.UNKNOWN else room.unit,
        intensity_unit=room.lights.intensity_unit if room else "",
    )


def _from_layers(name: str, view: View) -> BRDF:
    glossy = view.used & (view.roughness != DIFFUSE)
    if glossy.any():
        row, column = np.argwhere(glossy)[0]
        raise ValueError(
            f"{name}: the surface in row {row}, column {column} is not diffuse, so its BRDF is "
            "known to the scene alone; name the scene as well"
        )
    albedo = view.albedo[view.used].astype(float)
    return Lambert(albedo=albedo[:, :1] if is_grey(albedo) else albedo)


def _from_room(
    name: str, view: View, room: Room, w: NDArray
) -> tuple[BRDF, tuple[NDArray[np.intp], tuple[str, ...]]]:
    """The room's BRDFs at the view's n points, and the regions that share one.

    ``w`` (n, 3) are the ways from there to the camera. Refuses a room that the view does not show.
    """
    x = view.position[view.used].astype(float)
    si = probe(room.scene, x, w / np.linalg.norm(w, axis=1, keepdims=True))
    off = np.linalg.norm(np.array(si.p, float).T - x, axis=1)
    off[~np.array(si.is_valid())] = np.inf
    _refuse(name, view, room, off > MATCH * room.diagonal, "no surface")
    material = material_at(si)
    albedo, roughness = appearance(material, len(x))
    _refuse(
        name,
        view,
        room,
        (np.abs(albedo - view.albedo[view.used]) > SAME).any(axis=1)
        | (np.abs(roughness - view.roughness[view.used]) > SAME),
        "another albedo or roughness",
    )
    return material, regions_at(si)


def _refuse(name: str, view: View, room: Room, bad: NDArray, what: str) -> None:
    if bad.any():
        row, column = np.argwhere(view.used)[int(np.argmax(bad))]
        raise ValueError(
            f"{name}: does not show {room.path}, which has {what} where row {row}, "
            f"column {column} looks (were other parameters used?)"
        )
