"""What presses of two arms do not see, by name."""

import numpy as np
import pytest

from elastocal.elastic import ElasticModel, actuated, bearing, tensor
from elastocal.robot import T_from_xyzabc, catalogue
from elastocal.two_robots.presses import PairModel
from elastocal.two_robots.tilts import expresses_tilt, tilt_column, tilt_finding


@pytest.fixture(scope="module")
def robot():
    return catalogue.load("KR 210 R2700-2")


def pair_of(robot, springs) -> PairModel:
    first, second = (ElasticModel(robot, springs(robot)) for _ in range(2))
    return PairModel(("left", "right"), (first, second))


def test_the_column_of_a_tilt_is_how_a_turned_base_moves_the_tip():
    """Finite differences."""
    rng = np.random.default_rng(1)
    point, force, line = (
        rng.standard_normal((5, 3)),
        rng.standard_normal((5, 3)),
        rng.normal(size=3),
    )
    line /= np.linalg.norm(line)
    step = 1e-6
    for p, f, column in zip(point, force, tilt_column(point, force, line), strict=True):
        angle = step * float(line @ np.cross(p, f))
        K = np.cross(line, np.eye(3)).T
        turned = p + np.sin(angle) * K @ p + (1.0 - np.cos(angle)) * K @ K @ p
        assert (turned - p) / step == pytest.approx(column, abs=1e-5)


def test_both_arms_have_the_same_column_for_a_tilt_about_the_line_of_their_bases():
    rng = np.random.default_rng(2)
    point, force = rng.standard_normal((20, 3)), rng.standard_normal((20, 3))
    other = np.array([3.6, 0.4, -0.2])
    line = other / np.linalg.norm(other)
    first = tilt_column(point, force, line)
    second = -tilt_column(point - other, -force, line)
    # Of O_1(f) c_1 - O_2(-f) c_2 only the sum of both is seen.
    assert first == pytest.approx(second, abs=1e-12)


@pytest.mark.parametrize(
    ("springs", "y", "kind"),
    [
        (bearing, 0.0, "two-robots.tilt"),
        (bearing, 0.4, "two-robots.tilt-by-axes"),
        (tensor, 0.4, "two-robots.tilt"),
        (actuated, 0.0, None),
    ],
)
def test_the_tilts_that_are_not_seen_are_named(robot, springs, y, kind):
    T = T_from_xyzabc(3.6, y, 0.0, np.pi, 0.0, 0.0)
    found = tilt_finding(pair_of(robot, springs), T)
    assert (found and found.kind) == kind
    if kind == "two-robots.tilt":
        assert "about the line that joins both bases is not seen" in found
        assert "left" in found


def test_a_tilt_of_a_known_arm_is_taken_from_its_model(robot):
    T = T_from_xyzabc(3.6, 0.0, 0.0, np.pi, 0.0, 0.0)
    found = tilt_finding(pair_of(robot, bearing), T, ("right",))
    assert found.kind == "two-robots.tilt-known"
    assert "from the model of right" in found


def test_springs_at_joints_hold_no_tilt_of_the_base(robot):
    model = ElasticModel(robot, actuated(robot))
    assert not expresses_tilt(model, np.array([1.0, 0.0, 0.0]))
    assert expresses_tilt(model, np.array([0.0, 0.0, 1.0]))  # joint 1 is upright
