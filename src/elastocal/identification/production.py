"""Coverage of production by a calibration: the rule, the share, and what lies outside.

Intervals hold for postures and forces like those of the calibration. Elsewhere the arm may deviate
from the springs by an unknown amount.

A row of production is covered when some calibrated posture is near it, within `JOINT_REACH` in each
joint but the last of the wrist (A1 to A5 of a six-axis arm) and `RAIL_REACH` of every linear axis,
and its load is within the calibrated loads there (`CalibratedLoads`). Every command that states
where a model holds uses this rule.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields

import numpy as np
from scipy.spatial import cKDTree

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.identification.domain import LEVEL_REACH, CalibratedLoads, force_in_tcp
from elastocal.records import record
from elastocal.results import brief_repr
from elastocal.robot import Robot
from elastocal.wording import Phrase, counted, phrase, sentences

JOINT_REACH = float(np.radians(30.0))
"""Largest distance of a covered row from a calibrated posture in a turning joint, in rad."""
RAIL_REACH = 0.4
"""The same of a sliding joint, in m."""
_MOST_ALONE = 0.25
"""Largest share of isolated poses that is disregarded; where more are isolated, none has
neighbours, and all count."""
_OF_PRODUCTION = phrase("of production")
ENOUGH = 0.95
"""Share of production that a calibration must cover."""
_ARM = 6
"""Number of joints of an arm from which on the last one only turns the tool."""
_CHUNK = 2000


@brief_repr
@record()
class ProductionCoverage:
    """Share of production that a calibration covers."""

    rows: int
    """Rows of production."""
    covered: float
    """Share of them that are covered."""
    joints: float
    """Share with a calibrated posture within `JOINT_REACH` in every joint but the last."""
    rail: float | None
    """Share with such a posture within `RAIL_REACH` of every linear axis; None: no linear axis."""
    load: float
    """Share whose force is within the calibrated loads at those postures."""
    farthest: float
    """Largest distance of a row from its nearest posture in any of those joints, in rad."""
    farthest_joint: str
    """The joint of that distance."""
    farthest_rail: float | None
    """Largest distance of a row from its nearest posture in a linear axis, in m."""
    level: float | None
    """Largest level of a force; None where a force points in a direction without calibrated
    load."""
    direction: float
    """Largest angle of a force from the nearest calibrated one, in rad; for information only."""
    courses: tuple[str, ...]
    """Courses with rows that are not covered."""
    first: str = ""
    """First row that is not covered; empty where there is none or rows have no names."""

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
            first=self.first or other.first,
        )

    @property
    def is_enough(self) -> bool:
        """Whether the share that is covered is `ENOUGH`."""
        return self.covered >= ENOUGH

    def sentence(self, of: str = _OF_PRODUCTION) -> str:
        """Return the figures in a line, naming what lies outside.

        Parameters
        ----------
        of : str
            Which rows they are.
        """
        rows: str = sentences((counted(self.rows, "row"), of))
        if of == _OF_PRODUCTION:
            rows = phrase(
                "{number} row of production" if self.rows == 1 else "{number} rows of production",
                number=self.rows,
            )
        values = {
            "share": f"{self.covered:.0%}",
            "rows": rows,
            "angle": f"{np.degrees(JOINT_REACH):.0f}",
        }
        within = (
            phrase(
                "{share} of {rows} lie within {angle} deg in each joint but the last, and the loads"
                " of a calibrated posture",
                **values,
            )
            if self.rail is None
            else phrase(
                "{share} of {rows} lie within {angle} deg in each joint but the last, {rail} m of"
                " rail and the loads of a calibrated posture",
                **values,
                rail=f"{RAIL_REACH:g}",
            )
        )
        outside = tuple(self._outside())
        if not outside:
            return within
        parts = [within, phrase("outside: {what}", what=sentences(outside, ", "))]
        if self.courses:
            parts.append(phrase("in {courses}", courses=", ".join(self.courses)))
        if self.first:
            parts.append(phrase("first: {row}", row=self.first))
        return sentences(parts, "; ")

    def _outside(self) -> Iterator[Phrase]:
        """Yield descriptions of what lies outside, with distances."""
        if self.joints < 1.0:
            yield phrase(
                "{joint} up to {angle} deg away ({share} of rows)",
                joint=self.farthest_joint,
                angle=f"{np.degrees(self.farthest):.0f}",
                share=f"{1.0 - self.joints:.0%}",
            )
        if self.rail is not None and self.rail < 1.0:
            yield phrase(
                "rail up to {distance} m away ({share} of rows)",
                distance=f"{self.farthest_rail:.2f}",
                share=f"{1.0 - self.rail:.0%}",
            )
        if self.load < 1.0:
            share = f"{1.0 - self.load:.0%}"
            yield (
                phrase("load to a side to which nothing was pressed ({share} of rows)", share=share)
                if self.level is None
                else phrase(
                    "load up to {level} times that calibrated ({share} of rows)",
                    level=f"{self.level:.2f}",
                    share=share,
                )
            )


@brief_repr
@dataclass(frozen=True, eq=False)
class CoveredRows:
    """Rows with their distances from the calibrated postures and loads."""

    robot: Robot
    near_joints: BoolArray
    """Whether a calibrated posture is near in the turning joints, shape (row,)."""
    near: BoolArray
    """Whether one is near in the turning joints and the rail, shape (row,)."""
    gap: FloatArray
    """Distances from the nearest one joint by joint, shape (row, joint), in rad or m."""
    level: FloatArray
    """Level of the force at the near posture where it is least, or of the moment, shape (row,)."""
    direction: FloatArray
    """Angle of the force from the nearest calibrated one, shape (row,), in rad."""

    @property
    def within_load(self) -> BoolArray:
        """Whether the load is within the calibrated loads, shape (row,)."""
        return np.asarray(self.level <= LEVEL_REACH)

    @property
    def covered(self) -> BoolArray:
        """Whether posture and load are, shape (row,)."""
        return np.asarray(self.near & self.within_load)

    def figures(
        self, course: Sequence[str] = (), name: Callable[[int], str] | None = None
    ) -> ProductionCoverage:
        """Return the share of the rows that is covered.

        Parameters
        ----------
        course : sequence of str, shape (row,)
            Name of each row's course; empty: production has one.
        name : callable, optional
            Names a row for a person.
        """
        turning, sliding = _judged(self.robot)
        angles, slides, outside = self.gap[:, turning], self.gap[:, sliding], ~self.covered
        worst = np.unravel_index(int(np.argmax(angles)), angles.shape) if angles.size else (0, 0)
        largest = float(self.level.max(initial=0.0))
        return ProductionCoverage(
            rows=len(outside),
            covered=float(np.mean(~outside)),
            joints=float(np.mean(self.near_joints)),
            rail=float(np.mean(self.near)) if len(sliding) else None,
            load=float(np.mean(self.within_load)),
            farthest=float(angles[worst]) if angles.size else 0.0,
            farthest_joint=self.robot.joint_names[turning[worst[1]]] if angles.size else "",
            farthest_rail=float(slides.max()) if slides.size else None,
            level=largest if np.isfinite(largest) else None,
            direction=float(self.direction.max(initial=0.0)),
            courses=_courses_of(course, outside),
            first=name(int(np.argmax(outside))) if name and outside.any() else "",
        )


def covered_rows(
    robot: Robot,
    calibrated: CalibratedLoads,
    q: FloatArray,
    force: FloatArray,
    moment: FloatArray | None = None,
) -> CoveredRows:
    """Return which rows a calibration covers.

    Parameters
    ----------
    robot : Robot
        The robot that is calibrated, with its tool.
    calibrated : CalibratedLoads
        Its postures and loads.
    q : ndarray, shape (row, joint)
        Postures of production, in rad or m.
    force, moment : ndarray, shape (row, 3)
        Load on the robot at the tcp in base, in N and N·m.
    """
    pieces = [
        _covered_piece(robot, calibrated, q[some], force[some])
        for some in (slice(start, start + _CHUNK) for start in range(0, max(len(q), 1), _CHUNK))
    ]
    near_joints, near, gap, level, direction = (
        np.concatenate([getattr(piece, each.name) for piece in pieces])
        for each in fields(CoveredRows)[1:]
    )
    if moment is not None:
        level = np.maximum(level, calibrated.moment_levels(robot, q, moment))
    return CoveredRows(robot, near_joints, near, gap, level, direction)


def _covered_piece(
    robot: Robot, calibrated: CalibratedLoads, q: FloatArray, force: FloatArray
) -> CoveredRows:
    """Return some rows with their distances; each is compared with every posture at once."""
    turning, sliding = _judged(robot)
    angle, slide = (
        _distances(robot, joints, q, calibrated.joint_position) for joints in (turning, sliding)
    )
    apart = np.maximum(angle, slide)
    is_near = apart <= 1.0
    nearest = calibrated.joint_position[apart.argmin(axis=1)]
    force_tcp = force_in_tcp(robot, q, force)
    # Where no posture is near, all of them decide whether the load alone is outside.
    usable = is_near | ~is_near.any(axis=1, keepdims=True)
    size = np.linalg.norm(force_tcp, axis=1)
    cosine = (force_tcp @ calibrated.direction.T).max(axis=1, initial=-1.0)
    aligned = np.where(size > 1.0, cosine / np.maximum(size, 1.0), 1.0)
    return CoveredRows(
        robot,
        near_joints=np.asarray((angle <= 1.0).any(axis=1)),
        near=np.asarray(is_near.any(axis=1)),
        gap=np.stack([_gap(robot, j, q[:, j], nearest[:, j]) for j in range(q.shape[1])], axis=1),
        level=np.where(usable, calibrated.levels(force_tcp), np.inf).min(axis=1),
        direction=np.arccos(np.clip(aligned, -1.0, 1.0)),
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
    q : ndarray, shape (row, joint)
        Rows, in rad or m.
    poses : ndarray, shape (pose, joint)
        Postures.
    reaches : float
        How many times `posture_reach` they may be apart.
    """
    return np.asarray(_distances(robot, np.concatenate(_judged(robot)), q, poses) <= reaches)


def poses_in_company(robot: Robot, q: FloatArray, pose: IndexArray) -> BoolArray:
    """Return the poses by which models are compared: those near others, shape (pose,).

    Two poses within twice the reach of coverage cover all that lies between them. A pose farther
    from every other, such as one that only weighs the tool, is outside the domain of the others:
    its prediction when left out is an extrapolation, whose large error would hide the differences
    at all others.

    Parameters
    ----------
    q, pose : ndarray, shapes (reading, joint) and (reading,)
        Joint positions of readings in rad or m, and the poses that they are of.
    """
    _, first = np.unique(pose, return_index=True)
    nearest = _nearest_others(robot, q[first])
    company = np.asarray(nearest <= 2.0)
    return company if np.mean(~company) <= _MOST_ALONE else np.ones(len(first), dtype=bool)


def _nearest_others(robot: Robot, q: FloatArray) -> FloatArray:
    """Return the distance of the nearest other posture, relative to the reach, shape (pose,).

    The largest distance over the joints counts, modulo whole turns. A tree is used because ten
    thousand poses have a hundred million distances.
    """
    judged, reach = np.concatenate(_judged(robot)), posture_reach(robot)
    places, turns = q[:, judged] / reach[judged], np.array(robot.revolute)[judged]
    box = np.where(turns, 2.0 * np.pi / reach[judged], 0.0)
    places[:, turns] %= box[turns]
    # A tiny negative angle becomes the whole turn, which is outside of the tree's box.
    places[:, turns] = np.where(places[:, turns] < box[turns], places[:, turns], 0.0)
    distance, _ = cKDTree(places, boxsize=box).query(places, k=2, p=np.inf)
    return np.asarray(distance)[:, 1]


def posture_reach(robot: Robot) -> FloatArray:
    """Return the largest distance of a covered row from a posture per joint, shape (joint,).

    In rad or m; infinite for the joint that only turns the tool.
    """
    turning, sliding = _judged(robot)
    reach = np.full(len(robot.joint_names), np.inf)
    reach[turning], reach[sliding] = JOINT_REACH, RAIL_REACH
    return reach


def _judged(robot: Robot) -> tuple[IndexArray, IndexArray]:
    """Return the turning joints that are judged, and the prismatic ones."""
    revolute = np.array(robot.revolute)
    turning = np.flatnonzero(revolute)
    arm = len(revolute) - robot.external_axes
    return (turning[:-1] if arm >= _ARM and revolute[-1] else turning), np.flatnonzero(~revolute)


def _distances(robot: Robot, joints: IndexArray, q: FloatArray, poses: FloatArray) -> FloatArray:
    """Return distances relative to the reach, the largest of some joints, shape (row, pose)."""
    apart, reach = np.zeros((len(q), len(poses))), posture_reach(robot)
    # One joint at a time: rows by poses by joints are too many numbers at once.
    for joint in joints:
        gap = _gap(robot, joint, q[:, None, joint], poses[:, joint])
        np.maximum(apart, gap / reach[joint], out=apart)
    return apart


def _gap(robot: Robot, joint: int, q: FloatArray, poses: FloatArray) -> FloatArray:
    """Return distances in a joint, whole turns aside, in rad or m."""
    apart = q - poses
    if robot.revolute[joint]:
        apart -= np.round(apart / (2.0 * np.pi)) * 2.0 * np.pi
    return np.abs(apart)
