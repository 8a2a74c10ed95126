"""A solver, as a command or a suite names it: ours, the paper's, or anybody's function."""

from __future__ import annotations

import importlib
import importlib.util
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

OWN = ("search", "paper")
"""Methods of `lightloc.localize`."""


@dataclass(frozen=True)
class Method:
    """What finds the lights.

    Parameters
    ----------
    name
        "search" or "paper", or of a function the module and its own name: "module:function".
    file
        The Python file that holds it; None where the module is installed.
    """

    name: str
    file: Path | None = None

    @property
    def is_own(self) -> bool:
        """Whether `lightloc.localize` has it."""
        return self.name in OWN

    @property
    def module(self) -> str:
        """Of a function."""
        return self.name.partition(":")[0]

    @property
    def function(self) -> str:
        """Its name."""
        return self.name.partition(":")[2]

    @property
    def label(self) -> str:
        """A short name, for tables and folders: the module's last part, and a function's own.

        Examples
        --------
        >>> Method("mine.adam:solve").label, Method("mine.adam:fast").label, Method("paper").label
        ('adam', 'adam-fast', 'paper')
        """
        if self.is_own:
            return self.name
        module = self.module.rpartition(".")[2]
        return module if self.function == "solve" else f"{module}-{self.function}"

    @property
    def said(self) -> str:
        """What a command line takes, in any folder."""
        return f"{self.file}:{self.function}" if self.file else self.name

    @staticmethod
    def of(text: str, folder: Path) -> Method:
        """Read "search", "paper", "module:function" or "file.py:function".

        Modules and files are looked for in a folder first, then among what is installed.

        Raises
        ------
        ValueError
            If it is none of these, or there is no such file or module.

        Examples
        --------
        >>> Method.of("search", Path()).is_own
        True
        >>> Method.of("validation.solvers.grid:solve", Path()).function
        'solve'
        """
        if text in OWN:
            return Method(text)
        where, _, function = text.rpartition(":")
        if not where or not function.isidentifier():
            raise ValueError(
                f"method '{text}': expected search, paper, or a function of yours as "
                "module:function or file.py:function"
            )
        if where.endswith(".py"):
            file = (folder / where).resolve()
            if not file.is_file():
                raise ValueError(f"method '{text}': there is no file {file}")
            return Method(f"{file.stem}:{function}", file)
        if not all(part.isidentifier() for part in where.split(".")):
            raise ValueError(f"method '{text}': '{where}' is no module")
        file = folder.joinpath(*where.split(".")).with_suffix(".py").resolve()
        if file.is_file():
            return Method(f"{file.stem}:{function}", file)
        try:
            known = importlib.util.find_spec(where)
        except (ImportError, ValueError):
            known = None
        if known is None:
            raise ValueError(f"method '{text}': there is no module '{where}' in {folder.resolve()}")
        return Method(text)


def function(method: Method) -> Callable[..., Any]:
    """The function itself, imported into this process.

    Raises ValueError where the module has none of that name.
    """
    module = loaded(method.file) if method.file else importlib.import_module(method.module)
    found = getattr(module, method.function, None)
    if not callable(found):
        raise ValueError(f"{method.module} has no function '{method.function}'")
    called: Callable[..., Any] = found
    return called


def loaded(file: Path) -> ModuleType:
    """A file as a module, whatever else goes by its name; one in a package as a part of that."""
    parts, folder = [file.stem], file.parent
    while (folder / "__init__.py").is_file():
        parts, folder = [folder.name, *parts], folder.parent
    if str(folder) not in sys.path:
        sys.path.insert(0, str(folder))  # for what it imports itself
    if len(parts) > 1:
        return importlib.import_module(".".join(parts))
    spec = importlib.util.spec_from_file_location(f"solver_{file.stem}", file)
    assert spec and spec.loader
    module = sys.modules[spec.name] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
