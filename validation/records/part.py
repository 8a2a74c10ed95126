"""What all records share: checked pieces, and numbers that may be missing."""

from __future__ import annotations

import math
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field

SCHEMA = 1  # of every file


def known(value: Any) -> Any:
    """None for a number that is not finite: JSON has neither NaN nor infinity."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


Count = Annotated[int, Field(ge=0)]
Real = Annotated[float | None, BeforeValidator(known)]
Reals = Annotated[list[Real], BeforeValidator(lambda value: [] if value is None else value)]
Vector = Annotated[list[Real], Field(min_length=3, max_length=3)]


class Part(BaseModel):
    """A checked piece of a record; fields of later writers are kept and not drawn."""

    model_config = ConfigDict(extra="allow", frozen=True)


class Made(Part):
    """When and with what something was made."""

    date: str = ""
    commit: str | None = None
    versions: dict[str, str | None] = Field(default_factory=dict)


class MadeOn(Made):
    """When, with what and on what machine it was made."""

    cpus: int | None = None
    machine: str = ""
