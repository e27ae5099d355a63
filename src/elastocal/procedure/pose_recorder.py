"""Collect the raw streams of one pose attempt in memory and write them to one MCAP file."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from mcap.records import Metadata

from elastocal import __version__
from elastocal.arrays import FloatArray
from elastocal.cell.devices import ArmState, PointBlock, WrenchBlock
from elastocal.errors import ProcedureError
from elastocal.procedure.copies import file_sha256
from elastocal.procedure.mcap import TimeArray, Topic, write_mcap
from elastocal.procedure.stream_messages import (
    ARM,
    MARKER,
    MARKS,
    WRENCH,
    arm_messages,
    mark_message,
    point_messages,
    schemas,
    wrench_messages,
)

SCHEMA = "elastocal.streams/1"
RECORD = "elastocal"
"""Name of the metadata record that carries the schema."""
NANOSECONDS = 1e9
"""In a second."""


@dataclass(frozen=True)
class Mark:
    """Something that happened."""

    time: float
    """In s of the clock."""
    text: str


class PoseRecorder:
    """Collects what the devices say during one pose attempt; `save` writes it.

    Make a new one for each attempt. States and blocks are kept as they are given: they must not
    change afterwards. Empty blocks are welcome; a beam or a sensor that changes its state becomes
    a mark.

    Parameters
    ----------
    joint_names : sequence of str
        Joints of the arm, in the order of ``q``.
    """

    def __init__(self, joint_names: Sequence[str]) -> None:
        self._joint_names = tuple(joint_names)
        self._arm: list[ArmState] = []
        self._wrenches: list[WrenchBlock] = []
        self._points: list[PointBlock] = []
        self._marks: list[Mark] = []
        self._condition: dict[str, str] = {}

    def arm(self, state: ArmState) -> None:
        """Keep a state of the arm; one that was kept last is not kept twice."""
        if not self._arm or state.time != self._arm[-1].time:
            self._arm.append(state)

    def wrenches(self, block: WrenchBlock) -> None:
        """Keep the samples of a force sensor."""
        self._note("sensor", block.status.value)
        if len(block):
            self._wrenches.append(block)

    def points(self, block: PointBlock) -> None:
        """Keep the samples of a tracker."""
        self._note(f"beam of station {block.station}", block.beam.value)
        if len(block):
            self._points.append(block)

    def mark(self, time: float, text: str) -> None:
        """Keep a remark."""
        self._marks.append(Mark(time, text))

    def save(self, path: Path) -> str:
        """Write everything to an MCAP file, atomically and to the disk.

        Returns
        -------
        str
            SHA-256 of the file.

        Raises
        ------
        ProcedureError
            If a device's time is not a number, or negative.
        FileAccessError
            If the file cannot be written.
        """
        joints = json.dumps(self._joint_names)
        note = Metadata(name=RECORD, metadata={"schema": SCHEMA, "joints": joints})
        write_mcap(path, self._topics(), f"elastocal {__version__}", note)
        return file_sha256(path)

    def _note(self, what: str, condition: str) -> None:
        """Mark a condition that changed; an empty block has no time, so the arm's is taken."""
        if self._condition.get(what, "") != condition:
            self._condition[what] = condition
            self.mark(self._arm[-1].time if self._arm else 0.0, f"{what}: {condition}")

    def _topics(self) -> list[Topic]:
        texts = {
            ARM: arm_messages(self._arm, self._joint_names),
            WRENCH: wrench_messages(self._wrenches),
            MARKER: point_messages(self._points),
            MARKS: [mark_message(mark.text) for mark in self._marks],
        }
        times = {
            ARM: np.array([state.time for state in self._arm]),
            WRENCH: _end_to_end([block.time for block in self._wrenches]),
            MARKER: _end_to_end([block.time for block in self._points]),
            MARKS: np.array([mark.time for mark in self._marks]),
        }
        return [
            Topic(topic, name, schema, _nanoseconds(topic, times[topic]), texts[topic])
            for topic, (name, schema) in schemas(self._joint_names).items()
        ]


def _nanoseconds(topic: str, time: FloatArray) -> TimeArray:
    wrong = time[~((time >= 0.0) & (time < 2.0**63 / NANOSECONDS))]
    if len(wrong):
        raise ProcedureError(f"{topic}: time {wrong[0]} s cannot be recorded: it must be 0 or more")
    return np.rint(time * NANOSECONDS).astype(np.int64)


def _end_to_end(arrays: Sequence[FloatArray]) -> FloatArray:
    return np.concatenate(arrays) if arrays else np.empty(0)
