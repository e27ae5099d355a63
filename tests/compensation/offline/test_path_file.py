"""The true inverse: against the model, against a truth of other equations, and what it refuses."""

import re

import numpy as np
import pytest

from elastocal.compensation.offline import CorrectionSettings, compensate_path, correct_rows
from elastocal.elastic import ElasticModel
from elastocal.errors import PathError
from elastocal.identification import CalibratedModel
from elastocal.robot import Robot
from elastocal.robot.inverse import (
    inverse_for,
    joints_along_path,
    nearest_zero_posture,
    posture_jumps,
)
from elastocal.sim.arm.measurement import START
from support.cells import rich_truth, robot, urdf
from support.paths import (
    FORCE_TCP,
    calibrated,
    dome_course,
    euler_columns,
    force_columns,
    joint_columns,
    made_up,
    quaternion_columns,
    read_csv,
    write_csv,
)
from support.urdfs import KR_LIKE, opw_arm_urdf

SOLVER = inverse_for(robot())
COURSE = dome_course(30)
SETTINGS = CorrectionSettings(start=np.array(START))
STRETCHED = -float(np.arctan2(0.041, 1.2))
"""Joint 3 where the wrist centre is farthest from the shoulder, in rad."""


def named(row: int) -> str:
    return f"row {row}"


def programmed_rows() -> tuple[np.ndarray, np.ndarray]:
    """Return joints along the course, and forces in base."""
    q = joints_along_path(SOLVER, COURSE, np.zeros((len(COURSE), 0)), np.array(START), named)
    return q, COURSE[:, :3, :3] @ FORCE_TCP


def corrected(**changes):
    q, force = programmed_rows()
    return correct_rows(SOLVER, calibrated(), q, COURSE, (force, None), named, **changes)


class TestCorrect:
    def test_the_loaded_tcp_is_the_programmed_one_by_the_model_to_a_tenth_of_a_micrometre(self):
        found, (_, force) = corrected(may_turn=True), programmed_rows()
        model = calibrated().model
        deflection = model.deflection(calibrated().compliance, found.q, force)
        loaded = robot().forward(found.q)[:, :3, 3] + deflection
        np.testing.assert_allclose(loaded, COURSE[:, :3, 3], atol=1e-7)
        assert found.residual.max() < 1e-7
        assert found.first_order.min() > 1e-6
        np.testing.assert_allclose(found.deflection, deflection, atol=1e-15)

    def test_the_orientation_is_kept(self):
        found = corrected(may_turn=True)
        np.testing.assert_allclose(
            robot().forward(found.q)[:, :3, :3], COURSE[:, :3, :3], atol=1e-8
        )

    def test_it_leaves_at_most_a_tenth_of_the_deviation_of_an_arm_with_bending_links(self):
        (q, force), found = programmed_rows(), corrected(may_turn=True)
        before = rich_truth().equilibrium(q, force).tcp_position - COURSE[:, :3, 3]
        after = rich_truth().equilibrium(found.q, force).tcp_position - COURSE[:, :3, 3]
        before, after = (np.linalg.norm(each, axis=1) for each in (before, after))
        print(f"mean {after.mean() / before.mean():.4f}, max {after.max() / before.max():.4f}")
        assert before.mean() > 1e-3
        assert after.mean() <= 0.1 * before.mean()
        assert after.max() <= 0.1 * before.max()

    def test_a_moment_is_corrected_too(self):
        q, force = programmed_rows()
        moment = np.tile([0.0, 150.0, 0.0], (len(q), 1))
        found = correct_rows(SOLVER, calibrated(), q, COURSE, (force, moment), named, may_turn=True)
        without = corrected(may_turn=True)
        assert np.linalg.norm(found.deflection - without.deflection, axis=1).min() > 1e-5
        assert found.residual.max() < 1e-7

    def test_no_force_leaves_the_path_as_it_is(self):
        q, force = programmed_rows()
        found = correct_rows(SOLVER, calibrated(), q, COURSE, (0.0 * force, None), named)
        np.testing.assert_array_equal(found.q, q)
        assert found.first_order.max() == 0.0

    def test_a_straight_wrist_does_not_stop_the_row_nor_those_beside_it(self):
        q = np.array([[0.0, -1.75, 1.9, 0.2, 1e-12, 0.1], [0.1, -1.75, 1.9, 0.2, 0.8, 0.1]])
        T = robot().forward(q)
        force = np.tile([0.0, 700.0, 700.0], (2, 1))
        found = correct_rows(SOLVER, calibrated(), q, T, (force, None), named, may_turn=True)
        assert found.residual.max() < 1e-7
        np.testing.assert_allclose(robot().forward(found.q)[:, :3, :3], T[:, :3, :3], atol=1e-8)

    def test_a_joint_corrected_over_its_limit_is_refused_by_row(self):
        q, force = programmed_rows()
        row = slice(7, 8)
        move = corrected(may_turn=True).q[7, 1] - q[7, 1]
        ends = sorted((q[7, 1] - 0.9 * np.sign(move), q[7, 1] + 0.5 * move))
        arm = limited("joint_2", *ends)
        assert abs(move) > 1e-5
        with pytest.raises(PathError, match="row 0: joint_2 would be corrected to"):
            correct_rows(
                inverse_for(arm.model.robot), arm, q[row], COURSE[row], (force[row], None), named
            )

    def test_only_a_path_of_poses_may_go_over_a_limit_by_a_whole_turn(self):
        q, force = programmed_rows()
        move = corrected(may_turn=True).q[7, 5] - q[7, 5]
        start = np.copysign(np.pi, move) * (1.0 - 1e-9)
        q = q[7:8].copy()
        q[0, 5] = start
        T = robot().forward(q)
        load = (force[7:8], None)
        turned = correct_rows(SOLVER, calibrated(), q, T, load, named, may_turn=True).q[0, 5]
        assert abs(turned - start) > 6.0
        with pytest.raises(PathError, match="row 0: joint_6 would be corrected to"):
            correct_rows(SOLVER, calibrated(), q, T, load, named, may_turn=False)

    def test_a_joint_programmed_outside_its_limits_is_refused_by_row(self):
        q, force = programmed_rows()
        q = q.copy()
        q[3, 1] = 4.0
        with pytest.raises(PathError, match=r"row 3: joint_2 is programmed to 229\.2 deg"):
            correct_rows(SOLVER, calibrated(), q, COURSE, (force, None), named)

    def test_a_position_that_the_correction_puts_out_of_reach_is_refused_by_row(self):
        # The forearm in line with the upper arm; pushed back, it would have to reach farther.
        q = np.array([[0.0, 0.5, STRETCHED, 0.0, 0.5, 0.0]])
        T = robot().forward(q)
        inward = -1500.0 * (T[:, :3, 3] - [0.0, 0.0, 0.675])
        with pytest.raises(PathError, match="row 0: no posture reaches the corrected position"):
            correct_rows(SOLVER, calibrated(), q, T, (inward, None), named)


class TestFollow:
    def test_joints_go_on_without_a_jump_from_the_start(self):
        q, _ = programmed_rows()
        assert np.abs(np.diff(q, axis=0))[:, :5].max() < 0.1
        np.testing.assert_allclose(robot().forward(q), COURSE, atol=1e-9)

    def test_another_start_is_another_branch(self):
        start = np.array([np.pi, 1.0, -1.5, 0.0, -1.0, 0.0])
        q = joints_along_path(SOLVER, COURSE, np.zeros((len(COURSE), 0)), start, named)
        np.testing.assert_allclose(robot().forward(q), COURSE, atol=1e-9)
        assert np.abs(q - programmed_rows()[0]).max() > 1.0

    def test_whole_turns_go_on_as_far_as_the_limits_let_them(self):
        arm = limited("joint_6", -6.0, 6.0).model.robot
        spins = np.linspace(0.0, 3.5 * np.pi, 60)
        q0 = np.array([0.3, -1.5, 1.7, 0.2, 0.9, -1.0])
        q_true = np.tile(q0, (60, 1))
        q_true[:, 5] += spins
        T = robot().forward(q_true)
        q = joints_along_path(inverse_for(arm), T, np.zeros((60, 0)), q0, named)
        np.testing.assert_allclose(arm.forward(q), T, atol=1e-9)
        assert arm.limits.margin(q).min() >= 0.0
        inside = q_true[:, 5] <= 6.0
        np.testing.assert_allclose(q[inside], q_true[inside], atol=1e-8)
        assert posture_jumps(arm, q, q0).tolist() == [int(np.argmin(inside))]

    def test_a_pose_out_of_reach_is_refused_by_row(self):
        far = COURSE.copy()
        far[4, :3, 3] *= 3.0
        with pytest.raises(PathError, match=r"row 4: no posture of arm reaches \(\d+"):
            joints_along_path(SOLVER, far, np.zeros((len(far), 0)), np.array(START), named)

    def test_zero_is_where_limits_let_it_be(self):
        np.testing.assert_array_equal(nearest_zero_posture(robot()), np.zeros(6))
        arm = limited("joint_2", -2.4, -0.1).model.robot
        assert nearest_zero_posture(arm)[1] == -0.1


class TestPathFile:
    FORCE = force_columns(COURSE[:, :3, :3] @ FORCE_TCP)
    IN_TCP = force_columns(np.tile(FORCE_TCP, (30, 1)), "force_tcp_")
    POSITION = ("x[mm]", "y[mm]", "z[mm]")

    def run(self, tmp_path, columns, settings=SETTINGS, name="path.csv"):
        path = write_csv(tmp_path / name, columns)
        return compensate_path(calibrated(), path, tmp_path / f"out_{name}", settings)

    def test_every_form_of_a_path_gives_the_same_correction(self, tmp_path):
        q, _ = programmed_rows()
        expected = corrected(may_turn=True)
        forms = {
            "euler.csv": (euler_columns(COURSE), self.POSITION, 1e-3),
            "quaternion.csv": (quaternion_columns(COURSE), ("x[m]", "y[m]", "z[m]"), 1.0),
        }
        for name, (columns, names, scale) in forms.items():
            for number, force in enumerate((self.FORCE, self.IN_TCP)):
                file = f"{number}{name}"
                self.run(tmp_path, columns | force, name=file)
                found = scale * read_csv(tmp_path / f"out_{file}", *names)
                np.testing.assert_allclose(found, expected.T_base_tcp[:, :3, 3], atol=1e-9)
        inside = np.abs(q[:, 5]) < 3.1
        for unit, scale in (("deg", np.pi / 180.0), ("rad", 1.0)):
            columns = {n: c[inside] for n, c in (joint_columns(q, unit) | self.IN_TCP).items()}
            self.run(tmp_path, columns, name=f"{unit}.csv")
            found = scale * read_csv(tmp_path / f"out_{unit}.csv", *joint_columns(q, unit))
            turn = found - expected.q[inside]
            np.testing.assert_allclose(turn - 2 * np.pi * np.round(turn / 2 / np.pi), 0, atol=1e-9)

    def test_other_cells_stay_as_they_were_written(self, tmp_path):
        columns = {"note": ["a b"] * 30} | euler_columns(COURSE) | self.IN_TCP
        columns["feed[mm/s]"] = ["7.00"] * 30
        self.run(tmp_path, columns)
        before, after = (
            [line.split(",") for line in (tmp_path / name).read_text().splitlines()]
            for name in ("path.csv", "out_path.csv")
        )
        assert after[0][: len(before[0])] == before[0]
        assert after[0][-9:-6] == ["deflection_x[m]", "deflection_y[m]", "deflection_z[m]"]
        for old, new in zip(before[1:], after[1:], strict=True):
            assert new[:1] + new[4:11] == old[:1] + old[4:]
            assert new[1:4] != old[1:4]

    def test_deflection_is_that_at_the_corrected_row_and_inside_its_interval(self, tmp_path):
        self.run(tmp_path, euler_columns(COURSE) | self.IN_TCP)
        names = [[f"deflection_{axis}{end}[m]" for axis in "xyz"] for end in ("", "_low", "_high")]
        found, low, high = (read_csv(tmp_path / "out_path.csv", *each) for each in names)
        np.testing.assert_allclose(found, corrected(may_turn=True).deflection, atol=1e-12)
        assert np.all(low < high)
        assert np.mean((low <= found) & (found <= high)) > 0.9
        loaded = 1e-3 * read_csv(tmp_path / "out_path.csv", *self.POSITION) + found
        np.testing.assert_allclose(loaded, COURSE[:, :3, 3], atol=1e-9)

    def test_a_corrected_path_can_be_read_again(self, tmp_path):
        self.run(tmp_path, euler_columns(COURSE) | self.IN_TCP)
        again = tmp_path / "again.csv"
        tally = compensate_path(calibrated(), tmp_path / "out_path.csv", again, SETTINGS)
        assert tally.rows == 30
        header = again.read_text().splitlines()[0].split(",")
        assert len(header) == len(set(header))

    def test_comments_delimiter_and_line_ends_stay(self, tmp_path):
        path = write_csv(tmp_path / "p.csv", euler_columns(COURSE) | self.IN_TCP)
        text = "# course 7\n" + path.read_text().replace(",", ";")
        path.write_bytes(text.replace("\n", "\r\n").encode())
        compensate_path(calibrated(), path, tmp_path / "o.csv", SETTINGS)
        written = (tmp_path / "o.csv").read_bytes()
        assert written.startswith(b"# course 7\r\nx[mm];y[mm];")
        assert written.count(b"\n") == written.count(b"\r\n") == 32

    def test_the_tally_tells_the_first_order_step_from_the_iterated_one(self, tmp_path):
        told = []
        path = write_csv(tmp_path / "p.csv", euler_columns(COURSE) | self.IN_TCP)
        tally = compensate_path(
            calibrated(), path, tmp_path / "o.csv", SETTINGS, lambda *now: told.append(now)
        )
        figures = tally.figures()
        assert figures.rows == 30
        assert figures.residual.max < 1e-7 < 1e-6 < figures.first_order.max
        assert figures.first_order.max < 0.01 * figures.deviation.max
        assert told[-1] == ("rows", 30, 30)

    def test_pieces_of_any_size_give_the_same_file(self, tmp_path, monkeypatch):
        columns = euler_columns(COURSE) | self.IN_TCP
        self.run(tmp_path, columns, name="whole.csv")
        monkeypatch.setattr("elastocal.compensation.offline.path_file._ROWS_AT_A_TIME", 7)
        tally = self.run(tmp_path, columns, name="pieces.csv")
        whole, parts = (tmp_path / f"out_{name}.csv" for name in ("whole", "pieces"))
        np.testing.assert_allclose(
            read_csv(parts, *self.POSITION), read_csv(whole, *self.POSITION), atol=1e-6
        )
        assert tally.rows == 30

    def test_a_refused_row_is_named_by_line_and_leaves_no_file(self, tmp_path):
        columns = euler_columns(COURSE) | self.IN_TCP
        columns["x[mm]"] = columns["x[mm]"].copy()
        columns["x[mm]"][20] = 9000.0
        with pytest.raises(PathError) as refusal:
            self.run(tmp_path, columns)
        assert f"{tmp_path / 'path.csv'}: row 22: no posture of arm reaches (9000.0" in str(
            refusal.value
        )
        assert [path.name for path in tmp_path.iterdir()] == ["path.csv"]

    def test_a_deflection_too_large_to_be_meant_is_refused(self, tmp_path):
        columns = euler_columns(COURSE[:3]) | {f"force_{a}[kN]": [0.0, 0.0, 30.0] for a in "xyz"}
        huge = {f"force_{a}[N]": [1e200, 0.0, 0.0] for a in "xyz"}
        with pytest.raises(
            PathError, match=r"row 2, column 'force_x\[N\]': 1e\+200 N is not within"
        ):
            self.run(tmp_path, euler_columns(COURSE[:3]) | huge)
        with pytest.raises(PathError, match=r"row 4: a deflection of .* is the force in another"):
            self.run(tmp_path, columns)

    def test_a_rail_stands_where_its_column_or_the_start_has_it(self, tmp_path):
        arm = Robot.from_urdf(opw_arm_urdf(**KR_LIKE, rail=(-2.0, 2.0)), "tcp")
        model = made_up(arm)
        q = np.array([[0.5, 0.1, 0.6, 0.4, 0.2, 0.8, 0.0], [0.5, 0.2, 0.6, 0.4, 0.2, 0.8, 0.0]])
        columns = euler_columns(arm.forward(q)) | force_columns(np.full((2, 3), 300.0))
        without = write_csv(tmp_path / "without.csv", columns)
        given = write_csv(tmp_path / "given.csv", columns | {"rail[mm]": [500.0, 500.0]})
        with pytest.raises(PathError, match="nothing says where rail stands"):
            compensate_path(model, without, tmp_path / "o.csv")
        outs = []
        for path in (without, given):
            compensate_path(model, path, tmp_path / "o.csv", CorrectionSettings(start=q[0]))
            outs.append(read_csv(tmp_path / "o.csv", *self.POSITION))
        np.testing.assert_array_equal(*outs)
        beyond = write_csv(tmp_path / "beyond.csv", columns | {"rail[mm]": [500.0, 2500.0]})
        with pytest.raises(PathError, match=r"row 3, column 'rail\[mm\]': 2500 mm is not within"):
            compensate_path(model, beyond, tmp_path / "o.csv", CorrectionSettings(start=q[0]))


def limited(joint: str, low: float, high: float) -> CalibratedModel:
    """Return the calibrated model with other limits of one joint."""
    own = calibrated()
    head, tail = urdf().split(f'name="{joint}"')
    limit = f'<limit lower="{low!r}" upper="{high!r}"'.replace("np.float64(", "").replace(")", "")
    tail = re.sub(r'<limit lower="[^"]*" upper="[^"]*"', limit, tail, count=1)
    model = ElasticModel(Robot.from_urdf(f'{head}name="{joint}"{tail}', "tcp"), own.model.springs)
    return CalibratedModel(model, own.compliance, own.draws, own.observability)
