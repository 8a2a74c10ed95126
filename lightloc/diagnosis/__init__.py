"""Whether the model is wrong, and in which way: departures from it, fitted with the lights.

For other rooms, in pipeline order:

- `astray`: whether a departure explains with few lights what many found so far do not.
- `diagnosed`: an answer that says what is wrong with the model, and claims no light but for that.
"""

from lightloc.diagnosis.diagnose import diagnosed
from lightloc.diagnosis.early import astray

__all__ = ["astray", "diagnosed"]
