import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from elastocal.compensation.conditioning import read_postures
from elastocal.errors import CompensationError, DatasetError
from elastocal.robot import Robot
from support.virtual_chain import ARMS

WRENCH = "force_x[N],force_y[N],force_z[kN],moment_x[N*m],moment_y[N*m],moment_z[N*m]"
VALUES = "1,2,0.003,4,5,6"
ANGLES = np.radians([[10.0, 20.0, 30.0], [-90.0, 5.0, 170.0], [0.0, 0.0, 180.0]])


@pytest.fixture
def read(tmp_path):
    def read(header, rows, **options):
        path = tmp_path / "static.csv"
        path.write_text("\n".join(["# by hand", f"{header},{WRENCH}", *rows]) + "\n")
        return read_postures(path, **options)

    return read


def test_kuka_angles(read):
    rows = [f"{a},{b},{c},{VALUES}" for a, b, c in np.degrees(ANGLES)]
    postures = read("a[deg],b[deg],c[deg]", rows)
    expected = Rotation.from_euler("ZYX", ANGLES).as_matrix()
    np.testing.assert_allclose(postures.R_base_flange, expected, atol=1e-12)
    np.testing.assert_allclose(postures.force, [[1, 2, 3]] * 3)
    np.testing.assert_allclose(postures.moment, [[4, 5, 6]] * 3)


def test_quaternions(read):
    rotation = Rotation.from_euler("ZYX", ANGLES)
    rows = [",".join(map(str, q)) + f",{VALUES}" for q in rotation.as_quat()]
    postures = read("qx,qy,qz,qw", rows)
    np.testing.assert_allclose(postures.R_base_flange, rotation.as_matrix(), atol=1e-12)


def test_joints(read):
    robot = Robot.from_urdf(ARMS["six axes"], "tcp")
    header = ",".join(f"{name}[deg]" for name in robot.joint_names)
    q = np.radians([[10, -50, 60, 5, 20, -9], [0, -40, 50, 5, 20, 9], [1, -40, 10, 5, 20, 9]])
    rows = [",".join(map(str, row)) + f",{VALUES}" for row in np.degrees(q)]
    postures = read(header, rows, robot=robot)
    np.testing.assert_allclose(postures.R_base_flange, robot.forward(q)[:, :3, :3], atol=1e-12)


@pytest.mark.parametrize(
    ("header", "row", "reason"),
    [
        ("j[deg]", "1", "no orientation of the flange .* give --robot"),
        ("qx,qy,qz,qw", "1,1,0,0", "row 3: quaternion .* it must be 1"),
        ("qx,qy,qz,qw", "1,x,0,0", "row 3, column 'qy': 'x' is not a number"),
        ("a[mm],b[deg],c[deg]", "0,0,0", "'mm' is not an angle"),
        ("a,b[deg],c[deg]", "0,0,0", "column 'a' has no unit"),
    ],
)
def test_a_table_without_orientations_is_refused(read, header, row, reason):
    with pytest.raises((CompensationError, DatasetError), match=reason):
        read(header, [f"{row},{VALUES}"] * 3)


def test_two_rows_are_refused_with_the_file(read):
    with pytest.raises(CompensationError, match=r"static\.csv: 2 postures"):
        read("a[deg],b[deg],c[deg]", [f"0,0,0,{VALUES}"] * 2)


def test_forces_without_moments_are_refused(tmp_path):
    path = tmp_path / "static.csv"
    path.write_text("a[deg],b[deg],c[deg],force_x[N],force_y[N],force_z[N]\n" + "0,0,0,1,2,3\n" * 3)
    with pytest.raises(CompensationError, match=r"columns moment_x\[N\*m\] … are missing"):
        read_postures(path)


def test_degrees_in_a_column_of_radians_are_refused_by_posture(read):
    rows = [f"{a},{b},{c},{VALUES}" for a, b, c in np.degrees(ANGLES)]
    with pytest.raises(
        CompensationError, match=r"row 3, column 'a.rad.': .* of 573 deg is more than a turn"
    ):
        read("a[rad],b[rad],c[rad]", rows)
