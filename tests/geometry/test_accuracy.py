"""The figures of a report: errors by axis, ISO 9283's, and the arm in DH numbers."""

from dataclasses import replace

import numpy as np
import pytest

import elastocal as ec
from elastocal.geometry import GeometryProblem, accuracy_figures, link_table
from elastocal.geometry.arm import ArmErrors, JointLoads, frames
from elastocal.geometry.denavit_hartenberg import link_numbers, link_transform
from elastocal.geometry.ladder import climb
from elastocal.progress import silent
from elastocal.robot import T_from_xyzabc, catalogue
from support.cli import elastocal
from support.measured_arms import ARMS, MARKERS, kuka, measure, universal, write_positions
from support.pages import english_left


def ladder(data, robot):
    problem = GeometryProblem(robot, data)
    return problem, climb(problem, 40, np.random.default_rng(1), silent)


def visited(rows: int, visits: int, spread: float):
    """Return positions of poses that are each visited several times with a scatter of its own."""
    measured = measure(kuka(), rows, markers=1, stations=1, noise=0.0)
    again = np.repeat(np.arange(rows), visits)
    data = measured.data.rows(again)
    scatter = np.random.default_rng(4).normal(0.0, spread, data.markers.shape)
    return measured.robot, replace(data, markers=data.markers + scatter), scatter[:, 0]


def test_pose_repeatability_is_that_of_iso_9283():
    robot, data, scatter = visited(30, 5, 2e-4)
    problem, found = ladder(data, robot)
    poses = accuracy_figures(problem, found).poses
    assert len(poses) == 30
    for each in poses[:5]:
        own = scatter[each.row : each.row + 5]
        distance = np.linalg.norm(own - own.mean(axis=0), axis=1)
        assert each.visits == 5
        assert each.repeatability == pytest.approx(
            distance.mean() + 3.0 * np.sqrt(((distance - distance.mean()) ** 2).sum() / 4), rel=1e-3
        )
    assert np.mean([each.registration for each in poses]) > 3e-4
    assert np.mean([each.chosen for each in poses]) < 2.5e-4


def test_visits_under_another_load_are_others():
    robot, data, _ = visited(30, 2, 1e-4)
    heavy = replace(data, payload=np.tile([0.0, 10.0], 30))
    assert accuracy_figures(*ladder(heavy, robot)).poses == ()
    assert accuracy_figures(*ladder(measure(kuka(), 40).data, robot)).poses == ()


def test_errors_by_axis_make_up_those_of_the_ladder():
    measured = measure(kuka(), 60)
    problem, found = ladder(measured.data, measured.robot)
    figures = accuracy_figures(problem, found)
    axes = {each.axis: each for each in figures.axes}
    chosen = next(each for each in found.rungs if each.rung == found.chosen)
    assert axes["norm"].chosen.mean == pytest.approx(chosen.distance.mean())
    assert sum(axes[n].chosen.rms ** 2 for n in "xyz") == pytest.approx(
        axes["norm"].chosen.rms ** 2
    )
    # Places are in base: the nominal arm's, but for its errors.
    T = measured.robot.forward(measured.data.q)[figures.row]
    near = T[:, :3, 3] + np.einsum(
        "nij,nj->ni", T[:, :3, :3], found.whole.fit.state.markers[figures.marker]
    )
    assert np.abs(near - figures.place).max() < 0.05


@pytest.mark.parametrize("arm", [*ARMS, "KR 210 R3100-2", "UR20", "IRB 6700-200/2.60"])
def test_the_arm_is_rebuilt_from_its_link_numbers(arm):
    robot = ARMS[arm]() if arm in ARMS else catalogue.load(arm)
    joints, rng = len(robot.joint_names), np.random.default_rng(5)
    errors = ArmErrors.none(joints)
    errors.place[1:] = rng.normal(0.0, 1e-3, (joints - 1, 6))
    errors.motion[:, 0] = rng.normal(0.0, 1e-3, joints)
    q = rng.uniform(-1.0, 1.0, (4, joints))
    none = JointLoads.none(q)
    first = robot.chain.joints[0]
    # The ways of the links are those of the arm as drawn for both.
    for each in (ArmErrors.none(joints), errors):
        numbers = link_numbers(robot, each)
        T_truth = frames(robot, q, none, each).T_base_tcp
        links, tool = numbers[:-6].reshape(-1, 5), T_from_xyzabc(*numbers[-6:])
        for posture, T in zip(q, T_truth, strict=True):
            T_rebuilt = np.eye(4)
            for link, x in zip(links, posture, strict=True):
                T_rebuilt = T_rebuilt @ link_transform(link, x)
            # Up to the frame of the first joint as drawn.
            T_first = T @ np.linalg.inv(T_rebuilt @ tool)
            assert np.allclose(T_first[:3, 2], first.placement[:3, :3] @ first.axis, atol=1e-9)
            assert np.allclose(T_first[:3, 3], first.placement[:3, 3], atol=1e-9)


def test_planted_link_numbers_are_found_with_their_intervals():
    """A link of parallel axes that is 1 mm longer, and a zero that is off by 2 mrad."""
    robot = universal()
    measured = measure(robot, 80, error=0.0)
    planted = ArmErrors.none(6)
    planted.place[2, 2], planted.motion[3, 0] = 1e-3, 2e-3
    q = measured.data.q
    shift = (
        frames(robot, q, JointLoads.none(q), planted).T_base_tcp
        - frames(robot, q, JointLoads.none(q), ArmErrors.none(6)).T_base_tcp
    )
    tool = np.column_stack([MARKERS, np.ones(3)])
    station = (measured.data.station == "s1").astype(int)
    moved = np.einsum("nij,mj->nmi", shift, tool)[:, :, :3]
    seen = np.einsum("nij,nmj->nmi", measured.T_station_base[station, :3, :3], moved)
    data = replace(measured.data, markers=measured.data.markers + seen)
    problem, found = ladder(data, robot)
    table = {(row.joint, row.number): row for row in link_table(problem, found)}
    link = table["j2", "a"]
    assert link.nominal == pytest.approx(0.61)
    assert link.calibrated - link.nominal == pytest.approx(1e-3, abs=1e-4)
    assert link.low < link.nominal + 1e-3 < link.high
    assert table["j2", "d"].low is None
    assert "beta" in {number for joint, number in table if joint == "j2"}
    assert ("j1", "beta") not in table


def test_report_and_table_say_what_was_found(tmp_path):
    path = write_positions(tmp_path / "positions.csv", measure(kuka(), 60, blunders=3))
    page, table = tmp_path / "report.html", tmp_path / "links.csv"
    arm = ("--robot", "KR 210 R2700-2", "--tcp", "flange", "--draws", 40)
    command = ("geometry", path, *arm, "--out", tmp_path / "model.json")
    for _ in range(2):  # what it wrote itself it may replace
        assert elastocal(*command, "--report", page, "--table", table).code == 0
    text = page.read_text(encoding="utf-8")
    assert "default-src &#39;none&#39;" in text
    assert "http" not in text.replace("http://www.w3.org", "").split("</style>")[1][:2000]
    for expected in (
        "<title>Geometry report: KR 210 R2700-2</title>",
        "Errors by axis in mm, of poses left out",
        "No repeated visits",
        "9 positions of 180 more than seven standard deviations",
        "Rz(theta + q) Tz(d) Tx(a) Rx(alpha)",
        "What they go together with",
    ):
        assert expected in text, expected
    again = elastocal(
        *command, "--report", page, "--language", "de"
    )  # it knows its page in English
    assert again.code == 0
    text = page.read_text(encoding="utf-8")
    assert english_left(text) == []
    assert "<title>Geometriebericht: KR 210 R2700-2</title>" in text
    rows = table.read_text(encoding="utf-8").splitlines()
    assert rows[0] == "joint,number,unit,nominal,calibrated,difference,low,high"
    a2 = next(row.split(",") for row in rows if row.startswith("joint_a2,a,mm"))
    assert float(a2[3]) == pytest.approx(1150.0)
    assert float(a2[6]) < float(a2[4]) < float(a2[7])


def test_a_report_of_a_sound_arm_says_that_it_is_kept(tmp_path):
    path = write_positions(tmp_path / "positions.csv", measure(kuka(), 40, error=0.0))
    found = ec.geometry(
        path, robot="KR 210 R2700-2", tcp="flange", draws=40, report_file=tmp_path / "report.html"
    )
    assert not found.model.parameters
    assert "The nominal arm was kept" in (tmp_path / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    ("option", "name"), [("--report", "a.json"), ("--table", "a.xlsx"), ("--out", "a.txt")]
)
def test_other_kinds_of_files_are_refused_before_the_work(tmp_path, option, name):
    command = ("geometry", "none.csv", "--robot", "KR 210 R2700-2", "--tcp", "flange")
    result = elastocal(*command, "--out", tmp_path / "model.json", option, tmp_path / name)
    assert "its name must end in" in result.reason
