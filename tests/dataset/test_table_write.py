import pytest

from elastocal.dataset import Dataset
from elastocal.dataset._store import write_table
from support.datasets import dataset, full_keywords


@pytest.fixture
def path(tmp_path):
    return tmp_path / "data.csv"


def test_attributes_come_first_and_empty_ones_are_left_out(path):
    write_table(dataset(tcp_frame="tool"), path)
    lines = path.read_text().splitlines()
    assert lines[:2] == ['# schema: "elastocal.dataset/1"', '# tcp_frame: "tool"']
    assert lines[2].startswith("pose,load_case,joint_1[rad],joint_2[rad],force_x[N],")


def test_every_pose_and_load_case_has_a_row(path):
    data = Dataset.from_arrays(**full_keywords())
    write_table(data, path)
    rows = [line for line in path.read_text().splitlines() if not line.startswith("#")][1:]
    assert [row.split(",")[:3] for row in rows][1:4] == [
        ["4", "north", "ok"],
        ["2", "normal", "missing"],
        ["2", "north", "ok"],
    ]


def test_a_prismatic_joint_is_written_in_metres(path):
    write_table(dataset(joint_units=("m", "rad")), path)
    assert ",joint_1[m],joint_2[rad]," in path.read_text()


def test_numbers_have_all_their_digits(path):
    data = dataset()
    write_table(data, path)
    assert f",{data.force[0, 0, 1].item()!r}," in path.read_text()


def test_a_number_that_is_missing_is_an_empty_cell(path):
    write_table(Dataset.from_arrays(**full_keywords()), path)
    text = path.read_text()
    assert "\n2,normal,missing,,,,,," in text
    assert ",nan" not in text
