"""Springs brought up to date by production that a tracker has watched.

A calibrated model is the prior: ``c = c_0 + L z`` with ``L L^T`` the covariance of its draws and
``z`` standard normal. Each course of production has a constant of its own, the place that its
marker is counted from, so rows and deflections count from their means over the course. With rows
``O`` and deflections ``d`` so centred, and their noise ``s``,

    min |O (c_0 + L z) - d|^2 / (s^2 g) + |z|^2,    |z_k| <= 3.

What the springs cannot explain changes slowly along a course: readings of one course are not
independent, and count by ``g = (1 + r) / (1 - r)`` less, ``r`` the correlation of neighbouring
residuals (Bayley and Hammersley 1946). The springs move only as far as the calibration doubted
them, and only if courses that were left out are predicted better for it, by more than one standard
error of the paired difference. Draws are moved alike, each with noise of its own (randomised
maximum a posteriori).

The calibrated model knows what production should look like: where it explains little of it, the
production is another arm's or is read wrongly, and nothing is learnt from it.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from operator import itemgetter

import numpy as np
from numpy.random import Generator
from numpy.typing import ArrayLike
from scipy.optimize import lsq_linear

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.dataset import Readings
from elastocal.errors import ConventionError, IdentificationError
from elastocal.findings import Finding, Grade, Kind, as_number
from elastocal.identification.calibrated import CalibratedModel
from elastocal.identification.contact import require_metrology
from elastocal.identification.conventions import (
    LEFT_BY_UNDOING,
    POOR_FIT,
    check_joints,
    mistakes_of,
)
from elastocal.identification.displacement import displacement_blocks, with_references
from elastocal.identification.paired import Overlap, paired_difference
from elastocal.records import record
from elastocal.results import brief_repr
from elastocal.wording import mm, phrase

LEAST_COURSES = 2
"""One course to learn from, and one to test the result."""
_FARTHEST = 3.0
"""Largest move of a direction of the draws, in standard deviations."""
_STIFFEST, _SOFTEST = 0.85, 2.0
"""Ratio of measured and predicted deflection within which an arm changes: it wears, and no arm gets
stiffer by more than a calibration errs."""
_MOST_CORRELATED = 0.99
_BY_MISTAKE, _SURE_ERRORS = 0.8, 3.0
"""Part of the error that may be left for a mistake to be named, and standard errors of the paired
difference that undoing it must gain."""
_LEAST_CONSTANT = 0.05
"""Part of the median force from which a constant, or the end of a drift, is named."""
_WIDE = 10.0
"""Standard deviation of a number of a mistake, in those that explain what the model leaves."""
_DEAD = 1e-6
"""Part of the motion of the controller below which an axis of the marker is dead: a tool in contact
may move a thousandth of it, and no instrument repeats so well."""
_NEGLIGIBLE = 1e-9
"""Share of the largest standard deviation below which a direction of the draws is left out."""

UNEXPLAINED = Kind(
    "update.unexplained",
    "{left} of how deflections differ along courses is left unexplained, at most {most} is allowed",
    advice="Look whether it is this arm, and whether forces, joints and marker are as stated.",
    shown=dict.fromkeys(("left", "most"), as_number(".0%")),
)
ANOTHER_ARM = Kind(
    "update.no-arm-changes-so-much",
    "production deflects {ratio} times as much as predicted, and no arm changes so much"
    " ({low} to {high} times are allowed)",
    advice="Check the gain of the force sensor; calibrate again if the arm has changed.",
    shown={"ratio": as_number(".2f"), "low": as_number("g"), "high": as_number("g")},
)
READ_OTHERWISE = Kind(
    "update.read-otherwise",
    "production seems to hold {mistake}: with that undone the error at left-out courses falls from"
    " {before} to {after} mm",
    advice="Look how forces and marker were recorded: zero, weight, clocks; give the courses anew.",
    shown=dict.fromkeys(("before", "after"), as_number(".3f", 1e3)),
)
DEAD_MARKER = Kind(
    "update.dead-marker",
    "marker_displacement_{axis} does not change along courses, although the tool moves along it",
    advice="Check the tracker's column.",
)
NO_GAIN = Kind(
    "update.no-gain",
    "nothing is gained at left-out courses beyond one standard error, {error} mm",
    grade=Grade.NOTE,
    shown={"error": as_number(".3f", 1e3)},
)


@brief_repr
@record()
class SpringUpdate:
    """Update of a model by tracked production; lengths in m."""

    readings: int
    courses: tuple[str, ...]
    before: float
    """Mean distance between measured and predicted deflection at left-out courses, each counted
    from its own mean, with the springs as they were."""
    after: float
    """The same with the springs of the other courses."""
    farthest: float
    """Largest move of a direction of the draws, in its standard deviations; 0 where none is."""
    ratio: float | None = None
    """Measured over predicted deflection, counted so too, by least squares; None in older files."""
    refusal: Finding | None = None
    """Why the springs were left as they were; None where they were moved, and in older files."""
    made_from: dict[str, str] = field(default_factory=dict)
    """SHA-256 of what each dataset says that has moved the springs, by its file, those of earlier
    updates too; older files have them among those of the calibration."""
    calibrated: tuple[float, ...] | None = None
    """Compliances of the calibration itself, before the first update that moved them, in
    rad/(N·m) or m/N; None: they were never moved, or by an older version."""

    @property
    def taken(self) -> bool:
        """Whether the springs were moved."""
        return self.farthest > 0.0

    def facts(self) -> Iterator[tuple[str, str]]:
        """Yield the main facts, a label and a text each."""
        yield "updated by", f"{self.readings} readings on {len(self.courses)} courses"
        yield (
            "at left-out courses",
            f"{mm(self.before)} mean with the springs as they were, {mm(self.after)} with those of"
            " the other courses",
        )
        if self.ratio is not None:
            yield "deflection", f"{self.ratio:.2f} times what the springs as they were predict"
        moved = f"by {self.farthest:.1f} standard deviations at most"
        yield "springs", moved if self.taken else "left as they were"
        if self.refusal is not None:
            yield "warning", self.refusal


def draws_factor(draws: FloatArray) -> FloatArray:
    """Return ``L`` with ``L L^T`` the covariance of bootstrap draws.

    The variance of a predicted deflection ``O c`` is then the squared length of the rows of
    ``O L``: a fixed number of products, where percentiles would need a sort.

    Parameters
    ----------
    draws : ndarray, shape (draw, spring)
        In rad/(N·m) or m/N.

    Returns
    -------
    ndarray, shape (spring, direction)
        At least one direction.
    """
    centred = (draws - draws.mean(axis=0)) / np.sqrt(max(len(draws) - 1, 1))
    _, s, vt = np.linalg.svd(centred, full_matrices=False)
    kept = s > _NEGLIGIBLE * s[0]
    kept[0] = True
    factor: FloatArray = vt[kept].T * s[kept]
    return factor


@dataclass(frozen=True, eq=False)
class _Rows:
    """Centred rows of tracked courses, in the directions of the draws."""

    A: FloatArray
    """Shape (reading, 3, direction), in m."""
    r: FloatArray
    """Deflection less that of the model, shape (reading, 3), in m."""
    course: IndexArray

    def take(self, rows: IndexArray) -> "_Rows":
        return _Rows(self.A[rows], self.r[rows], self.course[rows])

    def weight(self, z: FloatArray) -> float:
        """Return ``1 / (s^2 g)`` of the residuals that a move leaves, in 1/m²."""
        left = self.r - self.A @ z
        variance = float((left**2).sum()) / max(3 * (len(left) - len(np.unique(self.course))), 1)
        pairs = np.flatnonzero(self.course[1:] == self.course[:-1])
        along = float((left[pairs] * left[pairs + 1]).sum())
        r = along / max(float((left[pairs] ** 2).sum()), np.finfo(float).tiny)
        r = min(max(r, 0.0), _MOST_CORRELATED)
        return (1.0 - r) / ((1.0 + r) * max(variance, np.finfo(float).tiny))

    def moved(self) -> tuple[FloatArray, float]:
        """Return how far the directions move, in standard deviations, and the weight of a row."""
        z, k = np.zeros(self.A.shape[2]), self.A.shape[2]
        A, r = self.A.reshape(-1, k), self.r.ravel()
        for _ in range(3):
            root = np.sqrt(self.weight(z))
            rows = np.concatenate([root * A, np.eye(k)])
            target = np.concatenate([root * r, np.zeros(k)])
            z = lsq_linear(rows, target, (-_FARTHEST, _FARTHEST)).x
        return z, self.weight(z)

    def left_out(self) -> Iterator[tuple[BoolArray, FloatArray]]:
        """Yield which rows are of each course, and how far the others move the directions."""
        for number in range(int(self.course.max()) + 1):
            own = self.course == number
            z, _ = self.take(np.flatnonzero(~own)).moved()
            yield own, z


def update_springs(
    calibrated: CalibratedModel,
    readings: Readings,
    rng: Generator,
    marker_offset: ArrayLike | None = None,
) -> tuple[CalibratedModel, SpringUpdate]:
    """Return a model that tracked production has brought up to date, and what that is worth.

    Parameters
    ----------
    calibrated : CalibratedModel
        The model as it is.
    readings : Readings
        Of production; their campaigns are the courses, in the order of time.
    rng : Generator
        Source of the noise of the draws.
    marker_offset : array_like, shape (3,), optional
        Marker in the tcp frame, in m.

    Raises
    ------
    IdentificationError
        If there are fewer than `LEAST_COURSES`.
    ConventionError
        If the model explains them only with a sign, a frame or a unit read otherwise.
    DatasetError
        If joints are outside the robot's limits, or elsewhere than the recorded positions.
    """
    names = readings.campaign
    courses = tuple(dict.fromkeys(names.tolist())) if names is not None else ()
    if names is None or len(courses) < LEAST_COURSES:
        raise IdentificationError(
            f"{len(courses) or 1} course of production (coordinate campaign): at least"
            f" {LEAST_COURSES} are needed, one of them to be left out"
        )
    model, c = calibrated.model, calibrated.compliance
    course = np.array([courses.index(name) for name in names.tolist()], dtype=np.intp)
    require_metrology(readings)
    check_joints(model.robot, readings)
    measured = _centred(readings.deflection, course)
    blocks = _centred(displacement_blocks(model, readings, marker_offset), course)
    predicted = blocks @ c
    if not _left(measured, predicted) <= POOR_FIT:
        _require_read_as_stated(calibrated, readings, course, marker_offset)
    L = draws_factor(calibrated.draws)
    rows = _Rows(blocks @ L, measured - predicted, course)
    z, weight = rows.moved()
    before, after = np.zeros((2, len(courses), 1))
    for number, (own, others) in enumerate(rows.left_out()):
        move = blocks[own] @ (_springs(calibrated, c + L @ others) - c)
        before[number] = np.linalg.norm(rows.r[own], axis=1).mean()
        after[number] = np.linalg.norm(rows.r[own] - move, axis=1).mean()
    gain = paired_difference(before, after, Overlap.leaving_one_out(len(courses)))
    count = np.bincount(course)
    ratio = _ratio(measured, predicted)
    known = SpringUpdate(
        readings=len(readings),
        courses=courses,
        before=float(np.average(before[:, 0], weights=count)),
        after=float(np.average(after[:, 0], weights=count)),
        farthest=float(np.abs(z).max()),
        ratio=ratio,
    )
    left = known.after / _mean_length(measured)
    refusal = _mistake(calibrated, readings, rows, measured, predicted, marker_offset) or _refusal(
        left, ratio, float(gain.mean[0]), float(gain.standard_error[0])
    )
    if refusal is not None:
        return calibrated, replace(known, farthest=0.0, refusal=refusal)
    draws = _draws(calibrated, rows, L, weight, rng)
    compliance = _springs(calibrated, c + L @ z)
    return replace(calibrated, compliance=compliance, draws=draws, spring_ends=None), known


def _refusal(left: float, ratio: float, gain: float, standard_error: float) -> Finding | None:
    """Return why the springs are left as they were; None: they are moved.

    Parameters
    ----------
    left : float
        Part of the deflections that springs of the other courses leave unexplained.
    ratio : float
        Measured over predicted deflection.
    gain, standard_error : float
        Mean over the courses of what the error at a course falls by, in m.
    """
    if not left <= POOR_FIT:
        return UNEXPLAINED(left=left, most=POOR_FIT)
    if not _STIFFEST <= ratio <= _SOFTEST:
        return ANOTHER_ARM(ratio=ratio, low=_STIFFEST, high=_SOFTEST)
    return None if gain > standard_error else NO_GAIN(error=standard_error)


def _mistake(
    calibrated: CalibratedModel,
    readings: Readings,
    rows: _Rows,
    measured: FloatArray,
    predicted: FloatArray,
    marker_offset: ArrayLike | None,
) -> Finding | None:
    """Return the mistake whose undoing predicts left-out courses far better; None without one.

    Each has numbers that are estimated beside the move of the springs and beside one factor of all
    deflections: an arm that has worn is no mistake.
    """
    told = _centred(readings.controller_displacement, rows.course)
    seen = _centred(readings.marker_displacement, rows.course)
    for axis, (moves, reads) in enumerate(zip(_sizes(told), _sizes(seen), strict=True)):
        if reads < _DEAD * moves:
            return DEAD_MARKER(axis="xyz"[axis])
    softer = _beside(rows, predicted[..., None])
    before = _left_out(softer)
    found = []
    for message, least, columns in _mistakes(calibrated, readings, rows.course, marker_offset):
        wide = _beside(softer, columns)
        after = _left_out(wide)
        gain = paired_difference(before, after, Overlap.leaving_one_out(len(before)))
        is_sure = gain.mean[0] > _SURE_ERRORS * gain.standard_error[0]
        if not (is_sure and after.mean() < _BY_MISTAKE * before.mean()):
            continue
        numbers, _ = wide.moved()
        size = numbers[-columns.shape[2] :] * _scale(softer, columns)
        if float(abs(size).max()) > least:
            found.append((float(after.mean()), message))
    if not found:
        return None
    left, message = min(found, key=itemgetter(0))
    if not left <= POOR_FIT * _mean_length(measured):
        return None
    return READ_OTHERWISE(mistake=message, before=float(before.mean()), after=left)


def _sizes(values: FloatArray) -> list[float]:
    """Return the root mean square of each axis."""
    return [float(each) for each in np.sqrt(np.square(values).mean(axis=0))]


def _scale(rows: _Rows, columns: FloatArray) -> FloatArray:
    """Return the numbers of columns that explain several times what the model leaves."""
    size = np.sqrt(np.square(columns).mean(axis=(0, 1)))
    return np.asarray(_WIDE * np.sqrt(np.mean(np.square(rows.r))) / np.maximum(size, 1e-12))


def _beside(rows: _Rows, columns: FloatArray) -> _Rows:
    """Return rows with columns of shape (reading, 3, number), whose numbers are hardly known."""
    return replace(rows, A=np.concatenate([rows.A, columns * _scale(rows, columns)], axis=2))


def _left_out(rows: _Rows) -> FloatArray:
    """Return the mean error at each course by the others, shape (course, 1)."""
    left = (rows.r[own] - rows.A[own] @ z for own, z in rows.left_out())
    return np.array([[np.linalg.norm(each, axis=1).mean()] for each in left])


def _mistakes(
    calibrated: CalibratedModel,
    readings: Readings,
    course: IndexArray,
    marker_offset: ArrayLike | None,
) -> Iterator[tuple[str, float, FloatArray]]:
    """Yield mistakes, the least number that is named, and how far each number moves deflections.

    Shape (reading, 3, number), in m per unit of the number, counted as rows of courses are.
    """
    model, c = calibrated.model, calibrated.compliance
    f, m = readings.force, readings.marker_displacement
    unloaded = displacement_blocks(model, replace(readings, force=0.0 * f), marker_offset)

    def bent(force: FloatArray) -> FloatArray:
        pushed = displacement_blocks(model, replace(readings, force=force), marker_offset)
        return np.asarray((pushed - unloaded) @ c)

    R = model.robot.forward(readings.joint_position)[:, :3, :3]
    size = _LEAST_CONSTANT * float(np.median(np.linalg.norm(f, axis=1)))
    place = np.arange(len(f)) - np.searchsorted(course, course)
    passed = place / np.bincount(course)[course]
    for frame, X in (("tcp", R), ("base", np.broadcast_to(np.eye(3), R.shape))):
        pushed = np.stack([-bent(X[:, :, axis]) for axis in range(3)], axis=2)
        constant = phrase(
            "a constant force too much or too little in the {frame} frame", frame=frame
        )
        yield constant, size, _centred(pushed, course)
        drift = phrase(
            "a force whose zero drifts along each course, in the {frame} frame", frame=frame
        )
        yield drift, size, _centred(pushed * passed[:, None, None], course)
    late = (
        (1, phrase("forces that lag"), phrase("marker displacements that lag")),
        (-1, phrase("forces that run ahead"), phrase("marker displacements that run ahead")),
    )
    for step, of_force, of_marker in late:
        alone = (np.roll(course, step) != course)[:, None]
        change, seen = (np.where(alone, 0.0, each - np.roll(each, step, axis=0)) for each in (f, m))
        yield of_force, 0.0, _centred(bent(change)[..., None], course)
        yield of_marker, 0.0, _centred(-seen[..., None], course)


def _ratio(measured: FloatArray, predicted: FloatArray) -> float:
    """Return measured over predicted deflections, by least squares; 0 where none is predicted."""
    square = float((predicted**2).sum())
    return float((measured * predicted).sum()) / square if square > 0.0 else 0.0


def _left(measured: FloatArray, predicted: FloatArray) -> float:
    """Return the part of deflections that predictions leave unexplained."""
    return float(np.linalg.norm(measured - predicted, axis=1).mean()) / _mean_length(measured)


def _mean_length(deflections: FloatArray) -> float:
    """Return their mean length, to divide by."""
    return max(float(np.linalg.norm(deflections, axis=1).mean()), np.finfo(float).tiny)


def _require_read_as_stated(
    calibrated: CalibratedModel,
    readings: Readings,
    course: IndexArray,
    marker_offset: ArrayLike | None,
) -> None:
    """Refuse production that is explained poorly as stated, and well with something read otherwise.

    Raises
    ------
    ConventionError
        With the mistake.
    """
    model, c = calibrated.model, calibrated.compliance

    def differ(stated: Readings) -> tuple[FloatArray, FloatArray]:
        blocks = displacement_blocks(model, stated, marker_offset)
        return _centred(stated.deflection, course), _centred(blocks @ c, course)

    sought = with_references(model.robot, readings)
    measured, predicted = differ(sought)
    stated = _left(measured, predicted)
    found = [
        (_left(*differ(mistake.undo(model.robot, sought))), mistake.message)
        for mistake in mistakes_of(model.robot)
    ]
    ratio = _ratio(measured, predicted)
    if ratio > 0.0:
        message = (
            f"production deflects {ratio:.3g} times as much as its forces say: another unit of"
            " force or displacement"
        )
        found.append((_left(measured, ratio * predicted), message))
    best, message = min(found)
    if best <= min(LEFT_BY_UNDOING * stated, POOR_FIT):
        raise ConventionError(
            f"{message}: read that way the calibrated springs leave {best:.0%} of how deflections"
            f" differ along courses unexplained, as stated {stated:.0%}"
        )


def _centred(values: FloatArray, course: IndexArray) -> FloatArray:
    """Return values less their mean over each course, along the first axis."""
    centred = np.array(values, dtype=float)
    for number in np.unique(course):
        own = course == number
        centred[own] -= centred[own].mean(axis=0)
    return centred


def _springs(calibrated: CalibratedModel, compliance: FloatArray) -> FloatArray:
    """Return compliances, shape (..., parameter), none of them below what a spring can have."""
    lower = np.array([parameter.lower for parameter in calibrated.model.parameters])
    possible: FloatArray = np.maximum(compliance, lower)
    return possible


def _draws(
    calibrated: CalibratedModel, rows: _Rows, L: FloatArray, weight: float, rng: Generator
) -> FloatArray:
    """Return the draws moved alike, each from where it was and with noise of its own."""
    k = L.shape[1]
    A = rows.A.reshape(-1, k)
    before = (calibrated.draws - calibrated.compliance) @ np.linalg.pinv(L).T
    noise = rng.standard_normal((len(before), k))
    H = weight * A.T @ A
    # A^T e of noise e has the covariance A^T A / weight: drawn as such, not row by row.
    root = np.linalg.cholesky(H + _NEGLIGIBLE * np.trace(H) / k * np.eye(k))
    target = weight * A.T @ rows.r.ravel() + noise @ root.T + before
    z = np.clip(np.linalg.solve(H + np.eye(k), target.T).T, -2 * _FARTHEST, 2 * _FARTHEST)
    return _springs(calibrated, calibrated.compliance + z @ L.T)
