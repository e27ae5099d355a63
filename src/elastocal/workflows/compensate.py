"""``compensate``: a programmed path with its forces, corrected offline."""

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.compensation import ArmGrowth
from elastocal.compensation.offline import (
    LARGEST_DEFLECTION,
    CorrectionFigures,
    CorrectionSettings,
    CorrectionSummary,
    Unloaded,
    compensate_path,
)
from elastocal.compensation.programs import (
    LIN_SPEED,
    NO_PROGRAM,
    PROGRAM_READERS,
    PROGRAM_WRITERS,
    PathProgram,
    choose_writer,
    compensate_program,
)
from elastocal.errors import FileAccessError, PlanningError
from elastocal.identification import (
    CalibratedModel,
    ModelSource,
    PredictionDoubt,
    ProductionCoverage,
)
from elastocal.options import Option
from elastocal.progress import Progress
from elastocal.records import record
from elastocal.results import Result
from elastocal.robot import Robot
from elastocal.templating import plain
from elastocal.units import quantity
from elastocal.workflows._inputs import (
    ArmAsBuilt,
    NewTool,
    TouchedArm,
    UnloadedArm,
    coverage_notes,
    growth_notes,
    parse_frame,
    parse_posture,
    write_posture,
)
from elastocal.workflows._workflow import workflow

_MOST_POSTURES = 500
"""Calibrated postures that are compared with one another."""
_PROGRAM_MARKS = ("NOT TRIED ON A ROBOT", "DECL E6AXIS XBEFORE=")
"""Marks of robot programs of elastocal: their head, KRL's positions by the first."""


@dataclass(frozen=True)
class CompensateSettings(NewTool, ArmAsBuilt, TouchedArm):
    """Settings of a correction: the model and the path."""

    model: Annotated[ModelSource, Option(argument=True)]
    """Model file of `calibrate`; in Python also what it returned."""
    path: Annotated[Path, Option(argument=True)]
    """Path, ``.csv``, or program of a controller, such as a KUKA ``.src`` beside its ``.dat``."""
    out: Path
    """File of the same kind to write."""
    forces: Path | None = None
    """Forces of a program: CSV with the columns ``point``, ``force_x[N] …``."""
    base: str | None = None
    """A program's frame in the model's base, ``"x, y, z, a, b, c"`` with units."""
    start: str | None = None
    """Posture before the first row, a quantity a joint from base to tip, such as
    ``0 deg, -90 deg, 90 deg, 0 deg, 45 deg, 0 deg``."""
    largest: Annotated[
        float,
        Option(
            "--limit",
            read="length",
            default="20 mm",
            help="Largest correction, deflection and geometry together.",
        ),
    ] = LARGEST_DEFLECTION
    """Largest correction, whatever it is made of, in m."""
    program: str | None = None
    """Name of a robot program of a path, to be written beside ``out``; none: no program."""
    language: Annotated[str | None, Option(choices="language")] = None
    """Its language; by default that of the robot's maker."""
    speed: Annotated[
        float, Option(read="speed", default="50 mm/s", help="Speed of the tool in that program.")
    ] = LIN_SPEED
    """Speed of the tool along the path in that program, in m/s."""
    force: bool = False
    """Replace a file that is no former output of this command."""


@record()
class CompensateResult(Result, CorrectionFigures):
    """The figures of a correction, predicted by the model."""

    tool: str
    """The tool that the correction is for, in words."""
    notes: tuple[str, ...]
    """Notes for the user."""
    coverage: ProductionCoverage | None = None
    """Share of the path that the calibration covers in postures, rail and loads; None where the
    model does not state its domain."""
    doubt: PredictionDoubt | None = None
    """Uncertainty of the predictions along the path; None where no row has a load."""
    program: tuple[str, ...] = ()
    """Files of the robot program that was written, the main one first."""

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return the main facts, a label and a text each."""
        lengths = {
            "deviation as programmed": self.deviation,
            "a first-order step would leave": self.first_order,
            "the correction leaves": self.residual,
            "correction": self.correction,
        }
        first = f", first at {self.first_jump}" if self.posture_jumps else ""
        return (
            ("tool", self.tool),
            ("rows", f"{self.rows}; all figures are predicted by the model, nothing is measured"),
            *(
                (
                    label,
                    f"{_shown(each.mean)} mean, {_shown(each.max)} max at {each.at} of the file",
                )
                for label, each in lengths.items()
            ),
            ("posture jumps", f"{self.posture_jumps}{first}"),
            ("rows where the force pulls", str(self.pulled)),
            *((("program", ", ".join(self.program)),) if self.program else ()),
            *(("note", text) for text in self.notes),
        )


@workflow(CompensateSettings, marks=("deflection_x_low[m]", *_PROGRAM_MARKS))
def compensate(settings: CompensateSettings, progress: Progress) -> CompensateResult:
    r"""Correct a programmed path so that the loaded tool is where it was programmed.

    Raises
    ------
    PathError
        If the path or program is not understood, or a row cannot be corrected; by its line.
    RobotError, UnitError
        If ``start`` or ``base`` does not fit.
    PlanningError
        If no program can be written of this robot, name, language or speed.
    FileAccessError
        If a file cannot be read or written, is an input, or does not belong to this kind of path.

    Examples
    --------
    >>> from pathlib import Path
    >>> import elastocal as ec
    >>> readings = ec.datasets.fanuc_r2000ic()
    >>> model = ec.calibrate(readings, springs="actuated", draws=40)
    >>> joints = ",".join(f"joint_{n}[deg]" for n in range(1, 7))
    >>> heads = f"{joints},force_x[N],force_y[N],force_z[N]"
    >>> _ = Path("path.csv").write_text(f"{heads}\n0,0,0,0,-60,0,0,0,500\n")
    >>> found = ec.compensate(model, path="path.csv", out="corrected.csv")
    >>> dict(found.facts())["correction"]
    '1.62 mm mean, 1.62 mm max at row 2 of the file'
    """
    path, forces = settings.path, settings.forces
    is_program = path.suffix.lower() in PROGRAM_READERS
    _require_readable(path)
    if is_program != (settings.out.suffix.lower() in PROGRAM_READERS):
        raise FileAccessError(f"--out {settings.out} must end in {path.suffix} like {path}")
    if settings.program is None and settings.language is not None:
        raise PlanningError(f"--language {settings.language} needs --program NAME")
    if is_program and settings.program is not None:
        raise FileAccessError(f"--program is for paths (.csv), {path} is a program already")
    if not is_program and (forces or settings.base):
        raise FileAccessError(f"--forces and --base are for KUKA programs (.src), not for {path}")
    calibrated = settings.read_model(settings.model)
    robot = calibrated.model.robot
    start = parse_posture(robot, settings.start)
    usual = None if is_program or start is not None else _usual_posture(calibrated)
    start = start if usual is None else usual
    arm = settings.unloaded(robot)
    state = settings.growth(robot)
    program, language = _program_of(settings, robot)
    hear = [each.add for each in (arm.angles, program) if each is not None]
    unloaded = _grown(state, arm)
    how = CorrectionSettings(start, settings.largest, unloaded, arm.controller, hear)
    if is_program:
        if forces is None:
            raise FileAccessError(f"{path} has no forces: name a table of them with --forces")
        T_base_frame = None if settings.base is None else parse_frame(settings.base, "--base")
        found = compensate_program(calibrated, path, forces, settings.out, how, T_base_frame)
        summary, notes = found.summary, found.notes
    else:
        summary = compensate_path(calibrated, path, settings.out, how, progress)
        notes = (*_path_notes(summary, robot, settings.start, usual is not None), *language)
    figures = summary.figures()
    further = (*_force_notes(summary), *_covered(summary))
    return CompensateResult(
        **{each.name: getattr(figures, each.name) for each in fields(figures)},
        tool=calibrated.tool_name,
        notes=(
            *_built(settings),
            *arm.notes,
            *growth_notes(state),
            *coverage_notes(calibrated),
            *notes,
            *further,
        ),
        coverage=summary.coverage,
        doubt=summary.doubt,
        program=() if program is None else _written(program, settings),
    )


def _grown(state: ArmGrowth | None, arm: UnloadedArm) -> Unloaded | None:
    """Return where the unloaded tool stands when the arm has grown as well; None: as programmed."""
    if state is None or not state.corrects:
        return arm.tool

    def unloaded(q: FloatArray) -> FloatArray:
        cold = arm.controller.forward(q)[:, :3, 3] if arm.tool is None else arm.tool(q)
        return cold + state.shift(arm.controller, q)

    return unloaded


def _require_readable(path: Path) -> None:
    """Refuse a program in a language that is written, and not read.

    Raises
    ------
    FileAccessError
        With the way to a corrected program.
    """
    suffix = path.suffix.lower()
    for writer in PROGRAM_WRITERS.values():
        known = (*writer.suffixes, *writer.other_suffixes)
        if suffix in known and not PROGRAM_READERS.keys() & set(known):
            raise FileAccessError(
                f"{path}: programs in {writer.title} are written, not read (read are"
                f" {', '.join(PROGRAM_READERS)}): give its points as a path (.csv), and"
                " --program NAME writes them, corrected"
            )


def _program_of(
    settings: CompensateSettings, robot: Robot
) -> tuple[PathProgram | None, tuple[str, ...]]:
    """Return the program to be filled, and in which language it is, if one is asked for."""
    if settings.program is None or (settings.language or "").casefold() == NO_PROGRAM:
        return None, ()
    writer, reason = choose_writer(robot, settings.language)
    if writer is None:
        raise PlanningError(reason)
    program = PathProgram(robot, writer, settings.program, settings.speed)
    return program, (f"program {settings.program}: {reason}",)


def _written(program: PathProgram, settings: CompensateSettings) -> tuple[str, ...]:
    fact = f"Path {plain(settings.path.name)}, corrected by elastocal compensate."
    robot = f"Robot: {plain(program.robot.name)}."
    return tuple(str(each) for each in program.write(settings.out.parent, fact, robot))


def _usual_posture(calibrated: CalibratedModel) -> FloatArray | None:
    """Return the calibrated posture nearest to the others, shape (joint,).

    None where the model does not state its domain, or the arm has external axes, whose position a
    path does not give.
    """
    domain = calibrated.domain
    if domain is None or calibrated.model.robot.external_axes or not len(domain.joint_position):
        return None
    q = domain.joint_position[:_MOST_POSTURES]
    apart = np.abs(q[:, None] - q[None]).max(axis=-1)
    return np.asarray(q[int(np.argmin(apart.sum(axis=1)))])


def _path_notes(
    summary: CorrectionSummary, robot: Robot, start: str | None, by_calibration: bool
) -> tuple[str, ...]:
    notes = []
    if summary.jumps:
        rows = "row" if summary.jumps == 1 else "rows"
        notes.append(
            f"the posture changes at {summary.jumps} {rows} (first:"
            f" {summary.first_jump}): a joint turns by more than 90 deg from the row before"
        )
    if summary.start and start is None:
        notes.append(
            "the first row is taken to be reached in the posture nearest to"
            f" {'those that were calibrated' if by_calibration else 'zero'}:"
            f" {write_posture(robot, summary.start)}; another"
            " posture deflects otherwise, give --start if it is another"
        )
    return tuple(notes)


def _shown(metres: float) -> str:
    """Return a length in mm; a length below the resolution of trackers is shown as zero."""
    return "below 0.001 mm" if 0.0 < metres < 1e-6 else quantity(metres, "mm", ".3g")


def _built(settings: CompensateSettings) -> tuple[str, ...]:
    if settings.geometry is None:
        return ()
    return (f"deviations hold the errors of the arm as built and its sag, of {settings.geometry}",)


def _covered(summary: CorrectionSummary) -> tuple[str, ...]:
    warnings = () if summary.doubt is None else summary.doubt.warnings
    covered = () if summary.coverage is None else (summary.coverage.sentence(),)
    return (*warnings, *covered)


def _force_notes(summary: CorrectionSummary) -> tuple[str, ...]:
    if not 2 * summary.pulled > summary.rows:
        return ()
    return (
        f"at {summary.pulled} of {summary.rows} rows the force on the robot draws the tool out"
        " (along +z of the tcp), which a surface cannot: is it the force on the part? Then turn"
        " its sign",
    )
