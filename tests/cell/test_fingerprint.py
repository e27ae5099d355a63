"""The fingerprint: changes with what a cell is, not with how or where it is written down."""

import shutil
from dataclasses import replace

import pytest
import yaml

from elastocal.cell import Limits, fingerprint, load_cell, named_files
from elastocal.cell.cell import SCHEMA, cell_file_model
from elastocal.cell.examples import write_example
from elastocal.errors import FileAccessError
from elastocal.records import read_yaml
from elastocal.robot import catalogue, collision_model


@pytest.fixture
def folder(tmp_path):
    write_example(tmp_path / "here", "machining")
    return tmp_path / "here"


def of(folder, file="cell.yaml"):
    return fingerprint(load_cell(folder / file))


def rewritten(folder, change):
    """The fingerprint after a change to the contents of the cell file."""
    path = folder / "cell.yaml"
    data = yaml.safe_load(path.read_text(encoding="utf-8"))
    change(data)
    path.write_text(yaml.safe_dump(data), encoding="utf-8")
    return of(folder)


def flip_last_byte(path):
    data = bytearray(path.read_bytes())
    data[-1] ^= 1
    path.write_bytes(data)


def test_it_is_a_sha256_and_says_the_same_twice(folder):
    assert of(folder) == of(folder)
    assert len(bytes.fromhex(of(folder))) == 32


def test_comments_and_the_order_of_keys_do_not_change_it(folder):
    before = of(folder)
    path = folder / "cell.yaml"
    path.write_text("# a comment\n" + path.read_text(encoding="utf-8"), encoding="utf-8")
    assert of(folder) == before
    assert rewritten(folder, dict) == before


def test_another_place_and_another_name_of_the_file_do_not_change_it(folder):
    before = of(folder)
    shutil.move(folder, folder.with_name("there"))
    there = folder.with_name("there")
    (there / "cell.yaml").rename(there / "other.yaml")
    assert of(there, "other.yaml") == before


def test_a_number_changes_it(folder):
    before = of(folder)
    assert rewritten(folder, lambda data: data["load_cases"].update(fz="1501 N")) != before


class LaterLimits(Limits):
    """Limits with the key of a check that a later version has."""

    reach: float | None = None


class LaterCellFile(cell_file_model()):
    limits: LaterLimits = LaterLimits()


def test_an_optional_key_that_is_not_given_leaves_it(folder):
    cell = load_cell(folder / "cell.yaml")
    later = read_yaml(cell.path, LaterCellFile, SCHEMA)
    assert fingerprint(replace(cell, file=later)) == fingerprint(cell)


def test_an_optional_key_that_is_given_changes_it(folder):
    cell = load_cell(folder / "cell.yaml")
    later = read_yaml(cell.path, LaterCellFile, SCHEMA)
    limits = later.limits.model_copy(update={"reach": 2.0})
    given = replace(cell, file=later.model_copy(update={"limits": limits}))
    assert fingerprint(given) != fingerprint(cell)


def test_plans_made_before_keys_could_be_left_out_still_match(folder):
    # The block's mesh has whole numbers: the print is the same on every machine.
    before = "79fc04c0b1c141621e6e0537074cad61a1d332ae27ce99b8d90b58ed08220fca"
    assert rewritten(folder, without_levels) == before


def without_levels(data):
    """Take out of the example what cells of then did not have."""
    for key in ("level", "check"):
        del data["load_cases"][key]


def test_a_key_that_was_null_and_is_given_changes_it(folder):
    before = of(folder)
    assert rewritten(folder, lambda data: data["limits"].update(payload="119 kg")) != before


def test_a_byte_of_the_surface_changes_it(folder):
    before = of(folder)
    flip_last_byte(folder / "block.stl")
    assert of(folder) != before


def test_a_byte_of_every_other_file_changes_it(folder):
    for name in ("tool.stl", "fixture.stl"):
        shutil.copy(folder / "block.stl", folder / name)
    (folder / "robot.urdf").write_text(catalogue.urdf("KR 300 R2500 ultra"))
    joints = ",".join(f"joint_a{i}[deg]" for i in range(1, 7))
    rows = f"{joints},force_x[N],force_y[N],force_z[N]\n0,-90,90,0,45,0,0,0,-100\n"
    (folder / "process.csv").write_text(rows)

    def name_them(data):
        data["robot"] = {"urdf": "robot.urdf"}
        data["process"] = {"file": "process.csv"}
        data["tool"]["shapes"].append({"mesh": {"file": "tool.stl", "unit": "mm"}})
        data["fixtures"].append({"mesh": {"file": "fixture.stl", "unit": "mm"}})

    seen = [rewritten(folder, name_them)]
    for name in ("tool.stl", "fixture.stl"):
        flip_last_byte(folder / name)
        seen.append(of(folder))
    for name in ("robot.urdf", "process.csv"):
        with (folder / name).open("a") as file:
            file.write("\n")
        seen.append(of(folder))
    assert len(set(seen)) == 5


def test_a_file_that_went_away_is_named(folder):
    cell = load_cell(folder / "cell.yaml")
    (folder / "block.stl").unlink()
    with pytest.raises(FileAccessError, match=r"cannot read .*block\.stl: No such file") as caught:
        fingerprint(cell)
    assert "\n" not in str(caught.value)


def with_mesh_arm(folder):
    """Give the cell an arm one link of which is a mesh, named as in a ROS package."""
    shutil.copy(folder / "block.stl", folder / "link.stl")
    shape = '<collision><geometry><mesh filename="package://arm/link.stl" scale="1e-6 1e-6 1e-6"/>'
    urdf = catalogue.urdf("KR 300 R2500 ultra").replace(
        '<link name="link_4">', f'<link name="link_4">{shape}</geometry></collision>'
    )
    assert "package://arm" in urdf
    (folder / "robot.urdf").write_text(urdf)
    return rewritten(folder, lambda data: data.update(robot={"urdf": "robot.urdf"}))


def test_a_byte_of_a_mesh_of_the_arm_changes_it_and_its_place_does_not(folder):
    before = with_mesh_arm(folder)
    shutil.move(folder, folder.with_name("there"))
    assert of(folder.with_name("there")) == before
    flip_last_byte(folder.with_name("there") / "link.stl")
    assert of(folder.with_name("there")) != before


def test_the_meshes_of_the_arm_are_among_the_files_of_the_cell(folder):
    with_mesh_arm(folder)
    cell = load_cell(folder / "cell.yaml")
    assert "link.stl" in set(named_files(cell))
    assert "package://arm/link.stl" in cell.robot.urdf


def test_a_missing_mesh_of_the_arm_is_refused_by_link_and_name(folder):
    with_mesh_arm(folder)
    (folder / "link.stl").unlink()
    robot = load_cell(folder / "cell.yaml").robot  # of which kinematics needs no mesh
    with pytest.raises(FileAccessError, match=r"^link 'link_4': mesh 'package://arm/link"):
        collision_model(robot)


def test_how_a_plan_is_carried_out_does_not_change_it(folder):
    before = of(folder)

    def change(data):
        data["procedure"] = {"retries": 3}
        data["faults"] = [{"kind": "robot_stop", "pose": 1, "step": "approach"}]
        data["simulation"] = {"seed": 77}

    assert rewritten(folder, change) == before
