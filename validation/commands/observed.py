"""What `lightloc localize` is given: observations, a view, a picture or readings, by content."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from validation.commands.outputs import in_the_unit

if TYPE_CHECKING:
    from lightloc import Observations
    from render import Room

KINDS = {".npz": "npz", ".exr": "exr", ".csv": "csv", ".tsv": "csv", ".txt": "csv"}
STARTS = {b"PK\x03\x04": "npz", b"\x76\x2f\x31\x01": "exr"}
ENCODED = (".png", ".jpg", ".jpeg", ".bmp", ".gif", ".webp", ".heic", ".tif", ".tiff")
LIMITS = ("floor", "saturated", "step")  # of a sensor; pictures tell their own
NOBODY_SAYS = "unit"  # the unit of length of a file that does not say it


@dataclass(frozen=True)
class Given:
    """The files, and what the command line says of them; None where it does not."""

    paths: Sequence[Path]
    sensor: int | None = None
    camera: list[float] | None = None
    transport: Literal["direct", "full"] | None = None
    max_depth: int | None = None
    albedo: float | None = None
    unit: str | None = None
    floor: float | None = None
    saturated: float | None = None
    step: float | None = None

    @property
    def kind(self) -> str:
        """npz, exr or csv: by the file's name, else by its first bytes."""
        first = self.paths[0]
        if first.suffix.lower() in KINDS:
            return KINDS[first.suffix.lower()]
        if first.suffix.lower() in ENCODED:
            raise ValueError(f"{first}: holds values encoded for display; expected linear, as EXR")
        try:
            with open(first, "rb") as file:
                return STARTS.get(file.read(4), "npz")
        except OSError:
            return "npz"

    def read(self, room: Room | None) -> tuple[Observations, str | None]:
        """The observations, and what to say of them."""
        import render
        from lightloc import Observations, read_readings
        from lightloc.checks import number

        kind, first = self.kind, self.paths[0]
        for name in LIMITS:
            if (value := getattr(self, name)) is not None:
                number(f"--{name}", value, above=name == "saturated")
        if kind == "exr" and (len(self.paths) > 1 or not render.is_view(first)):
            self._only("albedo", *LIMITS)
            return self._picture(room)
        if len(self.paths) > 1:
            raise ValueError(f"{self.paths[1]}: one file at a time, but for a picture's layers")
        if kind == "csv":
            self._only("sensor", "camera", "max_depth")
            both = self.transport == "full" or (self.transport is None and room is not None)
            unit = self.unit or (room.unit if room and room.unit != NOBODY_SAYS else None)
            seen = read_readings(
                first,
                albedo=self.albedo,
                interreflected=both,
                unit=unit,
                floor=self.floor,
                saturated=self.saturated,
                step=self.step or 0.0,
            )
            errors = "errors estimated" if seen.sigma is None else "errors given"
            said = f"{len(seen)} readings of {seen.quantity}, lengths in {seen.unit}, {errors}"
            return seen, said
        self._only("sensor", "camera", "transport", "max_depth", "albedo")
        if kind == "exr":
            self._only(*LIMITS)
            return in_the_unit(render.observe_view(first, room), self.unit, first), None
        seen = in_the_unit(Observations.load(first), self.unit, first)
        return self._limited(render.attach(seen, room) if room else seen), None

    def _limited(self, seen: Observations) -> Observations:
        """With the limits of the sensor that the command line names."""
        if self.floor is not None:
            seen = replace(seen, floor=self.floor)
        if self.saturated is not None:
            clipped = (seen.radiance >= self.saturated).any(axis=1)
            seen = replace(seen, saturated=seen.saturated | clipped)
        return seen if self.step is None else replace(seen, step=self.step)

    def _picture(self, room: Room | None) -> tuple[Observations, str]:
        import render

        if room:
            self._only("camera")
        else:
            self._only("sensor")
        picture = render.read_picture(*self.paths)
        seen = render.observe_picture(
            picture,
            room,
            sensor=self.sensor or 0,
            camera=self.camera,
            transport=self.transport,
            max_depth=self.max_depth,
            unit=self.unit or NOBODY_SAYS,
        )
        if seen.interreflected and not room:
            raise ValueError(
                f"{picture.name}: interreflected light can't be removed without --scene; give it, "
                "or --transport direct where there is none or --ambient stands for it"
            )
        ends = f", paths of length {seen.max_depth} at most" if seen.max_depth else ""
        light = f"all light{ends}" if seen.interreflected else "direct light alone"
        return seen, f"{picture}; {len(seen)} used, of {light}"

    def _only(self, *absent: str) -> None:
        """Refuse options that do not belong to such a file."""
        for name in absent:
            if getattr(self, name) is not None:
                option = name.replace("_", "-")
                raise ValueError(f"--{option}: does not belong to {self.paths[0]}")
