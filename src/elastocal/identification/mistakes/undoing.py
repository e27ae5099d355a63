"""Mistakes found by fitting: other interpretations of the readings are fitted and compared.

Forces, marker displacements and the order of rows may be interpreted otherwise than stated; each
interpretation is fitted with the same springs (`bearing`). For correct readings any other
interpretation leaves more unexplained, because model error and noise remain. So a mistake is named
where undoing it leaves clearly less, also at left-out poses, with a paired difference far beyond
its standard error.

Rows of springs are linear in the force. With the rows of three unit forces at each reading, a
rotated, exchanged or scaled force needs a product, not a new model. Unknown numbers, such as a
constant in the force or a drift, are estimated together with the springs, linearised about their
fit and iterated. Thresholds are measured on correct campaigns
(docs/decisions/0105-mistakes-undone.md).
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from itertools import combinations, compress, islice, permutations, product
from operator import itemgetter

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import expm, expm_frechet
from scipy.spatial.transform import Rotation
from scipy.special import stdtr

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.dataset import Readings
from elastocal.elastic import ElasticModel, ModelPosture, bearing
from elastocal.errors import IdentificationError
from elastocal.findings import Finding, Grade, Kind, as_number
from elastocal.identification.contact import Contact, compliance_columns
from elastocal.identification.conventions import FORCE_MISTAKES
from elastocal.identification.displacement import Between, reference_joints
from elastocal.identification.mistakes._motion import AXES, median_norm
from elastocal.identification.mistakes.plausibility import sensor_frames
from elastocal.identification.options import FitOptions
from elastocal.identification.problem import Problem, build
from elastocal.identification.solve import fit_each, grams_of, least_squares_left
from elastocal.identification.suspicious import screen
from elastocal.identification.uncertainty import HeldOut, leave_poses_out
from elastocal.robot import Robot
from elastocal.wording import spans

_TRACKER = FitOptions(encoders=False)
"""What a force or a frame read otherwise changes is the tracker's: encoders would hide it."""


@dataclass(frozen=True)
class OtherReading:
    """An interpretation of the data, with the mistake that it undoes."""

    message: str
    blocks: FloatArray
    """Rows of the springs, shape (reading, 3, spring), in m per unit of each."""
    d: FloatArray
    """Deflections, shape (reading, 3), in m."""
    least: float
    """Part of the error that may be left for the mistake to be named."""
    certain: bool = False
    """Whether data are refused for it where nothing else explains them as well."""
    louder: float = 1.0
    """Factor by which the noise of the marker is reduced."""
    estimated: bool = False
    """Whether numbers were estimated for it, which explain part of what the springs miss."""
    cause: str = ""
    """What it shares with another interpretation that adds nothing beside it."""


@dataclass(frozen=True, eq=False)
class Rows:
    """Readings, with the rows of their springs under a unit force along each axis of base."""

    model: ElasticModel
    readings: Readings
    problem: Problem
    basis: FloatArray
    """Shape (reading, 3, axis, spring), in m per N and unit of each spring."""
    reference: FloatArray
    """The same at the joints of the reference."""
    rest: FloatArray
    """Rows of what no force makes: moments and the arm's weight, shape (reading, 3, spring)."""
    place: FloatArray
    """Marker in the tcp frame, shape (3,), in m."""
    kept: BoolArray
    """Readings that are no blunders, shape (reading,)."""

    @classmethod
    def of(
        cls,
        robot: Robot,
        readings: Readings,
        marker_offset: ArrayLike | None,
        contact: Contact | None = None,
    ) -> "Rows":
        """Return the rows of readings, of the arm with the springs of its bearings.

        Columns of a contact that holds the tool follow; what its rows share is small beside what
        mistakes change, and is left out.
        """
        model = ElasticModel(robot, bearing(robot))
        zero = reference_joints(robot, readings)
        readings = replace(readings, reference_joint_position=zero)
        options = replace(_TRACKER, contact=contact)
        problem = replace(build(model, readings, options, marker_offset), shared=None)
        R = robot.forward(readings.joint_position)[:, :3, :3]
        at, before = model.at(readings.joint_position), model.at(zero)

        def unit(posture: ModelPosture) -> FloatArray:
            shape = readings.force.shape
            each = []
            for axis in np.eye(3):
                e = np.broadcast_to(axis, shape)
                springs = model.observation_blocks(posture, e, marker_offset=marker_offset)
                held = compliance_columns(R, e, readings.disks)[:, :, : len(problem.contact)]
                each.append(np.concatenate([springs, held], axis=2))
            return np.stack(each, axis=2)

        light = readings.reference_force
        reference = unit(before) if light is not None else np.zeros(0)
        kept = ~screen(problem).blunder
        place = np.zeros(3) if marker_offset is None else np.asarray(marker_offset, dtype=float)
        bare = cls(model, readings, problem, unit(at), reference, np.zeros(1), place, kept)
        return replace(bare, rest=problem.O - bare.blocks(readings.force, light))

    def blocks(self, force: FloatArray, light: FloatArray | None) -> FloatArray:
        """Return the rows of other forces under load and at the reference, each (reading, 3)."""
        made: FloatArray = np.einsum("rikn,rk->rin", self.basis, force)
        if light is not None:
            made -= np.einsum("rikn,rk->rin", self.reference, light)
        return made + self.rest

    def turned(self, G: FloatArray) -> FloatArray:
        """Return the rows of forces that matrices, shape (reading, 3, 3), make of those stated."""
        force, light = self.readings.force, self.readings.reference_force
        return self.blocks(
            np.einsum("rij,rj->ri", G, force),
            None if light is None else np.einsum("rij,rj->ri", G, light),
        )

    def moved(self, force: FloatArray, compliance: FloatArray) -> FloatArray:
        """Return how forces, shape (reading, 3, force), bend springs of compliances, in m."""
        return np.asarray(np.einsum("rikn,n->rik", self.basis, compliance) @ force)

    @cached_property
    def frames(self) -> dict[str, FloatArray]:
        """See `sensor_frames`."""
        return sensor_frames(self.model.robot, self.readings.joint_position)

    @cached_property
    def lever(self) -> FloatArray:
        """Rows per metre by which the marker sits elsewhere along each axis of the tcp frame.

        Shape (reading, 3, axis, spring).
        """
        between, n = Between.of(self.model, self.readings), self.problem.springs
        found = np.zeros((*self.problem.O.shape[:2], 3, self.problem.columns))
        for axis, e in enumerate(np.eye(3)):
            found[:, :, axis, n] = between.of_point(self.place + e) - self.problem.O[:, :, n]
        return found

    @cached_property
    def stated(self) -> Problem:
        """The problem of the kept rows, read as stated."""
        return self.without_blunders(self.problem)

    @cached_property
    def compliance(self) -> FloatArray:
        """Compliances of the readings as stated, shape (spring,)."""
        return fitted(self.stated)

    @cached_property
    def residual(self) -> FloatArray:
        """Norms of what they leave, shape (kept reading,), in m."""
        return np.asarray(np.linalg.norm(self.stated.residuals(self.compliance), axis=1))

    @cached_property
    def held_out(self) -> HeldOut:
        """Refits of the readings as stated without each pose."""
        return leave_poses_out(self.stated)

    def without_blunders(self, problem: Problem) -> Problem:
        """Return a problem of all readings without those that are blunders."""
        return problem if self.kept.all() else problem.take(self.kept)

    def read(self, reading: OtherReading) -> Problem:
        """Return the problem of the kept rows, read otherwise."""
        return self.without_blunders(replace(self.problem, O=reading.blocks, d=reading.d))

    def is_possible(self, grams: FloatArray) -> BoolArray:
        """Return which Gram matrices of ``[O d]`` some values of the springs may explain.

        The others leave far more than the readings as stated do, whatever the springs
        (`_HOPELESS`): a bounded fit need not say so. Shape (fit,).
        """
        most = _HOPELESS**2 * float(self.residual @ self.residual)
        left = least_squares_left(grams, self.problem.size)
        return np.asarray(left <= most + _ROUND_OFF**2 * grams[:, -1, -1])


def fitted(problem: Problem) -> FloatArray:
    """Return the bounded compliances of a problem by one Gram matrix, which is quick."""
    return np.asarray(fit_each([problem])[0])


def beside(problem: Problem, columns: FloatArray) -> Problem:
    """Return a problem with free columns beside those of the springs."""
    count = columns.shape[2]
    free = np.full(count, np.inf)
    norm = np.linalg.norm(problem.O.reshape(-1, problem.columns) * problem.size, axis=0).max()
    own = np.linalg.norm(columns.reshape(-1, count), axis=0)
    size = norm / np.where(own > 0.0, own, 1.0)
    return replace(
        problem,
        O=np.concatenate([problem.O, columns], axis=2),
        lower=np.concatenate([problem.lower, -free]),
        upper=np.concatenate([problem.upper, free]),
        prior_rows=np.insert(problem.prior_rows, [problem.columns] * count, 0.0, axis=1),
        size=np.concatenate([np.broadcast_to(problem.size, problem.lower.shape), size]),
    )


_CLEAR, _LIKELY, _FITTED, _IN_TIME = 0.9, 0.75, 0.85, 0.97
"""Part of the error that may be left: by forces and rows, by markers, by estimated numbers, by
those that grow in the order of poses, which no correct arm imitates."""
_IN_POSE, _GROWN = 0.75, 0.2
"""The same by what grows in each pose, and its least part of the median force or deflection:
correct arms creep, which leaves 0.7 of the error but is a drift of less than a tenth."""
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
_BETTER, _POLLUTED_ROUNDS = 0.7, 4
"""Part of the error of a pose that another reading leaves where it may be the right one, and fits
by which the poses settle at which it is."""
_HOPELESS = 2.0
"""Root mean square residual over that of the readings as stated above which others are hopeless:
what leaves twice as much in all does not leave clearly less in nine tenths of the rows."""
_ROUND_OFF = 1e-3
"""Part of the deflections below which what is left may be round-off."""
_SHORTEST = 3
"""Fewest poses of a part of the campaign that is mistaken by itself."""
_SHIFTS = (
    (-1, "the row before"),
    (1, "the row after"),
    (-2, "two rows before"),
    (2, "two rows after"),
)
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
_FARTHEST = 2.0
"""Distance in m between two places of a marker that is still believed."""
_ANGLES = (90, -90, 180, 30, -30, 45, -45, 60, -60, 120, -120, 135, -135, 150, -150)
"""Angles in deg by which a sensor is turned about the tool; about other axes the first three."""


def other_readings(rows: Rows) -> Iterator[OtherReading]:
    """Yield the other readings of the data that may explain them, the plainest first.

    Those of markers where there are any.
    """
    forces, markers = ([*turned(rows, plain=True)] for turned in (_turned_forces, _turned_markers))
    each = (
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
    seen = not rows.readings.by_contact.any()
    for readings, of_marker in each:
        if seen or not of_marker:
            yield from readings


def _possible(rows: Rows, readings: Iterable[OtherReading]) -> Iterator[OtherReading]:
    """Yield the readings that are not hopeless; see `Rows.is_possible`."""
    remaining = iter(readings)
    while part := list(islice(remaining, _AT_ONCE)):
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
        yield OtherReading(mistake.message, rows.blocks(force, light), d, _CLEAR, certain=True)
    for frame, X in rows.frames.items():
        for message, A in _turns(f"force_{{axis}} in the {frame} frame", frame != "base", plain):
            G = X @ A @ np.swapaxes(X, 1, 2)
            blocks = rows.turned(G)
            remedy = f"{message}; check the sensor's frame in the map"
            yield OtherReading(remedy, blocks, d, _CLEAR, certain=True)


def _turned_markers(rows: Rows, plain: bool = False) -> Iterator[OtherReading]:
    r, blocks = rows.readings, rows.problem.O
    for message, A in _turns("marker_displacement_{axis}", False, plain):
        d = r.marker_displacement @ A.T - r.controller_displacement
        remedy = f"{message}; check the tracker's frame"
        yield OtherReading(remedy, blocks, d, _LIKELY, certain=True)


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
            least=_FITTED,
            certain=False,
            estimated=True,
        )

    starts = range(_SHORTEST, len(order) - _SHORTEST + 1)
    if not starts:
        return
    coarse = sorted({starts[round(part * (len(starts) - 1))] for part in _PARTS})
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
    left = _residuals(rows.read(partly(*each)) for each in possible)
    _, (best, _, late) = min(zip(left, possible, strict=True), key=itemgetter(0))
    finer = _residuals(rows.read(partly(best, start, late)) for start in starts)
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
                least=_FITTED,
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
            _LIKELY,
        )


def _other_force_rows(rows: Rows, plain: bool = False) -> Iterator[OtherReading]:
    """Yield readings of forces in another order; plain ones are a row too early or too late."""
    r, d = rows.readings, rows.problem.d
    for message, order in _shifts(r)[:2] if plain else _orders(r):
        blocks = rows.blocks(r.force[order], r.reference_force)
        yield OtherReading(f"forces are {message}", blocks, d, _CLEAR, certain=True)


def _other_marker_rows(rows: Rows, plain: bool = False) -> Iterator[OtherReading]:
    """Yield readings of markers in another order, as `_other_force_rows`."""
    r, blocks = rows.readings, rows.problem.O
    for message, order in _shifts(r)[:2] if plain else _orders(r):
        moved = r.marker_displacement[order] - r.controller_displacement
        yield OtherReading(
            f"marker displacements are {message}", blocks, moved, _LIKELY, certain=True
        )


def _other_marker_counts(rows: Rows) -> Iterator[OtherReading]:
    """Yield readings of markers that are counted from elsewhere."""
    r = rows.readings
    message = "marker displacements are deflections already: give what the tracker measured"
    yield OtherReading(message, rows.problem.O, r.marker_displacement, _LIKELY, certain=True)
    summed = np.cumsum(r.marker_displacement, axis=0)
    start = np.vstack([np.zeros(3), summed])[_first_of_pose(r)]
    message = "marker displacements are counted from the load case before, not from the reference"
    counted = summed - start - r.controller_displacement
    yield OtherReading(message, rows.problem.O, counted, _LIKELY, certain=True)


def _first_of_pose(r: Readings) -> IndexArray:
    """Return the number of the first reading of each reading's pose, shape (reading,)."""
    begins = np.flatnonzero(_begins(r))
    return begins[np.searchsorted(begins, np.arange(len(r)), side="right") - 1]


def _begins(r: Readings) -> BoolArray:
    """Return whether a reading is the first of its pose, shape (reading,)."""
    return np.append(True, r.pose[1:] != r.pose[:-1])


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


@dataclass(frozen=True)
class _Unknown:
    """Numbers on which rows of springs depend, estimated with the springs."""

    none: FloatArray
    """What they are where the readings are as stated, shape (number,)."""
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
            message, blocks, rows.problem.d, _FITTED, estimated=True, cause="constant force"
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
    least: float = _IN_TIME
    """Part of the error that may be left."""
    smallest: float = 0.0
    """Part of the median force or deflection below which it is not reported."""


def _time(rows: Rows) -> FloatArray:
    """Return the place of each reading in the campaign, from 0 to 1."""
    return np.linspace(0.0, 1.0, len(rows.readings))


def _time_in_pose(rows: Rows) -> FloatArray:
    """Return the place of each reading in its pose, from just above 0 (the reference) to 1."""
    first = _first_of_pose(rows.readings)
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
            yield OtherReading(message, blocks, rows.problem.d, _LIKELY, estimated=True)
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
        yield OtherReading(message, blocks, rows.problem.d, _LIKELY, estimated=True)


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
            _FITTED,
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
            _FITTED,
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
            yield OtherReading(message, blocks, rows.problem.d, _FITTED, estimated=True)


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
            yield OtherReading(message, rows.problem.O, d, _FITTED, estimated=True)


def _since_beside(r: Readings, values: FloatArray) -> Iterator[tuple[str, FloatArray]]:
    """Yield the change of values, shape (reading, 3), since the load case before and after."""
    begins = _begins(r)
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
    stated, first = rows.problem.O, _first_of_pose(rows.readings)
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
    yield OtherReading(message, blocks, rows.problem.d, _FITTED, estimated=True)


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


_TRIMMED = 0.9
"""Part of the readings, those with the smallest residuals, that rank readings of the data."""
_AT_ONCE = 16
"""Problems that are fitted at once: each alone is mostly overhead, and all take memory."""
_FEWEST = 6
"""Fewest poses; with fewer, another interpretation may fit better by chance."""
_FEWEST_ESTIMATED = 8
"""Fewest poses for estimated numbers, which otherwise absorb the model error of a correct arm."""
_FEWEST_PARTED = 12
_PARTS = (0.33, 0.5, 0.67)
_LEFT_APART = 0.55
"""Part of the error that springs of both parts may leave: regions of the tooling differ, too."""
_TRIED = 5
"""Readings that are judged at left-out poses, the best first."""
_BY_CHANCE = 2e-3
"""Likelihood below which a gain is not chance."""
_SURE = (
    (0.75, _BY_CHANCE, 0.03),
    (0.85, 1e-8, 0.03),
    (0.85, 1e-4, 0.05),
    (np.inf, 1e-5, 0.05),
)
"""Ways to believe estimated numbers: the part of the error below which they leave it, the
likelihood of chance below which they do, and the part of the deflections above which they change.
They explain part of the model error, in correct data too: the less they explain, the smaller the
likelihood or the larger the change has to be."""
_CERTAIN = 0.5
_FITS_WELL = 0.2
_EQUAL = 1.1
"""Ratio of residuals below which two readings explain the data alike; the plainer is said first."""
_ALIKE = 1.25
"""The same of readings with estimated numbers, which explain part of each other's."""


def find_undone(
    robot: Robot,
    readings: Readings,
    marker_offset: ArrayLike | None = None,
    contact: Contact | None = None,
) -> tuple[Finding, ...]:
    """Return the mistake whose undoing explains readings far better; none of sound readings.

    Parameters
    ----------
    readings : Readings
        With joints in the robot's order.
    marker_offset : array_like, shape (3,), optional
        Marker in the tcp frame, in m.
    contact : Contact, optional
        What is known of the tooling that holds the tool, where no tracker measured.
    """
    poses = len(np.unique(readings.pose))
    if poses < _FEWEST:
        return ()
    try:
        rows = Rows.of(robot, readings, marker_offset, contact)
    except IdentificationError:
        return ()
    before = _trimmed(rows.residual)
    if not before > 1e-6 * float(np.linalg.norm(rows.stated.d, axis=1).mean()):
        return ()
    others = [
        each for each in other_readings(rows) if poses >= _FEWEST_ESTIMATED or not each.estimated
    ]
    left = _residuals(rows.read(each) for each in others)
    ranked = [
        (residual * max(each.louder, 1.0) / before, number, each)
        for number, (residual, each) in enumerate(zip(left, others, strict=True))
    ]
    possible = sorted(each for each in ranked if each[0] < each[2].least)[:_TRIED]
    tried = (_plainest(possible[number:]) for number in range(len(possible)))
    undone = next(filter(None, (_judged(rows, *each) for each in tried)), None)
    changed = _parted(rows, readings.pose[rows.kept])
    found = [each for each in (undone, changed) if each is not None]
    return (min(found, key=lambda each: each.left).mistake,) if found else ()


_Ranked = tuple[float, int, OtherReading]


READ_SO = Kind(
    "mistakes.read-so",
    "{mistake}: read so, the error at poses left out falls from {before} to {after} mm",
    shown=dict.fromkeys(("before", "after"), as_number(".3f", 1e3)),
)
CERTAINLY_READ_SO = replace(READ_SO, name="mistakes.certainly-read-so", grade=Grade.REFUSAL)
PARTED = Kind(
    "mistakes.parted",
    "readings from pose {pose} on are not like those before: fitted apart, the error at poses"
    " left out falls from {before} to {after} mm; was a sensor or tracker plugged, turned or"
    " set otherwise there?",
    shown=dict.fromkeys(("before", "after"), as_number(".3f", 1e3)),
)


@dataclass(frozen=True)
class _Found:
    """A mistake, and the part of the error that is left with it undone."""

    left: float
    mistake: Finding


def _plainest(possible: Sequence[_Ranked]) -> tuple[OtherReading, Sequence[str]]:
    """Return the plainest of the readings that explain about as much as the best, and another."""
    least, _, first = possible[0]
    near = [each for each in possible if each[0] <= (_EQUAL if each[2].certain else _ALIKE) * least]
    if first.certain:
        near = sorted((each for each in near if each[2].certain), key=lambda each: each[1])
    plainest, *others = (each for _, _, each in near)
    told = [each.message for each in others if not each.cause or each.cause != plainest.cause]
    return plainest, told[:1]


def _judged(rows: Rows, reading: OtherReading, others: Sequence[str]) -> _Found | None:
    """Return the mistake if errors at left-out poses say so too, with one that says the same."""
    undone, before = rows.read(reading), rows.held_out.error
    after = leave_poses_out(undone).error * max(reading.louder, 1.0)
    left, chance = _left(rows.stated, before, after)
    if not (left < reading.least and chance < _BY_CHANCE):
        return None
    if reading.estimated and not _believed(left, chance, _change(rows, undone)):
        return None
    deflection = float(np.linalg.norm(undone.d, axis=1).mean()) * max(reading.louder, 1.0)
    certain = reading.certain and left < _CERTAIN and float(after.mean()) < _FITS_WELL * deflection
    found = (CERTAINLY_READ_SO if certain else READ_SO)(
        mistake="; or ".join((reading.message, *others)),
        before=float(before.mean()),
        after=float(after.mean()) / max(reading.louder, 1.0),
    )
    return _Found(left, found)


def _change(rows: Rows, undone: Problem) -> float:
    """Return the relative change of the deflections by the springs of the other interpretation."""
    blocks, before = rows.stated.O, rows.compliance
    moved = np.linalg.norm(blocks @ (fitted(undone) - before), axis=1).mean()
    return float(moved / max(np.linalg.norm(blocks @ before, axis=1).mean(), 1e-12))


def _believed(left: float, chance: float, change: float) -> bool:
    """Return whether estimated numbers explain enough to be believed; see `_SURE`."""
    return any(left < part and chance < odds and change > least for part, odds, least in _SURE)


def _left(problem: Problem, before: FloatArray, after: FloatArray) -> tuple[float, float]:
    """Return the part of errors that is left, and how likely as much were gained by chance.

    By Student's distribution of the mean gain over poses.
    """
    blocks, index = np.unique(problem.block, return_inverse=True)
    gain = np.bincount(index, before - after) / np.bincount(index)
    error = float(gain.std(ddof=1)) / np.sqrt(len(blocks))
    chance = float(stdtr(len(blocks) - 1, -gain.mean() / error)) if error > 0.0 else 0.0
    return float(after.mean() / before.mean()), chance


def _parted(rows: Rows, pose: IndexArray) -> _Found | None:
    """Return a finding that readings change midway, where the springs of both parts differ."""
    blocks, first = np.unique(rows.stated.block, return_index=True)
    if len(blocks) < _FEWEST_PARTED:
        return None
    order = blocks[np.argsort(first)]
    place = np.argsort(np.argsort(first))[np.searchsorted(blocks, rows.stated.block)]
    # What is known beforehand would count for one fit and not for the other.
    is_known = len(rows.stated.prior_rows) > 0
    free = rows.stated.without_prior() if is_known else rows.stated
    before = (leave_poses_out(free) if is_known else rows.held_out).error
    found = []
    for part in _PARTS:
        late = place >= round(part * len(order))
        halves = [(mine, free.take(mine)) for mine in (late, ~late)]
        if any(_loaded_poses(half) < 2 for _, half in halves):
            continue
        after = np.empty_like(before)
        # No fit is better at a pose that it leaves out than at the same pose fitted.
        for mine, half in halves:
            after[mine] = np.linalg.norm(half.residuals(fitted(half)), axis=1)
        if not after.mean() < _LEFT_APART * before.mean():
            continue
        for mine, half in halves:
            after[mine] = leave_poses_out(half).error
        left, chance = _left(free, before, after)
        if left < _LEFT_APART and chance < _BY_CHANCE:
            found.append((left, late, after))
    if not found:
        return None
    left, late, after = min(found, key=itemgetter(0))
    parted = PARTED(pose=int(pose[late][0]), before=float(before.mean()), after=float(after.mean()))
    return _Found(left * _ALIKE, parted)


def _loaded_poses(problem: Problem) -> int:
    """Return the number of pose blocks whose readings load a spring."""
    return len(np.unique(problem.block[np.any(problem.O, axis=(1, 2))]))


def _residuals(problems: Iterable[Problem]) -> Iterator[float]:
    """Yield the trimmed mean residual of the fit of each problem of a shape, in m."""
    remaining = iter(problems)
    while part := list(islice(remaining, _AT_ONCE)):
        for problem, compliance in zip(part, fit_each(part), strict=True):
            yield _trimmed(np.linalg.norm(problem.residuals(compliance), axis=1))


def _trimmed(norms: FloatArray) -> float:
    """Return the mean of the smallest residuals."""
    return float(np.sort(norms)[: max(1, int(_TRIMMED * len(norms)))].mean())
