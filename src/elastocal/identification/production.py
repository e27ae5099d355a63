"""How much of production a calibration covers: one number, and what lies outside by name.

A row of production is covered when some calibrated posture is near it, within `JOINT_REACH` in each
joint but the last of the wrist (A1 to A5 of a six-axis arm) and `RAIL_REACH` of every linear axis,
and its force, in the tool's frame, is within what was pressed there. Presses held by friction never
point as far aside as a cutter's force; but deflections of small forces add up. So a force is within
the calibrated loads when the tool was pushed as hard in its directions, one by one:

    hypot(fx / Fx, fy / Fy) <= 1,   0 <= -fz / Fz <= 1,

with ``Fx`` the largest calibrated force to the side that ``fx`` points to, and so on; the larger of
the two is the *level* of the force. A side to which nothing was pushed has no level.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.identification.domain import CalibrationDomain
from elastocal.records import record
from elastocal.results import brief_repr
from elastocal.robot import Robot
from elastocal.wording import counted

JOINT_REACH = float(np.radians(30.0))
"""Largest distance of a covered row from a calibrated posture in a turning joint, in rad."""
RAIL_REACH = 0.4
"""The same of a sliding joint, in m."""
_MOST_ALONE = 0.25
"""Part of the poses that may stand alone without counting; where more do, none has neighbours to
speak of, and all count."""
LEVEL_REACH = 1.05
"""Largest level of a covered force: forces are never met exactly."""
ENOUGH = 0.95
"""Share of production that a calibration has to cover."""
_ARM = 6
"""Joints of an arm from which on the last one only turns the tool."""
_SIDES = ("+x", "-x", "+y", "-y", "press")
_LEAST = 1e-3
"""Force in N below which nothing was pushed to a side."""
_CHUNK = 2000


@brief_repr
@dataclass(frozen=True, eq=False)
class CalibratedLoads:
    """Calibrated postures, and how hard was pushed at each."""

    joint_position: FloatArray
    """Shape (pose, joint), in rad or m."""
    largest: FloatArray
    """Largest force on the robot towards +x, -x, +y, -y and -z of the tcp, (pose, 5), in N."""
    direction: FloatArray
    """Unit vectors along the forces on the robot, tcp frame, shape (load, 3)."""

    @classmethod
    def of_domain(cls, robot: Robot, domain: CalibrationDomain) -> "CalibratedLoads":
        """Return those of a calibration."""
        q = domain.joint_position
        R_base_tcp = robot.forward(q)[domain.reading_pose, :3, :3]
        force_tcp = np.einsum("rji,rj->ri", R_base_tcp, domain.force)
        return cls.of_forces(q, force_tcp, domain.reading_pose)

    @classmethod
    def of_forces(cls, q: FloatArray, force_tcp: FloatArray, pose: IndexArray) -> "CalibratedLoads":
        """Return those of readings.

        Parameters
        ----------
        q : ndarray, shape (pose, joint)
            Postures, in rad or m.
        force_tcp : ndarray, shape (reading, 3)
            Force on the robot in the tcp frame, in N.
        pose : ndarray of int, shape (reading,)
            Posture of each reading.
        """
        x, y, z = force_tcp.T
        largest = np.zeros((len(q), len(_SIDES)))
        np.maximum.at(largest, pose, np.stack([x, -x, y, -y, -z], axis=1))
        # Lateral loads may point between the axes of the tool: each is within what was pressed.
        own = _aside(_parts(_sides(force_tcp), largest[pose]))
        beyond = np.ones(len(q))
        np.maximum.at(beyond, pose, np.where(np.isfinite(own), own, 1.0))
        largest[:, :4] *= beyond[:, None]
        size = np.linalg.norm(force_tcp, axis=1, keepdims=True)
        units = (force_tcp / np.maximum(size, _LEAST))[size[:, 0] > _LEAST]
        # Readings of one load case at all poses point almost the same way: one of them will do.
        _, first = np.unique(np.round(units, 1), axis=0, return_index=True)
        return cls(q, largest, units[first])

    def levels(self, force_tcp: FloatArray) -> FloatArray:
        """Return the level of forces at each posture, shape (row, pose).

        Parameters
        ----------
        force_tcp : ndarray, shape (row, 3)
            Force on the robot in the tcp frame, in N.
        """
        part = _parts(_sides(force_tcp)[:, None], self.largest)
        pull = np.maximum(force_tcp[:, 2:3], 0.0) / np.maximum(self.largest[:, 4], _LEAST)
        pulls = np.where(pull > LEVEL_REACH - 1.0, np.inf, 0.0)
        return np.asarray(np.maximum(np.maximum(_aside(part), part[..., 4]), pulls))


def _parts(pushed: FloatArray, largest: FloatArray) -> FloatArray:
    """Return forces to each side in parts of the largest there; infinite where nothing was."""
    with np.errstate(divide="ignore", invalid="ignore"):
        part = pushed / np.where(largest > _LEAST, largest, 0.0)
    return np.where(pushed > _LEAST, part, 0.0)


def _aside(part: FloatArray) -> FloatArray:
    """Return the level of the lateral forces, shape (...), of their parts (..., 5)."""
    return np.asarray(np.hypot(part[..., :2].max(axis=-1), part[..., 2:4].max(axis=-1)))


def _sides(force_tcp: FloatArray) -> FloatArray:
    """Return the part of forces towards each of `_SIDES`, shape (row, 5), in N."""
    x, y, z = force_tcp.T
    return np.asarray(np.maximum(np.stack([x, -x, y, -y, -z], axis=1), 0.0))


@brief_repr
@record()
class ProductionCoverage:
    """How much of production a calibration covers."""

    rows: int
    """Rows of production."""
    covered: float
    """Share of them that are covered."""
    joints: float
    """Share with a calibrated posture within `JOINT_REACH` in every joint but the last."""
    rail: float | None
    """Share with such a posture within `RAIL_REACH` of every linear axis; None: there is none."""
    load: float
    """Share whose force is within what was pressed at those postures."""
    farthest: float
    """Largest distance of a row from its nearest posture in any of those joints, in rad."""
    farthest_joint: str
    """The joint of that distance."""
    farthest_rail: float | None
    """Largest distance of a row from its nearest posture in a linear axis, in m."""
    level: float | None
    """Largest level of a force; None where one points where nothing was pushed."""
    direction: float
    """Largest angle of a force from the nearest calibrated one, in rad; it says how far from the
    presses production pushes, and refuses nothing."""
    courses: tuple[str, ...]
    """Courses with rows that are not covered."""

    def plus(self, other: "ProductionCoverage") -> "ProductionCoverage":
        """Return the coverage of these rows and others."""
        own, rows = self.rows / (self.rows + other.rows), self.rows + other.rows

        def mean(name: str) -> float:
            return float(own * getattr(self, name) + (1.0 - own) * getattr(other, name))

        farthest = max(self, other, key=lambda each: each.farthest)
        is_known = self.level is not None and other.level is not None
        return ProductionCoverage(
            rows=rows,
            covered=mean("covered"),
            joints=mean("joints"),
            rail=None if self.rail is None else mean("rail"),
            load=mean("load"),
            farthest=farthest.farthest,
            farthest_joint=farthest.farthest_joint,
            farthest_rail=None
            if self.farthest_rail is None
            else max(self.farthest_rail, other.farthest_rail or 0.0),
            level=max(self.level or 0.0, other.level or 0.0) if is_known else None,
            direction=max(self.direction, other.direction),
            courses=tuple(dict.fromkeys((*self.courses, *other.courses))),
        )

    @property
    def is_enough(self) -> bool:
        """Whether the share that is covered is `ENOUGH`."""
        return self.covered >= ENOUGH

    def sentence(self) -> str:
        """Return the figures in a line, with what lies outside by name."""
        within = (
            f"{self.covered:.0%} of {counted(self.rows, 'row')} of production lie within"
            f" {np.degrees(JOINT_REACH):.0f} deg in each joint,"
            f"{'' if self.rail is None else f' {RAIL_REACH:g} m of rail'} and the loads of a"
            " calibrated posture"
        )
        outside = [
            f"{self.farthest_joint} up to {np.degrees(self.farthest):.0f} deg away"
            f" ({1.0 - self.joints:.0%} of rows)"
            if self.joints < 1.0
            else "",
            f"rail up to {self.farthest_rail:.2f} m away ({1.0 - self.rail:.0%} of rows)"
            if self.rail is not None and self.rail < 1.0
            else "",
            f"load {self._level} ({1.0 - self.load:.0%} of rows)" if self.load < 1.0 else "",
        ]
        parts = [each for each in outside if each]
        if not parts:
            return within
        named = f"; in {', '.join(self.courses)}" if self.courses else ""
        return f"{within}; outside: {', '.join(parts)}{named}"

    @property
    def _level(self) -> str:
        if self.level is None:
            return "to a side to which nothing was pressed"
        return f"up to {self.level:.2f} times that calibrated"


def production_coverage(
    robot: Robot,
    calibrated: CalibratedLoads,
    q: FloatArray,
    force: FloatArray,
    course: Sequence[str] = (),
) -> ProductionCoverage:
    """Return how much of production a calibration covers.

    Parameters
    ----------
    robot : Robot
        The robot that is calibrated, with its tool.
    calibrated : CalibratedLoads
        Where it is, and how hard was pushed there.
    q : ndarray, shape (row, joint)
        Postures of production, in rad or m.
    force : ndarray, shape (row, 3)
        Force on the robot at the tcp in base, in N.
    course : sequence of str, shape (row,)
        Name of each row's course; empty: production has one.
    """
    starts = range(0, len(q), _CHUNK)
    parts = [
        _Distances.of(robot, calibrated, q[start : start + _CHUNK], force[start : start + _CHUNK])
        for start in starts
    ]
    near, nearest, level, direction = (
        np.concatenate([getattr(part, name) for part in parts])
        for name in ("near", "nearest", "level", "direction")
    )
    turning, sliding = _judged(robot)
    gap = _gaps(robot, q, calibrated.joint_position[nearest])
    angles, slides = gap[:, turning], gap[:, sliding]
    worst = np.unravel_index(int(np.argmax(angles)), angles.shape) if angles.size else (0, 0)
    largest = float(level.max(initial=0.0))
    outside = ~(near.all(axis=1) & (level <= LEVEL_REACH))
    return ProductionCoverage(
        rows=len(q),
        covered=float(np.mean(~outside)),
        joints=float(np.mean(near[:, 0])),
        rail=float(np.mean(near[:, 1])) if len(sliding) else None,
        load=float(np.mean(level <= LEVEL_REACH)),
        farthest=float(angles[worst]) if angles.size else 0.0,
        farthest_joint=robot.joint_names[turning[worst[1]]] if angles.size else "",
        farthest_rail=float(slides.max()) if slides.size else None,
        level=largest if np.isfinite(largest) else None,
        direction=float(direction.max(initial=0.0)),
        courses=_courses_of(course, outside),
    )


def _courses_of(course: Sequence[str], rows: BoolArray) -> tuple[str, ...]:
    """Return the names of the courses of some rows, in their order, each once."""
    return tuple(dict.fromkeys(np.array(course, dtype=str)[rows].tolist())) if course else ()


def near_postures(
    robot: Robot, q: FloatArray, poses: FloatArray, reaches: float = 1.0
) -> BoolArray:
    """Return whether postures cover rows of production by their joints, shape (row, pose).

    Parameters
    ----------
    robot : Robot
        The robot.
    q, poses : ndarray, shapes (row, joint) and (pose, joint)
        Rows and postures, in rad or m.
    reaches : float
        How many times `posture_reach` they may be apart.
    """
    near = np.ones((len(q), len(poses)), dtype=bool)
    for joint, reach in enumerate(posture_reach(robot)):
        apart = q[:, None, joint] - poses[:, joint]
        if robot.revolute[joint]:
            apart -= np.round(apart / (2.0 * np.pi)) * 2.0 * np.pi
        near &= np.abs(apart) <= reaches * reach
    return near


def poses_in_company(robot: Robot, q: FloatArray, pose: IndexArray) -> BoolArray:
    """Return the poses by which models are compared, those not far from all others, shape (pose,).

    Two poses within twice the reach of coverage cover all that lies between them. A pose farther
    from every other, such as one that only weighs the tool, is no part of what the others cover:
    what a model makes of it when it is left out is an extrapolation, and its large error would hide
    the differences at all others.

    Parameters
    ----------
    robot : Robot
        The robot.
    q, pose : ndarray, shapes (reading, joint) and (reading,)
        Joint positions of readings in rad or m, and the poses that they are of.
    """
    _, first = np.unique(pose, return_index=True)
    near = near_postures(robot, q[first], q[first], 2.0)
    np.fill_diagonal(near, False)
    company = np.asarray(near.any(axis=1))
    return company if np.mean(~company) <= _MOST_ALONE else np.ones(len(first), dtype=bool)


def posture_reach(robot: Robot) -> FloatArray:
    """Return how far a covered row may be from a posture in each joint, shape (joint,).

    In rad or m; infinite for the joint that only turns the tool.
    """
    turning, sliding = _judged(robot)
    reach = np.full(len(robot.joint_names), np.inf)
    reach[turning], reach[sliding] = JOINT_REACH, RAIL_REACH
    return reach


def _judged(robot: Robot) -> tuple[IndexArray, IndexArray]:
    """Return the turning joints that are judged, and the sliding ones."""
    revolute = np.array(robot.revolute)
    turning = np.flatnonzero(revolute)
    arm = len(revolute) - robot.external_axes
    return (turning[:-1] if arm >= _ARM and revolute[-1] else turning), np.flatnonzero(~revolute)


def _gaps(robot: Robot, q: FloatArray, poses: FloatArray) -> FloatArray:
    """Return distances joint by joint, whole turns aside, in rad or m."""
    apart = q - poses
    turns = np.round(apart / (2.0 * np.pi)) * 2.0 * np.pi
    return np.asarray(np.abs(apart - np.where(robot.revolute, turns, 0.0)))


@dataclass(frozen=True, eq=False)
class _Distances:
    """Distances of some rows of production from their calibrated postures."""

    near: BoolArray
    """Whether a posture is near in the joints, and one in joints and rail, shape (row, 2)."""
    nearest: IndexArray
    """Nearest posture, shape (row,)."""
    level: FloatArray
    """Level of the force at the near posture where it is least, shape (row,)."""
    direction: FloatArray
    """Angle of the force from the nearest calibrated one, shape (row,), in rad."""

    @classmethod
    def of(
        cls, robot: Robot, calibrated: CalibratedLoads, q: FloatArray, force: FloatArray
    ) -> "_Distances":
        turning, sliding = _judged(robot)
        gap = _gaps(robot, q[:, None], calibrated.joint_position)
        angle = gap[..., turning].max(axis=-1, initial=0.0) / JOINT_REACH
        slide = gap[..., sliding].max(axis=-1, initial=0.0) / RAIL_REACH
        apart = np.maximum(angle, slide)
        is_near = apart <= 1.0
        force_tcp = np.einsum("rji,rj->ri", robot.forward(q)[:, :3, :3], force)
        level = calibrated.levels(force_tcp)
        # Where no posture is near, those of all tell whether the load alone is at fault.
        usable = is_near | ~is_near.any(axis=1, keepdims=True)
        size = np.linalg.norm(force_tcp, axis=1)
        cosine = (force_tcp @ calibrated.direction.T).max(axis=1, initial=-1.0)
        aligned = np.where(size > 1.0, cosine / np.maximum(size, 1.0), 1.0)
        return cls(
            np.stack([(angle <= 1.0).any(axis=1), is_near.any(axis=1)], axis=1),
            np.asarray(apart.argmin(axis=1), dtype=np.intp),
            np.where(usable, level, np.inf).min(axis=1),
            np.arccos(np.clip(aligned, -1.0, 1.0)),
        )
