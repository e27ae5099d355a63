"""Poses of a calibration without a tracker: turned tools, and places pressed on two disks.

Without a tracker the fit must tell the contact from the arm. The contact keeps the tool's frame,
the arm's springs keep the joints': a tool that is turned about the normal moves one against the
other. So each candidate is turned by a draw within `TURN` where all checks allow that.

Presses on one and on two stacked disks at one place differ by the compliance of one disk and in
nothing of the arm. `DOUBLED` places are enough for its standard error (decision 126); they are
visited a second time, after all others, so that the second disk is put on once, with the arm at
HOME.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator

from elastocal.arrays import BoolArray, FloatArray, IndexArray
from elastocal.cell import TRACKER, Cell, without_tracker
from elastocal.errors import PlanningError
from elastocal.findings import Finding, Kind
from elastocal.planning.checks import Margins, check_margins
from elastocal.planning.motion import Mover, clear_retreats, plan_route
from elastocal.planning.plan_result import PlanResult
from elastocal.planning.pool import Pool, SampledPool, point_checks, robot_checks
from elastocal.planning.postures import Postures
from elastocal.planning.rounds import Round
from elastocal.planning.search import Selection
from elastocal.planning.surface import Surface
from elastocal.planning.variant import PlanVariant
from elastocal.progress import Progress
from elastocal.robot.inverse import InverseKinematics, inverse_for

TURN = 1.0
"""Largest turn of a tool about the normal of the surface, in rad."""
DOUBLED = 8
"""Places that are pressed on one and on two disks, where the cell has disks to stack."""
_TURNS = 1
"""What the turns of tools are drawn for, beside the seed: other plans draw as they did."""
_FEWEST_DOUBLED = 4
"""From fewer places the compliance of a disk has no standard error."""

NO_DISK = Kind(
    "plan.no-disk-to-stack",
    "no place is pressed on two disks, since engagement.disk_thickness is not given: state the"
    " stiffness of the contact (a steel tip: by a dial gauge), or give the thickness of a soft disk"
    " of which two can be stacked",
)
FEW_DOUBLED = Kind(
    "plan.few-doubled",
    "only {found} of {wanted} places can be pressed on two disks as well: from fewer than"
    " {least} the compliance of a disk is not known",
)
NORMAL_ALONE = Kind(
    "plan.normal-alone",
    "every load case presses along the normal alone: without a tracker the lateral compliance of"
    " the contact is then not found, nor springs that only lateral loads show; add north, south,"
    " east and west to load_cases.cases",
)


@dataclass(frozen=True)
class Untracked(PlanVariant):
    """A plan whose readings no tracker takes, of a cell `elastocal.cell.without_tracker`."""

    doubled: int | None = None
    """Places that are pressed on two disks as well; None: as many as suffice."""
    without = (TRACKER,)

    def pool(self, cell: Cell, surface: Surface, sampled: SampledPool) -> SampledPool:
        """Return the pool with its tools turned about the normal."""
        rng = np.random.default_rng([cell.file.search.seed, _TURNS])
        return turned_pool(cell, surface, sampled, rng)

    def further_rounds(
        self,
        cell: Cell,
        surface: Surface,
        sampled: SampledPool,
        selection: Selection,
        mover: Mover,
        progress: Progress,
    ) -> tuple[Round, ...]:
        """Return the round through the places that are pressed on two disks."""
        wanted = require_doubled(cell, self.doubled, len(selection))
        again = doubled_places(cell, surface, sampled, selection.order, mover, progress, wanted)
        return () if again is None else (again,)

    def findings(self, cell: Cell, rounds: Sequence[Round]) -> tuple[Finding, ...]:
        """Return what is missing to tell the contact from the arm."""
        wanted = require_doubled(cell, self.doubled, len(rounds[0].chosen))
        return doubled_findings(cell, rounds[1] if rounds[1:] else None, wanted)


def turned_pool(cell: Cell, surface: Surface, sampled: SampledPool, rng: Generator) -> SampledPool:
    """Return a pool whose tools are turned about the normal, each by a draw within `TURN`.

    A posture that fails a check with its draw is tried turned the other way, and else stays.
    """
    pool = sampled.pool
    spin = rng.uniform(-TURN, TURN, len(pool.postures))
    for sign in (1.0, -1.0):
        left = np.flatnonzero(spin != 0.0)
        if len(left):
            turned = _turned(cell, pool.postures.take(left), sign * spin[left])
            good, margins = _passed(cell, surface, sampled, turned)
            pool = _replaced(pool, left[good], turned.take(good), margins.take(good))
            spin[left[good]] = 0.0
    return replace(sampled, pool=pool)


def _turned(cell: Cell, postures: Postures, spin: FloatArray) -> Postures:
    """Return postures with the tool turned about its own axis, shape (pose,) in rad."""
    T = np.array(postures.T_base_tcp)
    c, s = np.cos(spin)[:, None], np.sin(spin)[:, None]
    x, y = T[:, :3, 0].copy(), T[:, :3, 1].copy()
    T[:, :3, 0], T[:, :3, 1] = c * x + s * y, c * y - s * x
    return _reached(cell, inverse_for(cell.robot), T, postures)


def _reached(cell: Cell, inverse: InverseKinematics, T: FloatArray, near: Postures) -> Postures:
    """Return the postures at frames (pose, 4, 4) that are nearest to others; NaN where none is."""
    external = near.q[:, : cell.robot.external_axes]
    off = T.copy()
    off[:, :3, 3] += cell.file.engagement.approach_distance * near.normal
    here, there = (inverse.solve_many(frames, external).q for frames in (T, off))
    apart = np.abs(here - near.q[:, None]).max(axis=2)
    apart = np.where(np.abs(there - here).max(axis=2) < np.pi, apart, np.inf)
    best = np.where(np.isnan(apart), np.inf, apart).argmin(axis=1)
    rows = np.arange(len(T))
    reached = np.isfinite(apart[rows, best])[:, None]
    q = np.where(reached, here[rows, best], np.nan)
    q_approach = np.where(reached, there[rows, best], np.nan)
    return Postures(T, near.normal, q, q_approach, near.point)


def _passed(
    cell: Cell, surface: Surface, sampled: SampledPool, postures: Postures
) -> tuple[BoolArray, Margins]:
    """Return which postures pass every check, and their margins in the order of the pool's."""
    reached = np.flatnonzero(np.isfinite(postures.q).all(axis=1))
    robot = robot_checks(cell, surface)
    checks = replace(robot, point=point_checks(cell, surface, sampled.points))
    found = check_margins(checks.all, postures.take(reached))
    margin = np.full((len(found.names), len(postures)), -np.inf)
    margin[:, reached] = found.margin
    found = replace(found, margin=margin)
    return found.passed, found


def _replaced(pool: Pool, at: IndexArray, postures: Postures, margins: Margins) -> Pool:
    """Return a pool with other postures at some places."""
    merged, margin = {}, pool.margins.margin.copy()
    for name in ("T_base_tcp", "normal", "q", "q_approach", "point"):
        values = np.array(getattr(pool.postures, name))
        values[at] = getattr(postures, name)
        merged[name] = values
    margin[:, at] = margins.margin
    return replace(pool, postures=Postures(**merged), margins=replace(pool.margins, margin=margin))


def doubled_places(
    cell: Cell,
    surface: Surface,
    sampled: SampledPool,
    order: IndexArray,
    mover: Mover,
    progress: Progress,
    wanted: int,
) -> Round | None:
    """Return the places that are pressed on two disks as well: the first of the search that can.

    Parameters
    ----------
    order : ndarray of int, shape (pose,)
        The chosen candidates, in search order.
    mover : Mover
        Of the cell.
    wanted : int
        How many.

    Returns
    -------
    Round, optional
        With the tool a thickness farther off; None where the cell has no disk to stack, or no
        place can be.
    """
    thickness = cell.file.engagement.disk_thickness
    if thickness is None or wanted == 0:
        return None
    single = sampled.pool.postures.take(order)
    T = np.array(single.T_base_tcp)
    T[:, :3, 3] += thickness * single.normal
    raised = _reached(cell, inverse_for(cell.robot), T, single)
    # Where the disk stands on the surface is judged with one disk already.
    reached: BoolArray = np.asarray(np.isfinite(raised.q).all(axis=1))
    good, _ = _passed(cell, surface, sampled, _where_reached(raised, single, reached))
    left = np.flatnonzero(good & reached)
    left = left[clear_retreats(cell, mover, raised.take(left))] if len(left) else left
    while len(left):
        chosen = left[:wanted]
        postures = raised.take(chosen)
        route = plan_route(cell.home, postures, mover, progress)
        if not len(route.unreachable):
            return Round(chosen, postures, route)
        left = np.setdiff1d(left, chosen[route.unreachable], assume_unique=True)
    return None


def _where_reached(raised: Postures, single: Postures, reached: BoolArray) -> Postures:
    """Return postures with others in place of those that are not reached."""
    keep = reached[:, None]
    q = np.where(keep, raised.q, single.q)
    q_approach = np.where(keep, raised.q_approach, single.q_approach)
    return Postures(raised.T_base_tcp, raised.normal, q, q_approach, raised.point)


def doubled_findings(cell: Cell, found: Round | None, wanted: int) -> tuple[Finding, ...]:
    """Return remarks on what a plan without a tracker lacks."""
    lateral = np.abs(cell.file.load_cases.force_tcp[:, :2]).max() > 0.0
    notes = () if lateral else (NORMAL_ALONE(),)
    if wanted == 0:
        return notes
    if cell.file.engagement.disk_thickness is None:
        return (*notes, NO_DISK())
    count = 0 if found is None else len(found.chosen)
    if count < wanted:
        return (*notes, FEW_DOUBLED(found=count, wanted=wanted, least=_FEWEST_DOUBLED))
    return notes


def as_planned(cell: Cell, plan: PlanResult) -> Cell:
    """Return the cell that a plan is carried out in: without tracker where the plan has none."""
    return cell if plan.tracked else without_tracker(cell)


def require_doubled(cell: Cell, doubled: int | None, poses: int) -> int:
    """Return the number of places that are to be doubled.

    Raises
    ------
    PlanningError
        If there are not as many poses, or the cell has no disk to stack.
    """
    if doubled is None:
        return min(DOUBLED, poses)
    if doubled and cell.file.engagement.disk_thickness is None:
        raise PlanningError(
            f"--doubled {doubled}: the cell has no disk to stack: give its thickness"
            " (engagement.disk_thickness)"
        )
    if not doubled <= poses:
        raise PlanningError(f"--doubled {doubled}: must be at most the {poses} poses")
    return doubled
