"""A ladder of spring models, from few springs to gears with friction, and the choice of one.

More springs always fit better; whether they predict better is measured at poses left out of a refit
and, if there is one, at a low load left out of it. (A refit without the full load, or without an
isolated pose, would have to extrapolate, which no rung is required to do.) The rung with the lowest
such error is chosen, among those with no more parameters than the readings hold numbers; or a
simpler one, where that gains less than a twentieth of the error and less than one standard error of
their paired difference (`elastocal.identification.paired`). Where production is known, it decides
between all rungs that are not worse by more than one standard error
(`elastocal.identification.prediction_doubt`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import BoolArray, FloatArray
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel, KnownSpring, bearing
from elastocal.errors import IdentificationError, present
from elastocal.findings import Finding, Grade, Kind
from elastocal.identification.contact import as_fitted
from elastocal.identification.displacement import with_references
from elastocal.identification.knowledge import DriveCompliances, with_knowledge
from elastocal.identification.options import FitOptions
from elastocal.identification.paired import Judgement, Overlap, judge_models
from elastocal.identification.prediction_doubt import (
    ProductionForecast,
    ProductionRows,
    expected_errors,
)
from elastocal.identification.problem import Problem, build, pose_blocks
from elastocal.identification.production import poses_in_company
from elastocal.identification.rungs import (
    AUTO,
    NO_LEVELS,
    RUNGS,
    Rung,
    allowed_rungs,
    low_loads,
    rung_of,
)
from elastocal.identification.sag_share import with_sag_open
from elastocal.identification.solve import PoseGrams
from elastocal.identification.suspicious import screen
from elastocal.identification.uncertainty import HeldOut, leave_poses_out
from elastocal.parallel import one_blas_thread
from elastocal.results import brief_repr
from elastocal.robot import Robot

_LEAST_GAIN = 0.05
"""Part of the error that a richer rung must gain where the evidence for it is within one standard
error; measured in docs/decisions/0066-ladder.md."""
_AXES, _BEARINGS = "actuated", "bearing"
"""Names of the rungs with springs of the axes alone, and with those at the bearings besides."""
_LACKED = "gears"
"""The rung that is fitted beside a free contact as a first fit has it, where its springs imitate
the contact: bending links are what the rungs that are left lack."""
REFUSED = Kind(
    "ladder.refused",
    "springs {springs} were not tried: {reason}",
    grade=Grade.NOTE,
)
UNDOUBTED = Kind(
    "ladder.undoubted",
    "intervals lack the doubt that the arm has {springs}, which were not fitted beside the contact"
    " that was found: {reason}",
)


@brief_repr
@dataclass(frozen=True, eq=False)
class Climbed:
    """A rung that was fitted and judged."""

    name: str
    model: ElasticModel
    held_out: HeldOut
    """Errors at left-out poses; of the chosen rung those of the fit with its prior."""
    score: FloatArray
    """Mean error of each pose block, its low load left out too, shape (block,), in m."""
    predicted: FloatArray
    """Its predictions of the readings at left-out poses, shape (reading, 3), in m."""
    difference: float = 0.0
    """Mean score minus that of the best rung, in m."""
    low: float = 0.0
    """Lower end of its 95 % interval, in m."""
    high: float = 0.0
    """Upper end, in m."""
    standard_error: float = 0.0
    """Standard error of the difference, in m."""
    chosen: bool = False
    beside: bool = False
    """Whether its springs imitate a free contact, so that it was fitted with the contact of a first
    fit. It is never taken, and shows what the springs of the chosen rung lack."""
    counted: BoolArray | None = None
    """Pose blocks whose score decides, shape (block,); none: all. See `poses_in_company`."""
    apart: float = float("nan")
    """Root mean square distance of its predictions at left-out poses from those of the chosen rung,
    in m; NaN where it could not be chosen and does not show what that lacks: by being fitted
    ``beside``, or by predicting better by more than one standard error."""
    known: tuple[KnownSpring, ...] = ()
    """Prior knowledge of its springs that its fits used."""
    forecast: ProductionForecast | None = None
    """Its predictions on production, where that is known."""
    production_error: float = float("nan")
    """Error that is expected on production, in m; NaN where it is not estimated, as for rungs that
    left-out poses show to be worse."""
    told: Problem | None = None
    """Its problem with what the drives say, where springs of the axes alone were chosen and it has
    those at the bearings too: what the former may be if the arm has the latter."""

    @property
    def is_carried(self) -> bool:
        """Whether the readings hold as many numbers as the model has parameters."""
        return bool(self.held_out.compliance.shape[1] <= self.predicted.size)

    @property
    def is_backed(self) -> bool:
        """Whether it is certain enough for a correction on production; also where none is known.

        See `PredictionDoubt.is_small`.
        """
        return self.forecast is None or self.forecast.doubt.is_small


@brief_repr
@dataclass(frozen=True, eq=False)
class Choice:
    """A model chosen for readings, and the ladder from which it was chosen."""

    model: ElasticModel
    ladder: tuple[Climbed, ...]
    """Every rung that the readings allow, the simplest first."""
    refused: tuple[Finding, ...] = ()
    """Rungs that the readings do not allow, with the reason."""
    lacked: tuple[Climbed, ...] = ()
    """Rungs among those, fitted beside the contact of a first fit (`Climbed.beside`)."""

    @property
    def taken(self) -> str:
        """Name of the chosen rung."""
        return self._taken.name

    @property
    def known(self) -> tuple[KnownSpring, ...]:
        """Prior knowledge of the springs that a fit of the chosen rung uses."""
        return self._taken.known

    @property
    def _taken(self) -> Climbed:
        return next(each for each in self.ladder if each.chosen)


@one_blas_thread()
def choose_model(
    robot: Robot,
    readings: Readings,
    springs: str,
    options: FitOptions,
    marker_offset: ArrayLike | None = None,
    beside: Sequence[str] = (),
    production: ProductionRows | None = None,
) -> Choice:
    """Return the elastic model that an option requests.

    Parameters
    ----------
    readings : Readings
        Measurements, joints in the robot's order.
    springs : str
        ``auto``: the rung that the readings support; ``gears``: gears, with friction memory where
        they support it; the name of a layout; a spring file.
    options : FitOptions
        Bounds, weights; a prior applies to one model and is not used in the choice.
    marker_offset : array_like, shape (3,), optional
        Marker in the tcp frame, in m.
    beside : sequence of str
        Other layouts or spring files to judge with the ladder; none of them is taken.
    production : ProductionRows, optional
        Where the model is to predict. Every rung is then fitted with what the drives say of other
        springs (`DriveCompliances`), and chosen by production: see `take_best`. Without it the
        rungs are judged by the readings alone, and the prior is that of the chosen one
        (`Choice.known`). Springs that are asked for by name have none.

    Raises
    ------
    SpringError
        If ``springs`` is none of these.
    IdentificationError
        If the readings carry no model that was asked for.
    """
    allowed = allowed_rungs(springs)
    held = options.contact is not None
    ladder = (name for name, each in RUNGS.items() if held or not each.by_contact)
    names = dict.fromkeys((*ladder, *(() if springs == AUTO else allowed), *beside))
    rungs = tuple(rung_of(robot, name) for name in names if name != AUTO)
    options = replace(options, prior=None)
    readings = usable_for_choice(robot, readings, options, marker_offset)
    if len(allowed) == 1:
        return climb(robot, readings, rungs, allowed, options, marker_offset)
    choice = climb(robot, readings, rungs, allowed, options, marker_offset, production)
    return _told(choice, robot, readings, options, marker_offset)


def _told(
    choice: Choice,
    robot: Robot,
    readings: Readings,
    options: FitOptions,
    marker_offset: ArrayLike | None,
) -> Choice:
    """Return a choice with what the drives say of its springs.

    Where it has those of the axes alone, also with what they say of those at the bearings.
    """
    axes_alone = choice.taken == _AXES
    if choice.known and not axes_alone:
        return choice
    drives = DriveCompliances.of(robot, readings, options, marker_offset)

    def told(rung: Climbed) -> Climbed:
        doubts = axes_alone and rung.name == _BEARINGS and np.isfinite(rung.apart)
        if not doubts and (rung.known or not rung.chosen):
            return rung
        known = drives.known_springs(rung.model)
        fit = with_knowledge(options, known, rung.model, readings, marker_offset)
        problem = build(rung.model, readings, fit, marker_offset)
        if rung.chosen:
            return replace(rung, known=known, held_out=leave_poses_out(problem))
        every = np.ones(len(readings), dtype=bool)
        problem = with_sag_open(problem, rung.model, readings, every, fit, marker_offset)
        return replace(rung, told=problem)

    return replace(choice, ladder=tuple(map(told, choice.ladder)))


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
    readings = with_references(robot, readings)
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
    production: ProductionRows | None = None,
) -> Choice:
    """Return the allowed rung with the least error at left-out poses, or on production.

    Parameters
    ----------
    readings : Readings
        Without blunders.
    rungs : sequence of Rung
        Rungs to fit, the simplest first.
    allowed : sequence of str
        Names of the rungs to choose from; the others are shown beside them.
    options : FitOptions
        Bounds and weights.
    marker_offset : array_like, shape (3,), optional
        Marker in the tcp frame, in m.
    production : ProductionRows, optional
        As for `choose_model`.

    Raises
    ------
    IdentificationError
        If the readings allow none of them.
    """
    rows = None if production is None else production.few()
    drives = DriveCompliances.of(robot, readings, options, marker_offset) if rows else None
    tried: list[Climbed] = []
    lacked: list[Climbed] = []
    refused: list[Finding] = []
    low, reason = low_loads(readings), NO_LEVELS
    # The frame of a load case that is left out is not known, so it cannot be judged.
    judged = low & (options.free_frame != "load_case")
    counted = poses_in_company(robot, readings.joint_position, pose_blocks(readings))
    for rung in rungs:
        if rung.needs_levels and not np.any(low):
            continue
        model = ElasticModel(robot, rung.springs(robot, readings))
        try:
            known = drives.known_springs(model) if drives else ()
            fit = with_knowledge(options, known, model, readings, marker_offset)
            problem = build(model, readings, fit, marker_offset)
            forecast = ProductionForecast.of(model, problem, rows) if rows else None
            found = try_rung(rung.name, model, problem, judged)
            tried.append(replace(found, counted=counted, known=known, forecast=forecast))
        except IdentificationError as error:
            reason = str(error)
            refused.append(REFUSED(springs=rung.name, reason=reason))
            if rung.name == _LACKED and options.contact is not None:
                try:
                    fit = _beside_contact_found(robot, model, readings, options)
                    found = try_rung(rung.name, model, build(model, readings, fit), judged)
                    lacked.append(replace(found, counted=counted, beside=True))
                except IdentificationError as unsolved:
                    refused.append(UNDOUBTED(springs=rung.name, reason=str(unsolved)))
    if not any(each.name in allowed for each in tried):
        raise IdentificationError(reason)
    return replace(_against(take_best(tried, allowed), lacked), refused=tuple(refused))


def _against(choice: Choice, lacked: Sequence[Climbed]) -> Choice:
    """Return a choice with rungs that were fitted beside the contact of a first fit."""
    taken = next(each for each in choice.ladder if each.chosen)
    found = []
    for each in lacked:
        score = np.stack([taken.score, each.score], axis=1)
        score = score if each.counted is None else score[each.counted]
        overlap = Overlap.leaving_one_out(len(score))
        apart = judge_models(score, np.ones(2, dtype=bool), overlap).difference
        found.append(
            replace(
                each,
                difference=float(apart.mean[1]),
                standard_error=float(np.nan_to_num(apart.standard_error[1])),
                apart=_distance(each, taken),
            )
        )
    return replace(choice, lacked=tuple(found))


def _beside_contact_found(
    robot: Robot, model: ElasticModel, readings: Readings, options: FitOptions
) -> FitOptions:
    """Return options of a fit of springs that imitate a free contact, with that of a first fit."""
    options = replace(options, contact=as_fitted(present(options.contact, "contact")))
    known = DriveCompliances.of(robot, readings, options).known_springs(model)
    return with_knowledge(options, known, model, readings)


def take_best(tried: Sequence[Climbed], allowed: Sequence[str]) -> Choice:
    """Return the simplest allowed rung that no other beats clearly at left-out poses.

    Clearly is by a twentieth of the error, or by more than one standard error of the difference.
    A rung with more parameters than the readings hold numbers is chosen only if there is no smaller
    one, since with few left-out poses one of them may be best by chance. Where production is known,
    a rung with large uncertainty there is chosen only if all have it; and of those within one
    standard error of the best, the one with the least expected error there is chosen.

    Parameters
    ----------
    tried : sequence of Climbed
        Fitted to the same readings, the simplest first.
    allowed : sequence of str
        Names of the rungs to choose from; the others are judged beside them.

    Raises
    ------
    IdentificationError
        If none of them was tried: gears with friction memory, without load cases of low load.
    """
    may = np.array([each.name in allowed for each in tried])
    if not np.any(may):
        raise IdentificationError(f"springs {', '.join(allowed)} were not tried: {NO_LEVELS}")
    for mark in ("is_carried", "is_backed"):
        fit = may & np.array([getattr(each, mark) for each in tried])
        may = fit if np.any(fit) else may
    score = np.stack([each.score for each in tried], axis=1)
    score = score if tried[0].counted is None else score[tried[0].counted]
    found = judge_models(score, may, Overlap.leaving_one_out(len(score)))
    on_production = _errors_on_production(tried, found)
    known = np.isfinite(on_production).any()
    chosen = int(np.nanargmin(on_production)) if known else _simplest(found, score)
    each = found.difference
    figures = (each.mean, each.low, each.high, np.nan_to_num(each.standard_error))
    # Springs that were asked for by name lack what better ones have.
    doubts = may | (each.mean < -figures[3])
    ladder = tuple(
        replace(
            rung,
            difference=float(mean),
            low=float(low),
            high=float(high),
            standard_error=float(error),
            chosen=number == chosen,
            production_error=float(on_production[number]),
            apart=_distance(rung, tried[chosen]) if doubts[number] else float("nan"),
        )
        for number, (rung, mean, low, high, error) in enumerate(zip(tried, *figures, strict=True))
    )
    return Choice(ladder[chosen].model, ladder)


def _simplest(found: Judgement, score: FloatArray) -> int:
    """Return the simplest of the near rungs that the best one beats by less than a twentieth."""
    most = _LEAST_GAIN * float(score[:, found.best].mean())
    return int(found.near[np.argmax(found.difference.mean[found.near] <= most)])


def _errors_on_production(tried: Sequence[Climbed], found: Judgement) -> FloatArray:
    """Return the expected errors of the near rungs on production, shape (rung,), in m, or NaN."""
    errors = np.full(len(tried), np.nan)
    forecasts = [each for number in found.near if (each := tried[number].forecast) is not None]
    if forecasts:
        errors[found.near] = expected_errors(forecasts)
    return errors


def try_rung(name: str, model: ElasticModel, problem: Problem, low: BoolArray) -> Climbed:
    """Return a rung with its errors at left-out poses, and left-out low load.

    Parameters
    ----------
    name : str
        Name of the rung.
    model : ElasticModel
        Its model.
    problem : Problem
        Problem by which it is judged; rows of some poses, taken from a problem of all, contain the
        friction history of all readings at these poses.
    low : ndarray of bool, shape (reading,)
        Readings that are also left out together.
    """
    held_out = leave_poses_out(problem)
    error = np.linalg.norm(held_out.axis_error, axis=1)
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
    left = problem.take(rows)
    return np.asarray(np.linalg.norm(left.own_errors(left.residuals(compliance)), axis=1))
