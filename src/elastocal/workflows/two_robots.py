"""``plan-pair``, ``simulate-pair``, ``calibrate-pair``, ``compensate-pair``: two robots."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np

from elastocal import dataset
from elastocal.arrays import FloatArray
from elastocal.dataset import (
    Dataset,
    PathRows,
    PathTable,
    Readings,
    find_columns,
    in_file,
    new_rows,
)
from elastocal.errors import CompensationError, DatasetError, PathError, SchemaError
from elastocal.files import filling, require_place
from elastocal.identification import CalibratedModel, CalibrateResult, read_model, write_model
from elastocal.options import Exclude, Option
from elastocal.progress import Progress
from elastocal.records import read_json, schema_of, write_json
from elastocal.report import language_of, write_pair_plan_page
from elastocal.report.document import write_page
from elastocal.results import Result, brief_repr
from elastocal.robot import Robot
from elastocal.sim import Tips, press_together, true_arm
from elastocal.two_robots import (
    PAIR_FILE,
    CooperationSummary,
    PairCalibration,
    PairCell,
    PairPlan,
    PairResult,
    cooperation_summary,
    correct_pair,
    identify_pair,
    load_pair_cell,
    pair_readings,
    plan_meetings,
    require_opposed,
)
from elastocal.wording import phrase
from elastocal.workflows._workflow import workflow

__all__ = [
    "CalibratePairSettings",
    "CompensatePairSettings",
    "CooperationSummary",
    "PairPlan",
    "PairResult",
    "PlanPairSettings",
    "SimulatePairResult",
    "SimulatePairSettings",
    "calibrate_pair",
    "compensate_pair",
    "plan_pair",
    "simulate_pair",
]

PAGE_FILE = "pair.html"
"""Report of a calibration of two robots, in its folder."""
COOPERATION_FILE = "cooperation.json"
"""Record of a corrected cooperative process, in its folder."""

_PLAN_PAGE = '<meta name="generator" content="elastocal plan-pair">'
"""Mark in the page of a plan, in every language."""


@dataclass(frozen=True)
class PlanPairSettings:
    """Settings of ``plan-pair``: the cell of two robots."""

    cell: Annotated[Path, Option(argument=True)]
    """Cell file with the key ``robots``, ``.yaml``."""
    out: Annotated[Path, Option(metavar="PLAN.json", ends=(".json",))]
    """Plan to write; beside it its page, ``PLAN.html``: both arms at each meeting."""
    force: bool = False
    """Replace a file that is no former output of this command."""
    language: Annotated[str, Option(choices="page language")] = "en"
    """Language of the page."""


@workflow(PlanPairSettings, marks=(schema_of(PairPlan), _PLAN_PAGE))
def plan_pair(settings: PlanPairSettings, progress: Progress) -> PairPlan:  # noqa: ARG001 - seconds
    """Plan where two robots press on each other: postures that both reach, chosen by a search.

    Raises
    ------
    SchemaError
        If the cell is not one of two robots.
    PlanningError
        If the arms meet at too few places.
    ReportError
        If the page knows no such language.
    FileAccessError
        If a file cannot be read or written.

    Examples
    --------
    >>> import elastocal as ec
    >>> from elastocal.two_robots import write_pair_example
    >>> cell = write_pair_example("cell.yaml")
    >>> plan = ec.plan_pair(cell, out="plan.json")
    >>> len(plan.meetings)
    25
    """
    language, cell = language_of(settings.language), load_pair_cell(settings.cell)
    page = Path(settings.out).with_suffix(".html")
    require_place(page)
    found = plan_meetings(cell)
    write_json(settings.out, found)
    write_pair_plan_page(page, cell, found, language)
    return found


@dataclass(frozen=True)
class SimulatePairSettings:
    """Settings of ``simulate-pair``: the cell of two robots, and its plan."""

    cell: Annotated[Path, Option(argument=True)]
    """Cell file with the key ``robots``, ``.yaml``."""
    plan: Annotated[Path, Option(metavar="PLAN.json")]
    """Plan from `plan-pair`."""
    out: Annotated[Path, Option(metavar="DIR")]
    """Folder for the dataset of each arm, ``ARM.nc``."""
    tracked: bool = False
    """A tracker measures both tools; else they hold each other."""
    seed: Annotated[int | None, Option(least=0)] = None
    """Seed of the errors; by default the cell's."""
    force: bool = False
    """Replace what is in the folder."""


@dataclass(frozen=True, repr=False)
class SimulatePairResult(Result):
    """A simulated campaign of two robots."""

    arms: tuple[str, str]
    files: tuple[str, str]
    """Datasets, in the folder that was asked for."""
    poses: int
    load_cases: tuple[str, ...]
    largest_force: float
    """In N."""

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return what was pressed, and the files."""
        return (
            (phrase("Arms"), ", ".join(self.arms)),
            (phrase("Poses"), str(self.poses)),
            (phrase("Load cases"), ", ".join(self.load_cases)),
            (phrase("Largest force"), f"{self.largest_force:.0f} N"),
            (phrase("Datasets"), ", ".join(self.files)),
        )


_TRACKER = 15e-6
"""Standard deviation of a simulated tracker's displacement, in m."""


@workflow(SimulatePairSettings)
def simulate_pair(settings: SimulatePairSettings, progress: Progress) -> SimulatePairResult:  # noqa: ARG001 - seconds
    """Simulate the campaign of a plan: two true arms press on each other, tip to tip.

    Raises
    ------
    SchemaError
        If the cell is not one of two robots, or the plan is of another one.
    SpringError
        If an arm has not six joints.
    FileAccessError
        If a file cannot be read or written.

    Examples
    --------
    >>> import elastocal as ec
    >>> from elastocal.two_robots import write_pair_example
    >>> cell = write_pair_example("cell.yaml")
    >>> _ = ec.plan_pair(cell, out="plan.json")
    >>> made = ec.simulate_pair(cell, plan="plan.json", out="run")
    >>> made.files
    ('left.nc', 'right.nc')
    """
    cell = load_pair_cell(settings.cell)
    plan = _plan_of(settings.plan, cell)
    truth, presses = cell.file.simulation, cell.file.presses
    first, second = (
        true_arm(robot.urdf, robot.tip, robot.base, softness, truth.stiffening, truth.bending,
                 robot.gravity if robot.has_masses else (0.0, 0.0, 0.0))
        for robot, softness in zip(cell.robots, truth.softness, strict=True)
    )  # fmt: skip
    seed = truth.seed if settings.seed is None else settings.seed
    tips = Tips(
        normal=truth.normal,
        across=truth.across,
        spread=truth.spread,
        stop=truth.stop,
        slip=0.0 if presses.clamped else truth.slip,
        force_noise=truth.force_noise,
        marker=_TRACKER if settings.tracked else None,
    )
    T = cell.T_first_second.copy()
    T[0, 3] += truth.base_error
    datasets = press_together(
        (first, second), T, plan.q(), presses.cases, presses.light, tips,
        np.random.default_rng(seed),
    )  # fmt: skip
    names = cell.arms
    files = f"{names[0]}.nc", f"{names[1]}.nc"
    with filling(settings.out, files[1], settings.force) as folder:
        for file, each in zip(files, datasets, strict=True):
            dataset.write(each, folder / file)
    largest = max(float(np.linalg.norm(load)) for load in presses.cases.values())
    cases = tuple(presses.cases)
    return SimulatePairResult(names, files, len(plan.meetings), cases, largest)


def _plan_of(path: Path, cell: PairCell) -> PairPlan:
    """Return the plan of a cell.

    Raises
    ------
    SchemaError
        If it is of other arms, or of another base transform.
    """
    plan = read_json(path, PairPlan)
    joints = tuple(robot.joint_names for robot in cell.robots)
    if plan.arms != cell.arms or plan.joints != joints:
        raise SchemaError(f"{path} is a plan of {' and '.join(plan.arms)}, with other joints")
    if not np.allclose(plan.base_transform, cell.T_first_second, atol=1e-9):
        raise SchemaError(f"{path} was planned with another base_transform: plan again")
    return plan


@brief_repr
@dataclass(frozen=True)
class CalibratePairSettings:
    """Settings of ``calibrate-pair``: the cell of two robots, and the readings of each."""

    cell: Annotated[Path, Option(argument=True)]
    """Cell file with the key ``robots``, ``.yaml``."""
    first: Annotated[Path, Option(argument=True)]
    """Dataset of the first robot, in its own base: ``.nc`` or ``.csv``."""
    second: Annotated[Path, Option(argument=True)]
    """Dataset of the second robot: the same poses and load cases."""
    out: Annotated[Path, Option(metavar="DIR")]
    """Folder for the model of each arm, ``ARM.json``, ``pair.json`` and ``pair.html``."""
    springs: Annotated[str, Option(choices="springs", file=True)] = "auto"
    """Springs of both arms: ``auto``, a layout, or ``gears``."""
    exclude: Exclude = ()
    """Presses left out of both datasets by name, ``POSE`` or ``POSE:LOAD_CASE``."""
    draws: Annotated[int, Option(least=40, most=100_000)] = 200
    """Bootstrap draws."""
    seed: Annotated[int, Option(least=0)] = 0
    """Seed of the bootstrap."""
    force: bool = False
    """Replace what is in the folder."""
    language: Annotated[str, Option(choices="page language")] = "en"
    """Language of ``pair.html``."""


@workflow(CalibratePairSettings)
def calibrate_pair(settings: CalibratePairSettings, progress: Progress) -> PairResult:  # noqa: ARG001 - seconds
    """Calibrate two robots by presses on each other, with or without a tracker.

    Raises
    ------
    SchemaError
        If the cell is not one of two robots.
    DatasetError
        If the datasets have no press in common, or a name to exclude is of none.
    ConventionError
        If the tools do not meet and face each other, or the forces are not opposite.
    IdentificationError
        If there are too few poses, or the springs imitate a contact of which nothing is known.
    ReportError
        If the page knows no such language.
    FileAccessError
        If a file cannot be read or written.

    Examples
    --------
    >>> import elastocal as ec
    >>> from elastocal.two_robots import write_pair_example
    >>> cell = write_pair_example("cell.yaml")
    >>> _ = ec.plan_pair(cell, out="plan.json")
    >>> _ = ec.simulate_pair(cell, plan="plan.json", out="run")
    >>> found = ec.calibrate_pair(
    ...     cell, first="run/left.nc", second="run/right.nc", out="models", draws=40
    ... )
    >>> found.held_out < 0.02 * found.deflection
    True
    >>> [each.name for each in found.arms]
    ['left', 'right']
    """
    language = language_of(settings.language)
    cell = load_pair_cell(settings.cell)
    own = tuple(
        _readings(path, robot)
        for path, robot in zip((settings.first, settings.second), cell.robots, strict=True)
    )
    pair = pair_readings(
        cell.arms, cell.robots, (own[0], own[1]), cell.T_first_second, settings.exclude
    )
    known = {name: read_model(path) for name, path in cell.models().items()}
    rng = np.random.default_rng(settings.seed)
    found = identify_pair(pair, rng, cell.contact, settings.springs, known, settings.draws)
    files = f"{cell.arms[0]}.json", f"{cell.arms[1]}.json"
    result = PairResult.of(cell.name, found, files, _at_presses(cell, found))
    with filling(settings.out, PAIR_FILE, settings.force) as folder:
        for file, model in zip(files, found.models, strict=True):
            write_model(folder / file, model)
        write_json(folder / PAIR_FILE, result)
        title = phrase("Two robots: {cell}", cell=cell.name)
        sections = tuple(result.sections())
        write_page(folder / PAGE_FILE, title, sections, language, maker="elastocal calibrate-pair")
    return result


def _at_presses(cell: PairCell, found: PairCalibration) -> CooperationSummary | None:
    """Return the deviation at the presses before and after; none where an arm cannot correct it."""
    pair, share = found.pair, cell.file.share
    q = pair.first.joint_position, pair.second.joint_position
    T, force = pair.T_first_second, pair.first.force
    try:
        corrected = correct_pair(found.models, T, q, force, share.weights, share.limits)
    except PathError:
        return None
    return cooperation_summary(cell.arms, corrected, share.weights, share.limits)


def _readings(path: Path, robot: Robot) -> Readings:
    """Return the readings of an arm.

    Raises
    ------
    DatasetError
        If its joints are not the robot's.
    """
    data: Dataset = dataset.read(path)
    try:
        return data.readings(robot.joint_names)
    except DatasetError as error:
        raise DatasetError(f"{path}: {error}") from error


@brief_repr
@dataclass(frozen=True)
class CompensatePairSettings:
    """Settings of ``compensate-pair``: cell, calibration, and the path of each robot."""

    cell: Annotated[Path, Option(argument=True)]
    """Cell file with the key ``robots``, ``.yaml``."""
    models: Annotated[Path, Option(argument=True, metavar="DIR")]
    """Folder from `calibrate-pair`."""
    first: Annotated[Path, Option(argument=True)]
    """Path of the first robot: joints and the force on it, a row a step (``.csv``)."""
    second: Annotated[Path, Option(argument=True)]
    """Path of the second robot, row by row at the same times."""
    out: Annotated[Path, Option(metavar="DIR")]
    """Folder for the corrected paths, ``ARM.csv``."""
    shares: tuple[float, ...] = ()
    """Parts of the deviation that each arm corrects, such as 1 and 0; by default the cell's."""
    force: bool = False
    """Replace what is in the folder."""


@workflow(CompensatePairSettings)
def compensate_pair(settings: CompensatePairSettings, progress: Progress) -> CooperationSummary:  # noqa: ARG001 - seconds
    r"""Correct the paths of two robots that work on each other, shared by weights and limits.

    Raises
    ------
    SchemaError
        If the cell is not one of two robots, or the models are of others.
    CompensationError, PathError
        If the paths do not belong together, or a corrected pose is out of reach.
    FileAccessError
        If a file cannot be read or written.

    Examples
    --------
    >>> import elastocal as ec
    >>> from elastocal.two_robots import write_pair_example
    >>> cell = write_pair_example("cell.yaml")
    >>> plan = ec.plan_pair(cell, out="plan.json")
    >>> _ = ec.simulate_pair(cell, plan="plan.json", out="run")
    >>> _ = ec.calibrate_pair(
    ...     cell, first="run/left.nc", second="run/right.nc", out="models", draws=40
    ... )
    >>> from pathlib import Path
    >>> R = plan.base_transform[:3, :3]
    >>> for arm, names, q, f in zip(
    ...     plan.arms, plan.joints, plan.q(), ([0, 0, 500], [0, 0, -500] @ R), strict=True
    ... ):
    ...     heads = [*(f"{name}[rad]" for name in names), *(f"force_{a}[N]" for a in "xyz")]
    ...     row = map(repr, [*q[0].tolist(), *map(float, f)])
    ...     _ = Path(f"{arm}.csv").write_text(f"{','.join(heads)}\n{','.join(row)}\n")
    >>> found = ec.compensate_pair(
    ...     cell, models="models", first="left.csv", second="right.csv", out="corrected"
    ... )
    >>> found.after < 0.01 * found.before
    True
    """
    cell = load_pair_cell(settings.cell)
    weights = _weights(settings.shares, cell)
    models = _models(settings.models, cell)
    limits = cell.file.share.limits
    paths = tuple(
        _Path.read(path, model.model.robot)
        for path, model in zip((settings.first, settings.second), models, strict=True)
    )
    _require_same_rows(settings, paths[0], paths[1])
    q, R = (paths[0].rows.joints, paths[1].rows.joints), cell.T_first_second[:3, :3]
    labels = [paths[0].rows.label(row) for row in range(len(q[0]))]
    require_opposed(cell.arms, paths[0].force, paths[1].force @ R.T, labels)
    found = correct_pair(models, cell.T_first_second, q, paths[0].force, weights, limits)
    summary = cooperation_summary(cell.arms, found, weights, limits)
    turned = found.correction.second @ R
    with filling(settings.out, COOPERATION_FILE, settings.force) as folder:
        for name, path, joints, shift, e in zip(
            cell.arms, paths, found.q, (found.correction.first, turned),
            (found.before.e, found.before.e @ R), strict=True,
        ):  # fmt: skip
            path.write(folder / f"{name}.csv", joints, shift, e)
        write_json(folder / COOPERATION_FILE, summary)
    return summary


@dataclass(frozen=True)
class _Path:
    """The path of one robot."""

    table: PathTable
    rows: PathRows
    force: FloatArray
    """Force on the robot in its base, shape (row, 3), in N."""

    @classmethod
    def read(cls, path: Path, robot: Robot) -> "_Path":
        with in_file(path):
            table = PathTable.open(path, lambda header: find_columns(header, robot, poses=False))
            rows = table.rows()
            force, _ = rows.wrench_in_base(robot.forward(rows.joints))
            return cls(table, rows, force)

    def write(self, out: Path, q: FloatArray, shift: FloatArray, deviation: FloatArray) -> None:
        """Write the path with corrected joints, the shift, and the deviation, in its own base."""
        added = [f"{what}_{axis}[m]" for what in ("shift", "deviation") for axis in "xyz"]
        changed = [(column, q[:, j]) for j, column in enumerate(self.table.columns.joints)]
        with new_rows(out, self.table, added) as write:
            write(self.rows, np.column_stack([shift, deviation]), changed)


def _weights(given: tuple[float, ...], cell: PairCell) -> tuple[float, float]:
    if not given:
        return cell.file.share.weights
    if len(given) != 2:
        raise CompensationError(f"{len(given)} shares: two are needed, one for each arm")
    return given[0], given[1]


def _require_same_rows(settings: CompensatePairSettings, first: _Path, second: _Path) -> None:
    counts = len(first.rows), len(second.rows)
    if counts[0] != counts[1]:
        raise CompensationError(
            f"{settings.first} has {counts[0]} rows and {settings.second} {counts[1]}: the paths"
            " must go row by row at the same times"
        )


def _models(folder: Path, cell: PairCell) -> tuple[CalibratedModel, CalibratedModel]:
    """Return the models of a calibration, draw by draw of both arms.

    Raises
    ------
    SchemaError
        If it is of other arms, or of another base transform.
    """
    record = read_json(folder / PAIR_FILE, PairResult)
    names = tuple(each.name for each in record.arms)
    if names != cell.arms:
        raise SchemaError(f"{folder / PAIR_FILE} is of {', '.join(names)}, not {cell.arms}")
    if not np.allclose(record.base_transform, cell.T_first_second, atol=1e-9):
        raise SchemaError(
            f"{folder / PAIR_FILE} was calibrated with another base_transform: calibrate again"
        )
    first, second = (
        read_json(folder / each.model, CalibrateResult).calibrated for each in record.arms
    )
    return first, second
