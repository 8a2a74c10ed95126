"""How the gallery's pictures look: sizes that suit a desktop and a phone, colours for every eye."""

from __future__ import annotations

from typing import Any

import matplotlib.pyplot as plt
from cycler import cycler

OKABE_ITO = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")
"""Seven colours that the colour-blind tell apart (Okabe and Ito)."""


def style(gallery_conf: dict[str, Any], file: str) -> None:
    """Set before each script what all of them share."""
    plt.rcParams.update(
        {
            "figure.figsize": (6.0, 4.5),
            "figure.dpi": 100,
            "figure.constrained_layout.use": True,
            "font.size": 12,
            "axes.titlesize": 12,
            "axes.spines.top": False,
            "axes.spines.right": False,
            "axes.prop_cycle": cycler(color=OKABE_ITO),
            "legend.frameon": False,
        }
    )
