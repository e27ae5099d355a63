"""What goes wrong with absolute positions is named, and what is right raises no alarm."""

import re
from dataclasses import replace

import numpy as np
import pytest

from elastocal.errors import GeometryError
from elastocal.geometry import GeometryProblem, Positions, geometry_model, plausible_ladder
from elastocal.geometry.ladder import climb
from elastocal.progress import silent
from elastocal.robot import Robot, catalogue
from support.by_day import some_by_day
from support.measured_arms import Measured, chain, measure


def kuka() -> Robot:
    return catalogue.load("KR 210 R2700-2")


def findings(data: Positions, robot: Robot | None = None) -> tuple[str, ...]:
    problem = GeometryProblem(kuka() if robot is None else robot, data)
    return geometry_model(problem, climb(problem, 40, _rng(), silent), "test").findings


def _rng() -> np.random.Generator:
    return np.random.default_rng(0)


def coupled(q: np.ndarray) -> np.ndarray:
    return np.column_stack([q[:, :2], -(q[:, 1] + q[:, 2]), q[:, 3:]])


@pytest.mark.parametrize(
    ("recorded", "message"),
    some_by_day(
        [
            (coupled, "the third joint is coupled to the second as on FANUC controllers"),
            (
                lambda q: q * [1, 1, 1, -1, 1, 1],
                "joint_a4 turns the other way round than in the URDF",
            ),
            (
                lambda q: q * [-1, 1, 1, -1, 1, -1],
                "joints 1, 4 and 6 of the arm turn the other way",
            ),
        ]
    ),
)
def test_joints_of_another_convention_are_refused_by_it(recorded, message):
    data = measure(kuka(), 60).data
    problem = GeometryProblem(kuka(), replace(data, q=recorded(data.q)))
    with pytest.raises(GeometryError, match=message):
        plausible_ladder(problem, 40, _rng())


@pytest.mark.slow
def test_a_coupled_joint_is_named_where_single_joints_were_swept():
    """As of a public FANUC: six rows of 36 were set aside as blunders, without a word of it."""
    z, y, x = "0 0 1", "0 1 0", "1 0 0"
    arm = chain(
        ("0 0 0.67", z), ("0.31 0 0", y), ("0 0 1.07", "0 -1 0"), ("1.28 0 0.22", f"-{x}"),
        ("0 0 0", "0 -1 0"), ("0.21 0 0", f"-{x}"),
    )  # fmt: skip
    swept = np.zeros((36, 6))
    for joint in range(6):
        swept[6 * joint : 6 * joint + 6, joint] = np.linspace(-0.6, 0.9, 6)
    data = measure(arm, 36, joints=swept, stations=1, error=2e-4).data
    sound = plausible_ladder(GeometryProblem(arm, data), 40, _rng())
    assert sound.whole.fit.used.all()
    swept[:, 2] -= swept[:, 1]
    with pytest.raises(GeometryError, match=re.escape("FANUC controllers: use q2 + q3; with")):
        plausible_ladder(GeometryProblem(arm, replace(data, q=swept)), 40, _rng())


@pytest.mark.slow
@pytest.mark.parametrize("size", [1e-4, 3e-4, 5e-3])
def test_a_station_that_moved_is_named_with_the_row(size):
    data = measure(kuka(), 100).data
    later = (data.station == "s0") & (np.arange(100) >= 60)
    moved = data.markers + size * later[:, None, None] * np.array([1.0, 0.5, -0.3])
    (found,) = findings(replace(data, markers=moved))
    stated = re.search(r"station 's0' seems to have moved by ([\d.]+) mm before row 60 ", found)
    assert stated
    assert 0.5e-3 * float(stated[1]) < 1.16 * size < 2e-3 * float(stated[1])


@pytest.mark.parametrize(
    "measured",
    [
        *(lambda seed=seed: measure(kuka(), 100, seed=seed) for seed in range(3)),
        lambda: measure(kuka(), 30, markers=1),
        lambda: measure(kuka(), 100, blunders=20),
        # The robot's own sag under a payload that came half way is no move of the station.
        lambda: measure(kuka(), 100, payloads=(0.0,) * 50 + (80.0,) * 50, compliance=2e-7),
    ],
)
def test_sound_positions_raise_no_alarm(measured):
    found: Measured = measured()
    assert findings(found.data) == ()


def test_swapped_markers_are_named_with_their_rows():
    data = measure(kuka(), 80).data
    markers = data.markers.copy()
    markers[10:13, [0, 2]] = markers[10:13, [2, 0]]
    assert findings(replace(data, markers=markers)) == (
        "marker 1 and marker 3 are swapped in 3 rows (counted from 0: 10, 11, 12); they were left"
        " out",
    )


def test_rounded_joints_are_named_and_postures_in_whole_degrees_are_not():
    """0.1 deg left 1.7 mm in place of 0.05, without a word."""
    whole = np.radians(np.round(np.degrees(measure(kuka(), 40).data.q)))
    sound = measure(kuka(), 40, joints=whole).data
    assert findings(sound) == ()
    data = measure(kuka(), 40).data
    rounded = np.radians(np.round(np.degrees(data.q), 1))
    (found,) = findings(replace(data, q=rounded))
    assert found.startswith("joints are rounded to 0.1 deg, which moves the markers by 1.5 mm")


def test_an_arm_without_masses_is_said_to_be_one():
    bare = re.sub(r"<inertial>.*?</inertial>", "", kuka().urdf, flags=re.DOTALL)
    robot = Robot.from_urdf(bare, kuka().tip)
    (found,) = findings(measure(robot, 60).data, robot)
    assert "has no masses" in found
