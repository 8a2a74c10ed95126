"""Named scenes in, records out: run on all cores or a cluster, kept as they end, and resumed.

For other rooms, in pipeline order:

- `ready`: a path whose folder is there.
- `is_stream`: whether a path is a pipe or a device.
- `is_output`: whether a path is the standard output.
- `write_bytes`: a file that appears whole.
- `write_text`: the same of text.
- `write_json`: the same of plain data.
- `finite`: plain data without what JSON does not have.
- `read_json`: one JSON object, or a sentence.
- `made`: when, where and with what a result is made.
- `Scene`: the type of a function that runs a scene: a name in, a dataclass of plain values out.
- `Ended`: a scene that has ended.
- `FILE`: the name of the file that keeps them.
- `row_of`: the row that a scene's name belongs to.
- `every`: all results in a folder, from any version of the code.
- `read`: only the results of this version of the code.
- `waiting`: the scenes that have no result yet.
- `run`: runs them.
"""

from validation.jobs.disk import (
    finite,
    is_output,
    is_stream,
    read_json,
    ready,
    write_bytes,
    write_json,
    write_text,
)
from validation.jobs.pool import run
from validation.jobs.provenance import made
from validation.jobs.store import FILE, Ended, Scene, every, read, row_of, waiting

__all__ = [
    "ready",
    "is_stream",
    "is_output",
    "write_bytes",
    "write_text",
    "write_json",
    "finite",
    "read_json",
    "made",
    "Scene",
    "Ended",
    "FILE",
    "row_of",
    "every",
    "read",
    "waiting",
    "run",
]
