"""Columns and text of a path."""

import numpy as np
import pytest

from elastocal.dataset import PathTable, find_columns, find_wrench_columns, in_file
from elastocal.dataset.path_columns import PathColumns
from elastocal.errors import CompensationError, FileAccessError, PathError
from elastocal.robot import Robot
from support.cells import robot
from support.paths import dome_course, euler_columns, force_columns, quaternion_columns, write_csv
from support.urdfs import KR_LIKE, opw_arm_urdf

JOINTS = [f"{name}[deg]" for name in robot().joint_names]
POSE = ["x[mm]", "y[mm]", "z[mm]", "a[deg]", "b[deg]", "c[deg]"]
FORCE = ["force_x[N]", "force_y[N]", "force_z[N]"]
ON_RAIL = Robot.from_urdf(opw_arm_urdf(**KR_LIKE, rail=(-2.0, 2.0)), "tcp")


def table_of(path):
    return PathTable.open(path, lambda header: find_columns(header, robot()))


def no_columns(header):
    return PathColumns((), (), (), None, None)


def rows_of(path):
    return table_of(path).rows()


class TestColumns:
    def test_joints_and_forces_are_found_in_any_order(self):
        found = find_columns(["note", *FORCE, *reversed(JOINTS)], robot())
        assert [column.name for column in found.joints] == list(robot().joint_names)
        assert [column.index for column in found.joints] == [9, 8, 7, 6, 5, 4]
        assert not found.by_pose
        assert found.moment is None

    def test_a_pose_may_be_angles_or_a_quaternion(self):
        assert find_columns([*POSE, *FORCE], robot()).by_pose
        quaternion = ["x[m]", "y[m]", "z[m]", "qx", "qy", "qz", "qw"]
        found = find_columns([*quaternion, *FORCE], robot())
        assert [column.name for column in found.orientation] == ["qx", "qy", "qz", "qw"]

    def test_a_column_with_odd_brackets_is_somebody_elses(self):
        assert find_columns(["speed]", "", *POSE, *FORCE], robot()).by_pose

    def test_a_rail_may_stand_beside_a_pose(self):
        found = find_columns([*POSE, *FORCE, "rail[mm]"], ON_RAIL)
        assert [column.name for column in found.joints] == ["rail"]
        assert find_columns([*POSE, *FORCE], ON_RAIL).joints == ()

    def test_forces_need_not_be_there_where_nobody_asks_for_them(self):
        assert find_columns(POSE, robot(), forces=False).force is None

    @pytest.mark.parametrize(
        ("header", "why"),
        [
            ([*POSE], "path has no forces"),
            ([*JOINTS, *POSE, *FORCE], "both joints"),
            ([*POSE, *FORCE, "force_tcp_x[N]"], "both in base"),
            ([*POSE, "qx", *FORCE], "both angles"),
            (["time[s]", *FORCE], "neither the joints of"),
            ([*JOINTS[:5], *FORCE], "column 'joint_6[deg]' is missing"),
            ([*POSE[:5], *FORCE], "column 'c[deg]' is missing"),
            ([*POSE, *FORCE[:2]], "column 'force_z[N]' is missing"),
            ([*POSE, *FORCE, "x[m]"], "column 'x' stands twice"),
            (["x", *POSE[1:], *FORCE], "column 'x' has no unit"),
            (["x[deg]", *POSE[1:], *FORCE], "is not a length"),
            ([*POSE[:3], "qx[1]", "qy", "qz", "qw", *FORCE], "has no unit, write 'qx'"),
        ],
    )
    def test_what_is_refused_names_the_column(self, header, why):
        with pytest.raises(PathError) as refusal:
            find_columns(header, robot())
        assert why in str(refusal.value)
        assert isinstance(refusal.value, CompensationError)


class TestText:
    def test_layout_is_kept_comments_delimiter_and_line_ends(self, tmp_path):
        path = tmp_path / "path.csv"
        header = b"force_x[N];force_y[N];force_z[N]"
        path.write_bytes(
            b'# made by hand\r\n\r\n"a; b";' + header + b"\r\n1;2;2;2\r\n\r\n3;4;4;4\r\n"
        )
        table = PathTable.open(path, find_wrench_columns)
        layout = table.layout
        assert layout.preamble == ("# made by hand\r\n", "\r\n")
        assert layout.header[0] == "a; b"
        assert (layout.delimiter, layout.line_end) == (";", "\r\n")
        found = list(table.blocks(1))
        assert [rows.table.cells for rows in found] == [[["1", *"222"]], [["3", *"444"]]]
        assert [rows.label(0) for rows in found] == ["row 4", "row 6"]

    @pytest.mark.parametrize(
        ("text", "why"),
        [
            ("x,y\n1\n", "row 2 has 1 cells, the header has 2"),
            ("x,y\n", "no row"),
            ("# only\n", "no header"),
            ('x,y\n1,"2\n', "row 2"),
        ],
    )
    def test_a_table_that_is_none_is_refused(self, tmp_path, text, why):
        path = tmp_path / "path.csv"
        path.write_text(text)
        with pytest.raises(PathError) as refusal, in_file(path):
            PathTable.open(path, no_columns).rows()
        assert why in str(refusal.value)
        assert str(path) in str(refusal.value)

    @pytest.mark.parametrize("data", [None, b"x,y\n\xff\xfe,1\n"])
    def test_a_file_that_cannot_be_read_is_refused(self, tmp_path, data):
        path = tmp_path / "path.csv"
        if data is not None:
            path.write_bytes(data)
        with pytest.raises(FileAccessError, match="cannot read"):
            PathTable.open(path, no_columns).rows()


class TestValues:
    def test_angles_and_quaternions_say_the_same_pose(self, tmp_path):
        T = dome_course(5)
        force = force_columns(np.ones((5, 3)))
        for name, columns in (("e.csv", euler_columns(T)), ("q.csv", quaternion_columns(T))):
            found = rows_of(write_csv(tmp_path / name, columns | force))
            np.testing.assert_allclose(found.T_base_tcp, T, atol=1e-12)

    def test_units_of_the_header_count(self, tmp_path):
        columns = euler_columns(dome_course(2)) | {
            f"force_{axis}[kN]": [1.0, 2.0] for axis in "xyz"
        }
        found = rows_of(write_csv(tmp_path / "p.csv", columns))
        np.testing.assert_allclose(found.force, [[1e3] * 3, [2e3] * 3])

    def test_forces_in_the_tcp_frame_are_turned_by_the_programmed_orientation(self, tmp_path):
        T = dome_course(3)
        pressing = force_columns(np.tile([0.0, 0.0, -1100.0], (3, 1)), "force_tcp_")
        found = rows_of(write_csv(tmp_path / "p.csv", euler_columns(T) | pressing))
        force, moment = found.wrench_in_base(T)
        np.testing.assert_allclose(force, -1100.0 * T[:, :3, 2])
        assert moment is None

    @pytest.mark.parametrize(
        "cell", ["nan", "inf", "", "7x", "-1_100", "\u0661\u0662", "1e", "0x10", "1e999", "1 000"]
    )
    def test_a_cell_that_is_no_finite_number_is_refused_by_line_and_column(self, tmp_path, cell):
        columns = euler_columns(dome_course(3)) | force_columns(np.ones((3, 3)))
        columns["z[mm]"] = ["700.0", cell, "700.0"]
        with pytest.raises(PathError) as refusal:
            rows_of(write_csv(tmp_path / "p.csv", columns))
        assert f"row 3, column 'z[mm]': {cell!r}" in str(refusal.value)

    def test_a_quaternion_of_another_length_is_refused(self, tmp_path):
        columns = quaternion_columns(dome_course(3)) | force_columns(np.ones((3, 3)))
        columns["qw"] = columns["qw"] + 0.1
        with pytest.raises(PathError, match="row 2: quaternion"):
            rows_of(write_csv(tmp_path / "p.csv", columns))


def test_degrees_in_a_column_of_radians_are_refused_by_row(tmp_path):
    columns = euler_columns(dome_course(3)) | force_columns(np.zeros((3, 3)))
    in_rad = {name.replace("deg", "rad"): values for name, values in columns.items()}
    path = write_csv(tmp_path / "path.csv", in_rad)
    with pytest.raises(PathError, match=r"row 2, column 'b\[rad\]': .* more than a turn: is it in"):
        rows_of(path)
