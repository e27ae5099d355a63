"""From a dataset to a calibrated model: build, solve, certify (paper Eq. 15-19)."""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike

from elastocal.arrays import BoolArray, FloatArray
from elastocal.dataset import Readings
from elastocal.elastic import LAYOUTS, ElasticModel
from elastocal.errors import IdentificationError
from elastocal.identification.bootstrap import bootstrap
from elastocal.identification.calibrated import CalibratedModel
from elastocal.identification.conventions import POOR, check_conventions
from elastocal.identification.force_offset import force_offset
from elastocal.identification.grams import PoseGrams
from elastocal.identification.held_out import Comparison, HeldOut, compare, leave_poses_out
from elastocal.identification.joint_check import check_joints
from elastocal.identification.observability import observability
from elastocal.identification.options import FitOptions
from elastocal.identification.poses import same_configuration
from elastocal.identification.problem import Problem, build
from elastocal.identification.solve import Solution, factor, solve
from elastocal.identification.suspicious import Screening, screen
from elastocal.identification.widening import widen, widening


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
    held_out: HeldOut
    """Errors at left-out poses of the readings that entered the fit."""
    comparison: Comparison | None
    """The 6-spring model on the same left-out poses (or the 18-spring one against it)."""
    widening: float
    """Factor by which the bootstrap draws were stretched; see `widening`."""
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
        If there are too few poses or the bounds are impossible.
    """
    options = options or FitOptions()
    warnings = list(check_joints(model.robot, readings))
    problem = build(model, readings, options, marker_offset)
    warnings += _repeated(readings, problem)
    left = check_conventions(model, readings, marker_offset)
    if left > POOR:
        warnings.append(f"the springs leave {left:.0%} of the median deflection unexplained")

    screening = screen(problem)
    used = ~screening.blunder if options.set_blunders_aside else np.ones_like(screening.blunder)
    kept = problem.take(used)
    solution = solve(kept, options.loss)
    weighted = kept.reweighted(solution.reading_weight)
    held_out = leave_poses_out(weighted)
    draws = bootstrap(PoseGrams.of(weighted), options.draws, rng)
    by = widening(weighted, solution.compliance, draws, held_out.compliance)
    calibrated = CalibratedModel(
        model,
        solution.compliance,
        widen(weighted, solution.compliance, draws, by),
        # A prior makes nothing observable: what was believed before is not measured.
        observability(factor(weighted.without_prior()), model.springs),
        provenance,
    )
    offset = force_offset(model, readings.take(used), weighted, solution.compliance, marker_offset)
    warnings += [offset.message()] if offset else []
    return Calibration(
        calibrated=calibrated,
        readings=readings,
        used=used,
        residual=problem.residuals(solution.compliance),
        poses=len(np.unique(kept.block)),
        held_out=held_out,
        comparison=_compare(model, weighted, held_out, rng),
        widening=by,
        screening=screening,
        solution=solution,
        warnings=tuple(warnings),
    )


def _repeated(readings: Readings, problem: Problem) -> list[str]:
    return [
        f"poses {', '.join(map(str, group))} are one configuration: resampled and left out together"
        for group in same_configuration(readings, problem.block)
    ]


def _compare(
    model: ElasticModel, problem: Problem, ours: HeldOut, rng: Generator
) -> Comparison | None:
    """Fit the 6-spring model to the same readings when ours contains it."""
    actuated = [spring.name for spring in LAYOUTS["actuated"](model.robot)]
    names = list(model.spring_names)
    if names == actuated or not set(actuated) <= set(names):
        return None
    columns = np.array([names.index(name) for name in actuated], dtype=np.intp)
    try:
        other = leave_poses_out(problem.with_springs(columns))
    except IdentificationError:
        return None
    return compare(ours, other, "actuated", problem, rng)
