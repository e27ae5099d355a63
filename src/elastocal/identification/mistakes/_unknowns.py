"""Interpretations of readings with unknown numbers, estimated with the springs.

Constants, drifts, gains, lags and places: linearised about the springs' fit, and iterated.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from scipy.linalg import expm, expm_frechet

from elastocal.arrays import FloatArray
from elastocal.dataset import Readings
from elastocal.identification.mistakes._motion import AXES, median_norm
from elastocal.identification.mistakes._rows import (
    FITTED,
    IN_TIME,
    LIKELY,
    OtherReading,
    Rows,
    begins_pose,
    beside,
    first_of_pose,
)
from elastocal.identification.solve import fit_each

_IN_POSE, _GROWN = 0.75, 0.2
"""Part of the error that may be left by what grows in each pose, and its least part of the median
force or deflection: correct arms creep, which leaves 0.7 of the error but is a drift of less than a
tenth."""
_TILTED, _CROSS_TALK = np.radians(8.0), 0.15
"""Tilt of a sensor, and part of one axis in another, from which they are reported; where the
springs miss much, correct arms seem to have 6 deg and 9 %."""
_COMPRESSED, _LOST = 0.92, 0.1
"""Part of the error that may be left by a sensor whose gain falls with its load, and least part of
the largest force that it loses."""
_WARMED = 0.1
"""Part of the campaign after which a sensor that warms up is near its end."""
_PRELOADED, _LEAST_PRELOAD = 0.93, 0.15
"""Part of the error that may be left by a reference that was read under a part of a press, and the
least such part; correct arms seem to have 0.07."""
_SLIPPED, _LEAST_SLIP, _STUCK = 0.85, 1e-4, 0.1
"""Part of the error that may be left by a tool that slips, the least way in m, and the part of the
median force below which friction holds it."""
_ROUNDS = 4
_CONSTANT_ROUNDS = 10
"""A constant as large as half the force takes more rounds to settle than a gain."""
_LAG_ROUNDS = 1
"""A lag is estimated once: so its thresholds were measured."""
_SETTLED = 1e-6
"""Step over the numbers themselves below which they have settled; messages show three digits."""
_SMALLEST = 0.05
"""Part of the median force below which a constant is not reported."""
_UPRIGHT = 0.95
"""Cosine of its angle with the vertical from which a constant force may be a weight."""
_HEAVY = 0.7
"""Part of the median force above which it is hardly one."""
_LEAST_GAIN = 0.05
_MOST_LOST = 3.0
"""Force that a sensor at its largest reading loses, over that reading, still believed."""
_LARGEST_MIXTURE = 1.0
"""Angle in rad of a tilt about an axis, and part of one axis in another, still believed."""
_LONGEST_LAG = 2.0
"""Factor of the change since the load case before that is still believed."""
_LEAST_FRAME_TURN = 2.0
"""Turn of the tracker's frame in deg from which it is reported: an arm that is off by millimetres
turns the registration by some hundredths, which shows where springs miss little."""
_FARTHEST = 2.0
"""Distance in m between two places of a marker that is still believed."""


def estimates(rows: Rows) -> Iterator[tuple[Iterable[OtherReading], bool]]:
    """Yield other readings in groups, and whether each is of the marker."""
    yield from (
        (_constants(rows), False),
        (_marker_drifts(rows), True),
        (_force_drifts(rows), False),
        (_force_gains(rows), False),
        (_compressed_forces(rows), False),
        (_mixed_forces(rows), False),
        (_marker_gains(rows), True),
        (_force_lags(rows), False),
        (_marker_lags(rows), True),
        (_preloaded_references(rows), True),
        (_slips(rows), True),
        (_marker_places(rows), True),
        (_any_marker_frame(rows), True),
    )


@dataclass(frozen=True)
class _Unknown:
    """Numbers on which rows of springs depend, estimated with the springs."""

    none: FloatArray
    """Their values for readings that are as stated, shape (number,)."""
    blocks: Callable[[FloatArray], FloatArray]
    """Returns the rows of the springs with numbers, shape (reading, 3, spring)."""
    columns: Callable[[FloatArray, FloatArray], FloatArray]
    """Returns their own columns at numbers, with compliances, shape (reading, 3, number)."""
    is_believed: Callable[[FloatArray], bool]


def _estimated(
    rows: Rows, unknowns: Sequence[_Unknown], rounds: int
) -> list[tuple[FloatArray, FloatArray] | None]:
    """Return numbers and rows of each, None where they are not believed.

    Linearised about the springs' fit, and iterated; all of them at once, as many numbers each.
    """
    found = {number: (each.none, rows.problem.O) for number, each in enumerate(unknowns)}
    going = list(found)
    for turn in range(rounds):
        springs = [replace(rows.problem, O=found[each][1]) for each in going]
        compliances = (
            fit_each([*map(rows.without_blunders, springs)])
            if turn
            else [rows.compliance] * len(going)
        )
        wide = [
            beside(each, unknowns[number].columns(found[number][0], c))
            for number, each, c in zip(going, springs, compliances, strict=True)
        ]
        steps = fit_each([*map(rows.without_blunders, wide)])[:, rows.problem.columns :]
        changing = []
        for number, step in zip(going, steps, strict=True):
            numbers = found[number][0] + step
            if not unknowns[number].is_believed(numbers):
                del found[number]
                continue
            found[number] = numbers, unknowns[number].blocks(numbers)
            if not np.linalg.norm(step) <= _SETTLED * np.linalg.norm(numbers):
                changing.append(number)
        going = changing
        if not going:
            break
    return [found.get(number) for number in range(len(unknowns))]


def _constants(rows: Rows) -> Iterator[OtherReading]:
    """Yield readings without a constant in the forces: weight in base, bias in the tcp frame."""
    each = [(frame, np.ones(len(rows.readings))) for frame in ("base", "tcp")]
    for (frame, _), found in zip(each, _offsets(rows, each), strict=True):
        if found is None:
            continue
        offset, blocks = found
        if not np.linalg.norm(offset) > _SMALLEST * median_norm(rows.readings.force):
            continue
        kind = "zeroed at the wrong moment? Or, where the tool tilts little, tool weight left in?"
        down = _along(offset, np.array(rows.model.robot.gravity))
        if frame == "base" and abs(down) > _UPRIGHT:
            kind = "tool weight left in?" if down > 0.0 else "tool weight subtracted twice?"
            if np.linalg.norm(offset) > _HEAVY * median_norm(rows.readings.force):
                kind += " Or zeroed at the wrong moment?"
        x, y, z = offset
        message = (
            f"the forces seem to contain a constant of ({x:.0f}, {y:.0f}, {z:.0f}) N in the"
            f" {frame} frame: {kind}"
        )
        yield OtherReading(
            message, blocks, rows.problem.d, FITTED, estimated=True, cause="constant force"
        )


def _along(a: FloatArray, b: FloatArray) -> float:
    """Return the cosine of the angle between vectors; 1 where one is zero."""
    size = float(np.linalg.norm(a) * np.linalg.norm(b))
    return float(a @ b) / size if size > 0.0 else 1.0


def _parts(offset: FloatArray, scale: float = 1.0, digits: int = 0) -> dict[str, str]:
    return {name: f"{scale * value:.{digits}f}" for name, value in zip(AXES, offset, strict=True)}


def _offsets(
    rows: Rows, each: Sequence[tuple[str, FloatArray]]
) -> list[tuple[FloatArray, FloatArray] | None]:
    """Return forces that are too much in all readings, and rows without them.

    Each is constant in a frame, times a course of shape (reading,).
    """
    most = 3.0 * np.median(np.linalg.norm(rows.readings.force, axis=1))

    def constant(X: FloatArray, course: FloatArray) -> _Unknown:
        less = -X * course[:, None, None]
        return _Unknown(
            np.zeros(3),
            lambda offset: np.asarray(
                rows.problem.O + np.einsum("rikn,rk->rin", rows.basis, less @ offset)
            ),
            lambda _, c: rows.moved(less, c),
            lambda offset: bool(np.linalg.norm(offset) < most),
        )

    constants = [constant(rows.frames[frame], course) for frame, course in each]
    return _estimated(rows, constants, _CONSTANT_ROUNDS)


def _marker_drifts(rows: Rows) -> Iterator[OtherReading]:
    """Yield readings of markers without what grew, or came at once, in the order of time."""
    t = _time(rows)
    d, eye = rows.problem.d, np.eye(3)
    steps = [(t > part).astype(float) for part in (0.25, 0.33, 0.42, 0.5, 0.58, 0.67, 0.75)]
    whiles = [
        ((t > low) & (t < high)).astype(float)
        for low, high in ((0.25, 0.5), (0.33, 0.67), (0.25, 0.75), (0.5, 0.75))
    ]
    again = "over the campaign: read a fixed target again and again"
    in_pose = "in each pose: read the reference again at its end"
    jump = "jump half way (station bumped?)"
    courses = [("drift", _Course(t, again))]
    courses += [(jump, _Course(each, again)) for each in (*steps, *whiles)]
    courses.append(("drift", _Course(_time_in_pose(rows), in_pose, _IN_POSE, _GROWN)))
    columns = [course.place[:, None, None] * eye for _, course in courses]
    for (how, course), grown in zip(courses, _factors(rows, columns), strict=True):
        if np.linalg.norm(grown) < course.smallest * median_norm(d):
            continue
        yield OtherReading(
            ("marker displacements {how} by ({x}, {y}, {z}) mm {remedy}").format(
                how=how, remedy=course.remedy, **_parts(grown, 1000.0, 2)
            ),
            rows.problem.O,
            d - course.place[:, None] * grown,
            course.least,
            estimated=True,
        )


@dataclass(frozen=True)
class _Course:
    """The order of time in which something grows."""

    place: FloatArray
    """Of each reading, from 0 to 1."""
    remedy: str
    least: float = IN_TIME
    """Part of the error that may be left."""
    smallest: float = 0.0
    """Part of the median force or deflection below which it is not reported."""


def _time(rows: Rows) -> FloatArray:
    """Return the place of each reading in the campaign, from 0 to 1."""
    return np.linspace(0.0, 1.0, len(rows.readings))


def _time_in_pose(rows: Rows) -> FloatArray:
    """Return the place of each reading in its pose, from just above 0 (the reference) to 1."""
    first = first_of_pose(rows.readings)
    since = np.arange(len(first)) - first + 1.0
    return np.asarray(since / np.bincount(first)[first])


def _force_drifts(rows: Rows) -> Iterator[OtherReading]:
    """Yield readings of forces without a constant that grew in the order of time."""
    size = median_norm(rows.readings.force)
    warm = 1.0 - np.exp(-_time(rows) / _WARMED)
    begins = "at the begin of the campaign: let the sensor warm up, and zero it before each pose"
    courses = (
        _Course(_time(rows), "over the campaign: zero the sensor before each pose"),
        _Course(warm, begins, _IN_POSE, _GROWN),
        _Course(_time_in_pose(rows), "in each pose: let the sensor warm up", _IN_POSE, _GROWN),
    )
    each = [*product(courses, ("tcp", "base"))]
    offsets = _offsets(rows, [(frame, course.place) for course, frame in each])
    for (course, frame), found in zip(each, offsets, strict=True):
        if found is None or np.linalg.norm(found[0]) < course.smallest * size:
            continue
        yield OtherReading(
            (
                "the zero of the force drifts by ({x}, {y}, {z}) N in the {frame} frame {remedy}"
            ).format(frame=frame, remedy=course.remedy, **_parts(found[0])),
            found[1],
            rows.problem.d,
            course.least,
            estimated=True,
            cause="drift of the force",
        )


def _mixed_forces(rows: Rows) -> Iterator[OtherReading]:
    """Yield readings of forces of a tilted sensor, or one with cross-talk, in the tcp frame."""
    skew = np.cross(np.eye(3)[:, None], np.eye(3)[None]).swapaxes(1, 2)
    (found,) = _estimated(rows, [_mixture(rows, skew)], _ROUNDS)
    if found is not None:
        undone, blocks = found
        angle = float(np.linalg.norm(undone))
        if angle > _TILTED:
            x, y, z = -undone / angle
            message = (
                f"the sensor looks tilted by {np.degrees(angle):.0f} deg about ({x:.1f}, {y:.1f},"
                f" {z:.1f}) in the tcp frame: check how it is mounted"
            )
            yield OtherReading(message, blocks, rows.problem.d, LIKELY, estimated=True)
    others = [[each for each in range(3) if each != axis] for axis in range(3)]
    shears = [
        _mixture(rows, np.einsum("ki,j->kij", np.eye(3)[each], np.eye(3)[axis]))
        for axis, each in enumerate(others)
    ]
    for axis, found in enumerate(_estimated(rows, shears, _ROUNDS)):
        if found is None or not np.abs(found[0]).max() > _CROSS_TALK:
            continue
        undone, blocks = found
        parts = " and ".join(
            f"{-part:.0%} in force_{AXES[each]}"
            for each, part in zip(others[axis], undone, strict=True)
        )
        message = (
            f"force_{AXES[axis]} in the tcp frame seems to show by cross-talk, {parts}: check the"
            " sensor's calibration matrix"
        )
        yield OtherReading(message, blocks, rows.problem.d, LIKELY, estimated=True)


def _mixture(rows: Rows, generators: FloatArray) -> _Unknown:
    """Return the numbers that undo a mixture of the axes of the force in the tcp frame.

    The exponential of the sum of generators, shape (number, 3, 3), times numbers is the matrix
    that turns what was read into the force.
    """
    X = rows.frames["tcp"]
    own = np.einsum("rji,rj->ri", X, rows.readings.force)

    def mixed(numbers: FloatArray) -> FloatArray:
        return np.asarray(np.einsum("k,kij->ij", numbers, generators))

    def blocks(numbers: FloatArray) -> FloatArray:
        return rows.turned(X @ expm(mixed(numbers)) @ np.swapaxes(X, 1, 2))

    def columns(numbers: FloatArray, c: FloatArray) -> FloatArray:
        slopes = [expm_frechet(mixed(numbers), G, compute_expm=False) for G in generators]
        return rows.moved(np.einsum("rij,kjl,rl->rik", X, slopes, own), c)

    none = np.zeros(len(generators))
    return _Unknown(none, blocks, columns, lambda x: bool(np.abs(x).max() < _LARGEST_MIXTURE))


def _force_gains(rows: Rows) -> Iterator[OtherReading]:
    """Yield readings with one axis of the force scaled."""
    each = [(frame, axis) for frame in rows.frames for axis in range(3)]
    gains = [_force_gain(rows, rows.frames[frame][:, :, axis]) for frame, axis in each]
    for (frame, axis), found in zip(each, _estimated(rows, gains, _ROUNDS), strict=True):
        if found is None:
            continue
        (gain,), blocks = found
        yield OtherReading(
            (
                "force_{axis} in the {frame} frame looks {gain} times too large: check the"
                " gain of the sensor's channel"
            ).format(axis=AXES[axis], frame=frame, gain=f"{1.0 / gain:.2f}"),
            blocks,
            rows.problem.d,
            FITTED,
            estimated=True,
        )


def _compressed_forces(rows: Rows) -> Iterator[OtherReading]:
    """Yield readings of a sensor whose gain falls with the force on it, estimated."""
    r, light = rows.readings, rows.readings.reference_force
    largest = float(np.linalg.norm(r.force, axis=1).max())

    def squared(force: FloatArray) -> FloatArray:
        size = np.linalg.norm(force, axis=1, keepdims=True)
        return np.asarray(force * size / max(largest, 1e-12))

    less = None if light is None else squared(light)
    more = squared(r.force)

    def blocks(lost: FloatArray) -> FloatArray:
        zero = light if light is None or less is None else light + lost * less
        return rows.blocks(r.force + lost * more, zero)

    lost = _Unknown(
        np.zeros(1),
        blocks,
        lambda _, c: rows.moved(more[..., None], c),
        lambda lost: bool(abs(lost[0]) < _MOST_LOST),
    )
    (found,) = _estimated(rows, [lost], _ROUNDS)
    if found is None or not (part := float(found[0][0] / (1.0 + found[0][0]))) > _LOST:
        return
    message = (
        f"the force sensor's gain seems to fall with its load, by {part:.0%} at the largest force"
        " (not linear, or near the end of its range): check it with known weights, press with less"
    )
    yield OtherReading(message, found[1], rows.problem.d, _COMPRESSED, estimated=True)


def _force_gain(rows: Rows, x: FloatArray) -> _Unknown:
    """Return the factor that undoes a gain of the force along axes, shape (reading, 3)."""
    along = x[:, :, None] * x[:, None, :]
    part = np.einsum("rij,rj->ri", along, rows.readings.force)
    return _Unknown(
        np.ones(1),
        lambda gain: rows.turned(np.eye(3) + (gain - 1.0) * along),
        lambda _, c: rows.moved(part[..., None], c),
        lambda gain: bool(_LEAST_GAIN < gain[0] < 1.0 / _LEAST_GAIN),
    )


def _marker_gains(rows: Rows) -> Iterator[OtherReading]:
    """Yield readings with one axis of the marker scaled, or all."""
    names = (*(f"marker_displacement_{each}" for each in AXES), "marker displacements")
    each = [rows.readings.marker_displacement * kept for kept in (*np.eye(3), np.ones(3))]
    factors = _factors(rows, [-seen[..., None] for seen in each])
    for name, seen, (more,) in zip(names, each, factors, strict=True):
        gain = 1.0 + float(more)
        if not gain > 0.0:
            continue
        yield OtherReading(
            (
                "{name} look {gain} times too large (0.039: inches in a column of mm): check the"
                " tracker's column"
            ).format(name=name, gain=f"{1.0 / gain:.3g}"),
            rows.problem.O,
            rows.problem.d + (gain - 1.0) * seen,
            FITTED,
            certain=not 0.5 < gain < 2.0,
            louder=1.0 / gain,
            estimated=True,
        )


def _force_lags(rows: Rows) -> Iterator[OtherReading]:
    """Yield readings of forces without a part of what was read in a load case beside."""
    each = [*_since_beside(rows.readings, rows.readings.force)]
    lags = _estimated(rows, [_force_lag(rows, change) for _, change in each], _LAG_ROUNDS)
    for (which, _), found in zip(each, lags, strict=True):
        if found is not None:
            (late,), blocks = found
            message = _lagging("forces", late, which)
            yield OtherReading(message, blocks, rows.problem.d, FITTED, estimated=True)


def _force_lag(rows: Rows, change: FloatArray) -> _Unknown:
    """Return the factor of a change, shape (reading, 3), that the force lacks."""
    r = rows.readings
    return _Unknown(
        np.zeros(1),
        lambda late: rows.blocks(r.force + late * change, r.reference_force),
        lambda _, c: rows.moved(change[..., None], c),
        lambda late: bool(0.0 < late[0] < _LONGEST_LAG),
    )


def _marker_lags(rows: Rows) -> Iterator[OtherReading]:
    """Yield readings of markers without a part of what was read in a load case beside."""
    each = [*_since_beside(rows.readings, rows.readings.marker_displacement)]
    factors = _factors(rows, [-change[..., None] for _, change in each])
    for (which, change), (late,) in zip(each, factors, strict=True):
        if 0.0 < late < _LONGEST_LAG:
            d = rows.problem.d + late * change
            message = _lagging("marker displacements", late, which)
            yield OtherReading(message, rows.problem.O, d, FITTED, estimated=True)


def _since_beside(r: Readings, values: FloatArray) -> Iterator[tuple[str, FloatArray]]:
    """Yield the change of values, shape (reading, 3), since the load case before and after."""
    begins = begins_pose(r)
    for which, shift, alone in (("before", 1, begins), ("after", -1, np.roll(begins, -1))):
        yield which, np.where(alone[:, None], 0.0, values - np.roll(values, shift, axis=0))


def _factors(rows: Rows, columns: Iterable[FloatArray]) -> FloatArray:
    """Return the factors of columns that are fitted beside the springs, shape (fit, column).

    Those of each fit have shape (reading, 3, column), as many for each.
    """
    wide = [rows.without_blunders(beside(rows.problem, each)) for each in columns]
    return np.asarray(fit_each(wide)[:, rows.problem.columns :])


def _lagging(name: str, late: float, which: str) -> str:
    how = "lag" if which == "before" else "run ahead"
    return (
        f"{name} {how}: they seem to hold {late / (1.0 + late):.0%} of the load case {which}; let"
        " each press settle, and read all devices at the same time"
    )


def _preloaded_references(rows: Rows) -> Iterator[OtherReading]:
    """Yield readings of markers whose reference was read under a part of the pose's first press."""
    stated, first = rows.problem.O, first_of_pose(rows.readings)
    under = _Unknown(
        np.zeros(1),
        lambda part: np.asarray(stated - part * stated[first]),
        lambda _, c: -(stated @ c)[first][..., None],
        lambda part: bool(0.0 < part[0] < 1.0),
    )
    (found,) = _estimated(rows, [under], _ROUNDS)
    if found is None or not (part := float(found[0][0])) > _LEAST_PRELOAD:
        return
    message = (
        f"the reference of the marker seems to be read under {part:.0%} of the first press of each"
        " pose (a preload): read it in the air, or in a contact whose force is recorded"
    )
    yield OtherReading(message, found[1], rows.problem.d, _PRELOADED, estimated=True)


def _slips(rows: Rows) -> Iterator[OtherReading]:
    """Yield readings of a tool that slips in its holder with the sign of the force across it."""
    X, r = rows.frames["tcp"], rows.readings
    own = np.einsum("rji,rj->ri", X, r.force)
    across = np.tanh(own / max(_STUCK * median_norm(r.force), 1e-12)) * [1.0, 1.0, 0.0]
    column = np.einsum("rij,rj->ri", X, across)
    ((way,),) = _factors(rows, [column[..., None]])
    if not way > _LEAST_SLIP:
        return
    message = (
        f"the tool seems to slip by {1e3 * way:.2f} mm with the force across it: check the clamp"
        " of the tool, and the screws of the marker"
    )
    d = rows.problem.d - way * column
    yield OtherReading(message, rows.problem.O, d, _SLIPPED, estimated=True)


def _marker_places(rows: Rows) -> Iterator[OtherReading]:
    """Yield readings with the marker elsewhere on the tool, estimated."""
    elsewhere = _Unknown(
        np.zeros(3),
        lambda place: np.asarray(rows.problem.O + np.einsum("rikn,k->rin", rows.lever, place)),
        lambda _, c: np.asarray(np.einsum("rikn,n->rik", rows.lever, c)),
        lambda place: bool(np.linalg.norm(place) < _FARTHEST),
    )
    (found,) = _estimated(rows, [elsewhere], _ROUNDS)
    if found is None:
        return
    place, blocks = found
    x, y, z = 1e3 * place
    message = (
        f"the marker seems to sit ({x:.0f}, {y:.0f}, {z:.0f}) mm in the tcp frame from where it is"
        " said to be: check its place and unit"
    )
    yield OtherReading(message, blocks, rows.problem.d, FITTED, estimated=True)


def _any_marker_frame(rows: Rows) -> Iterator[OtherReading]:
    """Yield readings with the marker in another frame or unit altogether, estimated."""
    r = rows.readings
    m = r.marker_displacement
    columns = -np.einsum("ij,rk->rijk", np.eye(3), m).reshape(len(r), 3, 9)
    (x,) = _factors(rows, [columns])
    U, s, Vt = np.linalg.svd(np.eye(3) + x.reshape(3, 3))
    scale = float(np.median(s))
    if not s[2] > 0.0:
        return
    turn = U @ Vt
    mirrored = np.linalg.det(turn) < 0.0
    angle = float(np.degrees(np.arccos(np.clip(0.5 * (np.trace(turn) - 1.0), -1.0, 1.0))))
    if mirrored:
        message = "the tracker's frame looks left-handed (mirrored)"
    elif not 0.5 < scale < 2.0:
        message = (
            "marker displacements look {gain} times too large (0.039: inches in a column of mm)"
        ).format(gain=f"{1.0 / scale:.3g}")
    elif angle < _LEAST_FRAME_TURN:
        return
    else:
        message = (
            "marker displacements look turned by {angle} deg: the tracker's frame called base?"
        ).format(angle=f"{angle:.0f}")
    B = turn if 0.5 < scale < 2.0 else scale * turn
    yield OtherReading(
        (f"{message}; check the registration of the tracker"),
        rows.problem.O,
        m @ B.T - r.controller_displacement,
        LIKELY,
        certain=True,
        louder=1.0 / scale if not 0.5 < scale < 2.0 else 1.0,
    )
