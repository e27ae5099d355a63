import pytest

from elastocal.dataset._store import parse_header
from elastocal.errors import DatasetError

CELLS = [
    *("pose", "load_case", "a1[rad]", "a2[rad]"),
    *(f"force_{axis}[N]" for axis in "xyz"),
    *(f"controller_displacement_{axis}[m]" for axis in "xyz"),
    *(f"marker_displacement_{axis}[m]" for axis in "xyz"),
]


def changed(old, *new):
    index = CELLS.index(old)
    return [*CELLS[:index], *new, *CELLS[index + 1 :]]


def test_columns_may_come_in_any_order():
    header = parse_header(CELLS[::-1])
    assert header.text == {"load_case": 11, "pose": 12}
    assert [column.name for column in header.joints] == ["a2", "a1"]
    assert [column.index for column in header.vectors["force"]] == [8, 7, 6]


def test_units_and_spaces_around_names_are_read():
    header = parse_header([f" {cell} " for cell in changed("a2[rad]", "rail [mm]", "a3[deg]")])
    assert header.joint_units == ("rad", "m", "rad")
    assert [column.scale for column in header.joints] == pytest.approx([1, 1e-3, 0.01745329252])


def test_optional_columns_are_found():
    optional = [f"{name}_{axis}[m]" for name in ("tcp_position", "marker_sigma") for axis in "xyz"]
    header = parse_header([*CELLS, "status", *optional])
    assert set(header.vectors) >= {"tcp_position", "marker_sigma"}
    assert header.text["status"] == len(CELLS)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("force_x[N]", ("force_x",), "column 'force_x' has no unit: it is written force_x[N]"),
        ("force_x[N]", ("force_x[]",), "column 'force_x' has no unit: it is written force_x[N]"),
        (
            "force_x[N]",
            ("force_x[m]",),
            "column 'force_x[m]': unit 'm' is not a force: allowed are N, kN",
        ),
        ("force_x[N]", (), "column 'force_x[N]' is missing"),
        (
            "force_x[N]",
            ("forse_x[N]",),
            "column 'forse_x[N]' is not known; did you mean 'force_x'?",
        ),
        (
            "marker_displacement_y[m]",
            ("marker_displacment_y[m]",),
            "column 'marker_displacment_y[m]': it is not a joint; did you mean"
            " 'marker_displacement_y'?",
        ),
        ("a1[rad]", ("a1[rad]", "a1[rad]"), "column 'a1' stands twice in the header"),
        (
            "a1[rad]",
            ("a1",),
            "column 'a1' is not known (a joint column is written name[rad], name[deg], name[m] or"
            " name[mm])",
        ),
        ("a1[rad]", ("a1[grad]",), "column 'a1[grad]' is not known (a joint column is written"),
        ("a1[rad]", ("a1[rad",), "column header 'a1[rad' is not of the form name[unit]"),
        ("a1[rad]", ("a1[rad]", " "), "column 4 has no name in the header"),
        ("pose", ("Pose",), "column 'Pose' is not known; did you mean 'pose'?"),
        ("pose", (), "column 'pose' is missing"),
        ("load_case", (), "column 'load_case' is missing"),
        ("pose", ("pose[1]",), "column 'pose[1]' has a unit: it must be written 'pose'"),
        ("a1[rad]", ("a1[rad]", "moment_x[N*m]"), "column 'moment_y[N*m]' is missing"),
    ],
)
def test_a_header_that_does_not_fit_is_refused_by_column(old, new, message):
    with pytest.raises(DatasetError) as caught:
        parse_header(changed(old, *new))
    assert str(caught.value).startswith(message)


def test_a_table_without_joints_is_refused():
    with pytest.raises(DatasetError, match=r"^no joint column: a joint column is written name"):
        parse_header([cell for cell in CELLS if "rad" not in cell])
