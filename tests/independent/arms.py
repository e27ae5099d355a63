"""Four arms of four makes, with what gives way in them, and postures to press at.

Heavy arms are some ten times as stiff as a light one of the same reach; stiffnesses are round
numbers of their sizes, not those of a maker. The arm of seven joints is nobody's.
"""

from collections.abc import Callable
from functools import cache

import numpy as np

from elastocal.robot import T_from_xyzabc, catalogue, with_tool
from elastocal.sim.arm import Linkage, press_poses
from independent.mujoco_truth import Drawing

ARMS = ("kuka", "fanuc", "ur", "seven")
_TOOL = T_from_xyzabc(0.05, 0.0, 0.3, 0.0, np.radians(20.0), 0.0)
_SMALL_TOOL = T_from_xyzabc(0.02, 0.0, 0.12, 0.0, np.radians(20.0), 0.0)
ANOTHER_TOOL = T_from_xyzabc(0.0, 0.0, 0.15, 0.0, np.radians(30.0), 0.0)
"""Tcp of a tool 150 mm longer and turned, in the frame of the tcp that an arm is calibrated at."""
_MIDDLE = {
    "fanuc": (0.0, 0.4, -0.2, 0.3, -1.2, 0.0),
    "ur": (0.0, -1.2, 1.6, -1.9, -1.57, 0.0),
    "seven": (0.0, 0.6, 0.3, 1.6, 0.2, 0.9, 0.0),
}
"""Postures about which the arm presses, in rad."""
_SPREAD, _SPREAD_OF_THE_LAST = 0.5, 2.5


@cache
def drawing(arm: str, another_tool: bool = False) -> Drawing:
    """Return an arm of `ARMS`."""
    return _DRAWN[arm](ANOTHER_TOOL if another_tool else np.eye(4))


def poses(arm: str, count: int, seed: int) -> np.ndarray:
    """Return joints at which the tool touches the tooling, shape (pose, joint), in rad.

    Of the KUKA's on a dome. Where to press is no law of physics, so elastocal may say it.
    """
    rng = np.random.default_rng(seed)
    if arm == "kuka":
        return press_poses(Linkage.from_urdf(drawing(arm).urdf, "tcp"), count, rng).joints
    middle = np.array(_MIDDLE[arm])
    spread = np.full(len(middle), _SPREAD)
    spread[-1] = _SPREAD_OF_THE_LAST
    return middle + rng.uniform(-1.0, 1.0, (count, len(middle))) * spread


def _kuka(T_tcp_tool: np.ndarray) -> Drawing:
    urdf = with_tool(catalogue.urdf("KR 150 R3100-2"), "flange", "tcp", _TOOL @ T_tcp_tool)
    stiffness = (2.4e6, 2.9e6, 2.6e6, 8e5, 6e5, 3e5)
    return Drawing(urdf, stiffness, 9e6, ("joint_a3", "joint_a4"), 1100.0, 0.35e-3, 3e6)


def _fanuc(T_tcp_tool: np.ndarray) -> Drawing:
    urdf = with_tool(catalogue.urdf("R-2000iC/210F"), "flange", "tcp", _TOOL @ T_tcp_tool)
    stiffness = (2.2e6, 2.6e6, 2.0e6, 6e5, 5e5, 3e5)
    return Drawing(urdf, stiffness, 9e6, ("joint_3", "joint_4"), 1100.0, 0.35e-3, 3e6)


def _ur(T_tcp_tool: np.ndarray) -> Drawing:
    urdf = with_tool(catalogue.urdf("UR10e"), "flange", "tcp", _SMALL_TOOL @ T_tcp_tool)
    links = ("elbow_joint", "wrist_1_joint")
    return Drawing(urdf, (5e4, 5e4, 3e4, 1e4, 1e4, 1e4), 2e5, links, 165.0, 2e-3, 4.5e5)


def _seven(T_tcp_tool: np.ndarray) -> Drawing:
    """Return an arm whose axes turn about z and y by turns, 0.2 m apart."""
    places = (0.16, 0.2, 0.2, 0.2, 0.2, 0.2, 0.1)
    axes = ("0 0 1", "0 1 0", "0 0 1", "0 -1 0", "0 0 1", "0 1 0", "0 0 1")
    text, parent = ['<robot name="seven"><link name="base"/>'], "base"
    for number, (height, axis) in enumerate(zip(places, axes, strict=True), 1):
        child, aside = f"link_{number}", 0.08 if number == 7 else 0.0
        text.append(
            f'<joint name="joint_{number}" type="revolute"><parent link="{parent}"/>'
            f'<child link="{child}"/><origin xyz="0 {aside} {height}"/><axis xyz="{axis}"/>'
            '<limit lower="-2.9" upper="2.9" effort="200" velocity="2"/></joint>'
            f'<link name="{child}"><inertial><origin xyz="0 0.02 0.08"/>'
            f'<mass value="{5.0 - 0.5 * number}"/>'
            '<inertia ixx="0.05" iyy="0.05" izz="0.05" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        )
        parent = child
    text.append(
        f'<joint name="joint_flange" type="fixed"><parent link="{parent}"/><child link="flange"/>'
        '<origin xyz="0 0 0.05"/></joint><link name="flange"/></robot>'
    )
    stiffness = (1.5e4, 1.5e4, 1.2e4, 1.2e4, 1e4, 8e3, 6e3)
    links = ("joint_3", "joint_5")
    urdf = with_tool("".join(text), "flange", "tcp", _SMALL_TOOL @ T_tcp_tool)
    return Drawing(urdf, stiffness, 1e5, links, 110.0, 2e-3, 4.5e5)


_DRAWN: dict[str, Callable[[np.ndarray], Drawing]] = {
    "kuka": _kuka,
    "fanuc": _fanuc,
    "ur": _ur,
    "seven": _seven,
}
