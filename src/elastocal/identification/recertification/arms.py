"""The rows of a comparison, and their arm, which may have another tool, weight or mounting.

Springs belong to the arm. So two models are compared on the same arm, with the same tool and
weight, since a change of the tool is no change of the robot.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel
from elastocal.errors import IdentificationError
from elastocal.identification.calibrated import CalibratedModel
from elastocal.identification.domain import CalibrationDomain
from elastocal.results import brief_repr
from elastocal.robot import Robot, link_gap, of_one_arm, probe_configurations, same_joints, tool_gap
from elastocal.wording import phrase

_WEIGHT = 1e-3
"""Largest difference of two weights of one arm, as a part of the largest gravity torque."""


@brief_repr
@dataclass(frozen=True, eq=False)
class ComparedRows:
    """Poses and loads that matter, in order in time."""

    q: FloatArray
    """Joint positions, shape (row, joint), in rad or m."""
    force: FloatArray
    """Force on the robot at the tcp in base, shape (row, 3), in N."""
    moment: FloatArray | None = None
    """Moment on the robot about the tcp in base, shape (row, 3), in N·m; None: none."""
    visit: Sequence[object] | None = None
    """Rows with one value share what friction remembers; None: each is pressed from rest."""
    readings: Readings | None = None
    """The readings that the rows are: what matters then is the displacement that each shows,
    against its reference and after what the arm felt before."""
    arm: Robot | None = None
    """Robot of these rows, with its tool, weight and mounting; None: that of the new model."""

    @classmethod
    def of(cls, readings: Readings, arm: Robot | None = None) -> "ComparedRows":
        """Return readings as rows."""
        q, force, moment = readings.joint_position, readings.force, readings.moment
        return cls(q, force, moment, readings=readings, arm=arm)

    @classmethod
    def of_calibration(cls, domain: CalibrationDomain) -> "ComparedRows":
        """Return the readings that a model was calibrated at, each pressed from rest."""
        return cls(domain.joint_position[domain.reading_pose], domain.force, domain.moment)

    def __len__(self) -> int:
        return len(self.q)

    def friction(self, model: ElasticModel) -> FloatArray | None:
        """Return the friction state, shape (row, element); None: pressed from rest."""
        if self.visit is None or not len(model.friction):
            return None
        at = model.at(self.q)
        load = model.load_torques(at, self.force, self.moment)
        return model.friction.visits(at.weight, load, np.asarray(self.visit))[0]

    def taken(self, number: IndexArray) -> "ComparedRows":
        """Return some of the rows; their friction state must be known."""
        moment = None if self.moment is None else self.moment[number]
        return ComparedRows(self.q[number], self.force[number], moment)


def check_same_robot(old: Robot, new: Robot, names: tuple[str, str]) -> None:
    """Refuse two robots that are not the same; their tools may differ.

    Parameters
    ----------
    old, new : Robot
        The robots.
    names : tuple of str
        What they belong to, for the message.

    Raises
    ------
    IdentificationError
        If joints or kinematics differ.
    """
    a, b = names
    if not same_joints(old, new):
        raise IdentificationError(
            f"{a} and {b} are of different robots: {old.name} has the joints"
            f" {', '.join(old.joint_names)}, {new.name} has {', '.join(new.joint_names)}"
        )
    gap = link_gap(old, new)
    if not of_one_arm(gap, old, new):
        raise IdentificationError(
            f"{a} ({old.name}) and {b} ({new.name}) are of different robots: at the same joints"
            f" their last links are {gap} apart"
        )


def model_on(calibrated: CalibratedModel, arm: Robot) -> CalibratedModel:
    """Return a model on an arm that is the same robot, with its tool, weight and mounting.

    A model that was calibrated on such an arm is returned unchanged.
    """
    robot = calibrated.model.robot
    if tool_gap(robot, arm).closed and not _weighs_otherwise(robot, arm):
        return calibrated
    return replace(calibrated, model=ElasticModel(arm, calibrated.model.springs))


def arm_notes(
    models: tuple[CalibratedModel, CalibratedModel], arm: Robot, names: tuple[str, str]
) -> tuple[str, ...]:
    """Return the differences between the arms of two models and the arm of the comparison."""
    notes = []
    for calibrated, name in zip(models, names, strict=True):
        robot = calibrated.model.robot
        gap = tool_gap(robot, arm)
        about = {"name": name, "gap": str(gap), "tip": arm.tip}
        if not gap.closed and calibrated.tip is not None:
            notes.append(
                phrase(
                    "{name} has its tip where it was found beside the springs, {gap} from the tcp"
                    " compared at, {tip}: its springs are taken to be those of the arm alone",
                    **about,
                )
            )
        elif not gap.closed:
            notes.append(
                phrase(
                    "{name} was calibrated with another tool (tcp {own}, {gap} from the one"
                    " compared at, {tip}): its springs are taken to be those of the arm alone",
                    own=robot.tip,
                    **about,
                )
            )
        if not calibrated.model.bears_weight:
            continue
        if _weighs_otherwise(robot, arm):
            notes.append(
                phrase(
                    "{name} was calibrated under another weight of the arm (tool or mounting):"
                    " deflections are compared under one",
                    name=name,
                )
            )
        elif robot.has_masses != arm.has_masses:
            notes.append(
                phrase(
                    "{name} knows a weight of the arm, which the other side does not: gears"
                    " stiffen with it"
                    if robot.has_masses
                    else "{name} knows no weight of the arm, which the other side does know: gears"
                    " stiffen with it",
                    name=name,
                )
            )
    return tuple(notes)


def _weighs_otherwise(robot: Robot, arm: Robot) -> bool:
    """Return whether the known weights of two arms differ; unknown ones do not."""
    if not (robot.has_masses and arm.has_masses):
        return False
    here, there = (each.gravity_torques(probe_configurations(arm)) for each in (robot, arm))
    largest = max(float(np.abs(here).max()), float(np.abs(there).max()))
    return float(np.abs(here - there).max()) > _WEIGHT * largest


def count_outside_limits(robot: Robot, q: FloatArray) -> int:
    """Return how many rows of joint positions lie outside the robot's limits."""
    return int(np.sum(np.any(robot.limits.margin(q) < 0.0, axis=1)))
