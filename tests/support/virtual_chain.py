"""The motion of a chain whose springs have moved, by matrix products alone.

What the estimator's Jacobians are compared with: no Pinocchio, no Jacobian formula, only the
definition of a spring as a virtual joint in a joint's frame.
"""

import numpy as np

from elastocal.elastic import Spring
from elastocal.sim.arm import (
    Linkage,
)
from support.urdfs import (
    KR_LIKE,
    offset_wrist_urdf,
    opw_arm_urdf,
    planar_arm_urdf,
    sliding_arm_urdf,
)

STEP = 1e-5
"""Half the distance of a central difference, in rad or m."""

_TILTED = """
<robot name="tilted"><link name="base"/><link name="a"/><link name="b"/><link name="c"/>
<link name="tcp"/>
<joint name="slide" type="prismatic"><parent link="base"/><child link="a"/>
<origin xyz="0.1 0 0.4" rpy="0.1 0.2 0.3"/><axis xyz="0.6 0 0.8"/>
<limit lower="-1" upper="1" effort="0" velocity="0"/></joint>
<joint name="swing" type="continuous"><parent link="a"/><child link="b"/>
<origin xyz="0 0.3 0.2" rpy="-0.7 0 1.1"/><axis xyz="1 2 -1"/></joint>
<joint name="turn" type="revolute"><parent link="b"/><child link="c"/>
<origin xyz="0.8 0.1 0" rpy="0 0.9 0.2"/><axis xyz="0 0 -1"/>
<limit lower="-3" upper="3" effort="0" velocity="0"/></joint>
<joint name="grip" type="fixed"><parent link="c"/><child link="tcp"/>
<origin xyz="0.1 0.2 0.3" rpy="0.5 0.6 0.7"/></joint></robot>
"""

ARMS = {
    "six axes": opw_arm_urdf(**KR_LIKE),
    "on a rail": opw_arm_urdf(**KR_LIKE, rail=(-1.0, 1.0)),
    "offset wrist on a turntable": opw_arm_urdf(
        **KR_LIKE, wrist_offset=0.08, turntable=(-1.0, 1.0), mount=("0.2 -0.4 1.5", "0 1.2 0.3")
    ),
    "offset wrist": offset_wrist_urdf(),
    "sliding joint": sliding_arm_urdf(),
    "one joint": planar_arm_urdf((1.0,)),
    "axes between the coordinate axes": _TILTED,
}
"""URDF texts; the last link is `tcp`."""


def tcp_frame(linkage: Linkage, q: np.ndarray, spring: Spring, amount: float) -> np.ndarray:
    """Return T_base_tcp with one spring moved by ``amount`` (rad or m), shape (4, 4)."""
    T, before = np.eye(4), np.eye(4)
    for index, name in enumerate(linkage.joint_names):
        T_parent_joint = np.linalg.inv(before) @ linkage.T_base_joint[index]
        before = linkage.T_base_joint[index]
        moved = np.eye(4)
        if spring.joint == name:
            there, back = _shift(spring.offset), _shift(-np.array(spring.offset))
            moved = there @ _motion(spring.axis, amount, spring.revolute) @ back
        driven = _motion(linkage.axis[index], q[index], linkage.revolute[index])
        T = T @ T_parent_joint @ (driven @ moved if spring.distal else moved @ driven)
    return T @ np.linalg.inv(before) @ linkage.T_base_tip


def numerical_column(
    linkage: Linkage, q: np.ndarray, spring: Spring, point_tcp: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Return translation and rotation per unit of a spring, by central differences.

    The translation is that of ``point_tcp``, by default the tcp itself.
    """
    point = np.append(np.zeros(3) if point_tcp is None else point_tcp, 1.0)
    ahead, behind = (tcp_frame(linkage, q, spring, step) for step in (STEP, -STEP))
    turned = (ahead[:3, :3] - behind[:3, :3]) @ tcp_frame(linkage, q, spring, 0.0)[:3, :3].T
    skew = turned / (2.0 * STEP)
    rotation = np.array([skew[2, 1], skew[0, 2], skew[1, 0]])
    return ((ahead - behind) @ point)[:3] / (2.0 * STEP), rotation


def configurations(linkage: Linkage, count: int, seed: int = 0) -> np.ndarray:
    """Return joints within the limits, shape (count, joint), in rad or m."""
    lower, upper = np.maximum(linkage.lower, -2.0), np.minimum(linkage.upper, 2.0)
    return np.random.default_rng(seed).uniform(lower, upper, (count, len(lower)))


def _motion(axis: np.ndarray, amount: float, revolute: bool) -> np.ndarray:
    if not revolute:
        return _shift(amount * np.asarray(axis))
    x, y, z = axis
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    T = np.eye(4)
    T[:3, :3] += np.sin(amount) * K + (1.0 - np.cos(amount)) * K @ K
    return T


def _shift(by: np.ndarray | tuple[float, float, float]) -> np.ndarray:
    T = np.eye(4)
    T[:3, 3] = by
    return T
