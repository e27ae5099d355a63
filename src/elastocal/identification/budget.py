"""Error budget: the contribution of each term of a model, and the parts of the remaining error.

Ablation: each term that the model has is taken out, each that it lacks is added; the model is
refitted without each pose in turn and predicts the readings there. With mean squares ``m`` of the
errors at left-out poses, the contribution of a term is

    sign(m_without - m_with) sqrt(|m_without - m_with|),

since independent errors add up in quadrature. The interval is that of the paired difference over
pose blocks, which allows for refits that share nearly all their poses, as in the ladder
(`elastocal.identification.paired`).

The remaining error at left-out poses is split in quadrature, too: noise of the instruments, as
stated or as repeated readings scatter; the fit, which another choice of poses would change
(jackknife over poses); and the rest, which no term here explains.
"""

from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import chdtri

from elastocal.arrays import FloatArray
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel, Gear, Spring
from elastocal.identification.displacement import sag_blocks_between, with_references
from elastocal.identification.options import FitOptions
from elastocal.identification.paired import Overlap, corrected_mean
from elastocal.identification.problem import Problem, build
from elastocal.identification.rungs import RUNGS, has_levels
from elastocal.identification.solve import solve
from elastocal.identification.suspicious import screen
from elastocal.identification.uncertainty import CONFIDENCE, HeldOut, leave_poses_out
from elastocal.parallel import one_blas_thread
from elastocal.records import record
from elastocal.results import brief_repr
from elastocal.wording import phrase, phrases

TermName = Literal["bearings", "gears", "friction", "sag", "registration"]
_TERMS: tuple[TermName, ...] = get_args(TermName)
_WORDS = phrases("bearings", "stiffening gears", "friction memory", "gravity sag", "registration")
_LABELS: dict[TermName, str] = dict(zip(_TERMS, _WORDS, strict=True))
_FEWEST_REPEATS = 9
"""Components of repeated readings from which their scatter is known within a factor of two."""
_TURN = 1e-2
"""Standard deviation of the prior on a turn of the tracker, in rad: no registration is worse."""
_READING = 1e-5
"""Standard deviation against which that prior is weighted, in m: a reading of a tracker."""


@record()
class ErrorPart:
    """A part of the error at left-out poses: root of a mean square of norms, in m."""

    error: float | None
    """None where it is unknown."""
    low: float | None
    """Lower end of its 95 % interval; none where it has none."""
    high: float | None
    """Upper end."""
    source: str
    """Origin of the value, or the reason why it is unknown."""


@record()
class TermWorth:
    """Term of the model and its contribution to the error at left-out poses."""

    term: TermName
    taken: bool
    """Whether the model has the term; otherwise it was added to measure its contribution."""
    error: float | None
    """Root mean square error at left-out poses with the term removed, or added, in m; None where
    the readings do not allow the comparison."""
    worth: float | None
    """Reduction of the error by the term, in quadrature, in m; negative where it increases the
    error."""
    low: float | None
    """Lower end of its 95 % interval."""
    high: float | None
    """Upper end."""
    reason: str | None = None
    """Reason why it is not judged."""

    @property
    def label(self) -> str:
        """Name of the term in tables."""
        return _LABELS[self.term]

    @property
    def toggled(self) -> str:
        """Whether `error` is that without the term, or with it."""
        return "without" if self.taken else "with"

    @property
    def resolved(self) -> bool:
        """Whether its contribution differs significantly from zero."""
        return self.low is not None and self.high is not None and self.low * self.high > 0.0


@brief_repr
@record()
class ErrorBudget:
    """Error at left-out poses, its parts, and the contribution of each term (`error_budget`)."""

    deflection: float
    """Root mean square of the measured deflections, in m."""
    total: ErrorPart
    """Error of the model at left-out poses."""
    noise: ErrorPart
    """Noise of the instruments, in a reading."""
    fit: ErrorPart
    """Part due to the choice of poses."""
    rest: ErrorPart
    """Remainder, which no term here explains."""
    terms: tuple[TermWorth, ...]
    readings: int
    poses: int

    @property
    def parts(self) -> tuple[tuple[str, ErrorPart], ...]:
        """The error and its parts, with their names in tables."""
        return (
            (phrase("all, at left-out poses"), self.total),
            (phrase("noise of a reading"), self.noise),
            (phrase("the fit, by its poses"), self.fit),
            (phrase("the rest"), self.rest),
        )


@one_blas_thread()
def error_budget(
    model: ElasticModel,
    readings: Readings,
    options: FitOptions | None = None,
    marker_offset: ArrayLike | None = None,
) -> ErrorBudget:
    """Return the terms of the error at left-out poses, and the part that each takes from it.

    Parameters
    ----------
    model : ElasticModel
        Robot and springs, as chosen for these readings.
    readings : Readings
        Measurements, joints in the robot's order.
    options : FitOptions, optional
        Bounds, weights, loss, free frames. Priors and bounds of single springs apply to one model
        only and are not used, as in the ladder.
    marker_offset : array_like, shape (3,), optional
        Marker in the tcp frame, in m.

    Raises
    ------
    IdentificationError
        If there are too few poses.
    """
    options = _for_any_model(options or FitOptions())
    readings = with_references(model.robot, readings)
    problem = build(model, readings, options, marker_offset)
    if options.set_blunders_aside:
        readings = readings.set_aside(screen(problem).blunder)
        problem = build(model, readings, options, marker_offset)
    weight = solve(problem, options.loss).reading_weight
    chosen = problem.reweighted(weight)
    held_out, compliance = leave_poses_out(chosen), solve(chosen).compliance
    squares = _mean_squares(chosen, held_out)
    source = phrase("{poses} poses, each left out", poses=len(squares))
    total = _part(*_with_interval(squares), source)
    noise = _noise(model, readings, chosen, compliance)
    fit = _fit(chosen, held_out, compliance)
    ablation = _Ablation(model, readings, options, marker_offset, weight, squares)
    return ErrorBudget(
        deflection=float(np.sqrt(np.mean(np.sum(np.square(chosen.d), axis=1)))),
        total=total,
        noise=noise,
        fit=fit,
        rest=_rest(total, noise, fit),
        terms=tuple(ablation.worth(term) for term in _TERMS),
        readings=len(readings),
        poses=len(squares),
    )


def _for_any_model(options: FitOptions) -> FitOptions:
    """Return the options without those for single parameters; terms are of the tracker's rows."""
    lower = 0.0 if np.ndim(options.lower) else options.lower
    upper = np.inf if np.ndim(options.upper) else options.upper
    return replace(options, prior=None, lower=lower, upper=upper, encoders=False)


@dataclass(frozen=True, eq=False)
class _Ablation:
    """Models with one term more or less than the chosen one, on the same left-out poses."""

    model: ElasticModel
    readings: Readings
    options: FitOptions
    marker_offset: ArrayLike | None
    weight: FloatArray
    """Weights of the readings by the loss, shape (reading,)."""
    squares: FloatArray
    """Mean square errors of the chosen model at left-out pose blocks, shape (block,), in m^2."""

    def worth(self, term: TermName) -> TermWorth:
        """Return the reduction of the error at left-out poses by a term."""
        taken, reason = self._taken(term), self._refusal(term)
        if reason:
            return TermWorth(term, taken, None, None, None, None, reason)
        problem = self._other(term).reweighted(self.weight)
        squares = _mean_squares(problem, leave_poses_out(problem))
        difference = squares - self.squares if taken else self.squares - squares
        found = np.array(_with_interval(difference))
        worth, low, high = (np.sign(found) * np.sqrt(np.abs(found))).tolist()
        return TermWorth(term, taken, float(np.sqrt(squares.mean())), worth, low, high)

    def _taken(self, term: TermName) -> bool:
        """Return whether the chosen model has a term."""
        springs = self.model.springs
        return {
            "bearings": not all(map(self._is_axial, springs)),
            "gears": any(isinstance(each, Gear) and each.knees for each in springs),
            "friction": any(each.friction_limits for each in springs),
            "sag": self.model.robot.has_masses,
            "registration": self.options.free_frame != "none",
        }[term]

    def _refusal(self, term: TermName) -> str | None:
        """Return the reason why the readings do not allow a term to be judged."""
        if term in ("bearings", "gears", "friction") and not any(
            map(self._is_axial, self.model.springs)
        ):
            return phrase("not among these springs")
        if term == "friction" and not has_levels(self.readings):
            return phrase("no load case of low load")
        if term == "sag" and not self.model.robot.has_masses:
            return phrase("no masses in the URDF")
        return None

    def _other(self, term: TermName) -> Problem:
        """Return the problem of the model with this term taken out, or added."""
        if term in ("bearings", "gears", "friction"):
            model = ElasticModel(self.model.robot, self._other_springs(term))
            return build(model, self.readings, self.options, self.marker_offset)
        if term == "registration" and self._taken(term):
            options = replace(self.options, free_frame="none")
            return build(self.model, self.readings, options, self.marker_offset)
        problem = build(self.model, self.readings, self.options, self.marker_offset)
        if term == "registration":
            return _with_turn(problem, self.readings, self.model.parameters[0].scale)
        sag = sag_blocks_between(self.model, self.readings, self.marker_offset)
        return problem.with_springs(problem.O[:, :, problem.springs] - sag)

    def _other_springs(self, term: TermName) -> tuple[Spring, ...]:
        richest = "gears+friction" if has_levels(self.readings) else "gears"
        rich = RUNGS[richest].springs(self.model.robot, self.readings)
        springs, taken = self.model.springs, self._taken(term)
        if term == "bearings":
            source = springs if taken else rich
            axial = tuple(filter(self._is_axial, springs))
            more = () if taken else (each for each in source if not self._is_axial(each))
            return (*axial, *more)
        gears = {each.joint: each for each in rich if isinstance(each, Gear)}

        def changed(spring: Spring) -> Spring:
            if not self._is_axial(spring) or spring.joint not in gears:
                return spring
            knees = spring.knees if isinstance(spring, Gear) else ()
            slips = spring.friction_limits
            if term == "gears":
                knees = () if taken else gears[spring.joint].knees
            else:
                slips = () if taken else gears[spring.joint].slips
            plays = bool(slips)
            if isinstance(spring, Gear) and spring.slips:
                plays = spring.plays
            axis = spring.axes[0].axis
            return Gear(spring.name, spring.joint, axis, knees=knees, slips=slips, plays=plays)

        return tuple(map(changed, springs))

    def _is_axial(self, spring: Spring) -> bool:
        """Return whether a spring turns about its joint's own axis, as a gear does."""
        robot = self.model.robot
        joint = robot.chain.joints[robot.joint_names.index(spring.joint)]
        return len(spring.axes) == 1 and spring.axes[0].is_axis_of(joint)


def _with_turn(problem: Problem, readings: Readings, scale: float) -> Problem:
    """Return a problem with a turn of the tracker against the base, about the reference.

    A tracker that is turned by a small ``w`` shows ``dy = dx + w x dx``. That is all of a wrong
    registration that displacements show (`elastocal.identification.frames`).
    """
    columns = np.cross(np.eye(3), readings.marker_displacement[:, None, :]).swapaxes(1, 2)
    before, count = problem.prior_rows, problem.springs.stop
    prior = np.zeros((len(before) + 3, problem.columns + 4))
    prior[: len(before), :count] = before[:, :count]
    prior[: len(before), count + 3 :] = before[:, count:]
    prior[len(before) :, count : count + 3] = np.eye(3) * _READING / _TURN
    size = np.broadcast_to(problem.size, problem.lower.shape)
    free = np.full(3, np.inf)
    return replace(
        problem,
        O=np.insert(problem.O, [count] * 3, columns, axis=2),
        lower=np.insert(problem.lower, [count] * 3, -free),
        upper=np.insert(problem.upper, [count] * 3, free),
        prior_rows=prior,
        size=np.insert(size, [count] * 3, _TURN / scale),
    )


def _mean_squares(problem: Problem, held_out: HeldOut) -> FloatArray:
    """Return the mean square error of the readings of each pose block, shape (block,), in m^2."""
    _, index = np.unique(problem.block, return_inverse=True)
    return np.bincount(index, np.square(held_out.error)) / np.bincount(index)


def _with_interval(squares: FloatArray) -> tuple[float, float, float]:
    """Return the mean over pose blocks and the ends of its 95 % interval, in m^2."""
    found = corrected_mean(squares[:, None], Overlap.leaving_one_out(len(squares)))
    return float(found.mean[0]), float(found.low[0]), float(found.high[0])


def _part(square: float, low: float | None, high: float | None, source: str) -> ErrorPart:
    """Return a part of the error from its mean square, zero if that is negative."""
    low, high = (None if x is None else float(np.sqrt(max(x, 0.0))) for x in (low, high))
    return ErrorPart(float(np.sqrt(max(square, 0.0))), low, high, source)


def _fit(problem: Problem, held_out: HeldOut, compliance: FloatArray) -> ErrorPart:
    """Return the error that the choice of poses causes, by the jackknife over left-out poses."""
    folds = held_out.folds
    changes = problem.O @ (held_out.compliance - compliance).T
    square = (folds - 1) / folds * float(np.sum(np.square(changes))) / len(problem)
    return _part(square, None, None, phrase("{folds} refits, jackknife", folds=folds))


def _noise(
    model: ElasticModel, readings: Readings, problem: Problem, compliance: FloatArray
) -> ErrorPart:
    """Return the noise of a reading: the scatter of repeated ones, else as they state it."""
    residual = problem.residuals(compliance)
    pairs = np.stack([problem.block, np.unique(readings.load_case, return_inverse=True)[1]])
    _, group, count = np.unique(pairs, axis=1, return_inverse=True, return_counts=True)
    group = group.ravel()
    freedom = 3 * int(np.sum(count - 1))
    if freedom >= _FEWEST_REPEATS:
        sums = np.stack([np.bincount(group, column) for column in residual.T], axis=1)
        scatter = float(np.sum(np.square(residual - (sums / count[:, None])[group])))
        tail = 0.5 * (1.0 - CONFIDENCE)
        low, high = (3.0 * scatter / float(chdtri(freedom, p)) for p in (tail, 1.0 - tail))
        source = phrase("{count} repeated readings", count=freedom // 3)
        return _part(3.0 * scatter / freedom, low, high, source)
    if readings.marker_sigma is None:
        return ErrorPart(None, None, None, phrase("no repeated reading, no stated deviation"))
    return stated_noise(model, readings, compliance[: len(model.parameters)])


def stated_noise(model: ElasticModel, readings: Readings, compliance: FloatArray) -> ErrorPart:
    """Return the noise of a reading as the readings state it: root mean square of norms.

    Parameters
    ----------
    model : ElasticModel
        Turns a deviation of the force into one of the deflection.
    readings : Readings
        With their standard deviations, or without: then it is not known.
    compliance : ndarray, shape (parameter,)
        Compliance of the springs.
    """
    if readings.marker_sigma is None:
        return ErrorPart(None, None, None, phrase("no stated deviation"))
    square, source = np.sum(np.square(readings.marker_sigma), axis=1), phrase("stated: metrology")
    if readings.force_sigma is not None:
        place = (readings.joint_position, readings.force, readings.moment)
        C = model.cartesian_compliance(compliance, *place).translation
        square = square + np.sum(np.square(C * readings.force_sigma[:, None, :]), axis=(1, 2))
        source = phrase("stated: metrology and force sensor")
    return _part(float(square.mean()), None, None, source)


def _rest(total: ErrorPart, noise: ErrorPart, fit: ErrorPart) -> ErrorPart:
    """Return the part of the error that neither noise nor fit explains."""
    square, low, high = (
        (of_total or 0.0) ** 2 - (of_noise or 0.0) ** 2 - (fit.error or 0.0) ** 2
        for of_total, of_noise in (
            (total.error, noise.error),
            # The ends of both intervals that lie farthest apart.
            (total.low, noise.error if noise.high is None else noise.high),
            (total.high, noise.error if noise.low is None else noise.low),
        )
    )
    is_apart = noise.error is not None
    source = phrase("what noise and fit leave" if is_apart else "noise is in it")
    return _part(square, low, high, source)
