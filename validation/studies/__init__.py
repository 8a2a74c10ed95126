"""Studies: what the method can do beyond Table 1, each a set of named scenes and a table."""

NAMES = (
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
)
