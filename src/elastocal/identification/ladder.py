"""A ladder of spring models, from few springs to gears that remember, and how high to climb.

More springs always fit better; whether they predict better is seen at poses that a refit has not
seen, and at a low load that it has not seen, where there is one. (A refit without the full load, or
without a pose that stands alone, would have to extrapolate, which no rung is asked to.) The rung
taken is the simplest that is not worse than the best by more than one standard error of their
paired difference, which counts that the refits overlap (`elastocal.identification.paired`).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import BoolArray, FloatArray
from elastocal.dataset import Readings
from elastocal.elastic import (
    ElasticModel,
    Gear,
    Spring,
    actuated,
    bearing,
    bearing_ends,
    layout,
    links,
    tensor,
)
from elastocal.errors import IdentificationError
from elastocal.identification.displacement import reference_joints
from elastocal.identification.options import FitOptions
from elastocal.identification.paired import Overlap, judge_models
from elastocal.identification.problem import Problem, build, pose_blocks
from elastocal.identification.production import poses_in_company
from elastocal.identification.solve import PoseGrams
from elastocal.identification.suspicious import screen
from elastocal.identification.uncertainty import HeldOut, leave_poses_out
from elastocal.parallel import one_blas_thread
from elastocal.results import brief_repr
from elastocal.robot import Robot

AUTO = "auto"
"""Asks for the rung that the readings carry."""
_KNEES = (0.3, 1.0, 3.0)
"""Knees of the gears, in typical load torques of the joint: one below, at and above it."""
_KNEES_OF_PLAYS = (0.5, 2.0)
"""Knees of gears with friction, whose elements are knees as well."""
_SLIPS = (0.15, 0.3, 0.6, 1.5)
"""Limits of the friction elements, likewise: from what barely matters to gears that stick."""
_SLIDES = 0.6
"""Part of the joint's largest load torque up to which a friction element is fitted. One that slid
little or never has a column near zero, and a compliance that says nothing of the arm: where
production loads the joint a little more it would bend by millimetres."""
_LOADED = 0.01
"""Part of the largest typical torque below which a joint counts as never loaded."""
_LOW_LEVEL = 0.6
"""A load case is of low load below this part of the largest force at its pose."""
_NO_LEVELS = f"no load case has less than {_LOW_LEVEL:.0%} of the largest force at its pose"


@brief_repr
@dataclass(frozen=True)
class Rung:
    """A model of the ladder."""

    name: str
    springs: Callable[[Robot, Readings], tuple[Spring, ...]]
    """Makes its springs for a robot, scaled to the loads of the readings."""
    needs_levels: bool = False
    """Whether it needs load cases of low and full load."""


@brief_repr
@dataclass(frozen=True, eq=False)
class Climbed:
    """A rung that was tried."""

    name: str
    model: ElasticModel
    held_out: HeldOut
    """Errors at left-out poses."""
    score: FloatArray
    """Mean error of each pose block, its low load left out too, shape (block,), in m."""
    predicted: FloatArray
    """What it predicts of each reading at left-out poses, shape (reading, 3), in m."""
    difference: float = 0.0
    """Mean score minus that of the best rung, in m."""
    low: float = 0.0
    """Lower end of its 95 % interval, in m."""
    high: float = 0.0
    """Upper end, in m."""
    standard_error: float = 0.0
    """Of the difference, in m."""
    chosen: bool = False
    counted: BoolArray | None = None
    """Pose blocks whose score decides, shape (block,); none: all. See `poses_in_company`."""
    apart: float = float("nan")
    """Root mean square distance of its predictions at left-out poses from those of the chosen
    rung, in m; NaN where it was not to choose from."""


def gears(robot: Robot, readings: Readings, slips: tuple[float, ...] = ()) -> tuple[Spring, ...]:
    """Return the layout `links` with gears for axial springs.

    Parameters
    ----------
    robot : Robot
        The robot; joints that slide keep linear springs.
    readings : Readings
        Their median torque about each joint scales its gear; joints that they do not load keep
        linear springs.
    slips : tuple of float
        Limits of friction elements, in that torque; none without. Those that no load made slide
        by far are left out.
    """
    springs = links(robot)
    model = ElasticModel(robot, actuated(robot))
    torque = model.load_torques(readings.joint_position, readings.force, readings.moment)
    typical = dict(zip(robot.joint_names, np.median(np.abs(torque), axis=0), strict=True))
    largest = dict(zip(robot.joint_names, np.abs(torque).max(axis=0), strict=True))
    least = _LOADED * max(typical.values())

    def geared(spring: Spring, axial: bool) -> Spring:
        axis = spring.axes[0]
        size = float(typical[spring.joint])
        if not (axial and axis.revolute and size > least):
            return spring
        slides = [size * part for part in slips if size * part <= _SLIDES * largest[spring.joint]]
        parts = _KNEES_OF_PLAYS if slides else _KNEES
        knees = tuple(_rounded(size * part) for part in parts)
        limits = tuple(map(_rounded, slides))
        place = (spring.name, spring.joint, axis.axis)
        return Gear(*place, knees=knees, slips=limits, plays=bool(limits))

    count = len(robot.joint_names)
    return tuple(geared(spring, index < count) for index, spring in enumerate(springs))


RUNGS: dict[str, Rung] = {
    rung.name: rung
    for rung in (
        Rung("actuated", lambda robot, _: actuated(robot)),
        Rung("bearing", lambda robot, _: bearing(robot)),
        Rung("bearing-ends", lambda robot, _: bearing_ends(robot)),
        Rung("links", lambda robot, _: links(robot)),
        Rung("tensor", lambda robot, _: tensor(robot)),
        Rung("gears", gears),
        Rung(
            "gears+friction",
            lambda robot, readings: gears(robot, readings, _SLIPS),
            needs_levels=True,
        ),
    )
}
"""Rungs by name, the simplest first."""


@brief_repr
@dataclass(frozen=True, eq=False)
class Choice:
    """A model chosen for readings, and the ladder that it stands on."""

    model: ElasticModel
    ladder: tuple[Climbed, ...]
    """Every rung that the readings allow, the simplest first."""

    @property
    def taken(self) -> str:
        """Name of the chosen rung."""
        return next(each.name for each in self.ladder if each.chosen)


def allowed_rungs(springs: str) -> tuple[str, ...]:
    """Return the names of the rungs that a user's word for springs leaves to choose from."""
    return {AUTO: tuple(RUNGS), "gears": ("gears", "gears+friction")}.get(springs, (springs,))


def rung_of(robot: Robot, name: str) -> Rung:
    """Return a rung, or a layout beside the ladder as one.

    Raises
    ------
    SpringError
        If the name is neither a rung, nor a layout, nor a spring file.
    """
    if name in RUNGS:
        return RUNGS[name]
    springs = layout(robot, name, beside=(AUTO, *RUNGS))
    return Rung(name, lambda *_: springs)


@one_blas_thread()
def choose_model(
    robot: Robot,
    readings: Readings,
    springs: str,
    options: FitOptions,
    marker_offset: ArrayLike | None = None,
    beside: Sequence[str] = (),
) -> Choice:
    """Return the elastic model that a user asks for.

    Parameters
    ----------
    robot : Robot
        The robot.
    readings : Readings
        Measurements, joints in the robot's order.
    springs : str
        ``auto``: the rung that the readings carry; ``gears``: gears, with friction memory where
        they carry it; the name of a layout; a spring file.
    options : FitOptions
        Bounds, weights; a prior speaks of one model and has no part in the choice.
    marker_offset : array_like, shape (3,), optional
        Marker in the tcp frame, in m.
    beside : sequence of str
        Other layouts or spring files to judge with the ladder; none of them is taken.

    Raises
    ------
    SpringError
        If ``springs`` is none of these.
    IdentificationError
        If the readings carry no model that was asked for.
    """
    allowed = allowed_rungs(springs)
    names = dict.fromkeys((*RUNGS, *allowed, *beside))
    rungs = tuple(rung_of(robot, name) for name in names if name != AUTO)
    options = replace(options, prior=None)
    readings = usable_for_choice(robot, readings, options, marker_offset)
    return climb(robot, readings, rungs, allowed, options, marker_offset)


def usable_for_choice(
    robot: Robot,
    readings: Readings,
    options: FitOptions,
    marker_offset: ArrayLike | None = None,
) -> Readings:
    """Return the readings that a choice of springs rests on, with their references.

    Parameters
    ----------
    robot, readings, options, marker_offset
        As for `choose_model`.
    """
    # Sought once, not for every rung.
    readings = replace(readings, reference_joint_position=reference_joints(robot, readings))
    if not options.set_blunders_aside:
        return readings
    # Judged by springs that every reading can be judged by; they would decide otherwise.
    plain = build(ElasticModel(robot, bearing(robot)), readings, options, marker_offset)
    return readings.set_aside(screen(plain).blunder)


def climb(
    robot: Robot,
    readings: Readings,
    rungs: Sequence[Rung],
    allowed: Sequence[str],
    options: FitOptions,
    marker_offset: ArrayLike | None = None,
) -> Choice:
    """Return the simplest of the allowed rungs that is not worse than the best of them.

    Parameters
    ----------
    robot : Robot
        The robot.
    readings : Readings
        Without blunders.
    rungs : sequence of Rung
        What to try, the simplest first.
    allowed : sequence of str
        Names of the rungs to choose from; the others are shown beside them.
    options : FitOptions
        Bounds and weights.
    marker_offset : array_like, shape (3,), optional
        Marker in the tcp frame, in m.

    Raises
    ------
    IdentificationError
        If the readings allow none of them.
    """
    tried: list[Climbed] = []
    low, reason = low_loads(readings), _NO_LEVELS
    # The frame of a load case that is left out is not known, so it cannot be judged.
    judged = low & (options.free_frame != "load_case")
    counted = poses_in_company(robot, readings.joint_position, pose_blocks(readings))
    for rung in rungs:
        if rung.needs_levels and not np.any(low):
            continue
        model = ElasticModel(robot, rung.springs(robot, readings))
        try:
            problem = build(model, readings, options, marker_offset)
            tried.append(replace(try_rung(rung.name, model, problem, judged), counted=counted))
        except IdentificationError as error:
            reason = str(error)
    if not any(each.name in allowed for each in tried):
        raise IdentificationError(reason)
    return take_simplest(tried, allowed)


def take_simplest(tried: Sequence[Climbed], allowed: Sequence[str]) -> Choice:
    """Return the simplest of the allowed rungs that is not worse than the best of them.

    Parameters
    ----------
    tried : sequence of Climbed
        Tried on the same readings, the simplest first.
    allowed : sequence of str
        Names of the rungs to choose from; the others are judged beside them.

    Raises
    ------
    IdentificationError
        If none of them was tried: gears with friction memory, without load cases of low load.
    """
    may = np.array([each.name in allowed for each in tried])
    if not np.any(may):
        raise IdentificationError(f"springs {', '.join(allowed)} were not tried: {_NO_LEVELS}")
    score = np.stack([each.score for each in tried], axis=1)
    score = score if tried[0].counted is None else score[tried[0].counted]
    found = judge_models(score, may, Overlap.leaving_one_out(len(score)))
    each = found.difference
    figures = (each.mean, each.low, each.high, np.nan_to_num(each.standard_error))
    ladder = tuple(
        replace(
            rung,
            difference=float(mean),
            low=float(low),
            high=float(high),
            standard_error=float(error),
            chosen=number == found.chosen,
            apart=_distance(rung, tried[found.chosen]) if may[number] else float("nan"),
        )
        for number, (rung, mean, low, high, error) in enumerate(zip(tried, *figures, strict=True))
    )
    return Choice(ladder[found.chosen].model, ladder)


def has_levels(readings: Readings) -> bool:
    """Return whether load cases of low load stand beside those of full load."""
    # The largest force at a pose is never low beside itself.
    return bool(np.any(low_loads(readings)))


def low_loads(readings: Readings) -> BoolArray:
    """Return whether each reading is of low load beside others at its pose, shape (reading,)."""
    force = np.linalg.norm(readings.force, axis=1)
    labels, pose = np.unique(readings.pose, return_inverse=True)
    largest = np.zeros(len(labels))
    np.maximum.at(largest, pose, force)
    return np.asarray(force < _LOW_LEVEL * largest[pose])


def try_rung(name: str, model: ElasticModel, problem: Problem, low: BoolArray) -> Climbed:
    """Return a rung with its errors at left-out poses, and left-out low load.

    Parameters
    ----------
    name : str
        Of the rung.
    model : ElasticModel
        Its model.
    problem : Problem
        What it is judged by; rows of some poses, cut from a problem of all, know of friction what
        all readings at these poses did.
    low : ndarray of bool, shape (reading,)
        Readings that are also left out together.
    """
    held_out = leave_poses_out(problem)
    error = held_out.error.copy()
    if np.any(low):
        error[low] = 0.5 * (error[low] + _left_out(problem, low))
    blocks, index = np.unique(problem.block, return_inverse=True)
    score = np.bincount(index, error, len(blocks)) / np.bincount(index, minlength=len(blocks))
    n = problem.springs
    fitted = held_out.compliance[held_out.fold][:, n]
    predicted = np.einsum("rin,rn->ri", problem.O[:, :, n], fitted)
    return Climbed(name, model, held_out, score, predicted)


def _distance(one: Climbed, other: Climbed) -> float:
    """Return the root mean square distance of two rungs' predictions, in m."""
    squares = np.sum(np.square(one.predicted - other.predicted), axis=1)
    return float(np.sqrt(np.mean(squares)))


def _left_out(problem: Problem, rows: BoolArray) -> FloatArray:
    """Return the errors of some readings under a refit to the others, shape (row,), in m."""
    rest = PoseGrams.of(problem.take(~rows))
    compliance = rest.refit(np.ones((1, len(rest))))[0]
    return np.asarray(np.linalg.norm(problem.take(rows).residuals(compliance), axis=1))


def _rounded(torque: float) -> float:
    """Return a torque of two digits, which is all that its choice deserves."""
    return float(f"{torque:.2g}")
