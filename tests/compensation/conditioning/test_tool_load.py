import numpy as np
import pytest

from elastocal.compensation.conditioning import SensorLoad
from elastocal.errors import CompensationError
from elastocal.procedure.derive.tool import RawWrench, ToolLoad, wrench_on_robot
from support.compensated import load
from support.static_postures import turned


def test_it_agrees_with_the_procedures_tare():
    tool, rng = load(), np.random.default_rng(0)
    T, T_tare = np.eye(4), np.eye(4)
    T[:3, :3], T_tare[:3, :3] = turned(2, rng, angle=0.4)
    raw = rng.normal(size=(2, 3)) * [[500.0], [50.0]]
    R_tare = T_tare[:3, :3] @ tool.T_tcp_sensor[:3, :3]
    weight = tool.mass * tool.gravity @ R_tare
    tare = RawWrench(
        weight + tool.force_bias, np.cross(tool.centre, weight) + tool.moment_bias, T_tare
    )
    known = ToolLoad(tool.mass, tool.centre, tool.gravity, tool.T_tcp_sensor)
    expected = wrench_on_robot(RawWrench(*raw, T), tare, known)
    force, moment = tool.wrench_tcp(T[:3, :3], *raw)
    np.testing.assert_allclose(T[:3, :3] @ force, expected.force, rtol=1e-12)
    np.testing.assert_allclose(T[:3, :3] @ moment, expected.moment, rtol=1e-12)


def test_a_default_load_changes_nothing():
    force, moment = SensorLoad().wrench_tcp(np.eye(3), np.array([1.0, 2, 3]), np.array([4.0, 5, 6]))
    assert (force.tolist(), moment.tolist()) == ([1, 2, 3], [4, 5, 6])


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"mass": -1.0}, "mass of the tool is -1.0 kg"),
        ({"mass": np.nan}, "mass of the tool is nan kg"),
        ({"centre": [0.0, np.inf, 0.0]}, "centre of the tool must be finite"),
        ({"moment_bias": [0.0]}, "moment_bias of the tool must be finite numbers of shape"),
        ({"T_tcp_sensor": np.diag([1.0, 1.0, -1.0, 1.0])}, "does not hold a rotation"),
    ],
)
def test_a_load_that_cannot_be_is_refused(change, reason):
    with pytest.raises(CompensationError, match=reason):
        SensorLoad(**change)
