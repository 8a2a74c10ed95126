"""Whether the model is wrong, and in which way: departures from it, fitted with the lights.

For other rooms, in pipeline order:

- `diagnosed`: an answer that says what is wrong with the model, and claims no light but for that.
"""

from lightloc.diagnosis.diagnose import diagnosed

__all__ = ["diagnosed"]
