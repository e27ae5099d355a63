"""The rigid linkage of the simulated arm: its URDF, forward and inverse kinematics.

Only `xml.etree` and numpy: a mistake in the estimator's URDF reader must show up as a difference,
not be repeated here. Every movement, of a joint or of a spring, is a screw written down once, in
base, with the arm at zero (Brockett's product of exponentials; Lynch and Park, "Modern Robotics",
2017, chapter 4). The estimator chains link frames instead, so the two share no equation.
"""

import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from functools import cached_property
from xml.etree.ElementTree import Element

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import BoolArray, FloatArray
from elastocal.errors import RobotError
from elastocal.results import brief_repr

_MOVABLE = ("revolute", "continuous", "prismatic")
_DAMPING = 1e-3
"""Largest damping; it falls with the square of the error, so that the last steps are Newton's."""
_MAX_STEP = 0.5
"""Largest change of a joint in one iteration, in rad or m."""
_MAX_ITERATIONS = 60
_UNMOVED = np.eye(4)
_UNMOVED.setflags(write=False)


@brief_repr
@dataclass(frozen=True)
class Screws:
    """Axes of movement in the order in which they follow one another from base to tip."""

    axis: FloatArray
    """Unit vectors in base with the arm at zero, shape (element, 3)."""
    point: FloatArray
    """A point on each axis, in base with the arm at zero, shape (element, 3), in m."""
    revolute: BoolArray
    """Whether each turns (else it slides), shape (element,)."""

    @cached_property
    def twist(self) -> FloatArray:
        """Velocity of a point, ``S [p, 1]``, per speed of each element, shape (element, 4, 4)."""
        S = np.zeros((len(self.axis), 4, 4))
        wedge = np.cross(self.axis[:, None, :], np.eye(3)).transpose(0, 2, 1)
        S[self.revolute, :3, :3] = wedge[self.revolute]
        S[:, :3, 3] = np.where(self.revolute[:, None], np.cross(self.point, self.axis), self.axis)
        return S

    @cached_property
    def twist_squared(self) -> FloatArray:
        """Their squares, shape (element, 4, 4); zero for one that slides."""
        return self.twist @ self.twist


def motions(screws: Screws, positions: FloatArray) -> FloatArray:
    """Return the rigid motion that all elements in front of each one have made together.

    ``T[e] = exp(S_0 x_0) … exp(S_{e-1} x_{e-1})``; the last entry is the motion of the tip.

    Parameters
    ----------
    screws : Screws
        The elements.
    positions : ndarray, shape (batch, element)
        Position of each element in rad or m.

    Returns
    -------
    ndarray, shape (element + 1, batch, 4, 4)
        Motions to apply to points given in base with the arm at zero.
    """
    steps = _exponentials(screws, positions)
    total = np.empty((len(steps) + 1, *steps.shape[1:]))
    total[0] = _UNMOVED
    for index, step in enumerate(steps):
        np.matmul(total[index], step, out=total[index + 1])
    return total


def moved_axes(screws: Screws, before: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the axes and points of screws after the motions in front of them.

    Parameters
    ----------
    screws : Screws
        The elements.
    before : ndarray, shape (element, batch, 4, 4)
        Motion in front of each, from `motions`.

    Returns
    -------
    axis : ndarray, shape (element, batch, 3)
    point : ndarray, shape (element, batch, 3)
        Where the axes are now, in base.
    """
    rotation = before[..., :3, :3]
    axis = (rotation @ screws.axis[:, None, :, None])[..., 0]
    point = (rotation @ screws.point[:, None, :, None])[..., 0] + before[..., :3, 3]
    return axis, point


def _exponentials(screws: Screws, positions: FloatArray) -> FloatArray:
    """Return exp(S_e x_e) by Rodrigues' formula, shape (element, batch, 4, 4).

    ``exp(S x) = 1 + sin(x) S + (1 - cos x) S^2`` of one that turns, ``1 + x S`` of one that slides.
    """
    first = np.where(screws.revolute, np.sin(positions), positions).T[..., None, None]
    second = (1.0 - np.cos(positions)).T[..., None, None]
    steps: FloatArray = first * screws.twist[:, None]
    steps += second * screws.twist_squared[:, None]
    steps += _UNMOVED
    return steps


@brief_repr
@dataclass(frozen=True)
class PointMass:
    """The weight of one link."""

    joint: int
    """Number of joints in front of the link."""
    mass: float
    """In kg."""
    centre: FloatArray
    """Centre of mass in base with the arm at zero, shape (3,), in m."""


@dataclass(frozen=True, eq=False)
class Linkage:
    """Joints from a base link to a tip link, all written in base with the arm at zero."""

    joint_names: tuple[str, ...]
    """Movable joints from base to tip."""
    T_base_joint: FloatArray
    """Joint frames with the arm at zero, shape (joint, 4, 4)."""
    axis: FloatArray
    """Joint axes, each in its own joint frame, shape (joint, 3)."""
    revolute: tuple[bool, ...]
    """Whether each joint turns (else it slides)."""
    lower: FloatArray
    """Lower limits in rad or m, -inf if there is none, shape (joint,)."""
    upper: FloatArray
    """Upper limits in rad or m, inf if there is none, shape (joint,)."""
    T_base_tip: FloatArray
    """Tip frame with the arm at zero, shape (4, 4)."""
    masses: tuple[PointMass, ...]
    """Links that move, in no special order; a link without inertial has none."""
    name: str
    """Name of the robot."""
    urdf: str
    """The text it was read from."""
    tip: str
    """Name of the tip link."""

    def __repr__(self) -> str:
        return f"Linkage({self.name!r}, {len(self.joint_names)} joints to {self.tip!r})"

    @classmethod
    def from_urdf(cls, text: str, tip: str, base: str | None = None) -> "Linkage":
        """Return the linkage that a URDF text describes; ``base`` defaults to the root link.

        Raises
        ------
        RobotError
            If the text is no URDF, or has no serial chain from base to tip.
        """
        try:
            root = ElementTree.fromstring(text)
        except ElementTree.ParseError as error:
            raise RobotError(f"URDF is not valid XML: {error}") from error
        parents = {_link(joint, "child"): joint for joint in root.findall("joint")}
        path = _path(parents, tip, base)
        movable = [joint for joint in path if joint.get("type") != "fixed"]
        links = _links_at_zero(parents, _link(path[0], "parent"), movable)
        limits = np.array([_limits(joint) for joint in movable]).reshape(-1, 2)
        T_base_joint = [links[_link(joint, "child")][0] for joint in movable]
        return cls(
            joint_names=tuple(joint.get("name", "") for joint in movable),
            T_base_joint=np.array(T_base_joint).reshape(-1, 4, 4),
            axis=np.array([_axis(joint) for joint in movable]).reshape(-1, 3),
            revolute=tuple(joint.get("type") != "prismatic" for joint in movable),
            lower=limits[:, 0],
            upper=limits[:, 1],
            T_base_tip=links[tip][0],
            masses=_masses(root, links),
            name=root.get("name", "unnamed"),
            urdf=text,
            tip=tip,
        )

    @cached_property
    def screws(self) -> Screws:
        """Joint axes in base with the arm at zero."""
        axis = (self.T_base_joint[:, :3, :3] @ self.axis[:, :, None])[..., 0]
        return Screws(axis, self.T_base_joint[:, :3, 3], np.array(self.revolute, dtype=bool))

    def forward(self, q: ArrayLike) -> FloatArray:
        """Return T_base_tip of the rigid arm.

        Parameters
        ----------
        q : array_like, shape (..., joint)
            Joint positions in rad or m.

        Returns
        -------
        ndarray, shape (..., 4, 4)
        """
        q = np.asarray(q, dtype=float)
        flat = q.reshape(-1, len(self.joint_names))
        tips: FloatArray = motions(self.screws, flat)[-1] @ self.T_base_tip
        return tips.reshape(*q.shape[:-1], 4, 4)

    def jacobian(self, q: FloatArray) -> FloatArray:
        """Return velocity of the tip over its rotation, per joint velocity, in base axes.

        Parameters
        ----------
        q : ndarray, shape (batch, joint)
            Joint positions in rad or m.

        Returns
        -------
        ndarray, shape (batch, 6, joint)
        """
        total = motions(self.screws, q)
        axis, point = moved_axes(self.screws, total[:-1])
        tip = (total[-1] @ self.T_base_tip)[:, :3, 3]
        turns = self.screws.revolute[:, None, None]
        linear = np.where(turns, np.cross(axis, tip - point), axis)
        return np.concatenate([linear, np.where(turns, axis, 0.0)], axis=-1).transpose(1, 2, 0)


@brief_repr
@dataclass(frozen=True)
class InverseResult:
    """Joint positions for a batch of poses."""

    q: FloatArray
    """Shape (batch, joint), in rad or m."""
    ok: BoolArray
    """Whether each pose is reached within the tolerance, shape (batch,)."""


def solve_inverse(
    linkage: Linkage,
    T_base_tip: FloatArray,
    start: FloatArray,
    tolerance: float = 1e-11,
    locked: int = 0,
) -> InverseResult:
    """Return joint positions that bring the tip of the rigid arm to the poses.

    Levenberg's step ``J^T (J J^T + d² I)^{-1} e`` with ``d²`` proportional to ``|e|²`` (Sugihara,
    "Solvability-unconcerned inverse kinematics by the Levenberg-Marquardt method", IEEE Trans.
    Robotics 27, 2011). Limits are not looked at.

    Parameters
    ----------
    linkage : Linkage
        The arm.
    T_base_tip : ndarray, shape (batch, 4, 4)
        Poses to reach.
    start : ndarray, shape (batch, joint)
        Where to start; decides the posture that is found.
    tolerance : float
        Largest error that counts as reached, in m and rad.
    locked : int
        Number of joints, from the base on, that do not move.
    """
    q = np.array(start, dtype=float)
    error = pose_error(linkage.forward(q), T_base_tip)
    for _ in range(_MAX_ITERATIONS):
        if np.all(np.abs(error) <= tolerance):
            break
        J = linkage.jacobian(q)[:, :, locked:]
        damping = _DAMPING * np.minimum(1.0, np.sum(error**2, axis=1))
        normal = J @ J.transpose(0, 2, 1) + (damping + 1e-14)[:, None, None] * np.eye(6)
        step = (J.transpose(0, 2, 1) @ np.linalg.solve(normal, error[..., None]))[..., 0]
        largest = np.abs(step).max(axis=1, keepdims=True)
        q[:, locked:] += step * np.minimum(1.0, _MAX_STEP / np.maximum(largest, 1e-300))
        error = pose_error(linkage.forward(q), T_base_tip)
    return InverseResult(q, np.all(np.abs(error) <= tolerance, axis=1))


def pose_error(T_base_now: FloatArray, T_base_goal: FloatArray) -> FloatArray:
    """Return translation in m over rotation vector in rad from one pose to another, in base.

    Parameters
    ----------
    T_base_now, T_base_goal : ndarray, shape (batch, 4, 4)

    Returns
    -------
    ndarray, shape (batch, 6)
    """
    turn = T_base_goal[:, :3, :3] @ T_base_now[:, :3, :3].transpose(0, 2, 1)
    skew = 0.5 * np.stack(
        [
            turn[:, 2, 1] - turn[:, 1, 2],
            turn[:, 0, 2] - turn[:, 2, 0],
            turn[:, 1, 0] - turn[:, 0, 1],
        ],
        axis=1,
    )
    sine = np.linalg.norm(skew, axis=1)
    angle = np.arctan2(sine, 0.5 * (np.trace(turn, axis1=1, axis2=2) - 1.0))
    factor = np.where(sine > 1e-9, angle / np.maximum(sine, 1e-9), 1.0)
    shift = T_base_goal[:, :3, 3] - T_base_now[:, :3, 3]
    return np.concatenate([shift, factor[:, None] * skew], axis=1)


def _path(parents: dict[str, Element], tip: str, base: str | None) -> list[Element]:
    """Return the joints from base to tip, in that order."""
    path: list[Element] = []
    link = tip
    while link != base and link in parents and parents[link] not in path:
        path.append(parents[link])
        link = _link(parents[link], "parent")
    if not path or (base is not None and link != base):
        raise RobotError(f"URDF has no chain from base link {base!r} to tip link {tip!r}")
    for joint in path:
        if joint.get("type") not in (*_MOVABLE, "fixed"):
            raise RobotError(
                f"URDF joint {joint.get('name')!r} is {joint.get('type')}: the simulated arm may"
                f" have {', '.join(_MOVABLE)} and fixed joints"
            )
    return path[::-1]


def _links_at_zero(
    parents: dict[str, Element], base: str, movable: list[Element]
) -> dict[str, tuple[FloatArray, int]]:
    """Return T_base_link and the number of joints in front of every link that hangs on the base.

    All joints are at zero; those beside the chain stay there.
    """
    links = {base: (np.eye(4), 0)}
    waiting = [base]
    while waiting:
        parent = waiting.pop()
        T_base_parent, in_front = links[parent]
        for child, joint in parents.items():
            if _link(joint, "parent") == parent and child not in links:
                number = movable.index(joint) + 1 if joint in movable else in_front
                links[child] = (T_base_parent @ _origin(joint), number)
                waiting.append(child)
    return links


def _masses(root: Element, links: dict[str, tuple[FloatArray, int]]) -> tuple[PointMass, ...]:
    """Return the links that move with the chain and have a mass."""
    masses = []
    for link in root.findall("link"):
        inertial, element = link.find("inertial"), link.find("inertial/mass")
        T_base_link, joint = links.get(link.get("name", ""), (np.eye(4), 0))
        if inertial is not None and element is not None and joint > 0:
            centre = (T_base_link @ _origin(inertial))[:3, 3]
            masses.append(PointMass(joint, float(element.get("value", "0")), centre))
    return tuple(mass for mass in masses if mass.mass > 0.0)


def _link(joint: Element, role: str) -> str:
    element = joint.find(role)
    if element is None or not element.get("link"):
        raise RobotError(f"URDF joint {joint.get('name')!r} has no {role} link")
    return element.get("link", "")


def _limits(joint: Element) -> tuple[float, float]:
    limit = joint.find("limit")
    if limit is None or joint.get("type") == "continuous":
        return -np.inf, np.inf
    return float(limit.get("lower", "0")), float(limit.get("upper", "0"))


def _axis(joint: Element) -> FloatArray:
    element = joint.find("axis")
    axis = _numbers(element, "xyz", "1 0 0")
    length = float(np.linalg.norm(axis))
    if not 0.0 < length < np.inf:
        raise RobotError(f"URDF joint {joint.get('name')!r} has axis {axis}: not a direction")
    return axis / length


def _origin(owner: Element) -> FloatArray:
    """Return the transform of an ``<origin>``: roll, pitch, yaw about the fixed x, y, z."""
    element = owner.find("origin")
    (sr, sp, sy), (cr, cp, cy) = (f(_numbers(element, "rpy", "0 0 0")) for f in (np.sin, np.cos))
    about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    transform = np.eye(4)
    transform[:3, :3] = about_z @ about_y @ about_x
    transform[:3, 3] = _numbers(element, "xyz", "0 0 0")
    return transform


def _numbers(element: Element | None, key: str, default: str) -> FloatArray:
    text = default if element is None else element.get(key, default)
    return np.array([float(word) for word in text.split()])
