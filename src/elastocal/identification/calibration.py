"""From a dataset to a calibrated model: build, solve, certify (paper Eq. 15-19)."""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike

from elastocal.arrays import BoolArray, FloatArray
from elastocal.dataset import Readings
from elastocal.elastic import LAYOUTS, ElasticModel
from elastocal.errors import ConventionError, IdentificationError
from elastocal.identification._force_offset import force_offset
from elastocal.identification.calibrated import CalibratedModel
from elastocal.identification.conventions import POOR, check_conventions
from elastocal.identification.joint_check import check_joints
from elastocal.identification.observability import attainable_rank, observability
from elastocal.identification.options import FitOptions
from elastocal.identification.problem import Problem, build, same_configuration
from elastocal.identification.refits import PoseGrams
from elastocal.identification.solve import Solution, factor, solve
from elastocal.identification.suspicious import Screening, screen
from elastocal.identification.uncertainty import (
    Comparison,
    HeldOut,
    bootstrap,
    compare_layouts,
    leave_poses_out,
    widen_draws,
    widening_factor,
)
from elastocal.parallel import one_blas_thread
from elastocal.results import brief_repr


@brief_repr
@dataclass(frozen=True, eq=False)
class Calibration:
    """A calibrated model with everything that says how far to trust it."""

    calibrated: CalibratedModel
    readings: Readings
    """The readings that were offered, in the order of the arrays below."""
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
    comparison: Comparison | None
    """The 6-spring model on the same left-out poses (or the 18-spring one against it)."""
    widening: float
    """Factor by which the bootstrap draws were stretched; see `widening_factor`."""
    screening: Screening
    solution: Solution
    warnings: tuple[str, ...]

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

    Raises
    ------
    DatasetError
        If joints are outside the robot's limits or elsewhere than the recorded positions.
    ConventionError
        If the data fit only with a sign or frame read otherwise.
    IdentificationError
        If there are too few poses, or the bounds are impossible or leave the data no part.
    """
    options = options or FitOptions()
    problem = build(model, readings, options, marker_offset)
    doubts = _doubts(model, readings, problem, options, marker_offset)
    screening = screen(problem)
    used = ~screening.blunder if options.set_blunders_aside else np.ones_like(screening.blunder)
    kept = problem.take(used)
    solution = solve(kept, options.loss)
    weighted = kept.reweighted(solution.reading_weight)
    held_out = leave_poses_out(weighted)
    draws = bootstrap(PoseGrams.of(weighted), options.draws, rng)
    by = widening_factor(weighted, solution.compliance, draws, held_out.compliance)
    calibrated = CalibratedModel(
        model,
        solution.compliance,
        widen_draws(weighted, solution.compliance, draws, by),
        # A prior makes nothing observable: what was believed before is not measured.
        observability(factor(weighted.without_prior()), model.springs),
        provenance,
        held_out.misfit,
    )
    offset = force_offset(model, readings.take(used), weighted, solution.compliance, marker_offset)
    reach = max(attainable_rank(model, marker_offset), calibrated.observability.rank)
    doubts += [offset.message()] if offset else []
    doubts += _worth(calibrated, reach, held_out, weighted)
    return Calibration(
        calibrated=calibrated,
        readings=readings,
        used=used,
        residual=problem.residuals(solution.compliance),
        poses=len(np.unique(kept.block)),
        attainable_rank=reach,
        held_out=held_out,
        comparison=_compare(model, weighted, held_out, rng),
        widening=by,
        screening=screening,
        solution=solution,
        warnings=tuple(doubts),
    )


def _doubts(
    model: ElasticModel,
    readings: Readings,
    problem: Problem,
    options: FitOptions,
    marker_offset: ArrayLike | None,
) -> list[str]:
    """Return what is odd about the data before they are fitted, or refuse them."""
    doubts = list(check_joints(model.robot, readings)) + [
        f"poses {', '.join(map(str, group))} are one configuration: resampled and left out together"
        for group in same_configuration(readings, problem.block)
    ]
    try:
        left = check_conventions(model, readings, marker_offset)
    except ConventionError as error:
        if not options.trust_conventions:
            raise
        return [*doubts, f"fitted in spite of this: {error}"]
    if left > POOR:
        doubts.append(f"the springs leave {left:.0%} of the median deflection unexplained")
    return doubts


def _worth(
    calibrated: CalibratedModel, reach: int, held_out: HeldOut, problem: Problem
) -> list[str]:
    """Return what limits the use of a fit, or refuse one that the data had no part in."""
    c = calibrated.compliance
    if np.all((c == problem.lower) | (c == problem.upper)):
        raise IdentificationError(
            "every spring ends at a bound: the bounds, not the data, would make the model"
        )
    doubts = []
    missing = reach - calibrated.observability.rank
    if missing > 0:
        doubts.append(
            f"poses and load cases determine {calibrated.observability.rank} of the {reach}"
            " directions that more of them would: predictions elsewhere are not covered"
        )
    deflection = float(np.linalg.norm(problem.d, axis=1).mean())
    if held_out.mean >= deflection:
        doubts.append("at left-out poses the model predicts no better than none at all")
    return doubts


def _compare(
    model: ElasticModel, problem: Problem, ours: HeldOut, rng: Generator
) -> Comparison | None:
    """Fit the 6-spring model to the same readings when ours contains it."""
    actuated = [spring.name for spring in LAYOUTS["actuated"](model.robot)]
    names = list(model.parameter_names)
    if names == actuated or not set(actuated) <= set(names):
        return None
    columns = np.array([names.index(name) for name in actuated], dtype=np.intp)
    try:
        other = leave_poses_out(problem.with_columns(columns))
    except IdentificationError:
        return None
    return compare_layouts(ours, other, "actuated", problem, rng)
