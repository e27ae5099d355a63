"""Units by the size of forces: what an arm carries is its URDF's word, or a rule of thumb."""

import re

import numpy as np
import pytest

from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel, actuated
from elastocal.identification.mistakes.plausibility import find_wrong_units
from elastocal.robot import Robot, catalogue

POSES = 12


def arm(effort: str | None, size: float) -> Robot:
    """Return an arm without masses, as exporters write it, as large as a part of a UR10e."""
    urdf = re.sub(r"<inertial>.*?</inertial>", "", catalogue.urdf("UR10e"), flags=re.DOTALL)
    urdf = urdf if effort is None else re.sub(r'effort="[^"]*"', effort, urdf)

    def shrunk(origin: re.Match[str]) -> str:
        return f'{origin[1]}{" ".join(str(size * float(each)) for each in origin[2].split())}"'

    return Robot.from_urdf(re.sub(r'(<origin[^>]*xyz=")([^"]*)"', shrunk, urdf), "flange")


def pressed(robot: Robot, force: float, compliance: float) -> Readings:
    """Return readings of an arm that is pressed at its tool along each axis of base."""
    rng = np.random.default_rng(0)
    q = np.repeat(rng.uniform(-1.5, 1.5, (POSES, len(robot.joint_names))), 3, axis=0)
    forces = force * np.tile(np.eye(3), (POSES, 1))
    bent = ElasticModel(robot, actuated(robot)).observation_blocks(q, forces)
    moved = bent.sum(axis=-1) * compliance
    cases = np.tile(["x", "y", "z"], POSES)
    return Readings(np.repeat(np.arange(POSES), 3), cases, q, forces, np.zeros_like(moved), moved)


@pytest.mark.parametrize("effort", ['effort="0"', 'effort="100"'])
def test_sound_forces_on_a_small_arm_of_unknown_torques_are_no_counts(effort):
    robot = arm(effort, 0.5)
    assert [*find_wrong_units(robot, pressed(robot, 60.0, 2e-5))] == []


@pytest.mark.parametrize("effort", [None, 'effort="0"'])
def test_counts_are_found_by_the_torques_of_the_urdf_or_the_reach(effort):
    robot = arm(effort, 1.0)
    found = [*find_wrong_units(robot, pressed(robot, 6e7, 2e-11))]
    assert [each.kind for each in found] == ["mistakes.counts"]
