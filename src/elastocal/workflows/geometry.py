"""``geometry``: from absolute positions of markers to the geometry of the arm."""

from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np

from elastocal.files import write_text
from elastocal.geometry import (
    GeometryModel,
    GeometryProblem,
    climb,
    geometry_model,
    read_positions,
)
from elastocal.progress import Progress
from elastocal.records import write_json
from elastocal.results import Result, brief_repr
from elastocal.robot import BUILT_MARK
from elastocal.units import parse_point
from elastocal.wording import counted
from elastocal.workflows._inputs import find_robot
from elastocal.workflows._workflow import workflow

_MM = 1e3


@brief_repr
@dataclass(frozen=True)
class GeometrySettings:
    """Which positions, of which robot."""

    positions: str | PathLike[str]
    """CSV of joints and markers."""
    robot: str | None = None
    """URDF file or catalogue name."""
    tcp: str | None = None
    """Link that carries the markers."""
    out: Path | None = None
    """Model file to write; none: the model is only returned."""
    urdf: Path | None = None
    """Calibrated URDF to write."""
    markers: tuple[str, ...] = ()
    """Where on the tool each marker is, ``"x, y, z"`` in the tcp with units, where that is known:
    then an error of the tcp is found too."""
    draws: int = 200
    """Draws of the bootstrap over blocks of poses."""
    seed: int = 0
    """Of these draws."""
    force: bool = False
    """Replace a file that this command did not write."""


@dataclass(frozen=True, eq=False, repr=False)
class GeometryResult(Result):
    """A calibrated geometry."""

    model: GeometryModel

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return what a person wants to know first."""
        model = self.model
        before, after = model.held_out.registration, model.held_out.chosen
        known = sum(each.known for each in model.parameters)
        return (
            ("positions", f"{model.positions}, {counted(len(model.blunders), 'blunder')} left out"),
            ("nominal arm", _phrase(before.mean, before.p95, before.max)),
            ("calibrated", _phrase(after.mean, after.p95, after.max)),
            ("model", next(each.rung for each in model.ladder if each.chosen)),
            ("errors of the arm", f"{known} known of {len(model.parameters)} fitted"),
            *(("warning", each) for each in model.findings),
        )


@workflow(GeometrySettings, outputs=("out", "urdf"), marks=("elastocal.geometry/", BUILT_MARK))
def geometry(settings: GeometrySettings, progress: Progress) -> GeometryResult:
    """Find the geometric errors of an arm, and what it yields under its weight and payloads.

    Parameters
    ----------
    settings : GeometrySettings
        Or its ``positions``, and the other fields by name.
    progress : Progress, optional
        Called with stage, done and total.

    Raises
    ------
    GeometryError
        If the positions cannot be read, or no geometry can be found from them.
    RobotError
        If there is no such robot or link.
    FileAccessError
        If a file cannot be read or written.
    """
    path = Path(settings.positions)
    robot = find_robot(settings.robot, settings.tcp, None)
    problem = GeometryProblem(robot, read_positions(path, robot))
    found = climb(problem, settings.draws, np.random.default_rng(settings.seed), progress)
    markers = (
        np.array([parse_point(each) for each in settings.markers]) if settings.markers else None
    )
    model = geometry_model(problem, found, f"elastocal geometry {path.name}", markers)
    if settings.out is not None:
        write_json(settings.out, model)
    if settings.urdf is not None:
        write_text(settings.urdf, model.calibrated_urdf())
    return GeometryResult(model)


def _phrase(mean: float, p95: float, largest: float) -> str:
    return (
        f"{_MM * mean:.3f} mm mean, {_MM * p95:.3f} mm at 95 %, {_MM * largest:.3f} mm at most, at"
        " poses left out"
    )
