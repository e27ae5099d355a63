"""Comparison of two calibrations of one cell: changes and their significance (recertification).

The verdict is pass, fail or undecided, with the missing evidence and caveats in words.

Changes concern springs, and deflections along rows of joints and forces.

The draws of the two models describe the uncertainty of each estimate; the campaigns are
independent, so a draw of one may be combined with any draw of the other. Draws with the same number
are never paired: calibrations made with the same seed resample the same poses, and on the same plan
such a pair would agree too well.

**Springs.** With a 5 % test of each of 14 springs, about every fourth pair of campaigns of an
unchanged cell would name one. So the interval that decides holds for all of them at once:
``difference ± t se`` with one ``t``, the 95th percentile over pairs of draws of the largest
``|noise| / se`` (Efron and Tibshirani 1993; the single-step maxT of Westfall and Young,
*Resampling-Based Multiple Testing*, 1993). Unlike Bonferroni's it needs no percentile far out in
the tail, which 200 draws do not have, and it allows for correlated errors of springs.

**Deflections.** With ``delta`` the difference of two predictions at a row and ``noise`` its error
against the true difference ``Delta``, the triangle inequality gives for any ``Delta``

    |delta| - |noise|  <=  |Delta|  <=  |delta| + e . noise,    e = Delta / |Delta|.

The lower bound of the largest change must hold for all rows at once, since the row is unknown. From
above each row needs only its own bound: the true largest change is at some row, and is missed only
if that row's own bound is (intersection-union test; Berger, Technometrics 24, 1982).

Draws describe the variation over other poses *of the same kind*. Between campaigns at other poses
or under other loads the model error does not cancel, so the misfit of both models is then added to
``noise`` in quadrature.
"""

import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray, IndexArray
from elastocal.elastic import ElasticModel
from elastocal.errors import IdentificationError, RobotError, SpringError
from elastocal.identification.calibrated import CalibratedModel, check_rows
from elastocal.identification.displacement import displacement_blocks
from elastocal.identification.domain import CalibratedLoads, CalibrationDomain
from elastocal.identification.figures import CalibrationSummary
from elastocal.identification.model_file import CalibrateResult, ModelSource, model_name
from elastocal.identification.production import CoveredRows, covered_rows
from elastocal.identification.recertification._sums import (
    common_springs,
    comparable_sums,
    shared_numbers,
)
from elastocal.identification.recertification.arms import (
    ComparedRows,
    arm_notes,
    check_same_robot,
    count_outside_limits,
    model_on,
)
from elastocal.identification.recertification.result import (
    LEAST_COVERED,
    CommonGround,
    CompareResult,
    CompareSummary,
    Estimate,
    RowComparison,
    SpringChange,
    Verdict,
)
from elastocal.identification.spring_sums import sum_text, sum_weights
from elastocal.identification.uncertainty import CONFIDENCE, NORMAL_QUANTILE, interval
from elastocal.records import read_json
from elastocal.robot import Robot
from elastocal.units import in_unit, quantity
from elastocal.wording import Phrase, counted, mm, phrase

_SHIFTS = 10
"""Number of draws of the new model that each draw of the old one is paired with."""
_NAMES = (phrase("the old model"), phrase("the new model"))
_CHUNK = 100
"""Rows at a time, so that the pairs of a long path fit into memory."""
_ONE_SIDE = 50.0 * (1.0 + CONFIDENCE)
"""Percentile that leaves out half of what a 95 % interval leaves out."""
_Blocks = tuple[FloatArray, FloatArray]
"""Rows of the old and of the new model that times its parameters are deflections."""


@dataclass(frozen=True, eq=False)
class Spread:
    """Deviations of the draws of two models from their estimates, in pairs."""

    old: FloatArray
    """Draw minus estimate, shape (draw, old spring), in the springs' units."""
    new: FloatArray
    """The same, shape (draw, new spring)."""
    first: FloatArray
    """Deviation of the old model in each pair, shape (pair, old spring)."""
    second: FloatArray
    """Deviation of the new model in each pair, shape (pair, new spring)."""

    @classmethod
    def of(cls, old: CalibratedModel, new: CalibratedModel) -> "Spread":
        """Return the deviations of two models."""
        deviations = [each.draws - each.compliance for each in (old, new)]
        most, pairs = max(map(len, deviations)), min(map(len, deviations))
        # Whole turns over the longer list; each turn shifts the shorter one on.
        step = max(1, pairs // (_SHIFTS + 1))
        number = np.arange(most)
        shifted = np.concatenate([number + step * (turn + 1) for turn in range(_SHIFTS)])
        tiled = np.tile(number, _SHIFTS)
        return cls(
            deviations[0],
            deviations[1],
            deviations[0][tiled % len(deviations[0])],
            deviations[1][shifted % len(deviations[1])],
        )

    def noise(self, old_rows: FloatArray, new_rows: FloatArray) -> FloatArray:
        """Return the random part of the difference of linear functions of the compliances.

        Parameters
        ----------
        old_rows, new_rows : ndarray, shape (..., spring)
            The functions, e.g. observation blocks.

        Returns
        -------
        ndarray, shape (pair, ...)
            New minus old.
        """
        return np.moveaxis(new_rows @ self.second.T - old_rows @ self.first.T, -1, 0)

    def covariance(self) -> tuple[FloatArray, FloatArray]:
        """Return the second moments of the deviations, each of shape (spring, spring)."""
        old, new = (each.T @ each / len(each) for each in (self.old, self.new))
        return old, new


def common_ground(
    old: CalibratedModel, new: CalibratedModel, rows: ComparedRows | None, arm: Robot
) -> tuple[CommonGround | None, IndexArray]:
    """Return the range that both campaigns cover, and the numbers of the rows that are compared.

    Where both models say how gears stiffen, other loads are no obstacle to hold springs against
    one another: those of gears are compared over the torques that both met.

    Parameters
    ----------
    old, new : CalibratedModel
        As calibrated.
    rows : ComparedRows, optional
        Those that matter, of an arm with its tool.
    arm : Robot
        That arm.
    """
    count = 0 if rows is None else len(rows)
    number = np.arange(count)
    if old.domain is None or new.domain is None:
        return None, number
    if rows is not None:
        old_rows, new_rows = (
            _covered(each, arm, rows.q, rows.force, rows.moment)
            for each in (old.domain, new.domain)
        )
        number = np.flatnonzero(old_rows.covered & new_rows.covered)
    of_old = _readings_covered(old.domain, new.domain, old.model.robot)
    of_new = _readings_covered(new.domain, old.domain, new.model.robot)
    covered = float(of_old.covered.mean()), float(of_new.covered.mean())
    stiffen = old.model.bears_weight and new.model.bears_weight
    near = float(of_old.near.mean()), float(of_new.near.mean())
    judged = min(near if stiffen else covered) >= LEAST_COVERED
    counts = (None, None) if rows is None else (count, len(number))
    return CommonGround(*covered, judged, *counts), number


def _covered(
    domain: CalibrationDomain,
    robot: Robot,
    q: FloatArray,
    force: FloatArray,
    moment: FloatArray | None,
) -> CoveredRows:
    return covered_rows(robot, CalibratedLoads.of_domain(robot, domain), q, force, moment)


def _readings_covered(
    own: CalibrationDomain, other: CalibrationDomain, robot: Robot
) -> CoveredRows:
    """Return which readings of a calibration another one covers, with the tool of the first."""
    return _covered(other, robot, own.joint_position[own.reading_pose], own.force, own.moment)


def over(numbers: FloatArray, scale: FloatArray) -> FloatArray:
    """Return numbers over their scale; 0 where the scale is 0."""
    return np.divide(numbers, scale, out=np.zeros_like(numbers), where=scale > 0.0)


def _row_blocks(
    models: tuple[ElasticModel, ElasticModel], rows: ComparedRows, number: IndexArray
) -> Callable[[slice], _Blocks]:
    """Return the function that gives the blocks of numbered rows, for the old and the new model."""
    if rows.readings is not None:
        shown = [displacement_blocks(each, rows.readings)[number] for each in models]
        return lambda part: (shown[0][part], shown[1][part])
    some, friction = rows.taken(number), [rows.friction(each) for each in models]
    friction_torque = [None if each is None else each[number] for each in friction]

    def blocks_of(part: slice) -> _Blocks:
        m = None if some.moment is None else some.moment[part]
        first, second = (
            each.observation_blocks(
                some.q[part], some.force[part], m, friction=None if held is None else held[part]
            )
            for each, held in zip(models, friction_torque, strict=True)
        )
        return first, second

    return blocks_of


def compare_rows(
    old: CalibratedModel,
    new: CalibratedModel,
    spread: Spread,
    rows: ComparedRows,
    number: IndexArray | None = None,
    *,
    alike: bool = True,
) -> RowComparison:
    """Return the change of the deflection at every row, on average and at most.

    Parameters
    ----------
    old, new : CalibratedModel
        Two calibrations of one robot.
    spread : Spread
        Spread of the two models.
    rows : ComparedRows
        All of them, since friction remembers.
    number : ndarray of int, shape (row,), optional
        Numbers of the rows that count; all by default.
    alike : bool
        Whether both campaigns were made at like poses and loads. If not, what springs cannot
        express differs between them, and the intervals hold it: the misfit of both models.
    """
    number = np.arange(len(rows)) if number is None else number
    some, blocks_of = rows.taken(number), _row_blocks((old.model, new.model), rows, number)
    count = len(some)
    deflection = np.empty((2, count, 3))
    below, above, scale, share = np.empty((4, count))
    farthest, total = np.zeros((2, len(spread.first)))
    for start in range(0, count, _CHUNK):
        part = slice(start, start + _CHUNK)
        blocks = blocks_of(part)
        deflection[0, part] = blocks[0] @ old.compliance
        deflection[1, part] = blocks[1] @ new.compliance
        norms = np.linalg.norm(spread.noise(*blocks), axis=2)
        scale[part] = np.sqrt(np.mean(np.square(norms), axis=0))
        below[part] = np.percentile(norms, _ONE_SIDE, axis=0)
        above[part], share[part] = _widest(blocks, spread)
        farthest = np.maximum(farthest, over(norms, scale[part]).max(axis=1))
        total += norms.sum(axis=1)
    size = np.linalg.norm(deflection[1] - deflection[0], axis=1)
    missed = np.zeros(count) if alike else _misfit((old, new), deflection)
    t = np.percentile(farthest, _ONE_SIDE)
    # The draws are stretched for few poses already.
    high = size + np.hypot(NORMAL_QUANTILE * above, missed)
    surely = size - np.hypot(t * scale, missed)
    # What springs cannot express is no noise: it does not average out over rows.
    off = float(np.hypot(np.percentile(total / count, 100.0 * CONFIDENCE), missed.mean()))
    mean = float(size.mean())
    return RowComparison(
        number=number,
        q=some.q,
        force=some.force,
        moment=some.moment,
        tcp_position=new.model.robot.forward(some.q)[:, :3, 3],
        old=deflection[0],
        new=deflection[1],
        low=np.maximum(size - np.hypot(below, missed), 0.0),
        high=high,
        old_share=share,
        mean=Estimate(mean, max(mean - off, 0.0), mean + off),
        largest=Estimate(float(size.max()), max(float(surely.max()), 0.0), float(high.max())),
    )


def compare_calibrated_poses(
    old: CalibratedModel, new: CalibratedModel, spread: Spread
) -> RowComparison | None:
    """Return the change over the readings of the new calibration that the old one covers.

    None where there are none, or a model does not state its domain.
    """
    if new.domain is None:
        return None
    arm, rows = new.model.robot, ComparedRows.of_calibration(new.domain)
    ground, number = common_ground(old, new, rows, arm)
    if ground is None or not len(number):
        return None
    return compare_rows(model_on(old, arm), new, spread, rows, number, alike=ground.alike)


def _misfit(models: tuple[CalibratedModel, CalibratedModel], deflection: FloatArray) -> FloatArray:
    """Return the error of a change by the misfit of two models, shape (row,), in m."""
    errors = [
        each.misfit.error(size) if each.misfit.is_known else np.zeros_like(size)
        for each, size in zip(models, np.linalg.norm(deflection, axis=2), strict=True)
    ]
    return np.asarray(np.hypot(*errors))


def _widest(blocks: _Blocks, spread: Spread) -> tuple[FloatArray, FloatArray]:
    """Return the standard error in the direction in which it is largest, and the old one's part.

    Both of shape (row,): in m, and as a part of the variance in that direction.
    """
    parts = [
        rows @ S @ np.swapaxes(rows, -1, -2)
        for rows, S in zip(blocks, spread.covariance(), strict=True)
    ]
    both = parts[0] + parts[1]
    if not np.all(np.isfinite(both)):
        raise IdentificationError(
            "the intervals of the models at the rows are no finite numbers: draws or forces are of"
            " an impossible size"
        )
    variance, axes = np.linalg.eigh(both)
    widest, axis = np.maximum(variance[:, -1], 0.0), axes[:, :, -1]
    old = np.einsum("ri,rij,rj->r", axis, parts[0], axis)
    share = over(old, widest)
    return np.sqrt(widest), np.clip(share, 0.0, 1.0)


def compare_springs(
    old: CalibratedModel, new: CalibratedModel, spread: Spread
) -> tuple[SpringChange, ...]:
    """Return the change of every spring and sum of springs that both models determine.

    Parameters
    ----------
    old, new : CalibratedModel
        Two calibrations of one robot.
    spread : Spread
        Spread of the two models.
    """
    numbers = shared_numbers(old, new)
    sums = comparable_sums(old, new, numbers)
    if not sums:
        return ()
    W = sum_weights(sums, [each.name for each in numbers])
    rows = [W @ [each.old for each in numbers], W @ [each.new for each in numbers]]
    values = [W @ each.compliance for W, each in zip(rows, (old, new), strict=True)]
    ends = [interval(each.draws @ W.T) for W, each in zip(rows, (old, new), strict=True)]
    noise = spread.noise(*rows)
    alone = np.percentile(np.abs(noise), 100.0 * CONFIDENCE, axis=0)
    together = np.maximum(alone, critical(noise) * rms(noise))
    units = {each.name: each.unit for each in numbers}
    changes = []
    for i, terms in enumerate(sums):
        before, after = (
            Estimate(float(c[i]), float(low[i]), float(high[i]))
            for c, (low, high) in zip(values, ends, strict=True)
        )
        difference, simultaneous = (
            _around(values[1][i] - values[0][i], half[i]) for half in (alone, together)
        )
        changes.append(
            SpringChange(
                name=sum_text(terms),
                terms=terms,
                unit=units[terms[0].spring],
                old=before,
                new=after,
                difference=difference,
                together=simultaneous,
                moved=0.0 not in simultaneous,
            )
        )
    return tuple(changes)


def rms(noise: FloatArray) -> FloatArray:
    """Return the standard error of each comparison from the pairs, shape (comparison,)."""
    return np.asarray(np.sqrt(np.mean(np.square(noise), axis=0)))


def critical(noise: FloatArray) -> float:
    """Return ``t`` such that all comparisons stay within ``t`` standard errors with 95 %."""
    largest = over(np.abs(noise), rms(noise)).max(axis=1)
    return float(np.percentile(largest, 100.0 * CONFIDENCE))


def _around(value: float, half: float) -> Estimate:
    return Estimate(float(value), float(value - half), float(value + half))


_MOST = 20
"""Number of poses, as a multiple, beyond which no campaign is proposed."""
_PLAN = re.compile(r"\bplan ([0-9a-f]{12,})\b")
_LIKE = 1.25
"""Mean measured deflections further apart than by this factor come from other loads."""


def _judge(
    deflection: RowComparison | None, limit: float | None, ground: CommonGround | None = None
) -> tuple[Verdict | None, str]:
    """Return the verdict on the largest change against a limit in m, and why.

    Parameters
    ----------
    deflection : RowComparison, optional
        Over the rows of interest; None: there are none.
    limit : float, optional
        Largest accepted change, in m.
    ground : CommonGround, optional
        Rows that both campaigns cover, if known.
    """
    if limit is None:
        return None, "no limit was given"
    if deflection is None and ground is not None and ground.rows:
        return None, f"none of {counted(ground.rows, 'row')} lies where both campaigns measured"
    if deflection is None:
        return None, (
            "a limit is held against the poses and forces that matter, and no rows were given"
        )
    largest, allowed = deflection.largest, f"the limit of {quantity(limit, 'mm')}"
    where = ""
    if ground is not None and ground.left_out:
        where = f" over the {ground.rows_covered} of {ground.rows} rows that both campaigns cover"
    found = (
        f"the largest change{where} is {mm(largest.value)}"
        f" ({in_unit(largest.low, 'mm'):.3f} to {mm(largest.high)}, 95 %)"
    )
    if largest.high <= limit:
        return Verdict.PASS, f"{found}, all of it within {allowed}"
    if largest.low > limit:
        return Verdict.FAIL, f"{found}, all of it beyond {allowed}"
    decides = _what_decides(deflection, limit)
    return Verdict.UNDECIDED, f"{found}, and {allowed} lies in between; {decides}"


def _what_decides(deflection: RowComparison, limit: float) -> str:
    """Return advice on how to decide an open verdict, if the estimate stays.

    The old calibration cannot be repeated: that arm is gone. Only the new one's part of the
    variance shrinks, as one over its poses.
    """
    largest = deflection.largest
    passing = largest.value < limit
    half = largest.high - largest.value if passing else largest.value - largest.low
    row = int(deflection.high.argmax()) if passing else deflection.where
    share = float(deflection.old_share[row])
    spare = (abs(limit - largest.value) / half) ** 2 - share
    times = math.inf if not spare > 0.0 else (1.0 - share) / spare
    limits = f"limits of {mm(largest.high)} and more would pass"
    if largest.low > 0.0:
        limits += f", limits below {mm(largest.low)} fail"
    if not times <= _MOST:
        return f"more poses in the new calibration alone will hardly decide it; {limits}"
    return (
        f"about {max(math.ceil(10.0 * times) / 10.0, 1.1):.1f} times as many poses in the new"
        f" calibration would decide it, if the estimate stays; {limits}"
    )


def _other_readings(old: CalibratedModel, new: CalibratedModel) -> bool:
    """Return whether no force is of both: two campaigns whose files have equal names."""
    if old.domain is None or new.domain is None:
        return False
    return not np.isin(new.domain.force, old.domain.force).any()


def _notes_on(
    old: CalibratedModel,
    new: CalibratedModel,
    same_springs: bool,
    outside: int,
    ground: CommonGround | None = None,
) -> tuple[str, ...]:
    """Return the remarks that belong to the figures of a comparison, one sentence each.

    Parameters
    ----------
    old, new : CalibratedModel
        Models that are compared.
    same_springs : bool
        Whether the models have the same springs.
    outside : int
        Number of rows outside the joint limits.
    ground : CommonGround, optional
        What both campaigns cover, where it is known.
    """
    notes = []
    if not same_springs:
        notes.append(
            phrase(
                "the models have different springs: a spring's value depends on which others are in"
                " the model, so the springs do not tell whether the robot changed; predictions do,"
                " as far as both models can express the arm"
            )
        )
    if old.provenance and old.provenance == new.provenance and not _other_readings(old, new):
        notes.append(
            phrase(
                "both models state the same origin: calibrations of one set of readings are not"
                " independent, and the intervals do not hold for them"
            )
        )
    elif ground is None and not _same_plan(old, new):
        notes.append(
            phrase(
                "the models do not state one and the same plan: the intervals hold if both"
                " calibrations spread their poses over the same region under the same forces;"
                " elsewhere the arm does what springs cannot express, and this looks like a change"
            )
        )
    if ground is not None:
        notes += _ground_notes(ground)
    if outside:
        notes.append(
            phrase("{rows} outside the joint limits of the robot", rows=counted(outside, "row"))
        )
    return tuple(notes)


def _ground_notes(ground: CommonGround) -> Iterator[Phrase]:
    """Yield what lies outside of the region and the loads that both campaigns cover."""
    if ground.left_out:
        yield phrase(
            "{left} of {rows} lie outside of what both campaigns cover, by pose or by load, and"
            " were left out: nothing is known of them",
            left=ground.left_out,
            rows=counted(ground.rows or 0, "row"),
        )
    if ground.rows and not ground.alike:
        yield phrase(
            "the campaigns were made at other poses or loads ({old} and {new} of their readings lie"
            " where the other measured too): the intervals of the change hold what springs cannot"
            " express",
            old=f"{ground.old_covered:.0%}",
            new=f"{ground.new_covered:.0%}",
        )


def _load_note(old: float | None, new: float | None) -> str | None:
    """Return the effect of other loads on a comparison, or None where they were alike.

    Parameters
    ----------
    old, new : float, optional
        Mean measured deflection of each calibration, in m; None: not known.
    """
    if old is None or new is None or not (old > 0.0 and new > 0.0):
        return None
    if not abs(np.log(new / old)) > np.log(_LIKE):
        return None
    return phrase(
        "the arm was deflected by {old} on average in the old calibration and by {new} in the new"
        " one: with other forces gears that stiffen under load look like a change",
        old=mm(old),
        new=mm(new),
    )


def _frame_note(old: CalibrationSummary | None, new: CalibrationSummary | None) -> str | None:
    """Return the effect of estimated frames on a comparison; None where they were alike."""
    free = [
        "none" if each is None or each.settings is None else each.settings.free_frame
        for each in (old, new)
    ]
    if free[0] == free[1]:
        return None
    return phrase(
        "the old calibration estimated frames of the tracker by: {old}, the new one by: {new}; a"
        " tracker or marker that moved looks like a change where none were estimated",
        old=free[0],
        new=free[1],
    )


def _same_plan(old: CalibratedModel, new: CalibratedModel) -> bool:
    plans = [_PLAN.search(each.provenance) for each in (old, new)]
    return plans[0] is not None and plans[1] is not None and plans[0][1] == plans[1][1]


def recertify_files(
    old: ModelSource,
    new: ModelSource,
    q: ArrayLike | None = None,
    force: ArrayLike | None = None,
    moment: ArrayLike | None = None,
    *,
    rows: ComparedRows | None = None,
    limit: float | None = None,
) -> CompareResult:
    """Compare two model files; as `recertify`, with a note on other loads or free frames.

    Parameters
    ----------
    old, new : path, CalibrateResult or CalibratedModel
        What `elastocal calibrate` returned, or its files.
    q, force, moment, rows, limit
        As for `recertify`.

    Raises
    ------
    SchemaError, FileAccessError
        If a file is no model or cannot be read.
    IdentificationError, SpringError, RobotError
        See `recertify`.
    """
    names = model_name(old, "the old model"), model_name(new, "the new model")
    files = isinstance(old, str | PathLike) and isinstance(new, str | PathLike)
    if old is new or (files and Path(names[0]).resolve() == Path(names[1]).resolve()):
        kind = "file" if files else "model"
        raise IdentificationError(
            f"{names[0]} and {names[1]} are one and the same {kind}: nothing to compare"
        )
    (old_model, old_figures), (new_model, new_figures) = _read(old), _read(new)
    found = recertify(old_model, new_model, q, force, moment, rows=rows, limit=limit, names=names)
    notes = [_frame_note(old_figures, new_figures)]
    if not (old_model.model.bears_weight and new_model.model.bears_weight):
        means = [
            None if each is None else each.deflection.mean for each in (old_figures, new_figures)
        ]
        notes.append(_load_note(*means))
    said = tuple(note for note in notes if note is not None)
    return replace(found, summary=replace(found.summary, notes=(*found.summary.notes, *said)))


def recertify(
    old: CalibratedModel,
    new: CalibratedModel,
    q: ArrayLike | None = None,
    force: ArrayLike | None = None,
    moment: ArrayLike | None = None,
    *,
    rows: ComparedRows | None = None,
    limit: float | None = None,
    names: tuple[str, str] = _NAMES,
) -> CompareResult:
    """Compare two calibrations of one cell.

    Parameters
    ----------
    old, new : CalibratedModel
        The calibrations, of the same robot.
    q : array_like, shape (row, joint), optional
        Joint positions at which predictions are compared, in rad or m. Without rows only
        springs are compared.
    force : array_like, shape (row, 3), optional
        Force on the robot at the tcp in base, in N; needed with ``q``.
    moment : array_like, shape (row, 3), optional
        Moment on the robot about the tcp in base, in N·m.
    rows : ComparedRows, optional
        In place of ``q``, ``force`` and ``moment``: rows with a friction memory, the readings of a
        dataset, or those of an arm mounted differently from the new calibration.
    limit : float, optional
        Largest change of predicted deflection that is accepted at these rows, in m.
    names : tuple of str
        What to call the models in a refusal.

    Raises
    ------
    IdentificationError
        If the models are of different robots, are one and the same, or the limit is not a positive
        number.
    SpringError, RobotError
        If rows have another shape or are not finite.
    """
    if limit is not None and not 0.0 < limit < np.inf:
        raise IdentificationError(f"limit {limit:g} m: a largest accepted change is above 0")
    check_same_robot(old.model.robot, new.model.robot, names)
    given = _given_rows(new.model.robot, q, force, moment, rows)
    arm = new.model.robot if given is None or given.arm is None else given.arm
    if np.array_equal(old.compliance, new.compliance) and np.array_equal(old.draws, new.draws):
        raise IdentificationError(
            f"{names[0]} and {names[1]} are one and the same calibration: nothing to compare"
        )
    spread = Spread.of(old, new)
    ground, number = common_ground(old, new, given, arm)
    changes = None
    if given is not None and len(number):
        alike = ground is None or ground.alike
        on_arm = model_on(old, arm), model_on(new, arm)
        changes = compare_rows(*on_arm, spread, given, number, alike=alike)
    measured = compare_calibrated_poses(old, new, spread) if given is None else None
    verdict, reason = _judge(changes, limit, ground)
    springs = _judged_springs(old, new, spread, ground)
    moved = sorted(
        (each for each in springs if each.moved), key=lambda each: each.certainty, reverse=True
    )
    common = [spring.name for spring in common_springs(old, new)]
    compared = _compared_springs(old, new, springs)
    only_old, only_new = (
        tuple(name for name in each.model.spring_names if name not in common) for each in (old, new)
    )
    outside = 0 if given is None else count_outside_limits(arm, given.q)
    result = CompareSummary(
        robot=new.model.robot.name,
        tcp=arm.tip,
        old_provenance=old.provenance,
        new_provenance=new.provenance,
        springs=springs,
        moved=tuple(each.name for each in moved),
        not_compared=tuple(name for name in common if name not in compared),
        only_old=only_old,
        only_new=only_new,
        deflection=None if changes is None else changes.summary(),
        limit=limit,
        verdict=verdict,
        reason=reason,
        notes=(
            *_notes_on(old, new, not only_old and not only_new, outside, ground),
            *arm_notes((old, new), arm, names),
        ),
        ground=ground,
        calibrated=None if measured is None else measured.summary(),
    )
    return CompareResult(result, changes, measured)


def _judged_springs(
    old: CalibratedModel, new: CalibratedModel, spread: Spread, ground: CommonGround | None
) -> tuple[SpringChange, ...]:
    """Return the changes of springs; none counts as changed where the campaigns cannot show it."""
    springs = compare_springs(old, new, spread)
    if ground is not None and not ground.springs_judged:
        return tuple(replace(each, moved=False) for each in springs)
    return springs


def _compared_springs(
    old: CalibratedModel, new: CalibratedModel, changes: tuple[SpringChange, ...]
) -> set[str]:
    """Return the names of the springs in a comparison."""
    terms = {term.spring for change in changes for term in change.terms}
    return {each.spring for each in shared_numbers(old, new) if each.name in terms}


def _given_rows(
    robot: Robot,
    q: ArrayLike | None,
    force: ArrayLike | None,
    moment: ArrayLike | None,
    rows: ComparedRows | None,
) -> ComparedRows | None:
    """Return the rows of a comparison, or refuse them by shape or value; None: there are none."""
    if rows is not None:
        q, force, moment = rows.q, rows.force, rows.moment
        if rows.arm is not None:
            check_same_robot(rows.arm, robot, ("the robot of the rows", "that of the new model"))
    elif q is None:
        return None
    elif force is None:
        raise SpringError("rows have joint positions q but no force")
    joints, forces, moments = check_rows(robot, q, force, moment)
    if not len(joints):
        raise SpringError(f"force {forces.shape} does not have a row for each of q {joints.shape}")
    if rows is not None and rows.visit is not None and len(rows.visit) != len(joints):
        raise SpringError(f"visit has {len(rows.visit)} values for {len(joints)} rows")
    return rows or ComparedRows(joints, forces, moments)


def _read(source: ModelSource) -> tuple[CalibratedModel, CalibrationSummary | None]:
    """Return a model, and the figures of its calibration."""
    if isinstance(source, CalibratedModel):
        return source, None
    path = model_name(source)
    found = (
        source if isinstance(source, CalibrateResult) else read_json(Path(path), CalibrateResult)
    )
    try:
        return found.calibrated, found.calibration
    except (SpringError, RobotError) as error:
        # With two files, a refusal must name the one concerned.
        raise type(error)(f"{path}: {error}") from error
