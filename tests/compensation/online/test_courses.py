"""Where courses begin: a tool that was free, has pressed and stands in light contact."""

from dataclasses import dataclass, field

import numpy as np
import pytest

from elastocal.cell import BeamState, PointBlock
from elastocal.compensation.online import (
    CourseWatch,
    LightContact,
    LiveCycle,
    Status,
    TaughtCourses,
)
from elastocal.robot import Robot
from support.virtual_chain import ARMS

Q = np.array([0.1, -0.8, 1.0, 0.2, 0.7, 0.3])
LEVER = np.array([0.1, 0.0, -0.2])
TAUGHT, MOVED = np.array([3e-4, -2e-4, 1e-4]), np.array([5e-5, 8e-5, -6e-5])
LOOK = 0.05


def arm() -> Robot:
    return Robot.from_urdf(ARMS["six axes"], "tcp")


@dataclass
class Cell:
    """An arm, and a tracker that stands turned beside it."""

    robot: Robot = field(default_factory=arm)
    time: float = 5.0
    q: np.ndarray = field(default_factory=lambda: Q.copy())
    noise: float = 2e-6
    station: str = "left"
    silent: bool = False
    moved: np.ndarray = field(default_factory=lambda: MOVED)

    def __post_init__(self) -> None:
        T = np.eye(4)
        T[:3, :3] = [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
        T[:3, 3] = (3.0, 1.0, 0.5)
        self.T, self.rng = T, np.random.default_rng(0)
        place = self.robot.forward(np.array([Q, Q + 0.1]))[:, :3, 3]
        offset = np.array([TAUGHT, -TAUGHT])
        self.watch = CourseWatch(
            self.robot,
            TaughtCourses(place, offset, T, "left", LEVER),
            LightContact(force=60.0, settle=0.5, average=1.0, scatter=50e-6),
        )

    def marker(self) -> PointBlock:
        tool = self.robot.forward(self.q)
        seen = tool[:3, 3] + tool[:3, :3] @ LEVER + TAUGHT + self.moved
        seen = (seen - self.T[:3, 3]) @ self.T[:3, :3]
        time = self.time - LOOK + np.arange(1, 6) * LOOK / 5
        position = seen + self.noise * self.rng.normal(size=(5, 3))
        sigma = np.full((5, 3), self.noise)
        return PointBlock(time, position, sigma, BeamState.LOCKED, self.station, "test")

    def look(self, seconds: float, force: float, status: int = 0) -> list[tuple]:
        """Return the deviations that are found within a time."""
        found = []
        for _ in range(round(seconds / LOOK)):
            self.time += LOOK
            wrench = (0.0, 0.0, -force, 0.0, 0.0, 0.0)
            zero = (0.0, 0.0, 0.0)
            cycle = LiveCycle(self.time, self.q.tolist(), None, wrench, zero, 0.0, zero, status)
            found.append(self.watch.see(cycle, None if self.silent else self.marker()))
            self.free = self.watch.is_free(cycle)
        return [each for each in found if each is not None]


def test_a_course_begins_once_after_a_press_and_shows_what_has_moved_since_it_was_taught():
    cell = Cell()
    assert cell.look(2.0, 0.0) == []
    assert cell.look(1.0, 1100.0) == []
    (found,) = cell.look(3.0, 60.0)
    np.testing.assert_allclose(found, MOVED, atol=2e-6)
    assert cell.look(5.0, 1000.0) == []
    cell.look(0.3, 0.0)
    assert not cell.free  # a force that passes through zero ends no course
    cell.look(0.5, 0.0)
    assert cell.free


def test_without_a_press_no_course_begins():
    cell = Cell()
    assert cell.look(1.0, 0.0) + cell.look(4.0, 60.0) == []
    # A press before the tool was in the air is none of this course.
    assert cell.look(1.0, 900.0) + cell.look(1.0, 0.0) + cell.look(4.0, 60.0) == []


def test_a_tool_that_moves_or_readings_that_fail_begin_the_wait_anew():
    cell = Cell()
    cell.look(1.0, 900.0)
    for _ in range(4):
        assert cell.look(1.2, 60.0) == []
        cell.q = cell.q + 1e-3
    assert cell.look(1.4, 60.0) == []
    assert cell.look(0.1, 60.0, status=2) == []
    # The press is forgotten with them: the tool may have left meanwhile.
    assert cell.look(3.0, 60.0) == []


def test_cycles_between_two_readings_of_a_slower_sensor_take_nothing_away():
    cell = Cell()
    found = []
    for force in (0.0, 900.0, 60.0):
        for _ in range(round(2.0 / (2 * LOOK))):
            found += cell.look(LOOK, force) + cell.look(LOOK, force, status=Status.HELD.value)
    assert len(found) == 1
    cell.look(1.0, 0.0, status=Status.HELD.value)
    assert cell.free


@pytest.mark.parametrize(
    ("changes", "why"),
    [
        ({"noise": 1e-3}, "the marker scattered by"),
        ({"noise": np.nan}, "the tracker gave 0 positions: at least 5 are needed"),
        ({"station": "right"}, "the tracker gave 0 positions"),
        ({"silent": True}, "the tracker gave 0 positions"),
        ({"q": Q - 0.2}, "no place within 30 mm was taught, and the tool did not stand in the air"),
    ],
)
def test_what_is_no_reading_is_refused_by_its_reason(changes, why):
    cell = Cell(**changes)
    assert cell.look(1.0, 900.0) + cell.look(3.0, 60.0) == []
    assert why in cell.watch.refusal
    vars(cell).update({"noise": 2e-6, "station": "left", "silent": False, "q": Q})
    assert cell.look(1.0, 900.0) == []
    assert len(cell.look(3.0, 60.0)) == 1
    assert cell.watch.refusal == ""


def test_a_place_that_nobody_taught_is_taught_by_the_first_landing_there():
    cell = Cell(q=Q - 0.2)
    first, later = np.array([1e-5, 2e-5, 3e-5]), np.array([4e-5, -9e-5, 0.0])
    for moved in (first, first + later):
        cell.moved = np.zeros(3)
        assert cell.look(2.0, 0.0) == []  # in the air, before it lands
        assert cell.look(1.0, 900.0) == []
        cell.moved = moved
        (found,) = cell.look(2.0, 60.0)
        np.testing.assert_allclose(found, moved, atol=3e-6)
    # What the arm shows in the air the second time is no longer asked: it may have grown.
    cell.moved = later
    assert cell.look(2.0, 0.0) + cell.look(1.0, 900.0) == []
    (found,) = cell.look(2.0, 60.0)
    np.testing.assert_allclose(found, later, atol=3e-6)
