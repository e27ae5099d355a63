"""From a Staeubli's URDF, a mesh in mm and a path in CSV to a signed report, by the command line.

What somebody has who sees elastocal for the first time. The arm has the dimensions, limits and
torques of a TX2-90 and the frames of ROS-Industrial's description: x out of ``flange``, z out of
``tool0``, ``base`` at the height of axis 2. ``-s`` prints the time of each step.
"""

import time
from pathlib import Path

import numpy as np
import pytest

from elastocal.cell import load_cell
from elastocal.cell.examples import binary_stl, block_mesh
from support.cli import elastocal

JOINTS = (
    # origin in m, axis, limits in deg, torque in N·m, speed in deg/s
    ("0 0 0.478", "0 0 1", (-180, 180), 318, 400),
    ("0.05 0 0", "0 1 0", (-130, 147.5), 130, 390),
    ("0 0.05 0.425", "0 1 0", (-145, 145), 65, 420),
    ("0 0 0", "0 0 1", (-270, 270), 34, 540),
    ("0 0 0.425", "0 1 0", (-115, 140), 29, 475),
    ("0 0 0.1", "0 0 1", (-270, 270), 11, 760),
)
LINKS = (
    # mass in kg and its centre; radius, length and centre of a cylinder, in m
    (10.7, "0.01 0 0.12", 0.11, 0.3, "0 0 0.16"),
    (16.9, "0.02 0.02 -0.06", 0.1, 0.2, "0 0 -0.05"),
    (14.4, "0 0.22 0.21", 0.06, 0.4, "0 0.22 0.21"),
    (7.5, "0 0.06 -0.07", 0.07, 0.14, "0 0 0.03"),
    (6.4, "0 0.05 0.36", 0.055, 0.24, "0 0 0.24"),
    (0.57, "0 0.05 0.02", 0.035, 0.08, "0 0 0.04"),
    (0.03, "0 0.05 -0.2", 0.03, 0.01, "0 0 -0.01"),
)


def fixed(child: str, parent: str, origin: str) -> str:
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    return f'<link name="{child}"/><joint name="to_{child}" type="fixed">{ends}{origin}</joint>'


def urdf() -> str:
    """Return the description; the mesh of its base is in the package's folder."""
    names = ["base_link", *(f"link_{number}" for number in range(1, 7))]
    text = []
    for name, (mass, centre, radius, length, middle) in zip(names, LINKS, strict=True):
        shape = f'<cylinder radius="{radius}" length="{length}"/>'
        if name == "base_link":
            shape = '<mesh filename="package://staubli_support/meshes/base_link.stl"'
            shape += ' scale="0.001 0.001 0.001"/>'
            middle = "0 0 0"
        inertia = '<inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/>'
        text.append(
            f'<link name="{name}"><collision><origin xyz="{middle}"/><geometry>{shape}</geometry>'
            f'</collision><inertial><origin xyz="{centre}"/><mass value="{mass}"/>{inertia}'
            "</inertial></link>"
        )
    for index, (origin, axis, (low, high), torque, speed) in enumerate(JOINTS):
        lower, upper, velocity = np.radians([low, high, speed])
        text.append(
            f'<joint name="joint_{index + 1}" type="revolute"><origin xyz="{origin}"/>'
            f'<parent link="{names[index]}"/><child link="{names[index + 1]}"/><axis xyz="{axis}"/>'
            f'<limit lower="{lower}" upper="{upper}" effort="{torque}" velocity="{velocity}"/>'
            "</joint>"
        )
    text.append(fixed("flange", "link_6", f'<origin rpy="0 {-np.pi / 2} 0"/>'))
    text.append(
        fixed("tool0", "link_6", "") + fixed("base", "base_link", '<origin xyz="0 0 0.478"/>')
    )
    return f'<robot name="staubli_tx2-90">{"".join(text)}</robot>'


@pytest.fixture
def folder(tmp_path) -> Path:
    support = tmp_path / "staubli_support"
    for part in ("urdf", "meshes"):
        (support / part).mkdir(parents=True)
    (support / "urdf" / "tx2_90.urdf").write_text(urdf())
    block = block_mesh()
    block = block - block.min(axis=(0, 1))
    size = block.max(axis=(0, 1))
    foot = block / size * (0.2, 0.2, 0.3) - (0.1, 0.1, 0.0)
    (support / "meshes" / "base_link.stl").write_bytes(binary_stl(foot))
    (tmp_path / "part.stl").write_bytes(binary_stl(block / size * (0.4, 0.3, 0.085)))
    rows = ["x[mm],y[mm],z[mm],a[deg],b[deg],c[deg],force_tcp_x[N],force_tcp_y[N],force_tcp_z[N]"]
    rows += [f"{x:.1f},0,235,0,0,180,-30,0,-90" for x in np.linspace(420.0, 680.0, 60)]
    (tmp_path / "course.csv").write_text("\n".join(rows))
    return tmp_path


@pytest.mark.slow
def test_a_staeubli_comes_from_its_urdf_to_a_signed_report(folder):
    robot, cell, run = (
        folder / "staubli_support/urdf/tx2_90.urdf",
        folder / "cell.yaml",
        folder / "run",
    )
    key, model, report = folder / "line.key", folder / "model.json", folder / "report.html"
    steps = (
        ("check", robot),
        (
            *("new", "--robot", robot, "--mesh", folder / "part.stl", "-o", cell),
            *("--process", folder / "course.csv", "--tolerance", "0.2 mm"),
        ),
        ("check", cell, "--preview", folder / "cell.html"),
        ("plan", cell, "--out", folder / "plan"),
        ("verify", "--new-key", key),
        ("run", cell, "--plan", folder / "plan", "--out", run, "--sign", key),
        ("calibrate", run / "dataset.nc", "--out", model),
        ("compensate", model, folder / "course.csv", "--out", folder / "corrected.csv"),
        ("report", folder, "--out", report, "--sign", key),
        ("verify", folder, "--key", key.with_name("line.key.pub")),
    )
    began = time.monotonic()
    for step in steps:
        before = time.monotonic()
        result = elastocal(*step)
        assert result.code == 0, (step, result.err)
        print(f"{time.monotonic() - before:6.1f} s  {' '.join(map(str, step[:2]))}")
        if step[0] == "compensate":
            assert "100% of 60 rows of production" in " ".join(result.err.split())
    print(f"{time.monotonic() - began:6.1f} s  in all")
    file = load_cell(cell).file
    assert (file.robot.flange, file.surface.unit) == ("tool0", "mm")
    assert 90.0 < file.load_cases.fz < 100.0
    assert "Not judged" not in report.read_text(encoding="utf-8")
