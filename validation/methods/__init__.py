"""Any solver: named, run in a process of its own, its answer checked.

For other rooms, in pipeline order:

- `Method`: what finds the lights, as a command or a suite names it.
- `function`: the function itself, in this process.
- `called`: what it finds, in this process.
- `OWN`: the methods of `lightloc.localize`.
- `Scene`: a room, so that another process can load it.
- `solved`: runs a solver.
- `SolverFailed`: what it did wrong.
- `no_answer`: what stands for an answer then.
- `SECONDS`: how long it may take.
- `MEMORY_MB`: how much memory.
"""

from validation.methods.answer import called, no_answer
from validation.methods.apart import MEMORY_MB, SECONDS, Scene, SolverFailed, solved
from validation.methods.named import OWN, Method, function

__all__ = [
    "Method",
    "function",
    "called",
    "OWN",
    "Scene",
    "solved",
    "SolverFailed",
    "no_answer",
    "SECONDS",
    "MEMORY_MB",
]
