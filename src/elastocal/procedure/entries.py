"""What stands in a journal: one entry a line."""

from enum import Enum
from typing import Any

from pydantic import SerializerFunctionWrapHandler, model_serializer

from elastocal.procedure.pose_log import PoseLog
from elastocal.records import StrictModel

SCHEMA = "elastocal.journal/1"


class Event(Enum):
    """Why an entry was written."""

    START = "start"
    """First entry of a run; holds `RunRecord`."""
    RESUME = "resume"
    """A person let the run go on."""
    BEGIN = "begin"
    """Written before the devices are told to move or press."""
    END = "end"
    """Written after that is over."""
    FAULT = "fault"
    """Something made an attempt, or the run, fail."""
    COMMIT = "commit"
    """A pose is finished and its streams are on the disk; holds its `PoseLog`."""
    GIVEN_UP = "given up"
    """All attempts at a pose failed; the run goes on without it."""
    FINISH = "finish"
    """Last entry of a run, or of one stretch of it."""


class Action(Enum):
    """What the arm is told between two entries."""

    ENABLE = "enable"
    MOVE = "move"
    APPROACH = "approach"
    HOLD = "hold"
    RELEASE = "release"
    RETRACT = "retract"
    STOP = "stop"
    DISABLE = "disable"


class RunRecord(StrictModel):
    """Which run a journal belongs to."""

    schema_name: str = SCHEMA
    elastocal: str
    """Version that started it."""
    plan: str
    """SHA-256 of ``plan.json``."""
    cell: str
    """Fingerprint of the cell."""
    cell_file: str
    """Path of the cell file in the run's folder ``cell``."""
    seed: int
    """Of simulated devices."""
    started: str
    """Date and time of day, ISO 8601, UTC."""

    @property
    def origin(self) -> str:
        """What a dataset says of the run that it comes from."""
        return (
            f"started {self.started} with elastocal {self.elastocal}, plan {self.plan[:12]}, cell"
            f" {self.cell[:12]}, seed {self.seed}"
        )

    @model_serializer(mode="wrap")
    def _schema_first(self, rest: SerializerFunctionWrapHandler) -> dict[str, Any]:
        # An entry leaves out what is at its default; the schema must be there all the same.
        return {"schema_name": self.schema_name, **rest(self)}


class Entry(StrictModel):
    """One line of a journal."""

    n: int
    """Running number, from 0."""
    time: float
    """In s of the devices' clock."""
    event: Event
    pose: int | None = None
    """Id in the plan; None between poses."""
    attempt: int | None = None
    """At this pose, from 1."""
    step: str | None = None
    """State of the procedure."""
    action: Action | None = None
    target: str | tuple[float, ...] | None = None
    """Joint positions of a move in rad or m; name of the load case of a hold; distance of a
    straight motion in m."""
    text: str = ""
    """For people: what went wrong, or how a reading came about."""
    run: RunRecord | None = None
    log: PoseLog | None = None
    streams_sha256: str | None = None
    """Of the file with the raw streams of a finished pose."""
