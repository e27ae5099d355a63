"""Ways in which readings may be meant otherwise than stated, the plainest first."""

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.dataset import Readings
from elastocal.errors import IdentificationError
from elastocal.identification.conventions import FORCE_MISTAKES
from elastocal.identification.mistakes._rows import OtherReading, Rows, beside
from elastocal.identification.mistakes._suspicion import AXES, median_norm
from elastocal.identification.solve import solve

_CLEAR, _LIKELY, _FITTED = 0.9, 0.75, 0.8
_ROUNDS = 4
_CONSTANT_ROUNDS = 10
"""A constant as large as half the force takes more rounds to settle than a gain."""
_SMALLEST = 0.05
"""Part of the median force below which a constant is not worth naming."""
_LEAST_GAIN = 0.05
_ANGLES = (90, -90, 180, 30, -30, 45, -45, 60, -60, 120, -120, 135, -135, 150, -150)
"""Angles in deg by which a sensor is turned about the tool; about other axes the first three."""


def other_readings(rows: Rows, compliance: FloatArray) -> Iterator[OtherReading]:
    """Yield every other reading of the data, the plainest first."""
    yield from _turned_forces(rows)
    yield from _turned_markers(rows)
    yield from _other_rows(rows)
    yield from _constants(rows, compliance)
    yield from _drifts(rows, compliance)
    yield from _gains(rows, compliance)
    yield from _any_marker_frame(rows)


def _turned_forces(rows: Rows) -> Iterator[OtherReading]:
    """Yield readings of forces in other frames, with axes exchanged, reversed or turned."""
    d, robot, r = rows.problem.d, rows.model.robot, rows.readings
    for mistake in FORCE_MISTAKES:
        force, light = mistake.undo(robot, r).force, r.reference_force
        if light is not None:
            light = mistake.undo(robot, replace(r, force=light)).force
        yield OtherReading(mistake.message, rows.blocks(force, light), d, _CLEAR, certain=True)
    for frame, X in rows.frames.items():
        for message, A in _turns(f"force_{{axis}} in the {frame} frame", frame != "base"):
            G = X @ A @ np.swapaxes(X, 1, 2)
            blocks = rows.turned(G)
            remedy = f"{message}; check the sensor's frame in the map"
            yield OtherReading(remedy, blocks, d, _CLEAR, certain=True)


def _turned_markers(rows: Rows) -> Iterator[OtherReading]:
    r, blocks = rows.readings, rows.problem.O
    for message, A in _turns("marker_displacement_{axis}", False):
        d = r.marker_displacement @ A.T - r.controller_displacement
        remedy = f"{message}; check the tracker's frame"
        yield OtherReading(remedy, blocks, d, _LIKELY, certain=True)


def _turns(name: str, any_angle: bool) -> Iterator[tuple[str, FloatArray]]:
    """Yield matrices that undo exchanged, reversed and turned axes, with what was done."""
    whole = name.replace("_{axis}", "")
    for axis, letter in enumerate(AXES):
        A = np.eye(3)
        A[axis, axis] = -1.0
        yield (f"{name.format(axis=letter)} looks reversed"), A
    for a, b in combinations(range(3), 2):
        A = np.eye(3)
        A[[a, b]] = A[[b, a]]
        pair = name.replace("{axis}", f"{AXES[a]} and {whole.split()[0]}_{AXES[b]}")
        yield (f"{pair} look exchanged"), A
    for axis, letter in enumerate(AXES):
        angles = _ANGLES if any_angle and letter == "z" else _ANGLES[:3]
        for angle in angles:
            k, a = np.eye(3)[axis], np.radians(angle)
            K = np.cross(np.eye(3), k).T
            A = np.eye(3) + np.sin(a) * K.T + (1.0 - np.cos(a)) * K @ K
            by = -angle if abs(angle) < 180 else 180
            yield f"{whole} looks turned by {by} deg about {letter}", A


def _other_rows(rows: Rows) -> Iterator[OtherReading]:
    """Yield readings of forces and markers in another order."""
    r, d = rows.readings, rows.problem.d
    for message, order in _orders(r):
        blocks = rows.blocks(r.force[order], r.reference_force)
        yield OtherReading((f"forces are {message}"), blocks, d, _CLEAR, certain=True)
    for shift, which in ((-1, "before"), (1, "after")):
        order = np.roll(np.arange(len(r)), shift)
        moved = r.marker_displacement[order] - r.controller_displacement
        message = f"marker displacements are those of the row {which}"
        yield OtherReading(message, rows.problem.O, moved, _LIKELY, certain=True)


def _orders(r: Readings) -> Iterator[tuple[str, IndexArray]]:
    cases, poses = list(dict.fromkeys(r.load_case.tolist())), np.unique(r.pose)
    width = len(cases)
    index = np.arange(len(r))
    for shift, which in ((-1, "before"), (1, "after")):
        yield f"those of the row {which}: shift the column by a row", np.roll(index, shift)
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


def _constants(rows: Rows, compliance: FloatArray) -> Iterator[OtherReading]:
    """Yield readings without a constant in the forces: weight in base, bias in the tcp frame."""
    one = np.ones(len(rows.readings))
    for frame in ("base", "tcp"):
        found = _offset(rows, compliance, rows.frames[frame], one)
        if found is None:
            continue
        offset, blocks = found
        if not np.linalg.norm(offset) > _SMALLEST * median_norm(rows.readings.force):
            continue
        kind = "zeroed at the wrong moment? Or, where the tool tilts little, tool weight left in?"
        if frame == "base":
            down = float(offset @ np.array(rows.model.robot.gravity)) > 0.0
            kind = "tool weight left in?" if down else "tool weight subtracted twice?"
        x, y, z = offset
        message = (
            f"the forces seem to contain a constant of ({x:.0f}, {y:.0f}, {z:.0f}) N in the"
            f" {frame} frame: {kind}"
        )
        yield OtherReading(message, blocks, rows.problem.d, _FITTED)


def _parts(offset: FloatArray, scale: float = 1.0, digits: int = 0) -> dict[str, str]:
    return {name: f"{scale * value:.{digits}f}" for name, value in zip(AXES, offset, strict=True)}


def _offset(
    rows: Rows, compliance: FloatArray, X: FloatArray, course: FloatArray
) -> tuple[FloatArray, FloatArray] | None:
    """Return a force that is too much in all readings, times a course, and rows without it."""
    r, offset = rows.readings, np.zeros(3)
    blocks, c = rows.problem.O, compliance
    for _ in range(_CONSTANT_ROUNDS):
        columns = -np.einsum("rikn,n->rik", rows.basis, c) @ X * course[:, None, None]
        widened = beside(replace(rows.problem, O=blocks), columns).take(rows.kept)
        x = solve(widened).compliance
        offset = offset + x[-3:]
        if not np.linalg.norm(offset) < 3.0 * np.median(np.linalg.norm(r.force, axis=1)):
            return None
        made = np.einsum("rikn,rk->rin", rows.basis, course[:, None] * (X @ offset))
        blocks = rows.problem.O - made
        c = solve(replace(rows.problem, O=blocks).take(rows.kept)).compliance
    return offset, blocks


def _drifts(rows: Rows, compliance: FloatArray) -> Iterator[OtherReading]:
    """Yield readings without what grew, or came at once, in the order of time."""
    t = np.linspace(0.0, 1.0, len(rows.readings))
    d, eye = rows.problem.d, np.eye(3)
    steps = [(part, (t > part).astype(float)) for part in (0.25, 0.33, 0.42, 0.5, 0.58, 0.67, 0.75)]
    for part, course in ((None, t), *steps):
        widened = beside(rows.problem, course[:, None, None] * eye).take(rows.kept)
        grown = solve(widened).compliance[-3:]
        how = ("drift by") if part is None else ("jump half way (station bumped?) by")
        yield OtherReading(
            (
                "marker displacements {how} ({x}, {y}, {z}) mm over the campaign: read a"
                " fixed target again and again"
            ).format(how=how, **_parts(grown, 1000.0, 2)),
            rows.problem.O,
            d - course[:, None] * grown,
            _FITTED,
        )
    found = _offset(rows, compliance, rows.frames["tcp"], t)
    if found is not None:
        yield OtherReading(
            (
                "the zero of the force drifts by ({x}, {y}, {z}) N in the tcp frame over the"
                " campaign: zero the sensor before each pose"
            ).format(**_parts(found[0])),
            found[1],
            d,
            _FITTED,
        )


def _gains(rows: Rows, compliance: FloatArray) -> Iterator[OtherReading]:
    """Yield readings with one axis of force or marker scaled."""
    for frame, X in rows.frames.items():
        for axis, letter in enumerate(AXES):
            found = _force_gain(rows, compliance, X[:, :, axis])
            if found is None:
                continue
            yield OtherReading(
                (
                    "force_{axis} in the {frame} frame looks {gain} times too large: check the"
                    " gain of the sensor's channel"
                ).format(axis=letter, frame=frame, gain=f"{1.0 / found[0]:.2f}"),
                found[1],
                rows.problem.d,
                _FITTED,
            )
    for axis, letter in enumerate(AXES):
        seen = rows.readings.marker_displacement * np.eye(3)[axis]
        widened = beside(rows.problem, -seen[..., None]).take(rows.kept)
        gain = 1.0 + float(solve(widened).compliance[-1])
        if not gain > 0.0:
            continue
        yield OtherReading(
            (
                "marker_displacement_{axis} looks {gain} times too large (0.039: inches in a"
                " column of mm): check the tracker's column"
            ).format(axis=letter, gain=f"{1.0 / gain:.3g}"),
            rows.problem.O,
            rows.problem.d + (gain - 1.0) * seen,
            _LIKELY,
            certain=not 0.5 < gain < 2.0,
            louder=1.0 / gain,
        )


def _force_gain(
    rows: Rows, compliance: FloatArray, x: FloatArray
) -> tuple[float, FloatArray] | None:
    """Return the factor that undoes a gain along axes, shape (reading, 3), and rows with it."""
    along = x[:, :, None] * x[:, None, :]
    part = np.einsum("rij,rj->ri", along, rows.readings.force)
    gain, blocks, c = 1.0, rows.problem.O, compliance
    for _ in range(_ROUNDS):
        column = np.einsum("rikn,rk,n->ri", rows.basis, part, c)[..., None]
        widened = beside(replace(rows.problem, O=blocks), column).take(rows.kept)
        gain += float(solve(widened).compliance[-1])
        if not _LEAST_GAIN < gain < 1.0 / _LEAST_GAIN:
            return None
        blocks = rows.turned(np.eye(3) + (gain - 1.0) * along)
        c = solve(replace(rows.problem, O=blocks).take(rows.kept)).compliance
    return gain, blocks


def _any_marker_frame(rows: Rows) -> Iterator[OtherReading]:
    """Yield readings with the marker in another frame or unit altogether, estimated."""
    r = rows.readings
    m = r.marker_displacement
    columns = -np.einsum("ij,rk->rijk", np.eye(3), m).reshape(len(r), 3, 9)
    try:
        x = solve(beside(rows.problem, columns).take(rows.kept)).compliance[-9:]
    except IdentificationError:
        return
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
    else:
        message = (
            "marker displacements look turned by {angle} deg: the tracker's frame called base?"
        ).format(angle=f"{angle:.0f}")
    B = turn if 0.5 < scale < 2.0 else scale * turn
    yield OtherReading(
        (f"{message}; check the registration of the tracker"),
        rows.problem.O,
        m @ B.T - r.controller_displacement,
        _LIKELY,
        certain=True,
        louder=1.0 / scale if not 0.5 < scale < 2.0 else 1.0,
    )
