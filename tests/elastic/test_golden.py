"""The numbers of an independent implementation, to 1e-12 (spec section 2)."""

import json

import numpy as np
import pytest

from elastocal.elastic import ElasticModel, layout
from elastocal.robot import Robot
from support.shared import GOLDEN, needs_shared

pytestmark = needs_shared


@pytest.fixture(scope="module")
def golden():
    numbers = json.loads((GOLDEN / "golden_6r.json").read_text())
    return {
        key: np.array(value) if isinstance(value, list) else value for key, value in numbers.items()
    }


@pytest.fixture(scope="module")
def model():
    robot = Robot.from_file(GOLDEN / "golden_6r.urdf", "tcp")
    return ElasticModel(robot, layout(robot, "bearing-joint"))


def agree(found, expected):
    scale = np.abs(expected).max()
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12 * scale)


def test_spring_names_and_order(model, golden):
    assert list(model.spring_names) == golden["spring_names"].tolist()


def test_pose_of_the_tcp(model, golden):
    pose = model.robot.forward(golden["joint_position"])
    agree(pose[:, :3, 3], golden["tcp_position"])
    agree(pose[:, :3, :3], golden["tcp_rotation"])


def test_spring_jacobian(model, golden):
    agree(model.spring_jacobian(golden["joint_position"]).translation, golden["spring_jacobian"])


def test_observation_matrix(model, golden):
    found = model.observation_blocks(golden["joint_position"], golden["force"])
    agree(found, golden["observation_matrix"])


def test_deflection(model, golden):
    found = model.deflection(golden["compliance"], golden["joint_position"], golden["force"])
    agree(found, golden["deflection"])
