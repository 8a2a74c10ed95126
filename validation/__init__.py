"""validation: the judge. It knows nothing of how lights were found."""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from validation.judge import Comparison, Pair, compare

__all__ = ["Comparison", "Pair", "compare"]


def __getattr__(name: str) -> Any:
    """Import on first use: the command line must answer --help before scipy has loaded."""
    if name not in __all__:
        raise AttributeError(f"module 'validation' has no attribute '{name}'")
    return getattr(importlib.import_module("validation.judge"), name)
