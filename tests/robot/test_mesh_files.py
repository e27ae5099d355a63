"""Mesh files of a URDF: where each kind of name leads, and what is refused."""

import pickle

import numpy as np
import pytest
import trimesh

from elastocal.errors import FileAccessError, RobotError
from elastocal.robot import Robot, collision_model, find_meshes
from support.urdfs import KR_LIKE, opw_arm_urdf

SIZE = (0.1, 0.2, 0.3)


def with_mesh(name: str) -> str:
    """An arm whose only collision shape is a mesh on its fourth link."""
    shape = f'<collision><geometry><mesh filename="{name}"/></geometry></collision>'
    shown = '<visual><geometry><mesh filename="nowhere.dae"/></geometry></visual>'
    urdf = opw_arm_urdf(**KR_LIKE)
    link = urdf.split('<link name="')[4].partition('"')[0]
    bare = f'<link name="{link}"/>'
    assert bare in urdf
    return urdf.replace(bare, f'<link name="{link}">{shown}{shape}</link>')


@pytest.fixture
def package(tmp_path):
    """A package with the folders that ROS packages have."""
    folder = tmp_path / "arms" / "my_arm"
    (folder / "urdf").mkdir(parents=True)
    (folder / "meshes").mkdir()
    trimesh.creation.box(SIZE).export(folder / "meshes" / "link.stl")
    return folder


@pytest.mark.parametrize(
    "name",
    [
        "../meshes/link.stl",
        "package://my_arm/meshes/link.stl",
        "package://renamed_arm/meshes/link.stl",
        "file://{package}/meshes/link.stl",
        "{package}/meshes/link.stl",
    ],
)
def test_every_kind_of_name_leads_to_the_file_and_the_shape_is_read(package, name):
    urdf = with_mesh(name.format(package=package))
    meshes = find_meshes(urdf, package / "urdf")
    robot = Robot.from_urdf(urdf, "tcp", meshes=meshes)
    _, geometry = collision_model(robot)
    (shape,) = [body.geometry for body in geometry.geometryObjects]
    shape.computeLocalAABB()
    np.testing.assert_allclose(np.ptp([shape.aabb_local.min_, shape.aabb_local.max_], 0), SIZE)
    assert robot.urdf == urdf


def test_a_name_relative_to_the_working_folder_is_taken_from_the_urdfs(package, monkeypatch):
    monkeypatch.chdir(package.parent)
    urdf = with_mesh("../meshes/link.stl")
    ((_, place),) = find_meshes(urdf, (package / "urdf").relative_to(package.parent))
    assert place.is_absolute()
    assert place.samefile(package / "meshes" / "link.stl")


@pytest.mark.parametrize("name", ["no.stl", "package://my_arm/no.stl", "file:///no/no.stl", ""])
def test_a_missing_mesh_is_refused_by_link_and_name(package, name):
    urdf = with_mesh(name)
    robot = Robot.from_urdf(urdf, "tcp", meshes=find_meshes(urdf, package / "urdf"))
    with pytest.raises(
        FileAccessError, match=r"^link '\w+': mesh '.*': there is no file"
    ) as caught:
        collision_model(robot)
    assert repr(name) in str(caught.value)


def test_a_mesh_that_cannot_be_read_is_refused_in_one_line(package):
    (package / "meshes" / "link.stl").write_bytes(bytes(90))
    urdf = with_mesh("../meshes/link.stl")
    robot = Robot.from_urdf(urdf, "tcp", meshes=find_meshes(urdf, package / "urdf"))
    with pytest.raises(
        RobotError, match=r"link '\w+': mesh .*link\.stl has no triangles"
    ) as caught:
        collision_model(robot)
    assert "\n" not in str(caught.value)


def test_kinematics_reads_no_mesh():
    assert Robot.from_urdf(with_mesh("no.stl"), "tcp").joint_names


def test_a_robot_with_meshes_goes_to_another_process(package):
    urdf = with_mesh("../meshes/link.stl")
    robot = Robot.from_urdf(urdf, "tcp", meshes=find_meshes(urdf, package / "urdf"))
    assert pickle.loads(pickle.dumps(robot)).meshes == robot.meshes


def test_a_file_of_that_name_far_above_is_not_taken_for_the_packages(package):
    (package.parent / "link.stl").write_bytes((package / "meshes" / "link.stl").read_bytes())
    urdf = with_mesh("package://other/link.stl")
    robot = Robot.from_urdf(urdf, "tcp", meshes=find_meshes(urdf, package / "urdf"))
    with pytest.raises(FileAccessError, match="nor one of that name in the folders above"):
        collision_model(robot)
