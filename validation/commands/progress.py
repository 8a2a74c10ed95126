"""What a person at a terminal sees while something runs; nothing where nobody looks."""

from __future__ import annotations

from typing import Any

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn


class Bar:
    """A bar with what has passed and what is left, and a word on what is being done.

    ``total`` None is for work whose end cannot be known, as a search: the bar then pulses. One that
    is ``quiet`` shows and says nothing.
    """

    def __init__(self, what: str, total: float | None = None, quiet: bool = False) -> None:
        self.console = Console(stderr=True, quiet=quiet)
        columns = (
            TextColumn("{task.description}"),
            BarColumn(),
            TimeElapsedColumn(),
            TextColumn("left:"),
            TimeRemainingColumn(),
        )
        live = self.console.is_terminal and not quiet
        self.bar = Progress(*columns, console=self.console, disable=not live, transient=True)
        self.task = self.bar.add_task(what, total=total)

    def __enter__(self) -> Bar:
        self.bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.bar.stop()

    def to(self, done: float) -> None:
        """Move to ``done`` of the total."""
        self.bar.update(self.task, completed=done)

    def say(self, what: str) -> None:
        """Change the word on what is being done."""
        self.bar.update(self.task, description=what)

    def case(self, result: dict[str, Any]) -> None:
        """One case of a suite has ended; a line stays for each that did not hold."""
        self.bar.update(self.task, advance=1, description=result["name"])
        if result["outcome"] in ("failed", "crashed"):
            why = " ".join(result.get("why", []))
            line = f"{result['outcome']} {result['name']}: {why}"
            self.console.print(line, markup=False, soft_wrap=True)
