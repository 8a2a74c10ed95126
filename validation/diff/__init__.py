"""Two runs of a suite: what changed between them, beyond what noise and chance do.

For other rooms, in pipeline order:

- `Kind`: what sort of change it is, and in which order they are told.
- `Change`: one of a case.
- `Changes`: all of two runs.
- `changes`: what changed.
"""

from validation.diff.runs import Change, Changes, Kind, changes

__all__ = ["Kind", "Change", "Changes", "changes"]
