"""The files in `scenes/tables`: they are what `rooms.tables` makes, and mean what it says."""

from __future__ import annotations

import mitsuba as mi
import numpy as np
import pytest
from rooms import tables

from render.variant import use_mitsuba


@pytest.mark.parametrize("name", tables.FILES)
def test_file_is_as_made(name):
    assert (tables.FOLDER / name).read_bytes() == tables.FILES[name]()


def test_measured_cloth_is_the_brdf_it_was_tabulated_from(rng):
    """Between the nodes of so coarse a table too, to a twentieth in the mean; not so if diffuse."""
    use_mitsuba()
    path = str(tables.FOLDER / "cloth_rgb.bsdf")
    bsdf = mi.load_dict({"type": "measured", "filename": path})
    n = 4000
    wi, wo = (
        tables.spherical(np.arccos(rng.uniform(0.3, 1, n)), rng.uniform(0, 7, n)) for _ in "io"
    )
    si = mi.SurfaceInteraction3f()
    si.wi = mi.Vector3f(wi.T)
    value = np.array(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(wo.T)))[0]
    wanted = tables.cloth(wi, wo) * wo[:, 2]
    assert np.abs(value - wanted).mean() < 0.05 * wanted.mean()
    assert np.abs(tables.BASE / np.pi * wo[:, 2] - wanted).mean() > 0.05 * wanted.mean()
