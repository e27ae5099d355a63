"""A ladder of spring models, from few springs to gears that remember, and how high to climb.

More springs always fit better; whether they predict better is seen at poses that a refit has not
seen, and at a low load that it has not seen, where there is one. (A refit without the full load
would have to extrapolate, which no rung is asked to.) The rung taken is the simplest that is not
worse than the best by more than one standard error of their paired difference (the rule of L.
Breiman, J. Friedman, R. Olshen, C. Stone, *Classification and Regression Trees*, 1984, section
3.4.3). Refits without one pose each share nearly all their poses, so that their errors are not
independent; the standard error counts that by the corrected resampled t-test (C. Nadeau, Y.
Bengio, "Inference for the generalization error", Machine Learning 52, 2003): the variance of a
mean over ``J`` test sets is ``s^2 (1 / J + n_test / n_train)``. Why not a 95 % interval: see
docs/decisions/0066-ladder.md.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import stdtrit

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
from elastocal.identification.problem import Problem, build
from elastocal.identification.solve import PoseGrams
from elastocal.identification.suspicious import screen
from elastocal.identification.uncertainty import CONFIDENCE, HeldOut, leave_poses_out
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
_LOADED = 0.01
"""Part of the largest typical torque below which a joint counts as never loaded."""
_LOW_LEVEL = 0.6
"""A load case is of low load below this part of the largest force at its pose."""


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
    difference: float
    """Mean score minus that of the best rung, in m."""
    low: float
    """Lower end of its 95 % interval, in m."""
    high: float
    """Upper end, in m."""
    standard_error: float = 0.0
    """Of the difference, in m."""
    chosen: bool = False
    apart: float = 0.0
    """Root mean square distance of its predictions at left-out poses from those of the chosen
    rung, in m."""


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
        Limits of friction elements, in that torque; none without.
    """
    springs = links(robot)
    model = ElasticModel(robot, actuated(robot))
    torque = model.load_torques(readings.joint_position, readings.force, readings.moment)
    typical = dict(zip(robot.joint_names, np.median(np.abs(torque), axis=0), strict=True))
    least = _LOADED * max(typical.values())

    def geared(spring: Spring, axial: bool) -> Spring:
        axis = spring.axes[0]
        size = float(typical[spring.joint])
        if not (axial and axis.revolute and size > least):
            return spring
        parts = _KNEES_OF_PLAYS if slips else _KNEES
        knees = tuple(_rounded(size * part) for part in parts)
        limits = tuple(_rounded(size * part) for part in slips)
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


@one_blas_thread()
def choose_model(
    robot: Robot,
    readings: Readings,
    springs: str,
    options: FitOptions,
    marker_offset: ArrayLike | None = None,
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

    Raises
    ------
    SpringError
        If ``springs`` is none of these.
    IdentificationError
        If the readings carry no model that was asked for.
    """
    allowed = {AUTO: tuple(RUNGS), "gears": ("gears", "gears+friction")}.get(springs, (springs,))
    rungs = dict(RUNGS)
    if springs not in (AUTO, *RUNGS):
        asked = layout(robot, springs, beside=(AUTO, *RUNGS))
        rungs[springs] = Rung(springs, lambda *_: asked)
    options = replace(options, prior=None)
    # Sought once, not for every rung.
    sought = reference_joints(robot, readings)
    readings = replace(readings, reference_joint_position=sought)
    if options.set_blunders_aside:
        # Judged by springs that every reading can be judged by; they would decide otherwise.
        plain = build(ElasticModel(robot, bearing(robot)), readings, options, marker_offset)
        readings = readings.take(~screen(plain).blunder)
    return climb(robot, readings, tuple(rungs.values()), allowed, options, marker_offset)


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
    predicted: dict[str, FloatArray] = {}
    reason = f"no load case has less than {_LOW_LEVEL:.0%} of the largest force at its pose"
    for rung in rungs:
        if rung.needs_levels and not has_levels(readings):
            continue
        try:
            climbed, predicted[rung.name] = _tried(rung, robot, readings, options, marker_offset)
            tried.append(climbed)
        except IdentificationError as error:
            reason = str(error)
    candidates = [each for each in tried if each.name in allowed]
    if not candidates:
        raise IdentificationError(reason)
    best = min(candidates, key=lambda each: float(each.score.mean()))
    compared = [_against(each, best) for each in tried]
    chosen = next(e for e in compared if e.name in allowed and e.difference <= e.standard_error)
    ladder = tuple(
        replace(
            each,
            chosen=each is chosen,
            apart=_distance(predicted[each.name], predicted[chosen.name]),
        )
        for each in compared
    )
    return Choice(chosen.model, ladder)


def doubt(ladder: Sequence[Climbed]) -> float:
    """Return the mean square by which the choice of a rung may have moved a prediction, in m².

    A choice is not known to be right: had the poses been others, another rung would have been
    taken. Each counts with the weight ``exp(-z^2 / 2)`` of how far it is behind the best, ``z``
    being the difference in standard errors; 1 if it predicts better (S. T. Buckland, K. P.
    Burnham, N. H. Augustin, "Model selection: an integral part of inference", Biometrics 53, 1997).

    Parameters
    ----------
    ladder : sequence of Climbed
        With a chosen rung; 0 without any.
    """
    if not ladder:
        return 0.0
    difference = np.array([each.difference for each in ladder])
    error = np.array([each.standard_error for each in ladder])
    z = np.divide(difference, error, out=np.zeros_like(difference), where=error > 0.0)
    weight = np.exp(-0.5 * np.square(np.maximum(z, 0.0)))
    apart = np.array([each.apart for each in ladder])
    return float(weight @ np.square(apart) / weight.sum())


def has_levels(readings: Readings) -> bool:
    """Return whether load cases of low load stand beside those of full load."""
    # The largest force at a pose is never low beside itself.
    return bool(np.any(_of_low_load(readings)))


def _of_low_load(readings: Readings) -> BoolArray:
    """Return whether each reading is of low load beside others at its pose, shape (reading,)."""
    force = np.linalg.norm(readings.force, axis=1)
    labels, pose = np.unique(readings.pose, return_inverse=True)
    largest = np.zeros(len(labels))
    np.maximum.at(largest, pose, force)
    return np.asarray(force < _LOW_LEVEL * largest[pose])


def _tried(
    rung: Rung,
    robot: Robot,
    readings: Readings,
    options: FitOptions,
    marker_offset: ArrayLike | None,
) -> tuple[Climbed, FloatArray]:
    """Return a rung with its errors, and what it predicts at left-out poses, (reading, 3), in m."""
    model = ElasticModel(robot, rung.springs(robot, readings))
    problem = build(model, readings, options, marker_offset)
    held_out = leave_poses_out(problem)
    error = held_out.error.copy()
    low = _of_low_load(readings)
    # The frame of a load case that is left out is not known, so it cannot be judged.
    if np.any(low) and options.free_frame != "load_case":
        error[low] = 0.5 * (error[low] + _left_out(problem, low))
    blocks, index = np.unique(problem.block, return_inverse=True)
    score = np.bincount(index, error, len(blocks)) / np.bincount(index, minlength=len(blocks))
    n = problem.springs
    predicted = np.einsum(
        "rin,rn->ri", problem.O[:, :, n], held_out.compliance[held_out.fold][:, n]
    )
    return Climbed(rung.name, model, held_out, score, 0.0, 0.0, 0.0), predicted


def _distance(a: FloatArray, b: FloatArray) -> float:
    """Return the root mean square distance of predictions, in m."""
    return float(np.sqrt(np.mean(np.sum(np.square(a - b), axis=1))))


def _left_out(problem: Problem, rows: BoolArray) -> FloatArray:
    """Return the errors of some readings under a refit to the others, shape (row,), in m."""
    rest = PoseGrams.of(problem.take(~rows))
    compliance = rest.refit(np.ones((1, len(rest.gram))))[0]
    return np.asarray(np.linalg.norm(problem.take(rows).residuals(compliance), axis=1))


def _against(rung: Climbed, best: Climbed) -> Climbed:
    """Return the rung with its difference from the best, and the interval of that."""
    difference = rung.score - best.score
    count = len(difference)
    spread = float(difference.std(ddof=1)) * np.sqrt(1.0 / count + 1.0 / (count - 1))
    reach = float(stdtrit(count - 1, 0.5 * (1.0 + CONFIDENCE))) * spread
    mean = float(difference.mean())
    return replace(
        rung, difference=mean, low=mean - reach, high=mean + reach, standard_error=spread
    )


def _rounded(torque: float) -> float:
    """Return a torque of two digits, which is all that its choice deserves."""
    return float(f"{torque:.2g}")
