"""Scenes as strangers write them, each in four variants: loaded and right, or refused truthfully.

They are written anew after the kinds of things that public files hold, and each file with scenes
is one such kind. `strangers.world` turns a scene into its variants, `strangers.scene` writes it,
`strangers.trial` loads, observes and searches it, `strangers.reference` is Mitsuba's own path
integrator on the whole file, and ``python tests/strangers/run.py`` does all that.
"""

import importlib

from strangers.scene import SCENES

KINDS = (
    "versions",
    "instances",
    "units",
    "sides",
    "shapes",
    "emitters",
    "cameras",
    "looks",
    "refusals",
)
for kind in KINDS:
    importlib.import_module(f"strangers.{kind}")

__all__ = ["KINDS", "SCENES"]
