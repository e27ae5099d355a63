"""Presses of two arms on each other: readings of both that belong together, and their rows.

Both controllers hold; one tool presses the other. With the force ``f`` on the first robot at its
tcp, the second one feels ``-f``. In the first robot's base, with ``R`` the turn of the second base
in it, the two tcps move by

    p_1 = dp_1 + O_1(q_1, f) c_1,        p_2 = R dp_2 + R O_2(q_2, -R' f) c_2,

with the displacements ``dp`` that the controllers say. What a measurement between the tools sees of
their relative displacement ``m = p_1 - p_2`` is zero for rigid tips that hold each other, and

    m = -(n n' / k_n + (I - n n') / k_s) f

for tips that give way. So each press is three rows for the springs of both arms,

    m - (dp_1 - R dp_2) = [O_1(q_1, f)   -R O_2(q_2, -R' f)] [c_1; c_2],

where ``O`` counts from the light contact as in `elastocal.identification.displacement_blocks`. The
contact is a known or fitted compliance as in a calibration without a tracker.

A spring that turns either base about the line that joins both bases has the same column in both
arms: the torque of the force about that line is the same but for its sign, and so is the turn. Only
the sum of the two is seen, however many presses are made.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from elastocal.arrays import BoolArray, FloatArray
from elastocal.dataset import Readings, excluded_rows
from elastocal.elastic import ElasticModel, Parameter, Spring
from elastocal.errors import ConventionError, DatasetError, IdentificationError
from elastocal.identification import (
    Contact,
    Problem,
    contact_columns,
    contact_visibility_of,
    displacement_blocks,
    is_pressed_sideways,
    pose_blocks,
    relative_sizes,
    require_seen,
)
from elastocal.results import brief_repr
from elastocal.robot import Robot

_OPPOSED = 0.1
"""Part of a force by which the two sensors may disagree, as the median over the presses."""
_EQUAL = 0.5
"""The same with the second force turned round, below which the sign is taken to be turned."""
_MEET = 0.05
"""Largest distance of the tcps at a press in m: bases that are known to some millimetres."""
_FACING = -0.94
"""Largest cosine between the z axes of both tcps: they face each other within 20 degrees."""


@brief_repr
@dataclass(frozen=True, eq=False)
class PairReadings:
    """Presses that both arms recorded; row by row they belong together."""

    names: tuple[str, str]
    robots: tuple[Robot, Robot]
    first: Readings
    """Of the first robot, in its base."""
    second: Readings
    """Of the second robot, in its own base."""
    T_first_second: FloatArray
    """Base of the second robot in that of the first, shape (4, 4)."""
    unmatched: int = 0
    """Readings of either arm whose press the other did not record."""
    excluded: tuple[str, ...] = ()
    """Presses that were left out by name, each ``POSE:LOAD_CASE``."""

    def __len__(self) -> int:
        """Return the number of presses."""
        return len(self.first)

    @property
    def R(self) -> FloatArray:
        """Turn of the second base in the first, shape (3, 3)."""
        return self.T_first_second[:3, :3]

    @property
    def tracked(self) -> bool:
        """Whether a tracker measured both tools; else the contact holds them."""
        return self.first.contacts is None and self.second.contacts is None

    @property
    def relative(self) -> FloatArray:
        """Relative displacement of the tcps less what the controllers say, (press, 3), in m.

        In the first base: ``m - (dp_1 - R dp_2)``, with ``m`` zero where the contact holds.
        """
        own, other = self.first, self.second
        if self.tracked:
            return np.asarray(own.deflection - other.deflection @ self.R.T)
        return np.asarray(other.controller_displacement @ self.R.T - own.controller_displacement)

    def set_aside(self, index: BoolArray) -> "PairReadings":
        """Return the presses without some, of both arms (`elastocal.dataset.Readings.set_aside`).

        Parameters
        ----------
        index : ndarray of bool, shape (press,)
            Those to set aside.
        """
        first, second = self.first.set_aside(index), self.second.set_aside(index)
        return replace(self, first=first, second=second)

    def without(self, excluded: str | Sequence[str]) -> "PairReadings":
        """Return the presses without those named (`elastocal.dataset.without`), of both arms."""
        rows = excluded_rows(self.first, excluded)
        names = (*self.excluded, *map(self.name, np.flatnonzero(rows).tolist()))
        return replace(self.set_aside(rows), excluded=names)

    def name(self, row: int) -> str:
        """Return the name by which a press is left out, ``POSE:LOAD_CASE``."""
        return f"{self.first.pose[row]}:{self.first.load_case[row]}"


def pair_readings(
    names: tuple[str, str],
    robots: tuple[Robot, Robot],
    readings: tuple[Readings, Readings],
    T_first_second: FloatArray,
    exclude: str | Sequence[str] = (),
) -> PairReadings:
    """Return the presses that both arms recorded, if they belong together.

    Parameters
    ----------
    names : tuple of str
        Names of the arms.
    robots : tuple of Robot
        Each to its tcp.
    readings : tuple of Readings
        Of each arm in its own base; pose and load case name the press.
    T_first_second : ndarray, shape (4, 4)
        Base of the second robot in that of the first.
    exclude : str or sequence of str
        Presses to leave out, each ``POSE`` or ``POSE:LOAD_CASE``.

    Raises
    ------
    DatasetError
        If no press is in both, a name to exclude is of none, or one arm was tracked and the other
        was not.
    ConventionError
        If the frame is mirrored, the tools do not meet or face each other, or the forces are not
        opposite.
    """
    _require_rotation(T_first_second)
    keys = [
        list(zip(each.pose.tolist(), each.load_case.tolist(), strict=True)) for each in readings
    ]
    places = [{key: row for row, key in enumerate(own)} for own in keys]
    common = [key for key in keys[0] if key in places[1]]
    if not common:
        raise DatasetError(
            f"no press is in the readings of both {names[0]!r} and {names[1]!r}: pose and load"
            " case must be the same in both"
        )
    first, second = (
        each.take([own[key] for key in common]) for each, own in zip(readings, places, strict=True)
    )
    if (first.contacts is None) != (second.contacts is None):
        tracked = names[0] if first.contacts is None else names[1]
        raise DatasetError(
            f"marker_displacement is in the readings of {tracked!r} alone: a tracker must measure"
            " both tools, or neither"
        )
    unmatched = sum(map(len, keys)) - 2 * len(common)
    found = PairReadings(names, robots, first, second, T_first_second, unmatched).without(exclude)
    _require_meeting(found)
    labels = [f"pose {pose}" for pose in found.first.pose.tolist()]
    require_opposed(names, found.first.force, found.second.force @ found.R.T, labels)
    return found


def _require_rotation(T: FloatArray) -> None:
    R = T[:3, :3]
    if not np.allclose(R.T @ R, np.eye(3), atol=1e-6):
        raise ConventionError("the base transform is no rigid motion: its axes are not orthonormal")
    if not np.linalg.det(R) > 0.0:
        raise ConventionError(
            "the base transform is mirrored (its determinant is -1): a left-handed frame is none"
        )


def _require_meeting(pair: PairReadings) -> None:
    """Refuse tools that are not where they could press on each other."""
    T_1 = pair.robots[0].forward(pair.first.joint_position)
    T_2 = pair.T_first_second @ pair.robots[1].forward(pair.second.joint_position)
    apart = np.linalg.norm(T_1[:, :3, 3] - T_2[:, :3, 3], axis=1)
    worst = int(np.argmax(apart))
    if not apart[worst] <= _MEET:
        raise ConventionError(
            f"at pose {pair.first.pose[worst]} the tips of {pair.names[0]!r} and"
            f" {pair.names[1]!r} are {1e3 * apart[worst]:.0f} mm apart, and {1e3 * _MEET:.0f} mm is"
            " the most: is base_transform the second base in the first, and not the other way"
            " round or mirrored?"
        )
    facing = np.einsum("ri,ri->r", T_1[:, :3, 2], T_2[:, :3, 2])
    worst = int(np.argmax(facing))
    if not facing[worst] <= _FACING:
        raise ConventionError(
            f"at pose {pair.first.pose[worst]} the tools do not face each other: their z axes make"
            f" {np.degrees(np.arccos(np.clip(facing[worst], -1.0, 1.0))):.0f} deg, not 180"
        )


def require_opposed(
    names: tuple[str, str], first: FloatArray, second: FloatArray, labels: Sequence[str]
) -> None:
    """Refuse forces that are not opposite, by what they would be with the other sign.

    Parameters
    ----------
    names : tuple of str
        Names of the arms.
    first, second : ndarray, shape (row, 3)
        Force on each robot, both in the first base, in N.
    labels : sequence of str
        Names of the rows.

    Raises
    ------
    ConventionError
        If their median sum is more than a tenth of either.
    DatasetError
        If a row has no force.
    """
    size = np.linalg.norm(first, axis=1)
    if not np.all(size > 0.0):
        raise DatasetError(f"{labels[int(np.argmin(size))]}: the force on {names[0]!r} is zero")
    opposed = float(np.median(np.linalg.norm(first + second, axis=1) / size))
    equal = float(np.median(np.linalg.norm(first - second, axis=1) / size))
    if opposed <= _OPPOSED:
        return
    if equal <= _EQUAL:
        raise ConventionError(
            f"the forces on {names[0]!r} and {names[1]!r} have equal sign: each must be the force"
            " on its own robot, so that they are opposite"
        )
    raise ConventionError(
        f"the forces on {names[0]!r} and {names[1]!r} are not opposite: their sum is"
        f" {opposed:.0%} of either, and {_OPPOSED:.0%} is the most; is each in the base of its own"
        " robot, without the weight of the tool?"
    )


@brief_repr
@dataclass(frozen=True, eq=False)
class PairModel:
    """The elastic models of both arms, and their springs under names of their own."""

    names: tuple[str, str]
    models: tuple[ElasticModel, ElasticModel]

    @property
    def springs(self) -> tuple[Spring, ...]:
        """Springs of both arms, ``ARM:joint.axis``; those of the first come first."""
        return tuple(
            replace(spring, name=f"{name}:{spring.name}", joint=f"{name}:{spring.joint}")
            for name, model in zip(self.names, self.models, strict=True)
            for spring in model.springs
        )

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters of both arms, in the order of the columns."""
        return tuple(each for spring in self.springs for each in spring.parameters)

    def columns(self, arm: int) -> slice:
        """Return the columns of an arm."""
        count = len(self.models[0].parameters)
        return slice(0, count) if arm == 0 else slice(count, len(self.parameters))


def relative_blocks(
    models: tuple[ElasticModel, ElasticModel],
    R: FloatArray,
    q: tuple[FloatArray, FloatArray],
    force: FloatArray,
) -> FloatArray:
    """Return ``[O_1(q_1, f), -R O_2(q_2, -R' f)]`` against the unloaded arms at the same joints.

    Parameters
    ----------
    models : tuple of ElasticModel
        Of both arms.
    R : ndarray, shape (3, 3)
        Turn of the second base in the first.
    q : tuple of ndarray, shape (row, joint)
        Joints of each arm, in rad or m.
    force : ndarray, shape (row, 3)
        Force on the first robot in its base, in N.

    Returns
    -------
    ndarray, shape (row, 3, parameter)
        Those of the first arm come first.
    """
    first = models[0].observation_blocks(q[0], force)
    second = models[1].observation_blocks(q[1], -force @ R)
    return np.concatenate([first, -np.einsum("ij,rjn->rin", R, second)], axis=2)


def pair_blocks(model: PairModel, pair: PairReadings) -> FloatArray:
    """Return the rows of presses against the light contact, shape (press, 3, parameter)."""
    first = displacement_blocks(model.models[0], pair.first)
    second = np.einsum("ij,rjn->rin", pair.R, displacement_blocks(model.models[1], pair.second))
    return np.concatenate([first, -second], axis=2)


@dataclass(frozen=True, eq=False)
class PairPrior:
    """What is known of the springs of both arms beside the presses."""

    rows: FloatArray
    """Rows of unit variance in the fit, right-hand side last, shape (row, parameter + 1)."""
    drawn: FloatArray
    """Standard deviation of the right-hand side of each over the draws, shape (row,)."""


def build_pair(
    model: PairModel,
    pair: PairReadings,
    contact: Contact | None = None,
    prior: PairPrior | None = None,
    noise: float = 1.0,
) -> Problem:
    """Return the observation system of both arms.

    Parameters
    ----------
    model : PairModel
        Springs of both arms.
    pair : PairReadings
        The presses.
    contact : Contact, optional
        What is known of the contact that holds the tools; none where a tracker measured both.
    prior : PairPrior, optional
        What is known of the springs.
    noise : float
        Standard deviation of a component of a row in m, against which the prior is weighed.

    Raises
    ------
    IdentificationError
        If there are too few poses, or the springs imitate a compliance of the contact that is free.
    """
    parameters = model.parameters
    prior = prior or PairPrior(np.zeros((0, len(parameters) + 1)), np.zeros(0))
    problem = Problem(
        O=pair_blocks(model, pair),
        d=pair.relative,
        weight=np.ones((len(pair), 3)),
        block=pose_blocks(pair.first),
        lower=np.array([each.lower for each in parameters]),
        upper=np.full(len(parameters), np.inf),
        prior_rows=noise * prior.rows,
        size=relative_sizes(parameters),
        prior_error=noise * prior.drawn,
    )
    if pair.tracked:
        return problem
    if contact is None:
        raise IdentificationError("no tracker measured: what is known of the contact is needed")
    return _with_contact(problem, model, pair, contact)


def _with_contact(
    problem: Problem, model: PairModel, pair: PairReadings, contact: Contact
) -> Problem:
    """Return a problem with the columns of the contact last."""
    columns = contact_columns(pair.robots[0], pair.first, problem.block, contact)
    wider = problem.with_contact(columns, model.parameters[0].scale)
    seen = contact_visibility_of(wider, [each.name for each in model.parameters])
    require_seen(contact, seen, is_pressed_sideways(pair.robots[0], pair.first), False)
    return wider
