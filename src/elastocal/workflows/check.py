"""``check``: validate any of our files, and say what it holds.

The kind of a file is found by its suffix and the schema that it states; a new kind is a function
of `elastocal.workflows._file_kinds`, and its entry in a table here.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path
from typing import Annotated

from elastocal import meshes, planning, verdict, workflows
from elastocal.blocks import Block, Facts
from elastocal.cell import Cell, load_cell
from elastocal.codec import ARRAYS, VERDICTS
from elastocal.codec.study import DESIGN, PARTS
from elastocal.compensation.online import LIVE_LOG_SCHEMA, is_live_log, read_live_log_facts
from elastocal.compensation.process import TABLE
from elastocal.dataset import require_joint_names
from elastocal.errors import DatasetError, RobotError, SchemaError, nearest
from elastocal.options import Option
from elastocal.planning import PLAN
from elastocal.procedure import JOURNAL
from elastocal.progress import Progress
from elastocal.records import read_arrays, read_json, read_json_data, read_yaml_data
from elastocal.results import Result
from elastocal.robot import (
    Robot,
    catalogue,
    find_meshes,
    is_dh_table,
    leaf_links,
    parse_urdf,
    read_urdf,
    refusals_naming,
    tip_links,
    tool_link,
)
from elastocal.robot.inverse import inverse_for
from elastocal.wording import phrase, plainly
from elastocal.workflows import _file_kinds as kinds
from elastocal.workflows._file_kinds import FileDescription
from elastocal.workflows._inputs import ROBOT_SUFFIXES
from elastocal.workflows._table_kinds import dataset_file, table_file
from elastocal.workflows._workflow import workflow

_Describe = Callable[[Path], FileDescription]


def _recording(path: Path) -> FileDescription:
    """Describe an MCAP file by the schema that it states: of a run, or of a live compensation."""
    if not is_live_log(path):
        return kinds.streams_file(path)
    found = read_live_log_facts(path)
    facts = {**vars(found), "joints": list(found.joints)}
    return "log of a live compensation", {"schema": LIVE_LOG_SCHEMA} | facts


def _live_record(path: Path) -> FileDescription:
    """Describe the record of a live compensation."""
    found = read_json(path, workflows.LiveResult)
    facts = kinds.schema_and(found, "cell", "robot", "started", "seconds", "ended", "problem")
    return "record of a live compensation", facts | {"line": found.line.sentence()}


def _robot(path: Path, tcp: str | None = None) -> FileDescription:
    """Describe a robot description, up to a link: by default to the one that carries the tool."""
    text = read_urdf(path)
    with refusals_naming(path):
        root = parse_urdf(text)
        tips = tip_links(root)
        robot = Robot.from_urdf(text, tcp or tool_link(text))
        require_joint_names(robot.joint_names)
        beside = [leaf for leaf in leaf_links(root) if leaf not in tips]
        shapes = find_meshes(text, path.parent)
    missing = [str(file) for _, file in shapes if not file.is_file()]
    return "robot description", {
        "robot": robot.name,
        "tips": list(tips),
        "other_leaves": beside,
        "tcp": robot.tip,
        "z_of_tcp": robot.chain.tip_direction,
        "inverse_kinematics": inverse_for(robot).method,
        "joints": list(robot.joint_names),
        "external_axes": list(robot.joint_names[: robot.external_axes]),
        "masses": robot.chain.weight_gap or True,
        "collision_meshes": f"{len(shapes) - len(missing)} of {len(shapes)} found",
        **({"missing": missing} if missing else {}),
        "assumptions": [f"{a.field}: {a.reason}" for a in robot.assumptions],
    }


def _catalogue(path: Path) -> FileDescription:
    """Describe a catalogue of robots; the URDF of each is made and loaded."""
    robots = catalogue.read_table(read_yaml_data(path), str(path))
    with refusals_naming(path):
        for entry in robots.values():
            Robot.from_urdf(catalogue.urdf_of(entry), "flange")
    return "catalogue of robots", {"schema": catalogue.SCHEMA, "robots": list(robots)}


_JSON_KINDS: dict[str, _Describe] = {
    "elastocal.plan": kinds.plan_file,
    "elastocal.run-summary": kinds.summary_file,
    "elastocal.tool": kinds.tool_file,
    "elastocal.codec_verdicts": kinds.codec_verdicts,
    "elastocal.study": kinds.study_record,
    "elastocal.study_settings": kinds.study_settings,
    "elastocal.study_samples": kinds.study_samples,
    "elastocal.process": kinds.process_table,
    "elastocal.comparison": kinds.comparison_file,
    "elastocal.commissioning": kinds.commissioning_file,
    "elastocal.live": _live_record,
    "elastocal.model": kinds.model_file,
    "elastocal.signature": kinds.record_file(
        "signature", lambda: verdict.Signature, "of", "sha256", "made", "key"
    ),
    "elastocal.ports": kinds.record_file(
        "ports of simulated devices", lambda: workflows.Ports, "address", "ports"
    ),
    "elastocal.arm-state": kinds.record_file(
        "state of an arm",
        lambda: workflows.ArmGrowth,
        *("cell", "cold", "warm", "share", "offset"),
    ),
    "elastocal.stiffness": kinds.record_file(
        "stiffness along a path",
        lambda: workflows.StiffnessSummary,
        *("direction", "stations", "files"),
    ),
    "elastocal.geometry": kinds.geometry_file,
    "elastocal.position-plan": kinds.position_plan_file,
    "elastocal.pair-plan": kinds.record_file(
        "plan of two robots", lambda: workflows.PairPlan, "cell", "arms", "technique", "passed"
    ),
    "elastocal.two-robots": kinds.record_file(
        "calibration of two robots",
        lambda: workflows.PairResult,
        *("cell", "springs", "poses", "readings", "deflection", "held_out"),
    ),
    "elastocal.cooperation": kinds.record_file(
        "corrected cooperative process",
        lambda: workflows.CooperationSummary,
        *("arms", "rows", "before", "after", "weights", "largest", "limited"),
    ),
}
"""JSON files by the schema that they state, without its version."""
_NETCDF_KINDS: dict[str, _Describe] = {
    "elastocal.codec": kinds.codec_arrays,
    "elastocal.pool": kinds.pool_file,
    "elastocal.dataset": dataset_file,
}
"""NetCDF files by their schema."""
_YAML_KINDS: dict[str, _Describe] = {
    "elastocal.cell": kinds.cell_file,
    "elastocal.contact": kinds.contact_file,
    "elastocal.compensator": kinds.compensator_file,
    "elastocal.springs": kinds.springs_file,
    "elastocal.log-map": kinds.log_map_file,
    "elastocal.position-map": kinds.position_map_file,
    "elastocal.catalogue": _catalogue,
}
"""YAML files by their schema."""

_UNITS = {
    "after": "m",
    "before": "m",
    "correction": "m",
    "covering_radius": "m",
    "cycle": "s",
    "deflection": "m",
    "delay": "s",
    "filter_delay": "s",
    "held_out": "m",
    "held_out_mean_m": "m",
    "limit": "m",
    "mass": "kg",
    "max_after": "m",
    "mean_after": "m",
    "median_error_m": "m",
    "rate": "m/s",
}
"""SI units of the numbers that files hold, by the key of `CheckResult.holds`."""

_FEW_POSES, _FEW_CANDIDATES = 6, 150
"""Poses and candidates of a preview: seconds, not minutes."""
_PLAN_PAGE = '<meta name="generator" content="elastocal plan">'
"""Mark in the page of a plan, in every language."""
_FOLDERS: tuple[tuple[tuple[str, ...], _Describe], ...] = (
    ((PLAN,), lambda folder: kinds.plan_file(folder / PLAN)),
    ((JOURNAL,), kinds.run_folder),
    ((TABLE,), kinds.process_folder),
    ((DESIGN, PARTS), kinds.study_folder),
    ((ARRAYS, VERDICTS), kinds.codec_folder),
)
"""Folders by what lies in them."""


@dataclass(frozen=True)
class CheckSettings:
    """Settings of ``check``: the file to validate."""

    file: Annotated[str | PathLike[str], Option(argument=True)]
    """Any file of ours, a dataset, a robot, a mesh, or a folder that a command made."""
    tcp: str | None = None
    """Link of a robot at the tool centre point; by default that behind the most joints."""
    preview: Annotated[str | PathLike[str] | None, Option(metavar="PAGE.html")] = None
    """Page (.html) to write of a cell: a view in three dimensions of a first few poses."""
    force: bool = False
    """Replace a file that is there by the page."""
    language: Annotated[str, Option(choices="page language")] = "en"
    """Language of that page."""


@dataclass(frozen=True, eq=False, repr=False)
class CheckResult(Result):
    """A valid file: its kind and what it holds."""

    file: str
    kind: str
    holds: Mapping[str, object]
    """Figures by name, JSON-ready."""

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Return the main facts, a label and a text each."""
        return (("file", self.file), ("kind", self.kind), *self.lines())

    def show(self) -> Iterator[Block]:
        """Yield all that the file holds."""
        yield Facts(self.lines())

    def lines(self) -> tuple[tuple[str, str], ...]:
        """Return the contents of the file: pairs of a label and its text."""
        return tuple(
            (_label(name), plainly(value, _UNITS.get(name, "")))
            for name, value in self.holds.items()
        )


def _label(name: str) -> str:
    """Return a key in words; its unit follows the number."""
    return name.removesuffix("_m").replace("_", " ")


@workflow(CheckSettings, marks=("<title>Calibration plan:", _PLAN_PAGE), outputs=("preview",))
def check(settings: CheckSettings, progress: Progress) -> CheckResult:  # noqa: ARG001 - an instant
    """Validate a file and say what it holds.

    Raises
    ------
    SchemaError
        If the suffix is not one of ours, or a folder holds nothing of ours.
    ElastocalError
        If the contents are not valid, a tcp is asked for and is no link of a robot, or a preview
        of what is no cell, or of a cell that no pose can be found for.

    Examples
    --------
    >>> import elastocal as ec
    >>> readings = ec.datasets.fanuc_r2000ic()
    >>> _ = ec.calibrate(readings, springs="actuated", draws=40, out="model.json")
    >>> dict(ec.check("model.json").facts())["kind"]
    'calibrated model'
    """
    path = Path(settings.file)
    if settings.tcp is None:
        kind, holds = describe_file(path)
    elif path.suffix.lower() in ROBOT_SUFFIXES:
        kind, holds = _robot(path, settings.tcp)
    else:
        raise RobotError(f"{path} is no robot description: a tcp is a link of one")
    if settings.preview is not None:
        if kind != "cell file":
            raise SchemaError(f"{path} is a {kind}: a preview is of a cell file")
        _write_preview(Path(settings.preview), load_cell(path), settings.language)
    return CheckResult(str(settings.file), kind, holds)


def _write_preview(page: Path, cell: Cell, code: str) -> None:
    """Write the page of a plan of few poses from few candidates.

    It shows where the arm comes to, and what refuses the other points.
    """
    from elastocal.report import (  # takes longer to import than most files to check
        language_of,
        write_plan_page,
    )

    language = language_of(code)
    few = {"technique": "cover", "poses": _FEW_POSES, "d_max": None, "accuracy": None}
    search = cell.file.search.model_copy(update={**few, "pool": _FEW_CANDIDATES})
    file = cell.file.model_copy(update={"search": search, "process": None})
    planned = planning.make_plan(replace(cell, file=file, process=None))
    named = replace(
        planned.plan.cell, name=phrase("{name}, a first look with few poses", name=cell.name)
    )
    plan = replace(planned.plan, cell=named)
    write_plan_page(page, cell, planned.surface, plan, planned.pool, language)


def describe_file(path: Path) -> FileDescription:
    """Return the kind of a file, or of a folder that a command made, and what it holds.

    Raises
    ------
    SchemaError
        If the suffix is not one of ours, or a folder holds nothing of ours.
    ElastocalError
        If the contents are not valid.
    """
    if path.is_dir():
        return _folder(path)
    describe = _BY_SUFFIX.get(path.suffix.lower())
    if describe is None:
        raise SchemaError(f"{path}: suffix {path.suffix!r} is not one of {', '.join(_BY_SUFFIX)}")
    return describe(path)


def _folder(path: Path) -> FileDescription:
    """Describe the folder of a plan, a run, a simulated process, a study or a codec."""
    for names, describe in _FOLDERS:
        if all((path / name).exists() for name in names):
            return describe(path)
    raise SchemaError(
        f"{path} is a folder with none of {PLAN}, {JOURNAL}, {TABLE} in it, nor the files of a"
        " codec or a study"
    )


def _netcdf(path: Path) -> FileDescription:
    """Describe a NetCDF file by the schema that it states."""
    try:
        stated = read_arrays(path).attributes.get("schema")
    except SchemaError as error:
        raise DatasetError(str(error)) from error
    return _kind(path, stated, _NETCDF_KINDS)(path)


def _json(path: Path) -> FileDescription:
    """Describe a JSON file by the schema that it states."""
    return _kind(path, _stated(read_json_data(path)), _JSON_KINDS)(path)


def _settings(path: Path) -> FileDescription:
    """Describe a YAML file by the schema that it states; that of a contact may be left out."""
    data = read_yaml_data(path)
    stated = _stated(data)
    if stated is None and isinstance(data, dict) and "contact" in data:
        stated = "elastocal.contact"
    return _kind(path, stated, _YAML_KINDS)(path)


def _stated(data: object) -> object:
    """Return the schema that keys and values state; None if there is none."""
    return data.get("schema") if isinstance(data, dict) else None


def _kind(path: Path, stated: object, known: Mapping[str, _Describe]) -> _Describe:
    """Return the function that describes files of a schema; an unknown one is refused.

    The reader of the file checks its version.
    """
    text = stated if isinstance(stated, str) else ""
    name = text.partition("/")[0]
    if name in known:
        return known[name]
    found = f"has schema {text!r}" if text else "states no schema"
    raise SchemaError(f"{path} {found}{nearest(name, known)} (known: {', '.join(sorted(known))})")


def _table(path: Path) -> FileDescription:
    """Describe a table: one of Denavit and Hartenberg's numbers is a robot."""
    return _robot(path) if is_dh_table(path) else table_file(path)


_BY_SUFFIX: dict[str, _Describe] = {
    ".nc": _netcdf,
    ".csv": _table,
    ".json": _json,
    **dict.fromkeys(ROBOT_SUFFIXES, _robot),
    **dict.fromkeys(meshes.SUFFIXES, kinds.mesh_file),
    ".jsonl": kinds.journal_file,
    ".mcap": _recording,
    ".yaml": _settings,
    ".yml": _settings,
}
"""Files by their suffix."""
