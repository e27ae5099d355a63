"""From a dataset to a calibrated model: build, solve, certify (paper Eq. 15-19).

Prior knowledge in a spring file enters as bounds and a prior (`with_knowledge`). The compensation
and every prediction use the calibrated model.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike

from elastocal.arrays import BoolArray, FloatArray
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel, Parameter
from elastocal.errors import IdentificationError, present
from elastocal.findings import Finding, Kind, as_number
from elastocal.identification.calibrated import CalibratedModel, spring_rows
from elastocal.identification.contact import ContactSummary, contact_summary, untold_stacks
from elastocal.identification.domain import CalibrationDomain
from elastocal.identification.encoders import (
    EncoderSummary,
    EncoderZero,
    encoder_zeros,
    silent_encoders,
    strange_encoders,
)
from elastocal.identification.frames import FrameSummary, frame_summaries
from elastocal.identification.knowledge import expected_sizes
from elastocal.identification.ladder import Climbed
from elastocal.identification.mistakes import find_mistakes
from elastocal.identification.observability import (
    Observability,
    attainable_rank,
    find_faint,
    find_hidden,
    observability,
)
from elastocal.identification.options import MEDIAN_NORM, FitOptions
from elastocal.identification.problem import (
    Problem,
    contact_visibility,
    same_configuration,
)
from elastocal.identification.rungs import low_loads
from elastocal.identification.sag_share import with_sag_open
from elastocal.identification.solve import PoseGrams, Solution, factor, solve
from elastocal.identification.suspicious import Screening, screen
from elastocal.identification.tip_place import settle_tip, tip_with_interval
from elastocal.identification.uncertainty import (
    MOST_UNEXPLAINED,
    Coverage,
    HeldOut,
    bootstrap,
    distrust_factor,
    doubt,
    doubt_factor,
    interval,
    leave_poses_out,
    measured_coverage,
    noise_of_a_direction,
    profile_ends,
    widen_draws,
    widening_factor,
)
from elastocal.parallel import one_blas_thread
from elastocal.results import brief_repr
from elastocal.units import dimension_of_unit, largest

_PART_OF_DATA = 1e-2
"""Least part of the measured deflection that must change when springs go to their bounds."""
_LEVERS, _TRACKER = 0.3, 1e-5
"""Part of the noise, or of that of a tracker in m, that changed levers may make."""
_SOME_READINGS = 300
"""Readings that show how far the levers change."""

SAME_CONFIGURATION = Kind(
    "calibration.same-configuration",
    "poses {poses} are one configuration: resampled and left out together",
)
WEIGHT_GAP = Kind(
    "calibration.weight-gap",
    "robot {name}: {gap}: the arm's own weight bends it more or less under load than"
    " before, and this is taken for deflection; give the links their masses in a URDF",
)
NOT_DETERMINED = Kind(
    "calibration.not-determined",
    "poses and load cases determine {rank} of the {reach} directions that more of them"
    " would: predictions elsewhere are not covered",
)
UNFIT = Kind(
    "calibration.unfit",
    "at left-out poses the model leaves {left} of the deflection unexplained, more than"
    " half: it is not fit for use, and is not exported",
    shown={"left": as_number(".0%")},
)
WORSE_THAN_NONE = replace(
    UNFIT,
    name="calibration.worse-than-none",
    template=f"{UNFIT.template}; it predicts no better than none at all",
)
OTHER_CONTACT = Kind(
    "calibration.other-contact",
    "the readings have the {name} compliance of the contact at {found} nm/N, where the contact"
    " file states {stated} nm/N: does it describe this tip or disk, and are the forces in N?",
    shown={"found": as_number(".3g", 1e9), "stated": as_number(".3g", 1e9)},
)
UNTOLD_STACKS = Kind(
    "calibration.untold-stacks",
    "presses under one load at one pose travel {apart} mm apart, at {count} poses: were some of"
    " them on two disks? The dataset's contacts tells the number of disks of each press",
    shown={"apart": as_number(".3f", 1e3)},
)
NO_LIGHT_FORCE = Kind(
    "calibration.no-light-force",
    "reference_force is zero: a light contact without any force holds no tool, and displacements"
    " count from there",
)
SILENT_ENCODERS = Kind(
    "calibration.silent-encoders",
    "the secondary encoders of {joints} see nothing of their gears: do link positions repeat those"
    " of the motors?",
)
STRANGE_ENCODERS = Kind(
    "calibration.strange-encoders",
    "the secondary encoders of {joints} see what no load on their gears makes: is a sign turned, or"
    " a column that of another joint?",
)
LEVERS_CHANGE = Kind(
    "calibration.levers-change",
    "the arm yields by {most} mm, which changes its levers and with them deflections by {change}"
    " µm, beside {noise} µm of noise: springs behind short levers may be farther off than their"
    " intervals say; press with less",
    shown={
        "most": as_number(".2g", 1e3),
        "change": as_number(".2g", 1e6),
        "noise": as_number(".2g", 1e6),
    },
)
NOT_SETTLED = Kind(
    "calibration.loss-not-settled",
    "the {loss} loss had not settled when reweighting ended: its weights, and so the"
    " springs, depend on where it stopped",
)


@brief_repr
@dataclass(frozen=True, eq=False)
class Calibration:
    """A calibrated model with all evidence of its quality."""

    calibrated: CalibratedModel
    readings: Readings
    """The readings that were passed in, in the order of the arrays below."""
    used: BoolArray
    """Whether each reading entered the fit, shape (reading,), bool."""
    residual: FloatArray
    """``O c - d`` of every reading, shape (reading, 3), in m."""
    poses: int
    """Number of distinct poses."""
    attainable_rank: int
    """Rank that any number of poses and forces would reach; see `observability`."""
    held_out: HeldOut
    """Errors at left-out poses of the readings that entered the fit."""
    ladder: tuple[Climbed, ...]
    """Simpler and richer models at the same left-out poses; empty where none were tried."""
    coverage: Coverage
    """Measured coverage of the intervals of a prediction."""
    widening: float
    """Factor by which the draws of predictions were stretched; see `widening_factor`."""
    spring_widening: float
    """Factor by which those of the springs were: without the doubt about the model."""
    screening: Screening
    solution: Solution
    warnings: tuple[Finding, ...]
    frames: tuple[FrameSummary, ...] = ()
    """Frames that were estimated with the springs."""
    contact: ContactSummary | None = None
    """The contact that held the tool; None: a tracker measured every reading."""
    encoders: EncoderSummary | None = None
    """What secondary encoders brought; None: there are none."""

    @property
    def residual_norm(self) -> FloatArray:
        """Residual norm of each reading that entered the fit, in m."""
        return np.asarray(np.linalg.norm(self.residual[self.used], axis=1))

    @property
    def deflection_norm(self) -> FloatArray:
        """Measured deflection norm of each reading that entered the fit, in m."""
        return np.asarray(np.linalg.norm(self.readings.deflection[self.used], axis=1))


@one_blas_thread()
def calibrate(
    model: ElasticModel,
    readings: Readings,
    rng: Generator,
    options: FitOptions | None = None,
    *,
    marker_offset: ArrayLike | None = None,
    provenance: str = "",
    ladder: Sequence[Climbed] = (),
) -> Calibration:
    """Identify the compliances of a robot from measured readings.

    Parameters
    ----------
    model : ElasticModel
        Robot and springs.
    readings : Readings
        Measurements, joints in the robot's order; from `Dataset.readings`.
    rng : Generator
        Source of randomness of the bootstrap.
    options : FitOptions, optional
        Bounds, weights, loss, prior, number of draws.
    marker_offset : array_like, shape (3,), optional
        Metrology marker in the tcp frame, in m.
    provenance : str
        Where the readings came from; kept with the model.
    ladder : sequence of Climbed
        What the model was chosen from (`choose_model`), and what shows what it lacks
        (`Choice.lacked`); the former is kept with the calibration.

    Raises
    ------
    DatasetError
        If joints are outside the robot's limits or elsewhere than the recorded positions.
    ConventionError
        If the data fit only with a sign or frame read otherwise.
    IdentificationError
        If there are too few poses, or the bounds are impossible or leave the data no part.
    """
    model, options, problem = settle_tip(model, readings, options or FitOptions(), marker_offset)
    warnings = _data_warnings(model, readings, problem, options, marker_offset)
    screening, used, problem = _screened(problem, model, readings, options, marker_offset)
    kept, fitted = problem.take(used), readings.take(used)
    solution = solve(kept, options.loss)
    weighted = kept.reweighted(solution.reading_weight)
    held_out, doubting = leave_poses_out(weighted), _doubting(ladder, options.loss)
    unexplained = held_out.mean / float(np.linalg.norm(kept.d, axis=1).mean())
    springs, frames, c = weighted.springs, weighted.frame_columns, solution.compliance
    draws = _resampled(weighted, options.draws, rng, model.parameters)
    few, by = _widening(weighted, c, draws, held_out, ladder, unexplained)
    widened = _stretched(weighted, c, draws, by, model.parameters)
    seen = _seen(model, weighted.of_springs(), c[springs], options)
    calibrated = CalibratedModel(
        model,
        c[springs],
        widened[:, springs],
        seen,
        provenance,
        held_out.misfit,
        unexplained=unexplained,
        domain=CalibrationDomain.of(model.robot, fitted, kept.block),
        encoders=encoder_zeros(model, fitted, c[springs]) if options.encoders else (),
        spring_ends=_spring_ends(Fit(model, weighted, c), doubting, seen, draws, few),
        tip=(widened - c)[:, weighted.tip_columns] if weighted.tip else None,
    )
    reach = max(attainable_rank(model, marker_offset), calibrated.observability.rank)
    warnings += _fit_warnings(calibrated, reach, weighted) + _unsettled(solution, options.loss)
    warnings += _lever_warnings(calibrated, fitted, kept.residuals(c))
    encoders = _encoders(weighted, solution, held_out, calibrated.encoders)
    contact = _contact(model, weighted, fitted, options, widened, calibrated.tip)
    return Calibration(
        calibrated=calibrated,
        readings=readings,
        used=used,
        residual=problem.residuals(c),
        poses=len(np.unique(kept.block)),
        attainable_rank=reach,
        held_out=held_out,
        ladder=tuple(each for each in ladder if not each.beside),
        coverage=measured_coverage(weighted, held_out, widened - c, low_loads(fitted)),
        widening=by,
        spring_widening=few,
        screening=screening,
        solution=solution,
        warnings=(*warnings, *_encoder_warnings(encoders), *_contact_warnings(contact, options)),
        frames=frame_summaries(weighted.frames, c[frames], interval(widened[:, frames])),
        contact=contact,
        encoders=encoders,
    )


def _screened(
    problem: Problem,
    model: ElasticModel,
    readings: Readings,
    options: FitOptions,
    marker_offset: ArrayLike | None,
) -> tuple[Screening, BoolArray, Problem]:
    """Return the blunders, which readings are fitted, and their problem, the sag's share open."""
    found = screen(problem)
    used = ~found.blunder if options.set_blunders_aside else np.ones_like(found.blunder)
    return found, used, with_sag_open(problem, model, readings, used, options, marker_offset)


def _seen(
    model: ElasticModel, problem: Problem, compliance: FloatArray, options: FitOptions
) -> Observability:
    """Return what the readings tell of each spring."""
    # A prior makes nothing observable: what was believed before is not measured.
    seen = observability(factor(problem.without_prior()), model.springs, problem, compliance)
    seen = find_faint(seen, problem, compliance, model.parameters)
    sizes, held = expected_sizes(options.prior, problem, model.parameters)
    return find_hidden(seen, problem, compliance, model.parameters, sizes, held)


class Fit(NamedTuple):
    """A model that was fitted."""

    model: ElasticModel
    problem: Problem
    """Weighted as it was solved."""
    compliance: FloatArray
    """Shape (column,)."""


def _doubting(ladder: Sequence[Climbed], loss: str) -> list[Fit]:
    """Return fits of rungs that have all springs of the chosen one and more (`Climbed.told`)."""
    fits = []
    for each in ladder:
        if each.told is not None:
            found = solve(each.told, loss)
            weighted = each.told.reweighted(found.reading_weight)
            fits.append(Fit(each.model, weighted, found.compliance))
    return fits


def _spring_ends(
    fit: Fit, doubting: Sequence[Fit], seen: Observability, draws: FloatArray, by: float
) -> FloatArray:
    """Return the ends of the intervals of springs: of draws, and of the profiles of all fits.

    See `spring_rows`. Draws know which directions scatter more than others; profiles know what a
    spring may be whose neighbours a bound holds.

    Parameters
    ----------
    fit : Fit
        That of the model.
    doubting : sequence of Fit
        Those of models that have all its springs and more.
    seen : Observability
        What the readings tell of its springs.
    draws : ndarray, shape (draw, column)
        Draws of its fit.
    by : float
        Factor by which few poses stretch them.
    """
    model, fitted, compliance = fit
    rows = spring_rows(model.springs, seen)
    noise = noise_of_a_direction(fitted, compliance, draws)
    stretched = widen_draws(fitted, compliance, draws, by)[:, fitted.springs]
    found = [np.column_stack(interval(stretched @ rows.T))]
    for other, problem, c in (fit, *doubting):
        names = list(other.parameter_names)
        sums = np.zeros((len(rows), problem.columns))
        sums[:, [names.index(name) for name in model.parameter_names]] = rows
        found.append(profile_ends(problem, c, sums, noise))
    ends = np.column_stack([np.fmin.reduce(found)[:, 0], np.fmax.reduce(found)[:, 1]])
    most = np.abs(rows) @ _largest(model.parameters)
    return np.asarray(np.clip(ends, -most[:, None], most[:, None]))


def _encoders(
    problem: Problem, solution: Solution, held_out: HeldOut, zeros: tuple[EncoderZero, ...]
) -> EncoderSummary | None:
    """Return what secondary encoders brought; None where there are none."""
    if problem.encoders is None:
        return None
    folds = held_out.compliance[held_out.fold]
    found = problem.encoders.summary(problem.O, problem.d, solution.compliance, folds)
    return replace(found, zeros=zeros)


def _encoder_warnings(found: EncoderSummary | None) -> list[Finding]:
    """Return a finding about encoders that see nothing, or what gears do not do."""
    if found is None:
        return []
    kinds = (SILENT_ENCODERS, silent_encoders(found)), (STRANGE_ENCODERS, strange_encoders(found))
    return [kind(joints=", ".join(joints)) for kind, joints in kinds if joints]


def _contact(
    model: ElasticModel,
    problem: Problem,
    readings: Readings,
    options: FitOptions,
    draws: FloatArray,
    tip: FloatArray | None,
) -> ContactSummary | None:
    """Return the contact as it was found; None where a tracker measured every reading."""
    if options.contact is None or not problem.contact:
        return None
    own = problem.contact_columns
    found = np.median(draws[:, own], axis=0)
    # What the readings leave to the contact, they leave with the other sign to the arm.
    left = problem.O[:, :, own] @ (draws[:, own] - found).T
    zero = float(np.sqrt(np.mean(np.square(left))))
    seen = contact_visibility(problem, model)
    contact = options.contact if tip is None else tip_with_interval(options.contact, tip)
    return contact_summary(contact, readings, seen, (found, *interval(draws[:, own])), zero)


def _contact_warnings(found: ContactSummary | None, options: FitOptions) -> list[Finding]:
    if found is None or options.contact is None:
        return []
    return [
        OTHER_CONTACT(name=each.name, found=each.compliance, stated=each.stated)
        for each in found.figures
        if each.contradicts(options.contact.uncertainty)
    ]


def _largest(parameters: Sequence[Parameter]) -> FloatArray:
    """Return the largest compliance that any arm has of each parameter, in its unit."""
    dimensions = (present(dimension_of_unit(each.unit.si), "dimension") for each in parameters)
    return np.array([largest(each)[0] for each in dimensions])


def _as_of_arms(problem: Problem, draws: FloatArray, parameters: Sequence[Parameter]) -> FloatArray:
    """Return draws whose springs are no larger than compliances of any arm are.

    A spring that some choice of the poses does not turn takes any value in it.
    """
    most = _largest(parameters)
    found = draws.copy()
    found[:, problem.springs] = np.clip(draws[:, problem.springs], -most, most)
    return found


def _resampled(
    problem: Problem, count: int, rng: Generator, parameters: Sequence[Parameter]
) -> FloatArray:
    """Return the bootstrap draws."""
    draws = bootstrap(PoseGrams.of(problem), count, rng, problem.prior_error)
    return _as_of_arms(problem, draws, parameters)


def _stretched(
    problem: Problem,
    compliance: FloatArray,
    draws: FloatArray,
    by: float,
    parameters: Sequence[Parameter],
) -> FloatArray:
    """Return draws stretched about the estimate."""
    return _as_of_arms(problem, widen_draws(problem, compliance, draws, by), parameters)


def _widening(
    problem: Problem,
    compliance: FloatArray,
    draws: FloatArray,
    held_out: HeldOut,
    ladder: Sequence[Climbed],
    unexplained: float,
) -> tuple[float, float]:
    """Return the factors that widen draws: for few poses, and for model uncertainty besides.

    Another model would predict otherwise, while a spring has a value in its own model alone.
    """
    few = widening_factor(problem, compliance, draws, held_out.compliance)
    stretched = compliance + few * (draws - compliance)
    open_to_choice = [each for each in ladder if np.isfinite(each.apart)]
    figures = [(each.difference, each.standard_error, each.apart) for each in open_to_choice]
    beside = np.array([each.beside for each in open_to_choice], dtype=bool)
    difference, error, apart = np.array(figures).reshape(-1, 3).T
    moved = doubt(difference, error, apart, beside)
    by = few * doubt_factor(problem, compliance, stretched, moved)
    if not unexplained <= MOST_UNEXPLAINED:
        # No model of this arm: its springs are as far off as its predictions.
        by = max(by, distrust_factor(problem, compliance, draws, held_out))
        return by, by
    return few, by


def _data_warnings(
    model: ElasticModel,
    readings: Readings,
    problem: Problem,
    options: FitOptions,
    marker_offset: ArrayLike | None,
) -> list[Finding]:
    """Return a finding for each oddity of the data, or refuse them."""
    warnings: list[Finding] = [
        SAME_CONFIGURATION(poses=group) for group in same_configuration(readings, problem.block)
    ]
    if gap := model.robot.chain.weight_gap:
        warnings.append(WEIGHT_GAP(name=model.robot.name, gap=gap))
    warnings += _held_oddities(model, readings)
    return [*find_mistakes(model, readings, options, marker_offset), *warnings]


def _held_oddities(model: ElasticModel, readings: Readings) -> list[Finding]:
    """Return a finding for each oddity of readings that no tracker measured."""
    held = readings.by_contact
    if not held.any():
        return []
    found = []
    if (untold := untold_stacks(model.robot, readings)) is not None:
        found.append(UNTOLD_STACKS(apart=untold[0], count=untold[1]))
    if readings.reference_force is None or not np.any(readings.reference_force[held]):
        found.append(NO_LIGHT_FORCE())
    return found


def _fit_warnings(calibrated: CalibratedModel, reach: int, problem: Problem) -> list[Finding]:
    """Return the findings that limit the use of a fit; refuse one that no data decide."""
    _require_data_decide(problem, calibrated.compliance)
    warnings: list[Finding] = []
    missing = reach - calibrated.observability.rank
    if missing > 0:
        warnings.append(NOT_DETERMINED(rank=calibrated.observability.rank, reach=reach))
    left = calibrated.unexplained
    if not left <= MOST_UNEXPLAINED:
        warnings.append((UNFIT if left < 1.0 else WORSE_THAN_NONE)(left=left))
    return warnings


def _lever_warnings(
    calibrated: CalibratedModel, readings: Readings, residual: FloatArray
) -> list[Finding]:
    """Return the warning of an arm that yields so far that its levers are not those of the fit.

    The fit takes the levers at the joints of the controller (paper Eq. 10). Those halfway to where
    the joints have yielded are right to the second order.
    """
    some = np.unique(np.linspace(0, len(readings) - 1, _SOME_READINGS).astype(np.intp))
    model, c = calibrated.model, calibrated.compliance
    q, force = readings.joint_position[some], readings.force[some]
    yielded = model.joint_blocks(q, force) @ c
    as_fitted, halfway = (model.deflection(c, at, force) for at in (q, q + 0.5 * yielded))
    change = float(np.sqrt(np.mean(np.square(halfway - as_fitted))))
    noise = float(np.median(np.linalg.norm(residual, axis=1))) / MEDIAN_NORM
    if change <= _LEVERS * max(noise, _TRACKER):
        return []
    most = float(np.linalg.norm(as_fitted, axis=1).max())
    return [LEVERS_CHANGE(most=most, change=change, noise=noise)]


def _require_data_decide(problem: Problem, compliance: FloatArray) -> None:
    """Refuse a fit to which the data contribute nothing: the bounds alone determine it.

    A spring that hardly deflects the arm may lie between its bounds by rounding, so a test whether
    every spring ends at a bound does not suffice. The test is whether the data are explained worse
    when each spring moves to its nearest bound.
    """
    n = problem.springs
    lower, upper = problem.lower[n], problem.upper[n]
    bounded = np.where(compliance - lower <= upper - compliance, lower, upper)
    if not np.isfinite(bounded).all():
        return
    moved = (problem.O[:, :, n] @ (bounded - compliance)) * problem.weight
    if not np.linalg.norm(moved) > _PART_OF_DATA * np.linalg.norm(problem.d * problem.weight):
        raise IdentificationError(
            "every spring ends at a bound: the bounds, not the data, would make the model"
        )


def _unsettled(solution: Solution, loss: str) -> list[Finding]:
    """Return the warning of a loss whose weights still changed when reweighting ended."""
    if solution.settled:
        return []
    return [NOT_SETTLED(loss=loss)]
