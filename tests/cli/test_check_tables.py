"""`elastocal check` on CSV files: it names the kind that it took the file for, and reads it."""

import pytest

from elastocal.errors import DatasetError, PathError, SchemaError
from elastocal.planning.export import write_table
from elastocal.workflows.check import describe_file
from support import plans

JOINTS, FORCE = "joint_a1[deg],joint_a2[rad]", "force_x[N],force_y[N],force_z[N]"
POSE, MOMENT = "x[mm],y[mm],z[mm],a[deg],b[deg],c[deg]", "moment_x[N*m],moment_y[N*m],moment_z[N*m]"
QUATERNION = "x[m],y[m],z[m],qx,qy,qz,qw"


def written(tmp_path, header, *rows):
    path = tmp_path / "table.csv"
    path.write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("header", "row", "kind", "joints"),
    [
        (f"{JOINTS},{FORCE}", "10,0.2,1,2,3", "table of joints and forces (ROWS.csv", 2),
        (f"{JOINTS},{FORCE},visit", "10,0.2,1,2,3,a", "table of joints and forces (ROWS.csv", 2),
        (f"course,{JOINTS},{FORCE}", "0,10,0.2,1,2,3", "programmed path of joints (PATH.csv)", 2),
        (f"{POSE},{FORCE}", "1,2,3,10,20,30,1,2,3", "programmed path of tool poses (PATH.csv)", 0),
        (
            f"rail[m],{QUATERNION},{FORCE.replace('force_', 'force_tcp_')}",
            "0.1,1,2,3,0,0,0,1,1,2,3",
            "programmed path of tool poses (PATH.csv)",
            1,
        ),
        (f"a[deg],b[deg],c[deg],{FORCE},{MOMENT}", "1,2,3,1,2,3,1,2,3", "table of static post", 0),
        (
            f"{JOINTS},{FORCE},deflection_x[m],deflection_x_low[m]",
            "10,0.2,1,2,3,1e-3,0",
            "table of rows with predicted deflections (OUT.csv)",
            2,
        ),
    ],
)
def test_rows_of_every_command_are_known_by_their_columns(tmp_path, header, row, kind, joints):
    found, facts = describe_file(written(tmp_path, header, row, row))
    assert found.startswith(kind)
    assert (facts["rows"], len(facts["joints"])) == (2, joints)
    assert facts["force_in"] == ("tcp" if "force_tcp" in header else "base")


@pytest.mark.parametrize(
    ("header", "row", "words"),
    [
        (f"{JOINTS},{FORCE}", "10,nan,1,2,3", "row 2, column 'joint_a2[rad]': 'nan' is not a fin"),
        (f"{JOINTS},{FORCE}", "10,0.2,1,2", "row 2 has 4 cells, the header has 5"),
        (f"{JOINTS},force_x[N],force_y[N],force_z[mm]", "1,2,3,4,5", "'force_z[mm]'"),
        (f"{QUATERNION},{FORCE}", "1,2,3,0,0,0,2,1,2,3", "row 2"),
        (f"{JOINTS},{JOINTS},{FORCE}", "1,1,1,1,1,2,3", "'joint_a1' stands twice"),
        (f"{JOINTS},{FORCE}", "", "has a header but no row"),
    ],
)
def test_a_row_that_a_command_would_refuse_is_refused(tmp_path, header, row, words):
    with pytest.raises(PathError) as caught:
        describe_file(written(tmp_path, header, row))
    assert words in str(caught.value)
    assert "table.csv: " in str(caught.value)


def test_a_table_of_a_plan_is_one(tmp_path):
    kind, facts = describe_file(write_table(tmp_path, plans.plan()))
    assert (kind, facts["rows"]) == ("table of a plan", 6)


def test_a_dataset_without_a_column_is_refused_as_one(tmp_path):
    with pytest.raises(DatasetError):
        describe_file(written(tmp_path, f"pose,load_case,{JOINTS},{FORCE}", "0,normal,1,2,3,4,5"))


def test_columns_of_no_table_of_ours_are_refused_with_what_is_known(tmp_path):
    with pytest.raises(SchemaError, match="columns colour, taste are of no table of ours"):
        describe_file(written(tmp_path, "colour,taste", "red,sweet"))
