"""A KRL program corrected: new numbers in the ``.dat`` file, the ``.src`` file as it was."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.compensation.offline import (
    PathError,
    in_file,
    turned_to_base,
)
from elastocal.compensation.offline.correct import PathCorrection, correct_rows
from elastocal.compensation.offline.krl.forces import PointForces, read_forces
from elastocal.compensation.offline.krl.moves import Program, read_program
from elastocal.compensation.offline.krl.points import Point, read_points, replaced
from elastocal.compensation.offline.krl.text import read_lines
from elastocal.compensation.offline.krl.walk import Walk
from elastocal.compensation.offline.path_file import CorrectionSettings
from elastocal.compensation.offline.summary import CorrectionSummary
from elastocal.errors import FileAccessError, nearest
from elastocal.files import replacing
from elastocal.identification import CalibratedModel
from elastocal.robot.inverse import inverse_for


@dataclass(frozen=True)
class KrlResult:
    """What was corrected."""

    tally: CorrectionSummary
    base: str
    """What the program calls the frame of its points; empty when it does not say."""
    tool: str
    name: str
    """What the program calls itself; empty when it does not say."""
    files: tuple[Path, Path]
    """``.src`` and ``.dat``."""
    assumed: tuple[str, ...]
    """Motions that come from a ``PTP`` which does not tell its posture: the last known is taken."""


def compensate_krl(
    calibrated: CalibratedModel,
    src: Path,
    forces: Path,
    out: Path,
    settings: CorrectionSettings | None = None,
    T_base_points: FloatArray | None = None,
) -> KrlResult:
    """Correct every LIN and SLIN target of a program, and the PTP targets that have a force.

    Parameters
    ----------
    calibrated : CalibratedModel
        The model; its tcp is the program's tool.
    src : Path
        The ``.src`` file; the ``.dat`` file is beside it.
    forces : Path
        CSV with the column ``point`` and forces as in a path.
    out : Path
        The ``.src`` file to write; the ``.dat`` file comes beside it.
    settings : CorrectionSettings, optional
        How.
    T_base_points : ndarray, shape (4, 4), optional
        The program's $BASE in the model's base; the same by default.

    Raises
    ------
    PathError
        If the program is not understood, by line; a target has no force, a force no target; or
        a point cannot be corrected.
    FileAccessError
        If a file cannot be read or written.
    """
    settings = CorrectionSettings() if settings is None else settings
    dat, out_dat = _dat_of(src), Path(out).with_suffix(".dat")
    lines, data, table = read_lines(src), read_lines(dat), read_forces(forces)
    with in_file(dat):
        points = read_points(data)
    T_base_points = np.eye(4) if T_base_points is None else T_base_points
    walk = Walk(inverse_for(calibrated.model.robot), points, T_base_points)
    with in_file(src):
        program = read_program(lines, data)
        targets = _targets(program, points, table, forces)
        reached = walk.postures(program.moves, targets, settings.start)
    postures = reached.postures
    with in_file(dat):
        found, tally = _corrected(calibrated, walk, table, postures, settings.largest)
    for row, name in enumerate(postures):
        point = points[name]
        numbers = walk.numbers(point, found.q[row], found.T_base_tcp[row])
        data[point.line] = replaced(data[point.line], point, numbers)
    with replacing(out) as new_src, replacing(out_dat) as new_dat:
        new_src.write_bytes("".join(lines).encode("latin-1"))
        new_dat.write_bytes("".join(data).encode("latin-1"))
    files = (Path(out), out_dat)
    return KrlResult(tally, program.base, program.tool, program.name, files, reached.assumed)


def _dat_of(src: Path) -> Path:
    """Return the ``.dat`` file beside a ``.src`` file; Windows does not tell capitals."""
    for suffix in (".dat", ".DAT", ".Dat"):
        if (path := Path(src).with_suffix(suffix)).is_file():
            return path
    raise FileAccessError(f"cannot read {Path(src).with_suffix('.dat')}: it must be beside {src}")


def _targets(
    program: Program, points: dict[str, Point], table: PointForces, forces: Path
) -> frozenset[str]:
    """Return the points that are corrected: straight ones, and those that have a force."""
    targets: set[str] = set()
    for move in program.moves:
        if move.name is None or not (move.straight or move.name in table.rows):
            continue
        if move.name not in points:
            raise PathError(
                f"line {move.line}: {move.order} {move.name} goes to a point that the .dat file"
                " does not declare with a value"
            )
        if move.straight and points[move.name].by_axes:
            raise PathError(
                f"line {move.line}: {move.order} {move.name} goes to axis positions"
                f" ({points[move.name].kind}): a straight motion must go to a frame"
            )
        if move.name not in table.rows:
            raise PathError(
                f"line {move.line}: {move.order} {move.name} has no force in {forces}"
                f"{nearest(move.name, table.rows)}"
            )
        targets.add(move.name)
    for name in table.rows:
        if name not in targets:
            raise PathError(
                f"no motion goes to point {name!r} of {forces}{nearest(name, sorted(targets))}"
            )
    return frozenset(targets)


def _corrected(
    calibrated: CalibratedModel,
    walk: Walk,
    table: PointForces,
    postures: dict[str, FloatArray],
    largest: float,
) -> tuple[PathCorrection, CorrectionSummary]:
    q = np.array(list(postures.values()))
    labels = [f"point {walk.points[name].name}" for name in postures]
    T = np.array([walk.pose(walk.points[name], q[i]) for i, name in enumerate(postures)])
    rows = [table.rows[name] for name in postures]
    force = np.asarray(turned_to_base(table.force[rows], table.force_columns, T))
    moment = None if table.moment is None else table.moment[rows]
    moment = turned_to_base(moment, table.moment_columns, T)
    # An E6AXIS means its joints as they stand; the turn of a frame is the controller's.
    frames = not any(walk.points[name].by_axes for name in postures)
    wrench = (force, moment)
    found = correct_rows(
        walk.solver, calibrated, q, T, wrench, labels.__getitem__, may_turn=frames, largest=largest
    )
    shift = found.T_base_tcp[:, :3, 3] - T[:, :3, 3]
    return found, CorrectionSummary().plus(found, shift, labels, [])
