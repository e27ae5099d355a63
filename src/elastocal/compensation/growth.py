"""How far an arm has grown since its path was taught, from a few touches; its file ``state.json``.

Points of the tooling are touched cold, and again when the arm is warm. An arm that grows evenly
away from its foot moves the tool by

    d(q) = s u(q) + o,    u = p_tcp - p_foot,

with the thermal share ``s`` (steel: 12e-6 for each kelvin) and an offset ``o``. Touches ``d_i`` at
``q_i`` give both by least squares with normal priors, the noise of a touch by what they leave:

    min sum |d_i - s u_i - o|^2 / sigma^2 + (s / S)^2 + |o / A|^2.

The priors only say what a few touches close together cannot: how much of a shift that all of them
share grows with the distance from the foot. The state is used only where it predicts touches that
were left out better than no state does.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import fdtrc, stdtrit

from elastocal.arrays import FloatArray, IndexArray, Triple, triple
from elastocal.blocks import Block, Facts, Row, Table
from elastocal.errors import CompensationError
from elastocal.findings import Finding, Grade, Kind, as_number
from elastocal.identification import RobotRecord
from elastocal.records import read_json, record, write_json
from elastocal.results import Result, brief_repr
from elastocal.robot import Robot, link_gap, of_one_arm, refusals_naming, same_joints
from elastocal.units import quantity
from elastocal.wording import mm, phrase, phrases

LEAST_TOUCHES = 3
"""Fewer touches leave nothing to judge a state by."""
_SHARE_PRIOR, _OFFSET_PRIOR = 100e-6, 0.1e-3
"""Widths of the priors: 8 K of steel, and a tenth of a millimetre."""
_LARGEST_SHARE, _LARGEST_OFFSET = 1e-3, 2e-3
"""No arm grows by more: 80 K of steel, and 2 mm of everything else."""
_NOISE, _NOISE_WORTH = 30e-6, 2.0
"""Likely noise of a component of a touch, in m: two stops and what friction leaves of two free
moves; and how many residuals that guess counts as."""
_ROUNDS = 5
_DIFFERENT = 0.1e-3
"""Difference between tracker and tooling along the normal that is said, in m."""
_LEVEL = 0.975
_MIXED = 0.01
"""Risk that touches of one warmth, taken in several sessions, are called touches of two."""
_PAUSE = 600.0
"""Pause between two sessions that is said, in s: minutes change little of an arm's warmth."""
_OLD = 12.0
"""Age from which a state is warned of, in h: a shift and half of another."""

_mm, _ppm = as_number(".3f", 1e3), as_number(".1f", 1e6)
USELESS = Kind(
    "arm.nothing-to-correct",
    "touches that were left out are not predicted better with the state ({with_state} mm) than"
    " without ({without} mm): the state corrects nothing",
    grade=Grade.NOTE,
    shown={"with_state": _mm, "without": _mm},
)
WITNESSES = Kind(
    "arm.tracker-or-tooling-moved",
    "along the surface's normal the tooling shows {contact} mm, the tracker {tracker} mm: one of"
    " them has moved",
    advice="Look whether the tracker's stand or the tooling was moved, and touch cold again.",
    shown={"contact": _mm, "tracker": _mm},
)
PAUSED = Kind(
    "arm.touches-paused",
    "a run of touches paused for {minutes} min, in which the arm cools or warms",
    advice="Touch again without a pause.",
    shown={"minutes": as_number(".0f")},
)
LOST_TOUCHES = Kind("arm.touches-lost", "not touched in both runs: pose {poses}")


@brief_repr
@record()
class TouchedPoint:
    """A point of the tooling that was touched cold and warm."""

    pose: int
    """Id in the plan of the touches."""
    tcp_position: Triple
    """In base, in m."""
    shift: Triple
    """Displacement of the tool relative to its controller, in base, in m."""
    left: float
    """Distance in m from what the other touches predict."""


@record("elastocal.arm-state/1", sealed=True)
class ArmGrowth(Result):
    """The state of an arm: how far it has grown since it was cold; SI units."""

    cell: str
    robot: RobotRecord
    cold: str
    """When the cold run began; date and time, ISO 8601, UTC."""
    warm: str
    """When the warm run began: the state is of that time."""
    seconds: float
    """Duration of the warm touches, in s."""
    share: float
    """Thermal share, m of growth for each m between foot and tool; 0 where it is not used."""
    offset: Triple
    """In base, in m; 0 where it is not used."""
    share_half_width: float
    """Half of its 95 % interval."""
    offset_half_width: Triple
    """Half of its 95 % intervals, in m."""
    points: tuple[TouchedPoint, ...]
    noise: float
    """Standard deviation of a component of a touch, in m."""
    without: float
    """Mean distance of the touches from no growth, in m."""
    held_out: float
    """Mean distance of each touch from what the others predict, in m."""
    half_width: float
    """Half of the 95 % interval of the shift's most uncertain component at the touched points."""
    findings: tuple[Finding, ...] = ()

    def __post_init__(self) -> None:
        """Refuse a state that is none of an arm's.

        Raises
        ------
        CompensationError
            If it grows by more than any arm does, or a date is none.
        """
        _require_possible(self.share, np.array(self.offset), "the state says")
        for name, date in (("cold", self.cold), ("warm", self.warm)):
            if _date(date) is None:
                raise CompensationError(
                    f"{name} {date!r} is no date and time with its zone, such as"
                    " 2026-11-02T06:00:00+00:00"
                )

    @property
    def corrects(self) -> bool:
        """Whether it corrects anything."""
        return bool(self.share or any(self.offset))

    def shift(self, robot: Robot, q: ArrayLike) -> FloatArray:
        """Return how far the tool is from where a cold arm would have it, shape (..., 3), in m.

        Parameters
        ----------
        robot : Robot
            The arm, with the tool that is meant.
        q : array_like, shape (..., joint)
            In rad or m.
        """
        tool = robot.forward(q)[..., :3, 3]
        grown: FloatArray = self.share * (tool - robot.foot(q)) + np.array(self.offset)
        return grown

    def require_arm(self, robot: Robot, file: Path) -> None:
        """Refuse a robot that is not the one touched with; its tool may be another.

        Raises
        ------
        CompensationError
            By the names of both.
        RobotError
            If the state's own robot cannot be read.
        """
        with refusals_naming(file):
            touched = self.robot.read()
        gap = link_gap(touched, robot) if same_joints(touched, robot) else None
        if gap is None or not of_one_arm(gap, touched, robot):
            raise CompensationError(
                f"{file}: the state is of the arm {self.robot.name} of cell {self.cell}, not of"
                f" {robot.name}"
            )

    def notes(self, now: datetime) -> tuple[str, ...]:
        """Return what a person should know of a correction that counts the state in."""
        growth = phrase(
            "corrections hold the growth of the arm as touched at {time}: {share}, and {offset}"
            " besides",
            time=self.warm,
            share=_micro(self.share),
            offset=mm(float(np.linalg.norm(self.offset))),
        )
        age = (now - datetime.fromisoformat(self.warm)).total_seconds() / 3600.0
        old = phrase("the state of the arm is {age} h old: touch again", age=f"{age:.0f}")
        return (
            *([growth] if self.corrects else []),
            *self.findings,
            *([] if abs(age) <= _OLD else [old]),
        )

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return the main facts, a label and a text each."""
        low, high = (self.share + side * self.share_half_width for side in (-1.0, 1.0))
        return (
            ("touched", f"{len(self.points)} points, cold {self.cold}, warm {self.warm}"),
            ("warm touches took", f"{self.seconds / 60.0:.1f} min"),
            ("thermal share", f"{_micro(self.share)} ({_micro(low)} to {_micro(high)})"),
            (
                "offset in base",
                ", ".join(
                    f"{quantity(value, 'mm', '.3f')} ± {quantity(half, 'mm', '.3f')}"
                    for value, half in zip(self.offset, self.offset_half_width, strict=True)
                ),
            ),
            ("noise of a touch", f"{quantity(self.noise, 'µm', '.0f')} each component"),
            (
                "left-out touches",
                f"{mm(self.held_out)} from what the others predict, {mm(self.without)} without"
                " the state",
            ),
            *(("finding", text) for text in self.findings),
        )

    def show(self) -> Iterator[Block]:
        """Yield the state, and the touches that it was taken from."""
        yield Facts(self.facts())
        rows: list[Row] = [
            (
                str(point.pose),
                *(f"{1e3 * value:.3f}" for value in point.shift),
                f"{1e3 * point.left:.3f}",
            )
            for point in self.points
        ]
        heads = phrases("Pose", "x, mm", "y, mm", "z, mm", "From the others' prediction, mm")
        yield Table(phrase("How far the tool moved, cold to warm"), heads, tuple(rows))


def _micro(share: float) -> str:
    return f"{1e6 * share:.1f} µm/m"


@dataclass(frozen=True, eq=False)
class _Fit:
    """Estimate of share and offset from some touches."""

    x: FloatArray
    """Share, and offset in m, shape (4,); then the further offset of each later session."""
    covariance: FloatArray
    """Of these, for the noise that was found."""
    sigma: float
    """Noise of a component, in m."""
    free: float
    """Degrees of freedom of the noise."""

    @property
    def factor(self) -> float:
        """Half of a 95 % interval in standard deviations (Student's t)."""
        return float(stdtrit(self.free, _LEVEL))


def _fitted(lever: FloatArray, shift: FloatArray, later: FloatArray | None = None) -> _Fit:
    """Return share and offset of touches with levers and shifts, both (touch, 3), in m.

    Parameters
    ----------
    later : ndarray, optional
        Whether each touch is of each session but the first, shape (touch, session): each has an
        offset of its own then, which follows in the estimate.
    """
    later = np.empty((len(lever), 0)) if later is None else later
    shared = np.concatenate([np.ones((len(lever), 1)), later], axis=1)
    offsets = np.einsum("ts,ij->tisj", shared, np.eye(3)).reshape(len(lever), 3, -1)
    A = np.concatenate([lever[..., None], offsets], axis=2)
    A, d = A.reshape(-1, A.shape[2]), shift.ravel()
    prior = np.diag(1.0 / np.array([_SHARE_PRIOR, *[_OFFSET_PRIOR] * (A.shape[1] - 1)]) ** 2)
    sigma, free = _NOISE, _NOISE_WORTH
    for _ in range(_ROUNDS):
        covariance = np.linalg.inv(A.T @ A / sigma**2 + prior)
        x = covariance @ (A.T @ d) / sigma**2
        taken = float(np.trace(covariance @ A.T @ A)) / sigma**2
        free = len(d) - taken + _NOISE_WORTH
        squares = float(((d - A @ x) ** 2).sum())
        sigma = np.sqrt((squares + _NOISE_WORTH * _NOISE**2) / free)
    return _Fit(x, covariance, sigma, free)


def _predicted(x: FloatArray, lever: FloatArray) -> FloatArray:
    predicted: FloatArray = x[0] * lever + x[1:]
    return predicted


@brief_repr
@dataclass(frozen=True, eq=False)
class Touches:
    """What touches say of an arm; `elastocal.procedure.derive.TouchedShifts` without its files."""

    pose: tuple[int, ...]
    q: FloatArray
    """Shape (touch, joint), in rad or m."""
    shift: FloatArray
    """By the tracker, in base, shape (touch, 3), in m."""
    normal: FloatArray
    """Outward unit normals of the surface, shape (touch, 3)."""
    by_contact: FloatArray
    """The shift along the normal by the tooling, shape (touch,), in m."""
    lost: tuple[int, ...] = ()
    """Poses that were not touched in both runs."""
    sessions: IndexArray | None = None
    """Sessions of the cold and of the warm run, shape (touch, 2); None: each run was one."""
    pause: float = 0.0
    """Longest pause between two sessions, in s."""


def arm_growth(
    robot: Robot,
    touches: Touches,
    *,
    cell: str,
    times: tuple[str, str, float],
) -> ArmGrowth:
    """Return how far an arm has grown between cold and warm touches.

    Parameters
    ----------
    robot : Robot
        The arm, with the tool that touched.
    touches : Touches
        At least `LEAST_TOUCHES`.
    cell : str
        Name of the cell.
    times : tuple
        When the cold and the warm run began, ISO 8601, and how long the warm one took, in s.

    Raises
    ------
    CompensationError
        If there are too few touches, they say what is no arm's growth, or they are of several
        warmths.
    """
    count = len(touches.pose)
    if count < LEAST_TOUCHES:
        raise CompensationError(
            f"{count} points were touched in both runs: at least {LEAST_TOUCHES} are needed"
        )
    # By the shifts as they are: the priors of the fit would hide what is no growth in its noise.
    _require_possible(0.0, np.median(touches.shift, axis=0), "the touches say")
    tool = robot.forward(touches.q)[:, :3, 3]
    lever = tool - robot.foot(touches.q)
    _require_one_warmth(lever, touches)
    fit = _fitted(lever, touches.shift)
    others = (np.flatnonzero(np.arange(count) != row) for row in range(count))
    left = np.array(
        [
            touches.shift[row] - _predicted(_fitted(lever[rest], touches.shift[rest]).x, lever[row])
            for row, rest in enumerate(others)
        ]
    )
    held_out = float(np.linalg.norm(left, axis=1).mean())
    without = float(np.linalg.norm(touches.shift, axis=1).mean())
    used = fit.x if held_out < without else np.zeros(4)
    half = fit.factor * np.sqrt(np.diag(fit.covariance))
    findings = [
        *([] if used.any() else [USELESS(with_state=held_out, without=without)]),
        *_witnesses(touches, fit),
        *([LOST_TOUCHES(poses=list(touches.lost))] if touches.lost else []),
        *([] if touches.pause <= _PAUSE else [PAUSED(minutes=touches.pause / 60.0)]),
    ]
    cold, warm, seconds = times
    return ArmGrowth(
        cell=cell,
        robot=RobotRecord.of(robot),
        cold=cold,
        warm=warm,
        seconds=seconds,
        share=float(used[0]),
        offset=triple(used[1:]),
        share_half_width=float(half[0]),
        offset_half_width=triple(half[1:]),
        points=tuple(
            TouchedPoint(pose, triple(at), triple(shift), float(np.linalg.norm(off)))
            for pose, at, shift, off in zip(touches.pose, tool, touches.shift, left, strict=True)
        ),
        noise=fit.sigma,
        without=without,
        held_out=held_out,
        half_width=_half_width(fit, lever),
        findings=tuple(findings),
    )


def _require_one_warmth(lever: FloatArray, touches: Touches) -> None:
    """Refuse touches of several sessions between which the arm has grown or shrunk.

    Offsets of the later sessions, beside one share and offset of all, are tested against none (F
    test of a linear hypothesis; Seber and Lee, "Linear Regression Analysis", section 4.3).

    Raises
    ------
    CompensationError
        With the largest of these offsets.
    """
    if touches.sessions is None:
        return
    kinds, number = np.unique(touches.sessions, axis=0, return_inverse=True)
    count = len(kinds) - 1
    if not count:
        return
    later = np.equal.outer(number.ravel(), np.arange(1, count + 1)).astype(float)
    fit = _fitted(lever, touches.shift, later)
    apart, covariance = fit.x[4:], fit.covariance[4:, 4:]
    ratio = float(apart @ np.linalg.solve(covariance, apart)) / len(apart)
    if not fdtrc(len(apart), fit.free, ratio) >= _MIXED:
        away = float(np.linalg.norm(apart.reshape(-1, 3), axis=1).max())
        raise CompensationError(
            "the touches before a run was gone on with (--resume) and after it differ by"
            f" {quantity(away, 'mm', '.3f')}: the arm was not equally warm; touch again in one"
            " session, in another folder"
        )


def _half_width(fit: _Fit, lever: FloatArray) -> float:
    """Return half the 95 % interval of the most uncertain component at some levers, in m."""
    rows = np.concatenate([lever[..., None], np.tile(np.eye(3), (len(lever), 1, 1))], axis=2)
    variance = np.einsum("tiu,uv,tiv->ti", rows, fit.covariance, rows)
    return fit.factor * float(np.sqrt(variance.max()))


def _witnesses(touches: Touches, fit: _Fit) -> Iterator[Finding]:
    """Yield a finding where tracker and tooling disagree beyond the noise of both."""
    tracker = np.einsum("ti,ti->t", touches.normal, touches.shift)
    apart = touches.by_contact - tracker
    half = fit.factor * np.sqrt(2.0 * fit.sigma**2 / len(apart))
    if not abs(float(apart.mean())) <= max(half, _DIFFERENT):
        yield WITNESSES(contact=float(touches.by_contact.mean()), tracker=float(tracker.mean()))


def _require_possible(share: float, offset: FloatArray, what: str) -> None:
    away = float(np.linalg.norm(offset))
    if not (abs(share) <= _LARGEST_SHARE and away <= _LARGEST_OFFSET):
        raise CompensationError(
            f"{what} that the arm has grown by {_micro(share)} and moved by"
            f" {quantity(away, 'mm', '.3g')}, at most {_micro(_LARGEST_SHARE)} and"
            f" {quantity(_LARGEST_OFFSET, 'mm', '.3g')} are an arm's: did the tracker, the tooling"
            " or the tool move?"
        )


def _date(text: str) -> datetime | None:
    """Return a date and time with its zone; None: the text is none."""
    try:
        found = datetime.fromisoformat(text)
    except ValueError:
        return None
    return None if found.tzinfo is None else found


def read_arm_growth(path: Path, robot: Robot) -> ArmGrowth:
    """Return the state of a file, of the arm that is meant.

    Raises
    ------
    CompensationError
        If it is of another arm.
    SchemaError, FileAccessError
        If the file is no state, was changed by hand, or cannot be read.
    """
    found = read_json(path, ArmGrowth)
    found.require_arm(robot, path)
    return found


def write_arm_growth(path: Path, state: ArmGrowth) -> None:
    """Write a state, atomically.

    Raises
    ------
    FileAccessError
        If it cannot be written.
    """
    write_json(path, state)
