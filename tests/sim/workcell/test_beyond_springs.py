"""No inverse crime: what the simulated robot does, no springs at the joints can express."""

from functools import cache

import numpy as np
import pytest

from elastocal.dataset import Dataset
from elastocal.elastic import ElasticModel, layout
from elastocal.identification import calibrate
from elastocal.sim.workcell._robot import TrueRobot
from support.by_day import some_by_day
from support.simulated import example_cell, places


@cache
def readings(like):
    """Return noiseless readings; every load case follows the one before, as in a run."""
    cell = example_cell(like)
    robot, loads = TrueRobot.of(cell), cell.file.load_cases
    q = np.stack([place.q for place in places(like, 24)])
    force = np.einsum("pij,lj->pli", robot.forward(q)[:, :3, :3], loads.force_tcp)
    deflection = np.empty_like(force)
    for here, forces, moved in zip(q, force, deflection, strict=True):
        free = rest = robot.rest(here, np.zeros(3), robot.springs)
        for number, each in enumerate(forces):
            rest = robot.rest(here, each, rest.springs, rest.theta)
            moved[number] = rest.T_base_tcp[:3, 3] - free.T_base_tcp[:3, 3]
    dataset = Dataset.from_arrays(
        joint_position=np.repeat(q[:, None], len(loads.cases), axis=1),
        force=force,
        controller_displacement=np.zeros_like(force),
        marker_displacement=deflection,
        joint_names=cell.robot.joint_names,
        load_cases=loads.cases,
        joint_units=["rad" if turns else "m" for turns in cell.robot.revolute],
        robot_name=cell.robot.name,
        robot_urdf=cell.robot.urdf,
        tcp_frame=cell.robot.tip,
        provenance="a test",
    )
    return dataset.readings(cell.robot.joint_names)


@cache
def error(like, springs):
    """Mean error at left-out poses over the mean deflection."""
    cell, found = example_cell(like), readings(like)
    model = ElasticModel(cell.robot, layout(cell.robot, springs))
    calibration = calibrate(model, found, np.random.default_rng(0))
    return calibration.held_out.mean / np.linalg.norm(found.deflection, axis=1).mean()


@pytest.mark.parametrize("like", some_by_day(["afp", "machining"]))
class TestHiddenTruth:
    @pytest.mark.slow
    def test_eighteen_springs_predict_unseen_poses_better_than_six(self, like):
        assert error(like, "bearing") < 0.85 * error(like, "actuated")

    def test_neither_reproduces_it_even_without_noise(self, like):
        assert error(like, "bearing") > 0.01
        assert error(like, "actuated") > 0.01

    def test_yet_a_calibration_explains_most_of_it(self, like):
        assert error(like, "bearing") < 0.1
