"""The cell file: what a person writes about the cell, validated."""

from collections import Counter
from typing import Any

from pydantic import Field, field_validator

from elastocal.cell.description.acceptance import Acceptance
from elastocal.cell.description.devices import DeviceNames
from elastocal.cell.description.engagement import Engagement
from elastocal.cell.description.faults import Fault
from elastocal.cell.description.limits import Limits
from elastocal.cell.description.loads import LoadCases
from elastocal.cell.description.metrology import Marker, Tracker
from elastocal.cell.description.motion import Motion
from elastocal.cell.description.pose import IDENTITY, Pose
from elastocal.cell.description.procedure import ProcedureSettings
from elastocal.cell.description.robot import RobotEntry
from elastocal.cell.description.search import Search
from elastocal.cell.description.shapes import Shape
from elastocal.cell.description.simulation import Simulation
from elastocal.cell.description.surface import SurfaceEntry
from elastocal.cell.description.tool import ForceSensor, Tool
from elastocal.records import StrictModel

SCHEMA = "elastocal.cell/1"
TOOLING = "tooling"
"""Name of the surface among the solids of the cell; no fixture may have it."""


class ProcessFile(StrictModel):
    """Poses and forces of the production process."""

    file: str
    """CSV with joint and force columns (the ROWS.csv of `elastocal predict`), relative to the
    cell file."""


class CellFile(StrictModel):
    """All keys of a cell file but ``schema``."""

    name: str = ""
    robot: RobotEntry
    tcp: Pose = IDENTITY
    """Tool centre point in the flange frame, z out of the tool."""
    tool: Tool
    sensor: ForceSensor | None = None
    marker: Marker | None = None
    trackers: tuple[Tracker, ...] = ()
    surface: SurfaceEntry
    fixtures: tuple[Shape, ...] = ()
    """Solids in base."""
    load_cases: LoadCases
    engagement: Engagement
    limits: Limits = Field(default_factory=Limits)
    motion: Motion
    """Required: where HOME is safe is not guessed."""
    search: Search = Field(default_factory=Search)
    process: ProcessFile | None = None
    acceptance: Acceptance = Field(default_factory=Acceptance)
    """What the result is judged by; neither plan nor run depends on it."""
    procedure: ProcedureSettings = Field(default_factory=ProcedureSettings)
    devices: DeviceNames = Field(default_factory=DeviceNames)
    simulation: Simulation = Field(default_factory=Simulation)
    """Of the simulated devices; the calibration never reads it."""
    faults: tuple[Fault, ...] = ()
    """What the simulated devices get wrong, and when."""

    @field_validator("trackers")
    @classmethod
    def _named_once(cls, trackers: tuple[Tracker, ...]) -> tuple[Tracker, ...]:
        for name, times in Counter(tracker.name for tracker in trackers).items():
            if times > 1:
                raise ValueError(f"{times} stations are named {name!r}")
        return trackers

    @field_validator("trackers")
    @classmethod
    def _something_to_look_at(cls, trackers: tuple[Tracker, ...], info: Any) -> Any:
        if trackers and info.data.get("marker") is None:
            raise ValueError("trackers need a marker to look at (key 'marker')")
        return trackers

    @field_validator("fixtures")
    @classmethod
    def _none_is_the_tooling(cls, fixtures: tuple[Shape, ...]) -> tuple[Shape, ...]:
        # Under this name the plan knows the surface, which the tool may touch.
        if any(fixture.name == TOOLING for fixture in fixtures):
            raise ValueError(f"the name {TOOLING!r} is the surface's: name the fixture otherwise")
        return fixtures

    @field_validator("limits")
    @classmethod
    def _carries_the_tool(cls, limits: Limits, info: Any) -> Limits:
        mass, payload = getattr(info.data.get("tool"), "mass", 0.0), limits.payload
        if payload is not None and not mass <= payload:
            raise ValueError(f"payload {payload:g} kg is below the tool's mass, {mass:g} kg")
        return limits
