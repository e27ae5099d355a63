import numpy as np
import pytest

from elastocal.dataset import Dataset
from elastocal.dataset._store import read_table
from elastocal.errors import DatasetError, FileAccessError, SchemaError
from support.datasets import write_lines

VECTORS = ("force", "controller_displacement", "marker_displacement")
HEADER = "pose,load_case,status,a1[deg],rail[mm]," + ",".join(
    f"{name}_{axis}[{unit}]"
    for name, unit in zip((*VECTORS, "tcp_position"), ("kN", "m", "mm", "m"), strict=True)
    for axis in "xyz"
)
ROW = "{pose},{case},{status},90,{rail},0.5,0,0,0,0,0,{marker},0,0,{tcp},0,0"


def row(pose, case="normal", status="ok", rail="1500", marker="1", tcp="1.5"):
    return ROW.format(pose=pose, case=case, status=status, rail=rail, marker=marker, tcp=tcp)


def empty(pose, case, status=""):
    return f"{pose},{case},{status}" + "," * 14


def read_rows(tmp_path, *rows, header=HEADER):
    return Dataset.from_labelled(read_table(write_lines(tmp_path / "data.csv", header, *rows)))


def refusal(tmp_path, *rows, header=HEADER):
    with pytest.raises(DatasetError) as caught:
        read_rows(tmp_path, *rows, header=header)
    return str(caught.value)


def test_units_of_the_header_become_si(tmp_path):
    data = read_rows(tmp_path, row(3))
    assert data.joint_units == ("rad", "m")
    readings = data.readings(("rail", "a1"))
    np.testing.assert_allclose(readings.joint_position, [[1.5, np.pi / 2]])
    np.testing.assert_array_equal(readings.force, [[500.0, 0.0, 0.0]])
    np.testing.assert_array_equal(readings.marker_displacement, [[1e-3, 0.0, 0.0]])
    np.testing.assert_array_equal(readings.tcp_position, [[1.5, 0.0, 0.0]])


def test_labels_keep_the_order_of_the_file(tmp_path):
    data = read_rows(tmp_path, row(9, "west"), row(2, "east"), row(9, "east"), row(2, "west"))
    assert data.poses == (9, 2)
    assert data.load_cases == ("west", "east")


def test_an_absent_row_and_an_empty_one_are_missing_readings(tmp_path):
    data = read_rows(tmp_path, row(1, "a"), row(1, "b"), row(2, "a"), row(3, "a"), empty(3, "b"))
    assert data.to_xarray()["status"].values.tolist() == [[0, 0], [0, 4], [0, 4]]
    assert np.isnan(data.to_xarray()["force"].values[1, 1]).all()
    assert data.to_xarray()["tcp_position"].values[:, 0].tolist() == [1.5, 1.5, 1.5]


def test_status_words_are_read_and_an_empty_one_means_ok(tmp_path):
    data = read_rows(
        tmp_path,
        row(1, "a", ""),
        row(1, "b", "slipped"),
        row(2, "a", " unstable"),
        row(2, "b"),
        empty(3, "a", "aborted"),
    )
    assert data.to_xarray()["status"].values.tolist() == [[0, 1], [2, 0], [3, 4]]


def test_a_byte_order_mark_and_windows_line_ends_are_accepted(tmp_path):
    path = tmp_path / "data.csv"
    path.write_bytes(f"\ufeff{HEADER}\r\n{row(1)}\r\n".encode())
    assert Dataset.from_labelled(read_table(path)).poses == (1,)


def test_a_spreadsheet_with_semicolons_is_accepted(tmp_path):
    data = read_rows(tmp_path, row(1).replace(",", ";"), header=HEADER.replace(",", ";"))
    assert data.load_cases == ("normal",)


def test_a_file_without_attributes_says_nothing_about_the_robot(tmp_path):
    data = read_rows(tmp_path, row(1))
    assert (data.robot_name, data.robot_urdf, data.tcp_frame) == ("", None, None)


def test_attributes_are_read_from_comment_lines(tmp_path):
    lines = ('# tcp_frame: "tool"', "# a remark", HEADER, row(1))
    assert (
        Dataset.from_labelled(read_table(write_lines(tmp_path / "a.csv", *lines))).tcp_frame
        == "tool"
    )


def test_an_unknown_schema_is_refused_by_name(tmp_path):
    path = write_lines(tmp_path / "a.csv", '# schema: "elastocal.dataset/9"', HEADER, row(1))
    with pytest.raises(SchemaError, match=r"^dataset has schema 'elastocal.dataset/9'; this"):
        Dataset.from_labelled(read_table(path))


def test_a_pose_measured_twice_is_refused_with_both_rows(tmp_path):
    assert refusal(tmp_path, row(5), row(6), row(5)) == (
        "pose 5, load case 'normal' stands twice, in rows 2 and 4: a pose that was measured again"
        " needs its own label"
    )


@pytest.mark.parametrize(
    ("bad", "message"),
    [
        (row(2, rail="long"), "row 3, column 'rail[mm]': 'long' is not a number"),
        (row(2, rail="1_5"), "row 3, column 'rail[mm]': '1_5' is not a number"),
        (row("1_5"), "row 3: pose is '1_5': it must be an integer"),
        (row("A"), "row 3: pose is 'A': it must be an integer"),
        (row("1.5"), "row 3: pose is '1.5': it must be an integer"),
        (row("9" * 19), f"row 3: pose is '{'9' * 19}': it must lie within ±1e+15"),
        (row(2, case=" "), "row 3: load_case is empty: it must be a name"),
        (
            row(2, status="okay"),
            "row 3: status 'okay' is not known; did you mean 'ok'? (allowed: ok, slipped,"
            " unstable, aborted, missing)",
        ),
        (
            row(2, marker=""),
            "marker_displacement x of pose 2, load case 'normal' is nan although the status is ok:"
            " give a finite number, or the status 'missing'",
        ),
        (
            row(2, marker=" inf"),
            "marker_displacement x of pose 2, load case 'normal' is inf although the status is ok:"
            " give a finite number, or the status 'missing'",
        ),
        (
            row(1, case="north", tcp="1.25"),
            "tcp_position_x of pose 1 is 1.5 m in row 2 but 1.25 m in row 3: a pose has one"
            " unloaded position",
        ),
        (
            row(2) + ",7",
            "row 3 has 18 cells, the header has 17 (with a decimal comma the delimiter"
            " must be another, and the comma a point)",
        ),
    ],
)
def test_a_bad_cell_is_refused_by_row_and_column(tmp_path, bad, message):
    assert refusal(tmp_path, row(1), bad) == message


def test_a_decimal_comma_is_refused_by_row(tmp_path):
    bad = row(1, rail="1500.5").replace(",", ";").replace("1500.5", "1500,5")
    assert refusal(tmp_path, bad, header=HEADER.replace(",", ";")) == (
        "row 2, column 'rail[mm]': '1500,5' is not a number (the decimal sign is a point)"
    )


def test_a_blank_cell_is_an_empty_one(tmp_path):
    data = read_rows(tmp_path, row(1), row(2, "normal", "slipped", marker="  "))
    assert np.isnan(data.to_xarray()["marker_displacement"].values[1, 0, 0])


def test_an_empty_file_and_one_that_is_not_text_cannot_be_read(tmp_path):
    path = tmp_path / "data.csv"
    path.touch()
    with pytest.raises(FileAccessError, match=r"data.csv: the file is empty$"):
        read_table(path)
    path.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(FileAccessError, match=r"data.csv: not a UTF-8 text file$"):
        read_table(path)
