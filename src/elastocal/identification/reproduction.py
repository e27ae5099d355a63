"""Reproduction: a calibration is repeated to confirm its figures.

The fit is repeated from the dataset and the settings in the model file. If it gives the compliances
and the held-out errors of the file, model and data belong together, and the errors of single
readings give the intervals.
"""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from elastocal.arrays import FloatArray, IndexArray
from elastocal.dataset import Dataset, without
from elastocal.identification.calibrated import CalibratedModel
from elastocal.identification.calibration import Calibration, calibrate
from elastocal.identification.contact import at_tcp
from elastocal.identification.figures import CalibrationSummary
from elastocal.identification.knowledge import with_knowledge
from elastocal.identification.options import MINIMUM_DRAWS, FitSettings
from elastocal.identification.recertification import Estimate
from elastocal.identification.uncertainty import interval
from elastocal.results import brief_repr
from elastocal.wording import Phrase, mm, phrase

_DRAWS = 1000
"""Draws of whole poses, for the intervals of the errors."""
_MOST_ALONE = 3
"""Number of largest errors at one pose from which on that is said."""
_SAME = 1e-4
"""Relative difference below which two results are equal, also on different machines."""


@brief_repr
@dataclass(frozen=True)
class ErrorsAtOnePose:
    """The largest errors, which are all at one pose."""

    pose: int
    count: int
    rest: float
    """Largest error at the other poses, in m."""

    @property
    def sentence(self) -> Phrase:
        """The same in words."""
        return phrase(
            "The {count} largest errors are all at pose {pose}; at the other poses none exceeds"
            " {rest}.",
            count=self.count,
            pose=self.pose,
            rest=mm(self.rest),
        )


@brief_repr
@dataclass(frozen=True, eq=False)
class UnseenErrors:
    """Errors of predicted deflections at poses that were left out of the fit."""

    error: FloatArray
    """Norm of the error of each reading, shape (reading,), in m."""
    pose: IndexArray
    load_case: tuple[str, ...]
    folds: int
    """Number of refits."""
    mean: Estimate
    p95: Estimate
    """Largest error but for the worst 5 % of the readings."""

    @property
    def max(self) -> float:
        """Largest error in m."""
        return float(self.error.max())

    @property
    def poses(self) -> int:
        """Number of poses that were left out, one after the other."""
        return len(np.unique(self.pose))

    def beyond(self, tolerance: float) -> int:
        """Return how many readings have a larger error."""
        return int(np.count_nonzero(~(self.error <= tolerance)))

    def at_one_pose(self) -> "ErrorsAtOnePose | None":
        """Return the largest errors if they are all at one pose; None below three of them."""
        order = np.argsort(-self.error, kind="stable")
        pose = int(self.pose[order[0]])
        others = np.flatnonzero(self.pose[order] != pose)
        if not others.size or others[0] < _MOST_ALONE:
            return None
        return ErrorsAtOnePose(pose, int(others[0]), float(self.error[order[others[0]]]))


@dataclass(frozen=True, eq=False)
class Reproduction:
    """A calibration that was made once more."""

    calibration: Calibration
    unseen: UnseenErrors
    same: bool
    """Whether deflections and held-out errors are those of the model file."""


def reproduce_calibration(
    found: CalibratedModel, figures: CalibrationSummary | None, dataset: Dataset
) -> Reproduction:
    """Return the calibration of a dataset with the settings of a model file.

    Parameters
    ----------
    found : CalibratedModel
        The model.
    figures : CalibrationSummary, optional
        Its figures; without settings among them, defaults are taken.
    dataset : Dataset
        The readings that it should be made from.

    Raises
    ------
    ElastocalError
        If these readings give no calibration of this robot.
    """
    settings = (figures and figures.settings) or FitSettings()
    readings = dataset.readings(found.model.robot.joint_names)
    readings = without(readings, settings.exclude)
    marker = settings.marker or dataset.marker
    readings = at_tcp(found.model.robot, readings, marker)
    options, known = settings.options(MINIMUM_DRAWS), figures.known if figures else ()
    calibration = calibrate(
        found.model,
        readings,
        np.random.default_rng(0),
        with_knowledge(options, known, found.model, readings, marker),
        marker_offset=marker,
    )
    same = _same_deflections(calibration, found) and _same_errors(calibration, figures)
    return Reproduction(calibration, unseen_errors(calibration, np.random.default_rng(0)), same)


def unseen_errors(calibration: Calibration, rng: Generator) -> UnseenErrors:
    """Return the errors at left-out poses with intervals over resampled poses.

    The readings at one pose share what the model gets wrong there, so that whole poses are drawn
    (see `elastocal.identification.uncertainty`).

    Parameters
    ----------
    calibration : Calibration
        Whose poses were left out.
    rng : Generator
        Source of randomness.
    """
    held, used = calibration.held_out, calibration.used
    pose = np.asarray(calibration.readings.pose[used])
    cases = calibration.readings.load_case[used]
    blocks = [held.error[held.fold == fold] for fold in np.unique(held.fold)]
    chosen = rng.integers(len(blocks), size=(_DRAWS, len(blocks)))
    drawn = [np.concatenate([blocks[k] for k in row]) for row in chosen]
    return UnseenErrors(
        error=held.error,
        pose=pose,
        load_case=tuple(map(str, cases.tolist())),
        folds=held.folds,
        mean=_estimate(held.mean, np.array([each.mean() for each in drawn])),
        p95=_estimate(
            float(np.percentile(held.error, 95)), np.array([np.percentile(e, 95) for e in drawn])
        ),
    )


def _estimate(value: float, draws: FloatArray) -> Estimate:
    low, high = interval(draws)
    return Estimate(value, float(low), float(high))


def _same_deflections(calibration: Calibration, found: CalibratedModel) -> bool:
    """Return whether both predict the same; single springs may not be determined."""
    readings = calibration.readings
    blocks = found.model.observation_blocks(
        readings.joint_position, readings.force, readings.moment
    )
    return _alike(blocks @ calibration.calibrated.compliance, blocks @ found.compliance)


def _same_errors(calibration: Calibration, figures: CalibrationSummary | None) -> bool:
    held, stated = calibration.held_out, figures.held_out if figures else None
    if stated is None or stated.readings != len(held.error):
        return False
    return _alike(np.array([held.mean, held.max]), np.array([stated.mean, stated.max]))


def _alike(a: FloatArray, b: FloatArray) -> bool:
    if a.shape != b.shape:
        return False
    return bool(np.all(np.abs(a - b) <= _SAME * float(np.abs(b).max(initial=0.0))))
