"""The measured poses that a codec splits: physical ones, without readings that are blunders."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.codec.options import CodecOptions
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel
from elastocal.errors import ConventionError
from elastocal.identification import (
    build,
    check_conventions,
    check_joints,
    pose_blocks,
    same_configuration,
    screen,
)
from elastocal.robot import Robot


@dataclass(frozen=True, eq=False)
class Campaign:
    """Readings grouped by physical pose.

    A configuration that was measured twice is one pose, or it would be verified by itself.
    """

    readings: Readings
    """What is trained and verified with."""
    pose: IndexArray
    """Number of the physical pose of each reading, shape (reading,), from 0 without gaps."""
    contact: FloatArray
    """Tcp positions in base, shape (pose, 3), in m: the mean over the pose's readings of the
    forward kinematics of the recorded joints."""
    labels: tuple[tuple[int, ...], ...]
    """Labels of each pose in the dataset."""
    findings: tuple[str, ...]
    """What a user should know of the data."""

    def __len__(self) -> int:
        """Return the number of physical poses."""
        return len(self.contact)

    @property
    def load_cases(self) -> tuple[str, ...]:
        """Load cases that have readings, in the order of the dataset."""
        return tuple(dict.fromkeys(self.readings.load_case.tolist()))


def make_campaign(
    models: Sequence[ElasticModel],
    readings: Readings,
    options: CodecOptions,
    marker_offset: ArrayLike | None = None,
) -> Campaign:
    """Return the poses of a dataset, checked as `calibrate` checks them.

    A reading is set aside when no model of the comparison can take it for a measurement, so
    that all variants are trained and verified on the same readings.

    Parameters
    ----------
    models : sequence of ElasticModel
        Those of the comparison, of one robot; the first has to explain signs and frames.
    readings : Readings
        Measurements, joints in the robot's order.
    options : CodecOptions
        Whether blunders are set aside, and conventions trusted.
    marker_offset : array_like, shape (3,), optional
        Metrology marker in the tcp frame, in m.

    Raises
    ------
    DatasetError
        If joints are outside the robot's limits or elsewhere than the recorded positions.
    ConventionError
        If the data fit only with a sign or frame read otherwise.
    IdentificationError
        If there are fewer than three distinct poses.
    """
    findings = list(check_joints(models[0].robot, readings))
    try:
        check_conventions(models[0], readings, marker_offset)
    except ConventionError as error:
        if not options.trust_conventions:
            raise
        findings.append(f"fitted in spite of this: {error}")
    if options.set_blunders_aside:
        blunder = _blunders(models, readings, marker_offset)
        findings += [
            f"pose {readings.pose[row]}, load case {str(readings.load_case[row])!r} is set aside:"
            " it cannot be a measurement of this robot"
            for row in np.flatnonzero(blunder)
        ]
        readings = readings.take(~blunder)
    return _grouped(models[0].robot, readings, findings)


def _grouped(robot: Robot, readings: Readings, findings: list[str]) -> Campaign:
    """Return readings by physical pose."""
    pose = pose_blocks(readings)
    repeated = [
        f"poses {', '.join(map(str, group))} are one configuration: kept on one side of each split"
        for group in same_configuration(readings, pose)
    ]
    position = robot.forward(readings.joint_position)[:, :3, 3]
    counts = np.bincount(pose)
    contact = np.stack([np.bincount(pose, axis) / counts for axis in position.T], axis=1)
    labels = tuple(
        tuple(np.unique(readings.pose[pose == number]).tolist()) for number in range(len(counts))
    )
    return Campaign(readings, pose, contact, labels, (*findings, *repeated))


def _blunders(
    models: Sequence[ElasticModel], readings: Readings, marker_offset: ArrayLike | None
) -> BoolArray:
    """Return which readings every model takes for blunders, shape (reading,)."""
    found = [screen(build(model, readings, None, marker_offset)).blunder for model in models]
    return np.asarray(np.all(found, axis=0))
