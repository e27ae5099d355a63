"""Expected quality of a plan for production: coverage, loads, and error.

The standard deviation that ``sigma`` of a measured coordinate leaves in the predicted deflections
of production is, with the information matrix ``S`` of the chosen poses and ``P`` the mean of
``z z^T`` over the rows of production (Klimchik 2012; see `IOptimal`),

    noise = sigma sqrt(3 tr(P S^-1)),      expected = hypot(noise, floor),

the root mean square of the deviation's length. The model error is not in the noise: it is the
floor, which `elastocal study` measures on a simulated cell.
"""

import math
from collections.abc import Iterator

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.cell import Cell
from elastocal.errors import present
from elastocal.findings import Finding, Kind, as_number
from elastocal.identification import (
    LEVEL_REACH,
    CalibratedLoads,
    ProductionCoverage,
    covered_rows,
    force_in_tcp,
    near_postures,
)
from elastocal.planning.search import CRITERIA, Information
from elastocal.records import record
from elastocal.results import brief_repr
from elastocal.wording import mm, phrase, um

SIGMA = 25e-6
"""Standard deviation of a measured coordinate of a deflection, in m, where the cell file says none:
a laser tracker at some metres, averaged over a second, and a controller that stops."""
_SIDES = {"north": (0, "fx"), "south": (1, "fx"), "east": (3, "fy"), "west": (2, "fy")}
"""Load case that pushes to each side (+x, -x, +y, -y), and the key of its amplitude."""
_NOTHING = 1.0
"""Force in N that needs no load case."""
_MOST_ROWS = 500
"""Rows of production that are looked at when poses are chosen to cover it."""
_TILT = float(np.sin(np.radians(10.0)))
"""Spread of the direction of gravity in the tool from which the tool's weight is determined."""
_TILTED = 2
"""Axes about which the tool must be turned to be weighed."""
_SHOWN = (3, 4, 5, 6, 8, 10, 12, 15, 20, 25, 30)
"""Numbers of poses that tables show."""
_STEP = 10.0
"""Amplitudes are proposed in steps of this, in N."""


@record()
class ExpectedError:
    """The error to expect on production from a number of poses."""

    poses: int
    noise: float
    """Error due to the noise of the measurement, root mean square of the length, in m."""
    error: float
    """Error with the floor of the model, in m."""


@brief_repr
@record()
class ProductionRecord:
    """Expected quality of a plan for production."""

    file: str
    """Path as in the cell file."""
    courses: tuple[str, ...]
    coverage: ProductionCoverage
    """Coverage by the chosen poses."""
    poses: int
    """Number of chosen poses."""
    springs: str
    """Model whose parameters the poses were chosen for."""
    sigma: float
    """Standard deviation of a measured coordinate that the errors are expected with, in m."""
    floor: float | None
    """Error that the model leaves however many poses there are, in m; None: not known."""
    accuracy: float | None
    """Error that was asked for, in m."""
    expected: tuple[ExpectedError, ...]
    """Error to expect, pose by pose."""

    def expected_of(self, poses: int) -> ExpectedError | None:
        """Return the error to expect from a number of poses; None where it is not known."""
        return next((each for each in self.expected if each.poses == poses), None)

    def some_expected(self) -> tuple[ExpectedError, ...]:
        """Return the errors for some numbers of poses, the plan's among them."""
        shown = {*_SHOWN, self.poses}
        return tuple(each for each in self.expected if each.poses in shown)

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return coverage and the error to expect, in a few words."""
        found = self.expected_of(self.poses)
        if found is None:
            return ((phrase("production"), self.coverage.sentence()),)
        floor = (
            phrase("the model's own error is not known and comes on top")
            if self.floor is None
            else phrase("with the model's own error of {floor}", floor=um(self.floor))
        )
        text = phrase(
            "{error} for sigma {sigma}; {floor}",
            error=um(found.error),
            sigma=um(self.sigma),
            floor=floor,
        )
        return (
            (phrase("production"), self.coverage.sentence()),
            (phrase("expected error"), text),
        )


def plan_coverage(cell: Cell, q: FloatArray) -> ProductionCoverage | None:
    """Return the share of production that calibration poses cover; None if the cell names none.

    Parameters
    ----------
    cell : Cell
        For its process and its load cases.
    q : ndarray, shape (pose, joint)
        Postures in contact, in rad or m.
    """
    process = cell.process
    if process is None:
        return None
    force_tcp = cell.file.load_cases.force_tcp
    pose = np.repeat(np.arange(len(q)), len(force_tcp))
    loads = CalibratedLoads.of_forces(cell.robot, q, np.tile(force_tcp, (len(q), 1)), pose)
    rows = covered_rows(cell.robot, loads, process.joint_position, process.force, process.moment)
    return rows.figures(process.course)


def covering_candidates(cell: Cell, q: FloatArray) -> IndexArray:
    """Return as few candidates as cover what all of them cover of production, in greedy order.

    Parameters
    ----------
    cell : Cell
        For its process.
    q : ndarray, shape (candidate, joint)
        Postures in contact, in rad or m.
    """
    rows = present(cell.process, "process").joint_position
    some = rows[np.unique(np.linspace(0, len(rows) - 1, _MOST_ROWS).astype(int))]
    near = near_postures(cell.robot, some, q).T
    left, chosen = near.any(axis=0), []
    while left.any():
        best = int(np.argmax((near & left).sum(axis=1)))
        chosen.append(best)
        left &= ~near[best]
    return np.array(chosen, dtype=np.intp)


def weighing_candidates(cell: Cell, chosen: FloatArray, q: FloatArray) -> IndexArray:
    """Return candidates to add so that the poses turn the tool about two axes, at most two.

    `elastocal tool` finds mass, centre of mass and the sensor's bias from the unloaded readings of
    the run, if gravity points to different sides of the tool. A process that never tilts its tool
    has no such poses near it.

    Parameters
    ----------
    cell : Cell
        For gravity, and whether there is a sensor.
    chosen, q : ndarray, shapes (pose, joint) and (candidate, joint)
        Postures that are chosen, and all that may be, in rad or m.
    """
    if cell.file.sensor is None:
        return np.zeros(0, dtype=np.intp)
    down = cell.gravity_base / np.linalg.norm(cell.gravity_base)
    own, others = (
        cell.robot.forward(each)[:, :3, :3].transpose(0, 2, 1) @ down for each in (chosen, q)
    )
    middle = own.mean(axis=0)
    _, size, axes = np.linalg.svd(own - middle, full_matrices=False)
    known = axes[size >= _TILT * math.sqrt(len(own))]
    found: list[int] = []
    while len(known) < _TILTED:
        apart = others - middle
        rest = np.linalg.norm(apart - apart @ known.T @ known, axis=1)
        best = int(np.argmax(rest))
        if rest[best] < _TILT:
            break
        found.append(best)
        new = apart[best] - apart[best] @ known.T @ known
        known = np.vstack([known, new / np.linalg.norm(new)])
    return np.array(found, dtype=np.intp)


def expected_errors(
    cell: Cell, information: Information, order: IndexArray, most: int
) -> tuple[ExpectedError, ...]:
    """Return the error to expect from 1, 2, … poses, as far as their springs are all observed.

    Parameters
    ----------
    cell : Cell
        For ``search.sigma`` and ``search.floor``.
    information : Information
        Information of the candidates, with a process.
    order : ndarray of int, shape (n,)
        Poses to begin with, in the order of choice.
    most : int
        Number of poses up to which others are added, each the best next one.
    """
    criterion = CRITERIA["i"].of(information)
    chosen = order.tolist()
    while len(chosen) < min(most, len(information)):
        values = np.array(criterion.after_adding(information.matrix(chosen), information))
        values[chosen] = -np.inf
        chosen.append(int(np.argmax(values)))
    found = []
    for count in range(1, len(chosen) + 1):
        if count * len(information.rows) >= information.rank:
            value = float(criterion.value(information.matrix(chosen[:count])))
            found.append(expected_error(cell, count, value))
    return tuple(found)


def expected_error(cell: Cell, count: int, value: float) -> ExpectedError:
    """Return the error to expect from poses with a value of the criterion I."""
    search = cell.file.search
    noise = (search.sigma or SIGMA) * math.sqrt(max(-3.0 * value, 0.0))
    return ExpectedError(count, noise, math.hypot(noise, search.floor or 0.0))


_NEWTON = as_number(".0f")
CASE_MISSING = Kind(
    "plan.load-case-missing",
    "load case {case} is missing: production pushes the robot with {force} N to"
    ' that side; add it to load_cases.cases, with {key}: "{amplitude} N"',
    shown={"force": _NEWTON},
)
PUSHES_ASIDE = Kind(
    "plan.production-pushes-aside",
    "production pushes aside with {lateral} N, the load cases with {known} N: ask for"
    ' load_cases.fx and fy of "{amplitude} N", which friction holds from fz of "{held}'
    ' N" on',
    shown={"lateral": _NEWTON, "known": _NEWTON},
)
PRESSES = Kind(
    "plan.production-presses",
    "production presses with {press} N, the load cases with {fz} N: ask for"
    ' load_cases.fz of "{amplitude} N"',
    shown={"press": _NEWTON, "fz": _NEWTON},
)
PULLS = Kind(
    "plan.production-pulls",
    "production pulls the tool with {force} N, which no press on a surface does: the"
    " calibration does not cover it",
    shown={"force": _NEWTON},
)
PRODUCTION_NOT_COVERED = Kind(
    "plan.production-not-covered",
    "production is not covered: {found}; let the external axes be searched, widen"
    " surface.region towards it, or ask for more poses (search.poses)",
)
NOT_ACCURATE = Kind(
    "plan.accuracy-not-expected",
    "an error of {wanted} (search.accuracy) is not expected from {poses} poses:"
    " {error} is; raise search.poses, or press harder",
    shown={"wanted": mm, "error": mm},
)


def _load_findings(cell: Cell) -> Iterator[Finding]:
    """Yield where production pushes harder than the load cases, with the amplitudes to ask for."""
    process, loads = cell.process, cell.file.load_cases
    if process is None:
        return
    q, somewhere = process.joint_position, np.zeros(len(loads.force_tcp), dtype=np.intp)
    force_tcp = force_in_tcp(cell.robot, q, process.force)
    pressed = CalibratedLoads.of_forces(cell.robot, q[:1], loads.force_tcp, somewhere)
    level = pressed.levels(force_tcp)[:, 0]
    if not np.any(level > LEVEL_REACH):
        return
    x, y, z = force_tcp[level > LEVEL_REACH].T
    pushed = np.stack([x, -x, y, -y]).max(axis=1)
    for case, (side, key) in _SIDES.items():
        if pushed[side] > _NOTHING and not pressed.largest[0, side] > 0.0:
            force = float(pushed[side])
            yield CASE_MISSING(case=case, force=force, key=key, amplitude=_up(force))
    lateral = float(np.hypot(x, y).max())
    known = float(pressed.largest[0, :4].max())
    press = float((-z).max())
    if known > 0.0 and lateral > LEVEL_REACH * known:
        held = _up(lateral * loads.safety / loads.friction)
        yield PUSHES_ASIDE(
            lateral=lateral, known=known, amplitude=_up(lateral), held=max(held, _up(loads.fz))
        )
    if press > LEVEL_REACH * loads.fz:
        yield PRESSES(press=press, fz=float(loads.fz), amplitude=_up(press))
    if float(z.max()) > (LEVEL_REACH - 1.0) * loads.fz:
        yield PULLS(force=float(z.max()))


def _up(force: float) -> int:
    return int(math.ceil(force / _STEP) * _STEP)


def production_findings(cell: Cell, record: ProductionRecord | None) -> Iterator[Finding]:
    """Yield what a user should know of production before the robot moves."""
    yield from _load_findings(cell)
    if record is None:
        return
    if not record.coverage.is_enough:
        yield PRODUCTION_NOT_COVERED(found=record.coverage.sentence())
    wanted, found = record.accuracy, record.expected_of(record.poses)
    if wanted is not None and found is not None and found.error > wanted:
        yield NOT_ACCURATE(wanted=wanted, poses=record.poses, error=found.error)
