"""Interpretations of readings that need no numbers: signs, axes, units, angles, orders of rows.

All readings, a part of the campaign, or single poses may be interpreted otherwise.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from functools import cache
from itertools import combinations, compress, islice, permutations, product
from operator import itemgetter

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.arrays import FloatArray, IndexArray
from elastocal.dataset import Readings
from elastocal.identification.conventions import FORCE_MISTAKES
from elastocal.identification.mistakes._motion import AXES
from elastocal.identification.mistakes._rows import (
    AT_ONCE,
    CLEAR,
    FITTED,
    LIKELY,
    PARTS,
    OtherReading,
    Rows,
    first_of_pose,
    fitted,
    residuals,
)
from elastocal.identification.problem import Problem
from elastocal.identification.solve import grams_of
from elastocal.wording import spans

_BETTER, _POLLUTED_ROUNDS = 0.7, 4
"""Part of the error of a pose that another reading leaves where it may be the right one, and fits
by which the poses settle at which it is."""
_SHORTEST = 3
"""Fewest poses of a part of the campaign that is mistaken by itself."""
_SHIFTS = (
    (-1, "the row before"),
    (1, "the row after"),
    (-2, "two rows before"),
    (2, "two rows after"),
)
_ANGLES = (90, -90, 180, 30, -30, 45, -45, 60, -60, 120, -120, 135, -135, 150, -150)
"""Angles in deg by which a sensor is turned about the tool; about other axes the first three."""


def interpretations(rows: Rows) -> Iterator[tuple[Iterable[OtherReading], bool]]:
    """Yield other readings in groups, the plainest first, and whether each is of the marker."""
    forces, markers = ([*turned(rows, plain=True)] for turned in (_turned_forces, _turned_markers))
    yield from (
        (_possible(rows, _turned_forces(rows)), False),
        (_possible(rows, _turned_markers(rows)), True),
        (_wrong_for_a_part(rows, forces), False),
        (_wrong_for_a_part(rows, markers), True),
        (_wrong_at_some(rows, forces), False),
        (_wrong_at_some(rows, [*_marker_units(rows), *markers]), True),
        (_wrong_for_a_part(rows, _other_force_rows(rows, plain=True)), False),
        (_wrong_for_a_part(rows, _other_marker_rows(rows, plain=True)), True),
        (_possible(rows, _other_force_rows(rows)), False),
        (_possible(rows, _other_marker_rows(rows)), True),
        (_possible(rows, _other_marker_counts(rows)), True),
    )


def _possible(rows: Rows, readings: Iterable[OtherReading]) -> Iterator[OtherReading]:
    """Yield the readings that are not hopeless; see `Rows.is_possible`."""
    remaining = iter(readings)
    while part := list(islice(remaining, AT_ONCE)):
        grams = grams_of([rows.read(each) for each in part])
        yield from compress(part, rows.is_possible(grams))


def _turned_forces(rows: Rows, plain: bool = False) -> Iterator[OtherReading]:
    """Yield readings of forces in other frames, with axes exchanged, reversed or turned.

    Plain ones are turned by right angles.
    """
    d, robot, r = rows.problem.d, rows.model.robot, rows.readings
    for mistake in FORCE_MISTAKES:
        force, light = mistake.undo(robot, r).force, r.reference_force
        if light is not None:
            light = mistake.undo(robot, replace(r, force=light)).force
        yield OtherReading(mistake.message, rows.blocks(force, light), d, CLEAR, certain=True)
    for frame, X in rows.frames.items():
        for message, A in _turns(f"force_{{axis}} in the {frame} frame", frame != "base", plain):
            G = X @ A @ np.swapaxes(X, 1, 2)
            blocks = rows.turned(G)
            remedy = f"{message}; check the sensor's frame in the map"
            yield OtherReading(remedy, blocks, d, CLEAR, certain=True)


def _turned_markers(rows: Rows, plain: bool = False) -> Iterator[OtherReading]:
    r, blocks = rows.readings, rows.problem.O
    for message, A in _turns("marker_displacement_{axis}", False, plain):
        d = r.marker_displacement @ A.T - r.controller_displacement
        remedy = f"{message}; check the tracker's frame"
        yield OtherReading(remedy, blocks, d, LIKELY, certain=True)


@cache
def _turns(name: str, any_angle: bool, plain: bool) -> Sequence[tuple[str, FloatArray]]:
    """Return matrices that undo exchanged, reversed and rotated axes, with their descriptions.

    They include all 47 ways to interpret three columns as other axes, with or without their signs;
    plain ones are one axis reversed, two exchanged, or a turn by a right angle.
    """
    whole, found = name.replace("_{axis}", ""), []
    for axis, letter in enumerate(AXES):
        A = np.eye(3)
        A[axis, axis] = -1.0
        found.append((f"{name.format(axis=letter)} looks reversed", A))
    for a, b in combinations(range(3), 2):
        A = np.eye(3)
        A[[a, b]] = A[[b, a]]
        pair = name.replace("{axis}", f"{AXES[a]} and {whole.split()[0]}_{AXES[b]}")
        found.append((f"{pair} look exchanged", A))
    for axis, letter in enumerate(AXES):
        for angle in _ANGLES if any_angle and letter == "z" and not plain else _ANGLES[:3]:
            A = Rotation.from_rotvec(np.radians(angle) * np.eye(3)[axis]).as_matrix()
            by = -angle if abs(angle) < 180 else 180
            found.append((f"{whole} looks turned by {by} deg about {letter}", A))
    mixed = [] if plain else _mixed(whole, [np.eye(3), *(A for _, A in found)])
    return [*found, *mixed]


def _mixed(whole: str, known: Sequence[FloatArray]) -> Iterator[tuple[str, FloatArray]]:
    """Yield the matrices of axes in other columns, with or without their sign, but those known."""
    before = {tuple(each.round().ravel()) for each in known if np.allclose(each, each.round())}
    for order in permutations(range(3)):
        for signs in product((1.0, -1.0), repeat=3):
            A = np.diag(signs)[:, order]
            if tuple(A.ravel()) not in before:
                each = zip(np.abs(A).argmax(axis=1), A.sum(axis=1), strict=True)
                read = ", ".join(f"{'-' if sign < 0.0 else ''}{AXES[i]}" for i, sign in each)
                yield f"x, y, z of {whole} look mixed up: they read as {read}", A


def _wrong_for_a_part(rows: Rows, whole: Iterable[OtherReading]) -> Iterator[OtherReading]:
    """Yield the reading that holds before a pose, or from one on, and leaves least.

    A plug was changed in a break, or a row was lost.
    """
    labels, first = np.unique(rows.readings.pose, return_index=True)
    order = labels[np.argsort(first)]
    place = np.argsort(np.argsort(first))[np.searchsorted(labels, rows.readings.pose)]

    def partly(reading: OtherReading, start: int, late: bool) -> OtherReading:
        part = (place >= start) == late
        when = f"from pose {order[start]} on" if late else f"before pose {order[start]}"
        return replace(
            reading,
            message=f"{when} {reading.message}",
            blocks=np.where(part[:, None, None], reading.blocks, rows.problem.O),
            d=np.where(part[:, None], reading.d, rows.problem.d),
            least=FITTED,
            certain=False,
            estimated=True,
        )

    starts = range(_SHORTEST, len(order) - _SHORTEST + 1)
    if not starts:
        return
    coarse = sorted({starts[round(part * (len(starts) - 1))] for part in PARTS})
    piece = np.searchsorted(coarse, place, side="right")
    pieces = [np.flatnonzero((piece == each) & rows.kept) for each in range(len(coarse) + 1)]

    def grams(problem: Problem) -> FloatArray:
        return np.concatenate([grams_of([problem.take(each)]) for each in pieces])

    stated = grams(rows.problem)
    possible: list[tuple[OtherReading, int, bool]] = []
    for reading in whole:
        other = grams(replace(rows.problem, O=reading.blocks, d=reading.d))
        early = np.cumsum(other - stated, axis=0)[:-1]
        parted = np.stack([other.sum(axis=0) - early, stated.sum(axis=0) + early], axis=1)
        may = rows.is_possible(parted.reshape(-1, *stated.shape[1:]))
        possible.extend((reading, *each) for each in compress(product(coarse, (True, False)), may))
    if not possible:
        return
    left = residuals(rows.read(partly(*each)) for each in possible)
    _, (best, _, late) = min(zip(left, possible, strict=True), key=itemgetter(0))
    finer = residuals(rows.read(partly(best, start, late)) for start in starts)
    _, start = min(zip(finer, starts, strict=True))
    yield partly(best, start, late)


def _wrong_at_some(rows: Rows, whole: Iterable[OtherReading]) -> Iterator[OtherReading]:
    """Yield readings that hold at the poses at which they leave less, at half of them at most.

    A file of several was exported otherwise, or a person typed some of them.
    """
    stated, d = rows.problem.O, rows.problem.d
    labels, pose = np.unique(rows.readings.pose, return_inverse=True)

    def left(blocks: FloatArray, moved: FloatArray, c: FloatArray) -> FloatArray:
        norms = np.linalg.norm(blocks @ c - moved, axis=1)
        return np.asarray(np.bincount(pose[rows.kept], norms[rows.kept], len(labels)))

    before = left(stated, d, rows.compliance)
    for reading in whole:
        there = left(reading.blocks, reading.d, rows.compliance) < _BETTER * before
        for _ in range(_POLLUTED_ROUNDS):
            if not 2 <= np.count_nonzero(there) <= len(labels) // 2:
                break
            at = there[pose]
            partly = replace(
                reading,
                message=f"at poses {spans(labels[there].tolist())} {reading.message}",
                blocks=np.where(at[:, None, None], reading.blocks, stated),
                d=np.where(at[:, None], reading.d, d),
                least=FITTED,
                certain=False,
                estimated=True,
            )
            c, last = fitted(rows.read(partly)), there
            there = left(reading.blocks, reading.d, c) < _BETTER * left(stated, d, c)
            if np.array_equal(there, last):
                yield partly
                break


def _marker_units(rows: Rows) -> Iterator[OtherReading]:
    """Yield readings of markers in another unit of length."""
    r = rows.readings
    for name, factor in (("inches", 25.4), ("metres", 1e3)):
        yield OtherReading(
            f"marker displacements are in {name} in a column of mm: check the unit of that file",
            rows.problem.O,
            factor * r.marker_displacement - r.controller_displacement,
            LIKELY,
        )


def _other_force_rows(rows: Rows, plain: bool = False) -> Iterator[OtherReading]:
    """Yield readings of forces in another order; plain ones are a row too early or too late."""
    r, d = rows.readings, rows.problem.d
    for message, order in _shifts(r)[:2] if plain else _orders(r):
        blocks = rows.blocks(r.force[order], r.reference_force)
        yield OtherReading(f"forces are {message}", blocks, d, CLEAR, certain=True)


def _other_marker_rows(rows: Rows, plain: bool = False) -> Iterator[OtherReading]:
    """Yield readings of markers in another order, as `_other_force_rows`."""
    r, blocks = rows.readings, rows.problem.O
    for message, order in _shifts(r)[:2] if plain else _orders(r):
        moved = r.marker_displacement[order] - r.controller_displacement
        yield OtherReading(
            f"marker displacements are {message}", blocks, moved, LIKELY, certain=True
        )


def _other_marker_counts(rows: Rows) -> Iterator[OtherReading]:
    """Yield readings of markers that are counted from elsewhere."""
    r = rows.readings
    message = "marker displacements are deflections already: give what the tracker measured"
    yield OtherReading(message, rows.problem.O, r.marker_displacement, LIKELY, certain=True)
    summed = np.cumsum(r.marker_displacement, axis=0)
    start = np.vstack([np.zeros(3), summed])[first_of_pose(r)]
    message = "marker displacements are counted from the load case before, not from the reference"
    counted = summed - start - r.controller_displacement
    yield OtherReading(message, rows.problem.O, counted, LIKELY, certain=True)


def _shifts(r: Readings) -> list[tuple[str, IndexArray]]:
    """Return rows by which a column stands too early or too late, with the mistake's name."""
    index = np.arange(len(r))
    return [
        (f"those of {which}: shift the column back", np.roll(index, shift))
        for shift, which in _SHIFTS
    ]


def _orders(r: Readings) -> Iterator[tuple[str, IndexArray]]:
    """Yield rows in which a column belongs into its place, with the mistake's name."""
    cases, poses = list(dict.fromkeys(r.load_case.tolist())), np.unique(r.pose)
    width = len(cases)
    index = np.arange(len(r))
    yield from _shifts(r)
    if len(r) != width * len(poses) or width < 2:
        return
    table = index.reshape(-1, width)
    for a, b in combinations(range(width), 2):
        order = table.copy()
        order[:, [a, b]] = order[:, [b, a]]
        yield f"exchanged between load cases {cases[a]} and {cases[b]}", order.ravel()
    for shift, which in ((-1, "before"), (1, "after")):
        yield f"those of the load case {which}", np.roll(table, shift, axis=1).ravel()
        yield f"those of the pose {which}", np.roll(table, shift, axis=0).ravel()
    back = table.copy()
    back[1::2] = back[1::2, ::-1]
    yield "written backwards at every second pose", back.ravel()
    written = sorted(range(len(table)), key=lambda each: str(r.pose[table[each, 0]]))
    yield "sorted by pose as text (1, 10, 11, 2)", table[np.argsort(written)].ravel()
