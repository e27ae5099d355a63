"""A user's own process: a path file becomes courses in time."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from elastocal.compensation.process import (
    Course,
    PathTiming,
    at_load,
    read_programmed_path,
    write_programmed_path,
)
from elastocal.dataset import joint_dimensions
from elastocal.errors import PathError
from elastocal.robot import xyzabc_from_T
from support.cells import robot
from support.paths import FORCE_TCP, dome_course, start_text
from support.simulated import example_cell

AXES = "xyz"
SPEED = 0.1


def units():
    return joint_dimensions(robot().joint_names, robot().revolute)


def posture():
    return np.array([float(part.split()[0]) for part in start_text().split(",")])


def programme(rows: int = 40) -> Course:
    """A course across the dome with joints, forces that rise from nothing."""
    path = write_poses(rows)
    (course,) = read_programmed_path(path, robot(), PathTiming(SPEED, start=posture()))
    return course


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def write_poses(rows: int = 40, extra: dict[str, list[str]] | None = None, force: str = "_tcp"):
    T = dome_course(rows)
    xyzabc = xyzabc_from_T(T)
    table = {f"{axis}[m]": xyzabc[:, k] for k, axis in enumerate(AXES)}
    table |= {f"{angle}[rad]": xyzabc[:, 3 + k] for k, angle in enumerate("abc")}
    table |= {f"force{force}_{axis}[N]": np.full(rows, FORCE_TCP[k]) for k, axis in enumerate(AXES)}
    columns = {name: [repr(float(value)) for value in column] for name, column in table.items()}
    columns |= extra or {}
    lines = [",".join(columns), *(",".join(row) for row in zip(*columns.values(), strict=True))]
    path = Path("path.csv")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def test_the_tool_goes_along_the_poses_at_the_speed(folder):
    course = programme()
    steps = np.linalg.norm(np.diff(course.T_base_tcp[:, :3, 3], axis=0), axis=1)
    np.testing.assert_allclose(steps, SPEED * course.step, rtol=1e-3)
    np.testing.assert_allclose(robot().forward(course.q), course.T_base_tcp, atol=1e-9)


def test_forces_in_the_tcp_frame_turn_with_the_tool(folder):
    course = programme()
    force_tcp = np.einsum("rji,rj->ri", course.T_base_tcp[:, :3, :3], course.force)
    np.testing.assert_allclose(force_tcp, np.tile(FORCE_TCP, (len(force_tcp), 1)), atol=2.0)


def test_lateral_is_square_to_feed_and_tool_axis(folder):
    course = programme()
    feed = np.gradient(course.T_base_tcp[:, :3, 3], axis=0)
    np.testing.assert_allclose(np.linalg.norm(course.direction, axis=1), 1.0)
    for other in (feed, course.T_base_tcp[:, :3, 2]):
        np.testing.assert_allclose(np.einsum("rk,rk->r", course.direction, other), 0.0, atol=1e-12)


@pytest.mark.parametrize(("direction", "column"), [("normal", None), ("0,0,2", [0.0, 0.0, 1.0])])
def test_the_deviation_may_count_along_the_tool_or_a_vector(folder, direction, column):
    timing = PathTiming(SPEED, start=posture())
    (course,) = read_programmed_path(write_poses(), robot(), timing, direction)
    wanted = -course.T_base_tcp[:, :3, 2] if column is None else np.tile(column, (len(course.q), 1))
    np.testing.assert_allclose(course.direction, wanted, atol=1e-12)


def test_what_is_written_is_the_course_that_is_read(folder):
    course = programme()
    write_programmed_path(folder / "again.csv", [course], units())
    (again,) = read_programmed_path(folder / "again.csv", robot(), PathTiming())
    np.testing.assert_allclose(again.q, course.q, atol=1e-8)
    np.testing.assert_allclose(again.force, course.force, atol=1e-2)
    np.testing.assert_allclose(again.direction, course.direction, atol=1e-4)


def test_each_name_is_a_course_and_its_time_begins_anew(folder):
    names = ["first"] * 20 + ["second"] * 20
    time = [repr(0.1 * n) for n in range(40)]
    path = write_poses(extra={"course": names, "time[s]": time})
    first, second = read_programmed_path(path, robot(), PathTiming(start=posture()))
    assert (first.name, second.name) == ("first", "second")
    np.testing.assert_allclose(first.step * (len(first.q) - 1), 1.9, atol=first.step)
    # On the same branch; axis 6 may begin a whole turn elsewhere, within its limits.
    assert np.abs(second.q[0] - first.q[-1])[:5].max() < 0.1


def test_the_step_is_a_multiple_of_the_cycle():
    for cycle in (0.001, 0.004, 0.012, 0.05):
        parts = PathTiming(cycle=cycle).step / cycle
        assert parts == pytest.approx(round(parts))


TIMES = [repr(0.1 * n) for n in range(40)]


@pytest.mark.parametrize(
    ("extra", "speed", "reason"),
    [
        ({}, None, "nothing says how fast the path is run"),
        ({"time": TIMES}, None, "column 'time' has no unit"),
        ({"time[s]": [*TIMES[:5], *TIMES[4:-1]]}, None, "row 7: time does not advance"),
        ({"course": ["a"] * 10 + ["b"] * 10 + ["a"] * 20}, SPEED, "row 22: course 'a' begins a s"),
        (
            {"course": [""] * 40},
            SPEED,
            "row 2, column 'course': empty, but every row is of some course",
        ),
        ({"course": ["a"] * 39 + ["b"]}, SPEED, "row 41: course 'b' has a single row"),
        ({}, 1e3, "it must take 0.04 s and more"),
    ],
)
def test_a_path_that_is_no_process_is_refused_by_its_line(folder, extra, speed, reason):
    with pytest.raises(PathError, match=reason):
        read_programmed_path(write_poses(extra=extra), robot(), PathTiming(speed, start=posture()))


def test_a_path_along_the_tools_axis_has_no_side(folder):
    T = dome_course(40)[20]
    lines = ["x[m],y[m],z[m],a[rad],b[rad],c[rad],force_tcp_x[N],force_tcp_y[N],force_tcp_z[N]"]
    for depth in np.linspace(0.0, 0.02, 10):
        drilled = T.copy()
        drilled[:3, 3] += depth * T[:3, 2]
        place = xyzabc_from_T(drilled)
        lines.append(",".join(repr(float(x)) for x in (*place, 0.0, 0.0, -200.0)))
    path = folder / "drill.csv"
    path.write_text("\n".join(lines))
    timing = PathTiming(0.01, start=posture())
    with pytest.raises(PathError, match="no side to deviate to"):
        read_programmed_path(path, robot(), timing)
    assert len(read_programmed_path(path, robot(), timing, "normal")) == 1


@pytest.mark.usefixtures("folder")
class TestAtLoad:
    def test_half_is_half_of_all_of_it(self):
        course = programme()
        np.testing.assert_allclose(at_load(course, 0.5).force, 0.5 * course.force, atol=1e-9)

    def test_reversed_turns_what_is_lateral_and_presses_on(self):
        course = programme()
        turned = at_load(course, -1.0).force
        axis = course.T_base_tcp[:, :3, 2]
        along = [np.einsum("rk,rk->r", force, axis) for force in (course.force, turned)]
        np.testing.assert_allclose(along[1], along[0], atol=1e-9)
        lateral = [
            force - part[:, None] * axis
            for force, part in zip((course.force, turned), along, strict=True)
        ]
        assert np.abs(lateral[0]).max() > 100.0
        np.testing.assert_allclose(lateral[1], -lateral[0], atol=1e-9)

    def test_reversed_presses_on_along_the_normal_where_it_is_not_the_tools_axis(self):
        course = programme()
        normal = np.tile([0.0, np.sin(0.6), np.cos(0.6)], (len(course.force), 1))
        force = np.tile([100.0, 0.0, 300.0], (len(course.force), 1))
        turned = at_load(replace(course, normal=normal, force=force), -1.0).force
        np.testing.assert_allclose(
            np.einsum("rk,rk->r", turned, normal), 300.0 * np.cos(0.6), atol=1e-9
        )
        np.testing.assert_allclose(turned[:, 0], -100.0, atol=1e-9)


def test_joints_beyond_their_limits_are_refused(folder):
    cell = example_cell("machining")
    course = programme()
    q = np.tile(cell.home, (len(course.q), 1))
    q[3, 1] = 9.0
    write_programmed_path(
        folder / "far.csv", [Course("a", 0.02, course.T_base_tcp, course.force,
                                    course.direction, q=q)],
        joint_dimensions(cell.robot.joint_names, cell.robot.revolute),
    )  # fmt: skip
    with pytest.raises(PathError, match=r"row 5, column 'joint_a2\[rad\]': 9 rad is not within"):
        read_programmed_path(folder / "far.csv", cell.robot, PathTiming())
