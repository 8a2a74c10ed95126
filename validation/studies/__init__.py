"""Studies: what the method can do, Table 1 first, each a set of named scenes and a table."""

NAMES = (
    "table1",
    "many",
    "occluders",
    "coverage",
    "noise",
    "points",
    "wrong",
    "rooms3d",
    "rivals",
    "hard",
    "ablation",
    "crossed",
    "faults",
    "null",
    "power",
    "counts",
    "views",
    "brdf",
    "budget",
)

GROUPS = {"gauntlet": ("crossed", "faults", "views", "null", "power", "counts")}
"""Studies that are asked for together, by one name."""
