"""Plan: where two arms can press on each other, tip to tip, and which of these meetings are made.

A meeting is a pose of the first tcp; the second tcp is at the same point and looks the other way,
with a turn about the common normal that is free. Both arms have several postures there; one pair of
them that passes every check is taken at random, so that the pool has all kinds. Checks: joint
limits with a margin, distance to singularities, static torque of gravity, tool and press, and the
distance of the two arms from each other. The choice among what is left is that of a search
technique of `elastocal.planning.search` on the rows of both arms.
"""

import itertools
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import BoolArray, FloatArray
from elastocal.blocks import Block, Facts, PoseButton, Table
from elastocal.elastic import ElasticModel, bearing
from elastocal.errors import PlanningError
from elastocal.planning.search import Candidates, technique
from elastocal.records import record
from elastocal.results import Result, brief_repr
from elastocal.robot import Robot, T_from_xyzabc, inverse_transform, smallest_singular_value
from elastocal.robot.inverse import inverse_for
from elastocal.two_robots.cell import PairCell, PairLimits
from elastocal.two_robots.presses import relative_blocks
from elastocal.wording import phrase, phrases

_SAMPLES = 8
"""Points on each line between two joints by which the distance of the arms is measured."""
_TRIES = 4
"""Pairs of postures that are tried at a meeting."""
_FACING = np.diag([1.0, -1.0, -1.0, 1.0])
"""A tip that points against another one."""


@brief_repr
@record()
class Meeting:
    """A place where both arms press on each other."""

    id: int
    """Pose number, in visiting order."""
    first: tuple[float, ...]
    """Joints of the first arm, in rad or m."""
    second: tuple[float, ...]
    """Joints of the second arm."""
    point: tuple[float, float, float]
    """Where the tips meet, in the first base, in m."""
    normal: tuple[float, float, float]
    """Direction from the first arm to the second."""


@record("elastocal.pair-plan/1", eq=False, sealed=True)
class PairPlan(Result):
    """Meetings of two arms, in visiting order."""

    cell: str
    arms: tuple[str, str]
    joints: tuple[tuple[str, ...], tuple[str, ...]]
    """Names of the joints of each arm."""
    base_transform: FloatArray
    """Base of the second robot in that of the first, shape (4, 4)."""
    meetings: tuple[Meeting, ...]
    technique: str
    tried: int
    """Places that were tried."""
    passed: int
    """Places that both arms reach with every margin."""
    refused: Mapping[str, int]
    """Places that were refused, by the first check that refused them."""

    def q(self) -> tuple[FloatArray, FloatArray]:
        """Return the joints of both arms, shape (pose, joint), in rad or m."""
        first = np.array([each.first for each in self.meetings])
        return first, np.array([each.second for each in self.meetings])

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return what was tried, and what was chosen."""
        return (
            (phrase("Cell"), self.cell),
            (phrase("Arms"), ", ".join(self.arms)),
            (phrase("Places tried"), str(self.tried)),
            (phrase("Places that both arms reach"), str(self.passed)),
            (phrase("Meetings chosen"), str(len(self.meetings))),
            (phrase("Search technique"), self.technique),
        )

    def show(self) -> Iterable[Block]:
        """Return what was tried, and each meeting."""
        yield Facts(self.facts())
        if self.refused:
            yield Table(
                phrase("Places refused, by the first check that refused them"),
                phrases("Check", "Places"),
                tuple((phrase(name), count) for name, count in self.refused.items()),
            )
        yield Table(
            phrase("Meetings, in the base of the first robot"),
            phrases("Pose", "x [mm]", "y [mm]", "z [mm]", "Normal"),
            tuple(
                (
                    PoseButton(each.id),
                    *(f"{1e3 * value:.0f}" for value in each.point),
                    " ".join(f"{value:.2f}" for value in each.normal),
                )
                for each in self.meetings
            ),
            name="pose-table",
        )


REASONS = phrases(
    "out of reach of one arm", "joint limits", "singularity", "static torque", "arms too near"
)
"""Checks in the order in which they judge."""


@brief_repr
@dataclass(frozen=True, eq=False)
class Pool:
    """Meetings that pass every check."""

    q: tuple[FloatArray, FloatArray]
    """Joints of each arm, shape (meeting, joint), in rad or m."""
    T: FloatArray
    """First tcp in the first base, shape (meeting, 4, 4)."""
    refused: Mapping[str, int]


def plan_meetings(cell: PairCell) -> PairPlan:
    """Return the meetings that a campaign of two arms makes.

    Parameters
    ----------
    cell : PairCell
        Both arms, the volume in which they meet, presses and limits.

    Raises
    ------
    PlanningError
        If the arms meet at too few places, with the check that refused most.
    """
    search = cell.file.search
    rng = np.random.default_rng(search.seed)
    pool = meeting_pool(cell, rng)
    passed = len(pool.T)
    if not passed >= search.poses:
        most = max(pool.refused, key=lambda name: pool.refused[name])
        raise PlanningError(
            f"{cell.arms[0]!r} and {cell.arms[1]!r} can press on each other at {passed} of"
            f" {search.candidates} places, and {search.poses} are needed: most were refused by"
            f" {most!r}; is base_transform right, and volume between the arms?"
        )
    candidates = Candidates(pool.T[:, :3, 3], observation_rows(cell, pool))
    order = technique(search.technique).search(candidates, search.poses, rng).order
    order = _visiting_order(pool.q[0][order], order)
    meetings = tuple(
        _meeting(number, pool.q[0][k], pool.q[1][k], pool.T[k])
        for number, k in enumerate(order.tolist())
    )
    names = cell.robots[0].joint_names, cell.robots[1].joint_names
    return PairPlan(
        cell=cell.name,
        arms=cell.arms,
        joints=(tuple(names[0]), tuple(names[1])),
        base_transform=cell.T_first_second,
        meetings=meetings,
        technique=search.technique,
        tried=search.candidates,
        passed=passed,
        refused=pool.refused,
    )


def _meeting(number: int, q_1: FloatArray, q_2: FloatArray, T: FloatArray) -> Meeting:
    (x, y, z), (u, v, w) = T[:3, 3].tolist(), T[:3, 2].tolist()
    return Meeting(number, tuple(q_1.tolist()), tuple(q_2.tolist()), (x, y, z), (u, v, w))


def _visiting_order(q: FloatArray, order: np.ndarray) -> np.ndarray:
    """Return the meetings so that each is near the one before, by the largest move of a joint."""
    left, way = list(range(1, len(order))), [0]
    while left:
        moves = np.abs(q[left] - q[way[-1]]).max(axis=1)
        way.append(left.pop(int(np.argmin(moves))))
    return order[way]


def meeting_pool(cell: PairCell, rng: np.random.Generator) -> Pool:
    """Return the meetings that pass every check, of as many places as the cell has tried."""
    count = cell.file.search.candidates
    T = _places(cell, count, rng)
    spin = rng.uniform(-np.pi, np.pi, count)
    turned = T @ T_from_xyzabc(0, 0, 0, spin, 0, 0) @ _FACING
    poses = T, inverse_transform(cell.T_first_second) @ turned
    found = [
        inverse_for(robot).solve_many(own) for robot, own in zip(cell.robots, poses, strict=True)
    ]
    refused: Counter[str] = Counter()
    chosen: list[tuple[int, FloatArray, FloatArray]] = []
    force = np.stack(list(cell.file.presses.cases.values()))
    judge = _Judge(cell.robots, cell.T_first_second, cell.file.limits, force, _masses(cell))
    for k in range(count):
        branches = [each.q[k][each.exists[k]] for each in found]
        if not all(map(len, branches)):
            refused[REASONS[0]] += 1
            continue
        picks = [rng.integers(len(own), size=_TRIES) for own in branches]
        pairs = branches[0][picks[0]], branches[1][picks[1]]
        level = judge.first_failure(*pairs, T[k])
        best = int(np.argmax(level))
        if level[best] == len(REASONS):
            chosen.append((k, pairs[0][best], pairs[1][best]))
        else:
            refused[REASONS[level[best]]] += 1
    index = [k for k, _, _ in chosen]
    joints = [len(robot.joint_names) for robot in cell.robots]
    q_1 = np.array([q for _, q, _ in chosen]).reshape(-1, joints[0])
    q_2 = np.array([q for _, _, q in chosen]).reshape(-1, joints[1])
    counts = {str(name): refused[name] for name in REASONS if refused[name]}
    return Pool((q_1, q_2), T[index], counts)


def _masses(cell: PairCell) -> tuple[float, float]:
    first, second = cell.file.robots
    return first.tool_mass, second.tool_mass


def _places(cell: PairCell, count: int, rng: np.random.Generator) -> FloatArray:
    """Return random first tcps in the volume, z within 70 degrees of the way to the other base."""
    volume = cell.file.volume
    T = np.tile(np.eye(4), (count, 1, 1))
    size = np.array(volume.size)
    T[:, :3, 3] = np.array(volume.centre) + size * rng.uniform(-0.5, 0.5, (count, 3))
    towards = cell.T_first_second[:3, 3] / np.linalg.norm(cell.T_first_second[:3, 3])
    z = towards + 0.9 * rng.standard_normal((count, 3))
    z /= np.linalg.norm(z, axis=1, keepdims=True)
    x = np.cross(z, rng.standard_normal((count, 3)))
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    T[:, :3, :3] = np.stack([x, np.cross(z, x), z], axis=2)
    return T


@dataclass(frozen=True, eq=False)
class _Judge:
    """The checks of pairs of postures at a meeting."""

    robots: tuple[Robot, Robot]
    T_first_second: FloatArray
    limits: PairLimits
    force: FloatArray
    """Loads on the first robot in its tcp frame, shape (case, 3), in N."""
    masses: tuple[float, float]

    def first_failure(self, q_1: FloatArray, q_2: FloatArray, T: FloatArray) -> np.ndarray:
        """Return the number of the check that refuses each pair, or that of all checks.

        Parameters
        ----------
        q_1, q_2 : ndarray, shape (pair, joint)
            Joints of each arm.
        T : ndarray, shape (4, 4)
            First tcp in the first base.
        """
        loads = self.force @ T[:3, :3].T
        others = -loads @ self.T_first_second[:3, :3]
        both = tuple(zip(self.robots, (q_1, q_2), (loads, others), self.masses, strict=True))
        passes = [
            np.all([self._within(robot, q) for robot, q, _, _ in both], axis=0),
            np.all([self._regular(robot, q) for robot, q, _, _ in both], axis=0),
            np.all([self._carries(*each) for each in both], axis=0),
            self._clear(q_1, q_2),
        ]
        failed = ~np.array([*passes, np.zeros(len(q_1), dtype=bool)])
        return np.asarray(1 + np.argmax(failed, axis=0))

    def _within(self, robot: Robot, q: FloatArray) -> BoolArray:
        own = np.where(robot.revolute, self.limits.joint_margin, 0.0)
        return np.asarray(np.all(robot.limits.margin(q) >= own, axis=-1))

    def _regular(self, robot: Robot, q: FloatArray) -> BoolArray:
        return np.asarray(smallest_singular_value(robot, q) >= self.limits.singular_value)

    def _carries(self, robot: Robot, q: FloatArray, loads: FloatArray, mass: float) -> BoolArray:
        """Return whether gravity, tool and every press stay within the static torques."""
        most = self.limits.torque * np.array(robot.limits.effort)
        J = robot.jacobian(q).translation
        weight = mass * np.array(robot.gravity)
        held = robot.gravity_torques(q) if robot.has_masses else np.zeros_like(q)
        # The motors hold the arm against what pulls it down, and against the load.
        torque = held[:, None] - np.einsum("pij,ci->pcj", J, loads + weight)
        known = np.isfinite(most)
        return np.asarray(np.all(np.abs(torque)[..., known] <= most[known], axis=(1, 2)))

    def _clear(self, q_1: FloatArray, q_2: FloatArray) -> BoolArray:
        """Return whether the lines through the joints of both arms keep their distance."""
        first = skeleton(self.robots[0], q_1)
        second = skeleton(self.robots[1], q_2)
        second = second @ self.T_first_second[:3, :3].T + self.T_first_second[:3, 3]
        apart = np.linalg.norm(first[:, :, None] - second[:, None], axis=3)
        return np.asarray(apart.min(axis=(1, 2)) >= self.limits.clearance)


def skeleton(robot: Robot, q: FloatArray) -> FloatArray:
    """Return points on the lines through the joints up to the wrist, (posture, point, 3), in m.

    In the robot's base: from the base to the origin of the last joint but one.
    """
    origins = [np.zeros((len(q), 3)), *robot.joint_points(q).swapaxes(0, 1)[:-1]]
    along = np.linspace(0.0, 1.0, _SAMPLES)[None, :, None]
    lines = itertools.pairwise(origins)
    return np.concatenate([a[:, None] + along * (b - a)[:, None] for a, b in lines], axis=1)


def observation_rows(cell: PairCell, pool: Pool) -> FloatArray:
    """Return ``[O_1(q_1, f), -R O_2(q_2, -R' f)]`` of all load cases, (meeting, row, parameter).

    With springs at the bearings of both arms.
    """
    first, second = (ElasticModel(robot, bearing(robot)) for robot in cell.robots)
    R, axes = cell.T_first_second[:3, :3], pool.T[:, :3, :3]
    loads = cell.file.presses.cases.values()
    rows = [relative_blocks((first, second), R, pool.q, axes @ load) for load in loads]
    return np.concatenate(rows, axis=1)
