"""Markers of one body, and joints as a controller counts them."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from elastocal.errors import LogError
from elastocal.logs import ClockFit, days_of
from elastocal.logs._frames import stated_poses
from elastocal.logs.doubts import _set_clocks
from elastocal.logs.map import Joints, LogEntry, LogMap, TimeColumn, ToolPose, Vector
from elastocal.logs.streams import body_centre
from elastocal.logs.table import LogTable
from elastocal.robot import catalogue

SHAPE = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.15, 0.0], [0.02, 0.03, 0.12]])


def _moving_body(samples: int = 30):
    rng = np.random.default_rng(1)
    R = Rotation.random(samples, random_state=2).as_matrix()
    p = rng.uniform(-1.0, 1.0, (samples, 3))
    return p[:, None] + np.einsum("sij,mj->smi", R, SHAPE), p + R @ SHAPE.mean(axis=0)


def test_the_centre_of_a_body_is_found_where_a_marker_is_hidden():
    position, centre = _moving_body()
    for sample in range(1, 30):
        position[sample, sample % 4] = np.nan
    assert np.allclose(body_centre(position), centre, atol=1e-12)


def test_two_markers_do_not_tell_the_centre_of_four():
    position, _ = _moving_body()
    position[3, :2] = np.nan
    assert np.isnan(body_centre(position)[3]).all()


def test_a_body_that_is_never_seen_whole_is_refused():
    position, _ = _moving_body()
    position[:, 0] = np.nan
    with pytest.raises(LogError, match="no row sees all 4 markers"):
        body_centre(position)


@pytest.mark.parametrize(
    ("unit", "times", "days"),
    [
        (None, ("27.11.2026 09:41:11.750", "27.11.2026 17:00:00"), "2026-11-27"),
        (None, ("2026-11-27T23:59:00", "2026-11-28T00:10:00"), "2026-11-27/2026-11-28"),
        (None, ("09:41:11", "09:41:12"), None),
        ("s", ("0.0", "86401.0"), None),
        ("s", ("1795772471750", "1795772471760"), None),
        ("ms", ("1795772471750", "1795772471760"), "2026-11-27"),
    ],
)
def test_the_days_of_logs_are_those_of_their_dates(tmp_path, unit, times, days):
    path = tmp_path / "arm.csv"
    path.write_text("t;A1;X\n" + "".join(f"{time};1.0;2.0\n" for time in times))
    entry = {
        "log": "arm.csv",
        "time": {"column": "t", "unit": unit},
        "joints": [{"columns": ["A1"], "unit": "deg"}],
    }
    entry = LogEntry.model_validate(entry)
    assert days_of(LogMap(robot={"model": "UR20"}, logs=(entry,)), [path]) == days


def test_without_dates_of_the_joints_those_of_another_log_count(tmp_path):
    arm, tracker = tmp_path / "arm.csv", tmp_path / "tracker.csv"
    arm.write_text("t;A1\n0.0;1.0\n0.1;1.0\n")
    tracker.write_text("t;X;Y;Z\n2026-05-18T09:12:14.320+02:00;1;2;3\n")
    joints = [{"columns": ["A1"], "unit": "deg"}]
    markers = [{"columns": ["X", "Y", "Z"], "unit": "mm"}]
    entries = (
        {"log": "tracker.csv", "time": {"column": "t"}, "markers": markers},
        {"log": "arm.csv", "time": {"column": "t", "unit": "s"}, "joints": joints},
    )
    logs = tuple(LogEntry.model_validate(each) for each in entries)
    found = days_of(LogMap(robot={"model": "UR20"}, logs=logs), [arm, tracker])
    assert found == "2026-05-18"


@pytest.mark.parametrize(
    ("drift", "sigma", "told"),
    [(-938e-6, 142e-6, 1), (-40e-6, 3e-6, 0), (2e-3, 4e-6, 0), (600e-6, 500e-6, 0)],
)
def test_a_clock_that_was_set_during_the_work_is_told(drift, sigma, told):
    fit = ClockFit("force.txt", "arm.csv", -3.7, 0.05, drift, sigma, 0.72, 3.7)
    doubts = list(_set_clocks([fit]))
    assert len(doubts) == told
    assert all("force.txt drifts by -938 ppm, and not evenly" in each for each in doubts)


ENTRIES = {
    "arm.csv": {"joints": [{"columns": ["A1"], "unit": "deg"}]},
    "force.csv": {"force": {"columns": ["Fx", "Fy", "Fz"], "unit": "N"}},
    "marker.csv": {"markers": [{"columns": ["X", "Y", "Z"], "unit": "mm"}]},
}


@pytest.mark.parametrize(
    ("keys", "reason"),
    [
        ({"arm.csv": {"offset": "3 s"}}, "arm.csv has the clock of the joints: leave its offset"),
        (
            {"arm.csv": {"clock": "plc"}, "force.csv": {"clock": "plc", "offset": "3 s"}},
            "force.csv has the clock of the joints: leave its offset out",
        ),
        (
            {"force.csv": {"clock": "box", "offset": "3 s"}, "marker.csv": {"clock": "box"}},
            "force.csv and marker.csv share a clock: state the same offset at both",
        ),
        (
            {"arm.csv": {"handshake": "n"}, "force.csv": {"handshake": "n", "offset": "3 s"}},
            "force.csv has a handshake: leave its offset out",
        ),
        ({"force.csv": {"offset": "3 s"}, "marker.csv": {"offset": "-4 s"}}, None),
    ],
)
def test_an_offset_that_would_be_passed_over_is_refused(keys, reason):
    time = {"column": "t", "unit": "s"}
    logs = [{"log": log, "time": time, **own, **keys.get(log, {})} for log, own in ENTRIES.items()]
    data = {"robot": {"model": "UR20"}, "logs": logs}
    if reason is None:
        assert [each.offset for each in LogMap.model_validate(data).logs] == [None, 3.0, -4.0]
        return
    with pytest.raises(ValueError, match=reason):
        LogMap.model_validate(data)


def test_a_clock_far_from_any_date_is_said_in_seconds():
    fit = ClockFit("box", "arm", -1.8e15, 0.1, 0.0, None, 0.9, 1.8e15)
    assert fit.sentence.startswith("box: -1800000000000000.000 s")


@pytest.mark.parametrize(
    ("height", "order", "said"),
    [
        (0.55, "ZYX", r"base lies at \(0, 0, 550\) mm in that of the joints: leave `pose` out"),
        (0.0, "XYZ", "another maker than the map says, or of another tool: leave `angles` out"),
        (0.55, "XYZ", "in that of the joints, the angles are of another maker.*leave `pose` out"),
    ],
)
def test_a_tool_frame_of_another_base_or_maker_is_told_with_what_to_leave_out(height, order, said):
    robot = catalogue.load("RX160")
    q = np.random.default_rng(1).uniform(-1.0, 1.0, (9, 6))
    T = robot.forward(q)
    angles = Rotation.from_matrix(T[:, :3, :3]).as_euler(order, degrees=True)
    place = 1e3 * (T[:, :3, 3] - [0.0, 0.0, height])
    table = LogTable.from_rows("log", [list("xyzabc"), *np.hstack([place, angles]).tolist()])
    a_b_c = "abc" if order == "ZYX" else "cba"
    pose = ToolPose(
        position=Vector(columns=tuple("xyz"), unit="mm"),
        angles=Vector(columns=tuple(a_b_c), unit="deg"),
    )
    joints = Joints(columns=tuple("123456"), unit="rad")
    entry = LogEntry(log="log", time=TimeColumn(column="t"), joints=(joints,), pose=pose)
    with pytest.raises(LogError, match=said):
        stated_poses(entry, table, q, robot)
