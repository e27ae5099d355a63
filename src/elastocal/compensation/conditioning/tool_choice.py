"""Choice of unknowns for static postures, exclusion of blunders, and widening of intervals.

* **Blunders.** Whatever tool, rotation, sign and matrix: the readings are affine in gravity as the
  flange sees it, ``y_i = G u_i + b``. The best of many affine laws through few postures (least
  median of squares, Rousseeuw 1984) shows which postures agree; one whose reading the law of the
  others does not predict, by a t test over all components, is set aside and named.
* **Choice.** Drift, matrix and, where asked for, the sensor's rotation are freed one after the
  other, each only if it predicts left-out postures better by a paired interval that counts the
  overlap of the training sets (Nadeau and Bengio 2003). A rotation must also be larger than its
  interval beside a matrix with its prior: cross-talk looks like a rotation.
* **Cross-talk.** Where the matrix is not freed, the intervals are still those beside it.
* **Order.** Correlated residuals of neighbouring postures are not independent readings. Where a
  permutation test shows this, intervals grow by ``sqrt((1 + r) / (1 - r))``; where the first or
  last half of the postures disagrees with the whole, they are extended to its estimate.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import stdtr, stdtrit

from elastocal.arrays import BoolArray, FloatArray
from elastocal.compensation.conditioning.postures import StaticPostures
from elastocal.compensation.conditioning.tool_fit import (
    TOOL_UNKNOWNS,
    ToolFit,
    ToolModel,
    fit_tool,
    rotation_off,
    tool_residual,
)
from elastocal.parallel import one_blas_thread
from elastocal.records import record
from elastocal.results import brief_repr

_LEAST = 7
"""Postures, from which on there is something to choose or to set aside."""
_TRIALS = 150
_SMALL = 1e-9
"""Part of the readings' size: rounding, which is no noise."""
_CHANCE = 1e-4
"""Probability, over all components, below which a posture's reading is no chance."""
_MOST_ASIDE = 0.2
"""Share of postures that may be set aside; with more, it is not known which are right."""
_FOLDS = 10
_LEVEL = 0.95
_SHUFFLES = 999
_SERIAL = 0.01
"""Probability of the serial correlation under shuffling, below which it is believed."""
_MOST_SERIAL = 0.9
_ROTATIONS = TOOL_UNKNOWNS[1:4]
_CLEARLY = 1.5
"""Angle, in its own half interval, from which on a rotation about one of three axes is believed."""
_HALVES = 1.5
"""Distance of a half's value from that of all, in its own half intervals, that is too far."""


@record()
class PostureSetAside:
    """A posture that does not fit the others."""

    posture: int
    """Number of the posture from 1, in the order of the file or run."""
    force: float
    """Distance of its force from what the others foretell, in N."""
    moment: float
    """The same of its moment, in N·m."""

    @property
    def text(self) -> str:
        """The posture and its residual, in words."""
        return (
            f"posture {self.posture} does not fit the others: {self.force:.3g} N and"
            f" {self.moment:.3g} N*m from what they foretell"
        )


@record()
class ToolRung:
    """A model that was tried, with what it leaves of postures that it was not fitted to."""

    free: str
    force: float
    """Root mean square of a force component, in N."""
    moment: float
    """In N·m."""
    chosen: bool


@brief_repr
@dataclass(frozen=True, eq=False)
class ToolChoice:
    """The tool by the simplest model that unseen postures do not speak against."""

    fit: ToolFit
    """Its intervals are those that count serial correlation and halves that disagree."""
    used: BoolArray
    """Postures that it was fitted to."""
    set_aside: tuple[PostureSetAside, ...]
    ladder: tuple[ToolRung, ...]
    serial_correlation: float
    """Correlation of neighbouring postures' residuals; NaN with too few postures."""
    notes: tuple[str, ...]


@one_blas_thread()
def choose_tool(
    postures: StaticPostures,
    R_nominal: FloatArray | None = None,
    richest: ToolModel | None = None,
) -> ToolChoice:
    """Return tool and sensor by what the postures carry.

    Parameters
    ----------
    postures : StaticPostures
        In the order of time.
    R_nominal : ndarray, shape (3, 3), optional
        Rotation of the sensor in the flange as it was mounted.
    richest : ToolModel, optional
        What may be freed; by default drift and a matrix with a cross-talk of 1 %.
    """
    richest = richest or ToolModel(drift=True, cross_talk=0.01)
    aside = blunders(postures)
    used = np.ones(len(postures), dtype=bool)
    used[[each.posture - 1 for each in aside]] = False
    good = postures.chosen(used)
    model, ladder, notes = _climb(good, R_nominal, richest)
    fit = _beside_cross_talk(good, R_nominal, fit_tool(good, R_nominal, model), richest)
    fit, correlation, more = _in_order(good, R_nominal, fit)
    return ToolChoice(fit, used, aside, ladder, correlation, (*notes, *more))


def _beside_cross_talk(
    postures: StaticPostures, R_nominal: FloatArray | None, fit: ToolFit, richest: ToolModel
) -> ToolFit:
    """Return a fit whose intervals reach to those beside a matrix, which postures need not show."""
    if fit.model.has_matrix or not richest.cross_talk > 0.0:
        return fit
    matrix = replace(richest, rotation=False, drift=False)
    beside = fit_tool(postures, R_nominal, _beside(fit.model, matrix))
    away = np.abs(_values(beside) - _values(fit))
    # What is not determined stays so; a matrix that leaves nothing over says nothing.
    ends = np.nan_to_num(away + [beside.half_width[name] for name in TOOL_UNKNOWNS]).tolist()
    widths = {n: max(fit.half_width[n], end) for n, end in zip(TOOL_UNKNOWNS, ends, strict=True)}
    return replace(fit, half_width=widths)


def affine_scatter(postures: StaticPostures) -> FloatArray | None:
    """Return the rest of force and moment components after the best affine law of gravity, (2,).

    It is the noise of the postures whatever tool and sensor are; None with too few postures.
    """
    if len(postures) < _LEAST:
        return None
    A, y = _affine(postures)
    kept, _ = _together(A, y)
    A, y = A[kept], y[kept]
    left = y - A @ np.linalg.pinv(A) @ y
    over = len(A) - np.linalg.matrix_rank(A)
    if over < 1:
        return None
    return np.asarray(np.sqrt((left.reshape(-1, 2, 3) ** 2).sum(axis=(0, 2)) / (3 * over)))


def blunders(postures: StaticPostures) -> tuple[PostureSetAside, ...]:
    """Return the postures that no affine law of the others foretells; none with too few."""
    n = len(postures)
    if n < _LEAST:
        return ()
    kept, off = _together(*_affine(postures))
    if not 0 < np.sum(~kept) <= max(1, int(_MOST_ASIDE * n)):
        return ()
    return tuple(
        PostureSetAside(
            int(row) + 1,
            float(np.linalg.norm(off[row, :3])),
            float(np.linalg.norm(off[row, 3:])),
        )
        for row in np.flatnonzero(~kept)
    )


def _affine(postures: StaticPostures) -> tuple[FloatArray, FloatArray]:
    """Return the rows of the affine law, shape (posture, 4), and the readings, (posture, 6)."""
    u = postures.gravity_flange / np.linalg.norm(postures.gravity)
    A = np.hstack([u, np.ones((len(u), 1))])
    return A, np.hstack([postures.force, postures.moment])


def _together(A: FloatArray, y: FloatArray) -> tuple[BoolArray, FloatArray]:
    """Return which postures go together, and how far each is from what those foretell."""
    kept = _majority(A, y)
    for _ in range(len(A)):
        off, chance = _foretold(A, y, kept)
        again = chance >= _CHANCE / y.size
        if np.array_equal(again, kept):
            break
        kept = again
    return kept, off


def _majority(A: FloatArray, y: FloatArray) -> BoolArray:
    """Return the three quarters of the postures that go together best."""
    # Seeded: the same postures always give the same choice.
    n, rng = len(A), np.random.default_rng(0)
    share = n - max(1, n // 4)
    best, kept = np.inf, np.ones(n, dtype=bool)
    size = np.maximum(np.abs(y - np.median(y, axis=0)).max(axis=0), _SMALL * (1 + np.abs(y).max()))
    for _ in range(_TRIALS):
        # One posture more than the four unknowns of the law for each component. Two concentration
        # steps, fits to the postures nearest to the last one, then approach the best subset.
        few = rng.choice(n, 5, replace=False)
        for _ in range(2):
            left = (((y - A @ np.linalg.pinv(A[few]) @ y[few]) / size) ** 2).sum(axis=1)
            few = np.argsort(left, kind="stable")[:share]
        total = float(np.sort(left)[:share].sum())
        if total < best:
            best, kept = total, np.isin(np.arange(n), few)
    return kept


def _foretold(A: FloatArray, y: FloatArray, kept: BoolArray) -> tuple[FloatArray, FloatArray]:
    """Return the residual of each posture against the others' prediction, and its probability."""
    off, chance = np.zeros_like(y), np.ones(len(A))
    floor = _SMALL * (1 + np.abs(y).max())
    for row in range(len(A)):
        others = kept.copy()
        others[row] = False
        inverse = np.linalg.pinv(A[others])
        left = y[others] - A[others] @ inverse @ y[others]
        over = int(others.sum()) - np.linalg.matrix_rank(A[others])
        if over < 1:
            continue
        sigma = np.sqrt((left**2).sum(axis=0) / over) + floor
        off[row] = y[row] - A[row] @ inverse @ y[others]
        spread = sigma * np.sqrt(1.0 + (A[row] @ inverse @ inverse.T @ A[row]))
        chance[row] = 2.0 * stdtr(over, -np.abs(off[row] / spread).max())
    return off, chance


def _climb(
    postures: StaticPostures, R_nominal: FloatArray | None, richest: ToolModel
) -> tuple[ToolModel, tuple[ToolRung, ...], tuple[str, ...]]:
    """Return the model to take, all that were tried, and what there is to say about them."""
    chosen = ToolModel(lever=richest.lever)
    if len(postures) < _LEAST:
        asked = ("rotation",) if richest.rotation else ()
        note = f"{len(postures)} postures are too few to leave some out: {', '.join(asked)} kept"
        return chosen, (), (note,) * bool(asked)
    tried = {chosen: _left_out(postures, R_nominal, chosen)}
    notes: list[str] = []
    as_mounted, turn = _mounted_rotation(postures, R_nominal, richest)
    steps = [
        replace(richest, rotation=False, cross_talk=0.0),
        replace(richest, rotation=False, drift=False),
    ]
    if richest.rotation and not as_mounted:
        steps.append(ToolModel(rotation=True, lever=richest.lever))
    elif richest.rotation:
        notes.append(
            f"the sensor's rotation stays as mounted: it comes out {turn} from there, no more than"
            f" a cross-talk of {100 * richest.cross_talk:g} % makes"
        )
    elif not as_mounted:
        notes.append(
            f"the postures put the sensor {turn} from where it is mounted, more than a cross-talk"
            f" of {100 * richest.cross_talk:g} % makes: correct the drawing, or free its rotation"
        )
    for step in steps:
        further = _beside(chosen, step)
        # Beside a matrix a rotation changes what is foretold little: without it, it must win.
        pair = (chosen, further)
        rivals = [replace(each, cross_talk=0.0) for each in pair] if step.rotation else pair
        for each in (*rivals, further):
            if each not in tried:
                tried[each] = _left_out(postures, R_nominal, each)
        if further != chosen and _wins(tried[rivals[1]], tried[rivals[0]]):
            chosen = further
        elif step.rotation:
            notes.append("the sensor's rotation stays as mounted: free, it foretells no better")
    rungs = tuple(
        ToolRung(model.name, *_root_mean(left), chosen=model == chosen)
        for model, left in tried.items()
    )
    return chosen, rungs, tuple(notes)


def _beside(model: ToolModel, step: ToolModel) -> ToolModel:
    """Return a model with what another frees free, too."""
    return ToolModel(
        model.rotation or step.rotation,
        model.drift or step.drift,
        max(model.cross_talk, step.cross_talk),
        model.lever,
    )


def _mounted_rotation(
    postures: StaticPostures, R_nominal: FloatArray | None, richest: ToolModel
) -> tuple[bool, str]:
    """Return whether the rotation agrees with the mounting within cross-talk, and the angle."""
    nominal = np.eye(3) if R_nominal is None else R_nominal
    fit = fit_tool(postures, nominal, replace(richest, rotation=True))
    angles = rotation_off(nominal, fit.R_flange_sensor)
    widths = np.array([fit.half_width[name] for name in _ROTATIONS])
    shown = ", ".join(
        f"{np.degrees(a):.2f} ± {np.degrees(w):.2f}" for a, w in zip(angles, widths, strict=True)
    )
    return not np.any(np.abs(angles) > _CLEARLY * widths), f"{shown} deg"


def _left_out(
    postures: StaticPostures, R_nominal: FloatArray | None, model: ToolModel
) -> FloatArray:
    """Return residuals of postures that the fit had not, shape (posture, 6)."""
    n = len(postures)
    left = np.empty((n, 6))
    for fold in range(min(_FOLDS, n)):
        out = np.arange(n) % min(_FOLDS, n) == fold
        fit = fit_tool(postures.chosen(~out), R_nominal, model)
        left[out] = np.hstack(tool_residual(postures.chosen(out), fit))
    return left


def _root_mean(left: FloatArray) -> tuple[float, float]:
    force, moment = np.sqrt((left.reshape(-1, 2, 3) ** 2).mean(axis=(0, 2))).tolist()
    return force, moment


def _wins(rich: FloatArray, plain: FloatArray) -> bool:
    """Return whether one model leaves less of unseen postures, by a paired interval."""
    n = len(rich)
    size = np.repeat(np.maximum(_root_mean(plain), np.finfo(float).tiny), 3)
    gain = (((plain / size) ** 2) - ((rich / size) ** 2)).mean(axis=1)
    folds = min(_FOLDS, n)
    # Test sets of 1/folds, training sets of the rest, which share most of their postures.
    error = np.std(gain, ddof=1) * np.sqrt(1.0 / n + 1.0 / (folds * (folds - 1)))
    return bool(gain.mean() > stdtrit(n - 1, 0.5 + _LEVEL / 2) * error)


def _in_order(
    postures: StaticPostures, R_nominal: FloatArray | None, fit: ToolFit
) -> tuple[ToolFit, float, tuple[str, ...]]:
    """Return a fit with intervals that count the order, the serial correlation, and notes."""
    if len(postures) < _LEAST or not np.isfinite([fit.force_scatter, fit.moment_scatter]).all():
        return fit, float("nan"), ()
    left = np.hstack(tool_residual(postures, fit))
    left /= np.maximum(np.sqrt((left**2).mean(axis=0)), np.finfo(float).tiny)
    r = _serial(left)
    rng = np.random.default_rng(0)
    more = sum(_serial(rng.permutation(left)) >= r for _ in range(_SHUFFLES))
    widths, notes = dict(fit.half_width), []
    if (1 + more) / (1 + _SHUFFLES) < _SERIAL:
        factor = np.sqrt((1.0 + r) / (1.0 - r)) if r < _MOST_SERIAL else np.sqrt(19.0)
        widths = {name: factor * width for name, width in widths.items()}
        notes.append(
            f"what is left of a posture resembles its neighbour's (correlation {r:.2f}): intervals"
            f" widened by {factor:.2f}"
        )
    widths, disagreeing = _halves(postures, R_nominal, fit, widths)
    return replace(fit, half_width=widths), r, (*notes, *disagreeing)


def _serial(left: FloatArray) -> float:
    return float((left[1:] * left[:-1]).sum() / max(float((left**2).sum()), np.finfo(float).tiny))


def _halves(
    postures: StaticPostures,
    R_nominal: FloatArray | None,
    fit: ToolFit,
    widths: dict[str, float],
) -> tuple[dict[str, float], Sequence[str]]:
    """Return intervals that reach to the halves' values where these are too far, and a note."""
    first = np.arange(len(postures)) < len(postures) // 2
    # The matrix is no matter of time: that a half says less of it is no disagreement.
    plain = replace(fit.model, cross_talk=0.0, drift=False)
    halves = [fit_tool(postures.chosen(kept), R_nominal, plain) for kept in (first, ~first)]
    whole = fit_tool(postures, R_nominal, plain)
    widened, said = dict(widths), []
    for k, name in enumerate(TOOL_UNKNOWNS):
        width = widths[name]
        values = [_values(each)[k] for each in halves]
        own = [each.half_width[name] for each in halves]
        drifts = fit.model.drift and "bias" in name
        if drifts or name in _ROTATIONS or not np.isfinite([width, *own]).all():
            continue
        away = [abs(value - _values(whole)[k]) for value in values]
        if any(a > _HALVES * max(o, width) for a, o in zip(away, own, strict=True)):
            widened[name] = max(width, *away)
            said.append(name)
    if not said:
        return widths, ()
    return widened, (
        f"the first and the last half of the postures disagree about {', '.join(said)}: their"
        " intervals reach to what each half says",
    )


def _values(fit: ToolFit) -> FloatArray:
    return np.concatenate([[fit.mass], np.zeros(3), fit.force_bias, fit.centre, fit.moment_bias])
