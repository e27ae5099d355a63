"""``export``: C99 of a model and its compensator for a real-time target."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np

from elastocal.cell import Cell, PathLimits, load_cell
from elastocal.compensation import CorrectionLimits, read_settings
from elastocal.compensation.conditioning import read_sensor_load
from elastocal.compensation.export import LinuxTarget, linux_files, write_c
from elastocal.compensation.kernel import Routine, compiled
from elastocal.compensation.online import design
from elastocal.drivers.kuka_rsi import DRIVER as KUKA, PostureReader
from elastocal.drivers.net_ft import NetFtSettings
from elastocal.errors import CompensationError, nearest, present
from elastocal.identification import ModelSource, PredictionDoubt, model_name
from elastocal.options import Option
from elastocal.progress import Progress
from elastocal.records import record
from elastocal.results import Result
from elastocal.robot import Robot, probe_configurations
from elastocal.units import quantity
from elastocal.workflows._inputs import (
    ArmAsBuilt,
    NewTool,
    TouchedArm,
    UnloadedArm,
    coverage_notes,
    growth_notes,
    require_model_of_arm,
    require_same_robot,
)
from elastocal.workflows._operator_and_devices import rig_of
from elastocal.workflows._workflow import workflow
from elastocal.workflows.krc_config import kuka_settings
from elastocal.workflows.live import settings_within

EXPORT_TARGETS = ("linux",)
"""Machines that a whole program is written for."""


@dataclass(frozen=True)
class ExportSettings(NewTool, ArmAsBuilt, TouchedArm):
    """Settings of an export: the model and the compensator."""

    model: Annotated[ModelSource, Option(argument=True)]
    """Model file of `calibrate`; in Python also what it returned."""
    out: Annotated[Path, Option("--c")]
    """Folder to write the C files into."""
    compensator: Annotated[Path | None, Option("--settings")] = None
    """Settings of the compensator (.yaml)."""
    tool: Path | None = None
    """Tool file of `tool`: weight, bias, sensor."""
    platform: Annotated[str | None, Option("--target", choices="target")] = None
    """Besides, a program for a real-time Linux: RSI and Net F/T around the compensator."""
    cell: Path | None = None
    """Cell file, whose addresses and limits that program holds."""
    force: bool = False
    """Replace files that are there."""


_NO_TOOL = (
    "no tool file: wrenches are taken as at the tool centre point, in its axes, bias and tool"
    " weight removed"
)
_ARM_ERROR = (
    "elastocal_arm_error gives what the unloaded arm as built is off by; the step corrects the"
    " deflection alone"
)
_MEASURED_ANGLES = (
    "functions of joints in elastocal_arm_error hold where these were measured: {ranges} deg"
)
_AGREEMENT = 1e-12
"""Largest difference between statements and the geometry itself, in m: rounding is some 1e-15."""


@record()
class ExportResult(Result):
    """The C files that were written, and the key figures of their compensator."""

    folder: str
    files: tuple[str, ...]
    robot: str
    joints: int
    springs: int
    cycle: float
    """Time between two corrections, in s."""
    filter_delay: float
    """Delay of a slow wrench, in s."""
    limits: CorrectionLimits
    tool: str
    """The tool that the model is for, in words."""
    notes: tuple[str, ...]
    """Notes for the user."""
    on_production: PredictionDoubt | None = None
    """Uncertainty of the model on the production that it was calibrated for; None: no production
    was named."""

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return the main facts, a label and a text each."""
        limits = self.limits
        return (
            ("robot", f"{self.robot}: {self.joints} joints, {self.springs} springs"),
            ("tool", self.tool),
            ("folder", self.folder),
            ("files", ", ".join(self.files)),
            ("cycle", quantity(self.cycle, "ms")),
            ("delay of the filters", quantity(self.filter_delay, "ms", ".3g")),
            (
                "on production",
                "not known: calibrate with --process"
                if self.on_production is None
                else f"the model predicts {self.on_production.figures}",
            ),
            (
                "largest correction",
                f"{quantity(limits.correction, 'mm')}, {quantity(limits.rate, 'mm/s')}",
            ),
            *(("note", text) for text in self.notes),
        )


@workflow(ExportSettings)
def export(settings: ExportSettings, progress: Progress) -> ExportResult:  # noqa: ARG001 - done in an instant
    """Write a model as dependency-free C99 with filters, limits and a self-test.

    Raises
    ------
    CompensationError, SchemaError
        If model, settings or tool do not fit.
    FileAccessError
        If a file cannot be read or written, or the folder holds files and ``force`` is not given.

    Examples
    --------
    >>> import elastocal as ec
    >>> readings = ec.datasets.fanuc_r2000ic()
    >>> model = ec.calibrate(readings, springs="actuated", draws=40)
    >>> dict(ec.export(model, out="c").facts())["cycle"]
    '4 ms'
    """
    name = model_name(settings.model)
    calibrated = settings.read_model(settings.model)
    require_model_of_arm(calibrated, name)
    around = _around(settings, calibrated.model.robot)
    if around is None:
        chosen = None if settings.compensator is None else read_settings(settings.compensator)
    else:
        chosen = settings_within(settings.compensator, *around[1:])
    load = read_sensor_load(settings.tool, calibrated.model.robot)
    state = settings.growth(calibrated.model.robot)
    built = settings.built(calibrated.model.robot)
    arm = settings.unloaded(calibrated.model.robot)
    try:
        numbers = design(calibrated, chosen, load, state, built)
    except CompensationError as error:
        raise CompensationError(f"{name}: {error}") from error
    if numbers.arm_error is not None:
        _require_agreement(arm, numbers.arm_error)
    on_production = calibrated.on_production
    beside = {} if around is None else linux_files(numbers, around[0])
    files = write_c(settings.out, numbers, settings.force, beside)
    return ExportResult(
        folder=str(settings.out),
        files=tuple(files),
        robot=calibrated.model.robot.name,
        joints=numbers.joints,
        springs=len(calibrated.model.springs),
        cycle=numbers.settings.cycle,
        filter_delay=float(np.asarray(numbers.filters.delay())),
        limits=numbers.settings.limits,
        tool=calibrated.tool_name,
        notes=(
            *(coverage_notes(calibrated) if calibrated.tool is not None else ()),
            *(on_production.warnings if on_production else ()),
            *((_NO_TOOL,) if settings.tool is None else ()),
            *growth_notes(state),
            *((_ARM_ERROR,) if built is not None else ()),
            *_measured_angles(arm),
        ),
        on_production=on_production,
    )


def _measured_angles(arm: UnloadedArm) -> tuple[str, ...]:
    """Return where the statements hold, if functions of joints are among them."""
    ranges = "" if arm.angles is None else arm.angles.ranges
    return (_MEASURED_ANGLES.format(ranges=ranges),) if ranges else ()


def _require_agreement(arm: UnloadedArm, error: Routine) -> None:
    """Refuse statements that give something else than the geometry, before C is made of them."""
    q = probe_configurations(arm.controller)
    known = present(arm.tool, "geometry")(q) - arm.controller.forward(q)[:, :3, 3]
    of = compiled(error, len(arm.controller.joint_names), loaded=False)
    off = float(np.abs(np.array([of(each) for each in q.tolist()]) - known).max())
    if not off <= _AGREEMENT:
        raise CompensationError(
            f"the program of the arm's errors differs from its geometry by {1e3 * off:.3g} mm"
        )


def _around(settings: ExportSettings, model: Robot) -> tuple[LinuxTarget, PathLimits, Cell] | None:
    """Return the target's settings, the path limits and the cell; None without a target.

    Raises
    ------
    CompensationError, DeviceError
        If the cell is not one that the program is for.
    """
    if settings.platform is None:
        if settings.cell is not None:
            raise CompensationError("a cell file is for --target linux, which holds its addresses")
        return None
    if settings.platform not in EXPORT_TARGETS:
        raise CompensationError(
            f"target {settings.platform!r} is none{nearest(settings.platform, EXPORT_TARGETS)}"
            f" (known: {', '.join(EXPORT_TARGETS)})"
        )
    if settings.cell is None or settings.tool is None:
        raise CompensationError(
            "--target linux needs --cell, for addresses and limits, and --tool: a Net F/T gives"
            " raw wrenches"
        )
    cell = load_cell(settings.cell)
    require_same_robot(model, cell.robot, (model_name(settings.model), cell.name))
    arm = kuka_settings(cell)
    limits = KUKA.path_limits(cell, arm)
    sensor = rig_of(cell).wanted.get("net_ft", {}).get("sensor")
    if not isinstance(sensor, NetFtSettings) or sensor.tcp_port is None:
        raise CompensationError(
            f"{cell.path}: devices.sensor: --target linux reads a Net F/T (driver net_ft) that"
            " tells its counts by TCP (tcp_port)"
        )
    target = LinuxTarget(
        cell=cell.name,
        rsi=(arm.address, arm.port),
        controller=arm.robot,
        sentype=arm.sentype,
        timeout=arm.timeout,
        sensor=(sensor.address, sensor.port, sensor.tcp_port),
        external=cell.robot.external_axes,
        scale=PostureReader(cell.robot, arm.signs).scales,
        correction=limits.correction,
        rate=limits.rate,
        delay=arm.motion_delay(cell),
    )
    return target, limits, cell
