"""``new``: a cell file for a robot and a mesh, with sane defaults, that ``check`` passes."""

import json
import math
import os
import re
from dataclasses import dataclass, replace
from itertools import product
from os import PathLike
from pathlib import Path

import numpy as np

from elastocal import planning
from elastocal.arrays import FloatArray
from elastocal.cell import Cell, load_cell
from elastocal.errors import ElastocalError, FileAccessError, PlanningError, RobotError, SchemaError
from elastocal.files import replacing
from elastocal.meshes import load_triangles
from elastocal.planning.motion import Mover, mover_for
from elastocal.planning.surface import Surface, arm_reach, sample_uniform
from elastocal.progress import Progress
from elastocal.results import Result
from elastocal.robot import Robot, catalogue, parse_urdf, read_urdf, refusals_naming, tip_links
from elastocal.robot.inverse import inverse_for
from elastocal.templating import templates
from elastocal.units import parse_point, parse_quantity
from elastocal.workflows._file_kinds import cell_file
from elastocal.workflows._inputs import ROBOT_SUFFIXES, parse_frame
from elastocal.workflows._workflow import workflow

NONE = "none"
"""What leaves sensor or tracker out."""
_FLANGES = ("flange", "tool0", "tool_0")
"""Links that carry the tool in URDFs as they are published."""
_MOST_METRES = 25.0
"""Largest extent that a mesh is taken for metres up to; beyond, for millimetres."""
_SIZES = ((1.4, 100.0, 3.0, 15.0), (2.2, 300.0, 10.0, 15.0), (math.inf, 1000.0, 40.0, 20.0))
"""Press in N, mass of the tool in kg and radius of the contact in mm of arms up to a reach in m."""
_AHEAD, _ABOVE = (0.55, 0.65, 0.45, 0.75), (0.15, 0.3, 0.0, 0.45)
"""Where a surface is tried, in reaches of the arm: its middle ahead of the base, its lowest point
above it."""
_RETREATS = (0.25, 0.15, 0.4)
"""How far HOME is from the surface, in m, as tried."""
_TRIED, _TURNS = 40, 8
"""Points before which HOME is looked for, and turns of the tool at each."""
_MOST_POSTURES = 40
"""Postures that are tried as HOME for collisions."""
_REMARK, _COLUMN = re.compile(r"(?m)^(?=[^#\n]*\S)(.*?\S) +(# .*)$"), 38
"""A line with a remark behind it, and where remarks begin."""


@dataclass(frozen=True)
class NewSettings:
    """What is known of a cell; quantities are texts with their units, and what is None is guessed.

    `filled` says what is guessed.
    """

    out: str | PathLike[str]
    """Cell file to write."""
    robot: str | None = None
    """Name in the catalogue, or a URDF file."""
    mesh: str | PathLike[str] | None = None
    """Surface that the tool presses on: STL, OBJ or PLY."""
    flange: str | None = None
    """Link that carries the tool."""
    unit: str | None = None
    """Unit of the mesh's numbers."""
    place: str | None = None
    """Frame of the mesh in base, ``"x, y, z, a, b, c"``."""
    tcp: str | None = None
    """Tool centre point in the flange, ``"x, y, z, a, b, c"``, z out of the tool."""
    tool_mass: str | None = None
    """Mass of all that hangs on the flange."""
    tool_centre: str | None = None
    """Its centre in the flange, ``"x, y, z"``."""
    press: str | None = None
    """Largest force onto the surface; a third of it is pressed aside."""
    force_range: str | None = None
    """Largest forces of the sensor along its axes, ``"fx, fy, fz"``, or ``none``: no sensor."""
    moment_range: str | None = None
    """Its largest moments, likewise."""
    tracker: str | None = None
    """Place of the tracker in base, ``"x, y, z"``, or ``none``: no tracker."""
    marker_place: str | None = None
    """Marker in the tcp frame, ``"x, y, z"``."""
    poses: int = 15
    """Number of poses."""
    force: bool = False
    """Replace a file that is there."""


@dataclass(frozen=True, repr=False)
class NewResult(Result):
    """A cell file that was begun."""

    cell: Path
    robot: str
    findings: tuple[str, ...]
    """What ``check`` says of it."""


def filled(settings: NewSettings) -> NewSettings:
    """Return settings with a guess for all that is None, by the robot and the mesh.

    Raises
    ------
    RobotError
        If no robot is named, or there is none of that name.
    SchemaError
        If no mesh is named.
    FileAccessError
        If a file cannot be read.
    """
    if settings.robot is None:
        raise RobotError("--robot is missing: a name of `elastocal robots`, or a URDF file")
    flange = settings.flange or _flange(settings.robot)
    reach = arm_reach(_arm(settings.robot, flange))
    if settings.mesh is None:
        raise SchemaError("--mesh is missing: the surface that the tool presses on (.stl)")
    bounds = np.array(load_triangles(Path(settings.mesh)).bounds, dtype=float)
    unit = settings.unit or ("m" if np.ptp(bounds, axis=0).max() <= _MOST_METRES else "mm")
    _, press, mass, _ = _sizes(reach)
    done = replace(
        settings,
        flange=flange,
        unit=unit,
        tcp=settings.tcp or "0 mm, 0 mm, 200 mm, 0 deg, 0 deg, 0 deg",
        tool_mass=settings.tool_mass or f"{mass:g} kg",
        press=settings.press or f"{press:g} N",
        place=settings.place or _place(bounds, unit, reach, _AHEAD[0], _ABOVE[0]),
        marker_place=settings.marker_place or "70 mm, 0 mm, -110 mm",
    )
    tip, force = parse_frame(done.tcp or "")[:3, 3], parse_quantity(done.press, "force")
    centre = settings.tool_centre or ", ".join(f"{500.0 * x:.0f} mm" for x in tip)
    moment = _rounded_up(2.0 * force * (float(np.linalg.norm(tip)) + 0.1))
    x, _, z = parse_frame(done.place or "")[:3, 3]
    return replace(
        done,
        tool_centre=centre,
        force_range=settings.force_range or _thrice(_rounded_up(2.0 * force), "N"),
        moment_range=settings.moment_range or _thrice(moment, "N*m"),
        tracker=settings.tracker or f"{x:.1f} m, {-max(2.0, 1.2 * reach):.1f} m, {z + 1.0:.1f} m",
    )


@workflow(NewSettings)
def new(settings: NewSettings, progress: Progress) -> NewResult:  # noqa: ARG001 - seconds
    """Write a cell file for a robot and a mesh, which ``check`` passes.

    Where the surface stands is tried, if it is not said, until the arm comes to it. HOME is a
    posture before the surface that is free of collisions.

    Parameters
    ----------
    settings : NewSettings
        Or its ``out``, and the other fields by name.
    progress : Progress, optional
        Called with stage, done and total.

    Raises
    ------
    ElastocalError
        If ``check`` refuses the cell wherever the surface is tried, with its first reason.
    FileAccessError
        If the file is there already, or a file cannot be read or written.
    """
    out = Path(settings.out)
    if out.exists() and not settings.force:
        raise FileAccessError(f"{out} is there already: give --force to replace it")
    known = filled(settings)
    refused: ElastocalError | None = None
    with replacing(out) as temporary:
        for place, flip in _tries(settings, known):
            trial = replace(known, place=place)
            try:
                findings = _write(temporary, out, trial, flip)
            except ElastocalError as error:
                refused = refused or error
                continue
            return NewResult(out, str(known.robot), findings)
        reason = str(refused).replace(str(temporary), str(out))
        raise SchemaError(f"no cell that check passes: {reason}") from refused


def _tries(settings: NewSettings, known: NewSettings) -> list[tuple[str, bool]]:
    """Return where the surface is tried, and whether its normals are turned round."""
    if settings.place is not None:
        return [(settings.place, False), (settings.place, True)]
    bounds = np.array(load_triangles(Path(str(known.mesh))).bounds, dtype=float)
    reach = arm_reach(_arm(str(known.robot), str(known.flange)))
    return [
        (_place(bounds, str(known.unit), reach, ahead, above), flip)
        for above, ahead, flip in product(_ABOVE, _AHEAD, (False, True))
    ]


def _write(temporary: Path, out: Path, settings: NewSettings, flip: bool) -> tuple[str, ...]:
    """Write the cell file, and return what ``check`` finds; it raises what ``check`` refuses."""
    robot = _arm(str(settings.robot), str(settings.flange))
    middle = 0.5 * (robot.limits.lower + robot.limits.upper)
    temporary.write_text(_text(out, settings, robot, middle, flip), encoding="utf-8")
    cell = load_cell(temporary)
    surface = planning.cell_surface(cell)
    rng = np.random.default_rng(cell.file.search.seed)
    planning.surface_findings(cell, surface, rng)
    home = _home(cell, surface, mover_for(cell, planning.collision_scene(cell, surface)))
    temporary.write_text(_text(out, settings, robot, home, flip), encoding="utf-8", newline="\n")
    findings = cell_file(temporary)[1]["findings"]
    assert isinstance(findings, list)
    return tuple(findings)


def _home(cell: Cell, surface: Surface, mover: Mover) -> FloatArray:
    """Return a posture before the surface that is far from its limits and free of collisions."""
    points = sample_uniform(surface, _TRIED, np.random.default_rng(0))
    places = [
        _before(point, normal, retreat, turn)
        for retreat in _RETREATS
        for point, normal in zip(points.position, points.normal, strict=True)
        for turn in np.arange(_TURNS) * 2.0 * np.pi / _TURNS
    ]
    found = inverse_for(cell.robot).solve_many(np.array(places)).q
    q = np.degrees(found[np.isfinite(found).all(axis=-1)])
    q = np.radians(np.round(q, 1))
    if not len(q):
        raise PlanningError("the arm comes to no point before the surface: move it by --place")
    lower, upper = cell.robot.limits.lower, cell.robot.limits.upper
    room = np.minimum(q - lower, upper - q).min(axis=1)
    for posture in q[np.argsort(-room)][:_MOST_POSTURES]:
        if mover.sweep.free(posture[None], posture[None])[0]:
            return np.asarray(posture)
    raise PlanningError("no posture before the surface is free of collisions and within the limits")


def _before(point: FloatArray, normal: FloatArray, retreat: float, turn: float) -> FloatArray:
    """Return a tcp frame, shape (4, 4), that looks at a point of the surface from afar."""
    z = -normal
    aside = np.cross(z, np.eye(3)[int(np.argmin(np.abs(z)))])
    x = aside / np.linalg.norm(aside)
    T = np.eye(4)
    y = np.cross(z, x)
    T[:3, 0], T[:3, 1] = np.cos(turn) * x + np.sin(turn) * y, np.cos(turn) * y - np.sin(turn) * x
    T[:3, 2], T[:3, 3] = z, point + retreat * normal
    return T


def _text(out: Path, settings: NewSettings, robot: Robot, home: FloatArray, flip: bool) -> str:
    """Return the text of the cell file; paths in it are relative to the file."""
    is_file = _is_urdf(str(settings.robot))
    tip = parse_frame(str(settings.tcp))[:3, 3]
    side = parse_quantity(settings.press, "force") / 3.0
    shown = zip(robot.joint_names, np.degrees(home) + 0.0, strict=True)
    slow = not np.isfinite(robot.limits.velocity).all()
    text = templates("elastocal.cell").get_template("new.yaml").render(
        name=_quoted(out.stem if out.stem.isidentifier() else "cell"),
        urdf=_quoted(_relative(str(settings.robot), out)) if is_file else "",
        robot=_quoted(robot.name),
        flange=_quoted(settings.flange),
        tcp=_frame(str(settings.tcp)),
        tool_mass=_quoted(settings.tool_mass),
        tool_centre=_listed(str(settings.tool_centre)),
        shape=_shape(tip, arm_reach(robot)),
        force_range="" if settings.force_range == NONE else _listed(str(settings.force_range)),
        moment_range=_listed(str(settings.moment_range)),
        tracker="" if settings.tracker == NONE else _listed(str(settings.tracker)),
        marker=_listed(str(settings.marker_place)),
        mesh=_quoted(_relative(str(settings.mesh), out)),
        unit=settings.unit,
        place=_frame(str(settings.place)),
        flip=flip,
        floor=f"{1e3 * min(0.0, _lowest(settings)) - 100.0:.0f} mm",
        side=_quoted(f"{side:.3g} N"),
        press=_quoted(settings.press),
        disk=_quoted(f"{_sizes(arm_reach(robot))[3]:g} mm"),
        home=", ".join(f'{_quoted(name)}: "{value:.1f} deg"' for name, value in shown),
        speed=", ".join(f'{_quoted(n)}: "90 deg/s"' for n in robot.joint_names) if slow else "",
        poses=settings.poses,
    )  # fmt: skip
    return _REMARK.sub(lambda found: f"{found[1]:<{_COLUMN - 3}}   {found[2]}", text)


def _shape(tip: FloatArray, reach: float) -> str:
    """Return a solid for the tool: a rod along z, or a ball half way to a tip elsewhere."""
    length = 1e3 * float(np.linalg.norm(tip))
    radius = 30.0 if reach < _SIZES[0][0] else 50.0
    if length > 1.0 and tip[2] > 0.999 * np.linalg.norm(tip):
        middle = f'["0 mm", "0 mm", "{0.42 * length:.0f} mm"]'
        rod = f'{{radius: "{radius:.0f} mm", length: "{0.8 * length:.0f} mm"}}'
        return f"{{name: tool, cylinder: {rod}, pose: {{xyz: {middle}}}}}"
    middle = ", ".join(f'"{500.0 * x:.0f} mm"' for x in tip)
    return f'{{name: tool, sphere: {{radius: "{radius:.0f} mm"}}, pose: {{xyz: [{middle}]}}}}'


def _place(bounds: FloatArray, unit: str, reach: float, ahead: float, above: float) -> str:
    """Return a frame of the mesh: its middle ahead of the base, its lowest point at a height."""
    low, high = bounds * parse_quantity(f"1 {unit}", "length")
    middle = 0.5 * (low + high)
    x, y, z = np.round([ahead * reach - middle[0], -middle[1], above * reach - low[2]], 2) + 0.0
    return f"{x:.2f} m, {y:.2f} m, {z:.2f} m, 0 deg, 0 deg, 0 deg"


def _lowest(settings: NewSettings) -> float:
    """Return the height of the lowest corner of the box about the mesh, in base in m."""
    bounds = np.array(load_triangles(Path(str(settings.mesh))).bounds, dtype=float)
    corners = np.array(list(product(*bounds.T))) * parse_quantity(f"1 {settings.unit}", "length")
    T = parse_frame(str(settings.place))
    return float((corners @ T[2, :3] + T[2, 3]).min())


def _arm(robot: str, flange: str) -> Robot:
    """Return the robot up to its flange."""
    if not _is_urdf(robot):
        return catalogue.load(robot, flange)
    with refusals_naming(Path(robot)):
        return Robot.from_urdf(read_urdf(Path(robot)), flange)


def _flange(robot: str) -> str:
    """Return the link that carries the tool, as far as names tell; else the longest chain's end."""
    if not _is_urdf(robot):
        return "flange"
    with refusals_naming(Path(robot)):
        tips = tip_links(parse_urdf(read_urdf(Path(robot))))
        known = next((name for name in _FLANGES if name in tips), None)
        return known or max(tips, key=lambda tip: tips[tip])


def _is_urdf(robot: str) -> bool:
    return Path(robot).suffix.lower() in ROBOT_SUFFIXES


def _sizes(reach: float) -> tuple[float, float, float, float]:
    return next(each for each in _SIZES if reach <= each[0])


def _rounded_up(value: float) -> float:
    """Return a value rounded up to its second digit."""
    step = 10.0 ** (math.floor(math.log10(value)) - 1)
    return math.ceil(value / step - 1e-9) * step


def _thrice(value: float, unit: str) -> str:
    return ", ".join([f"{value:g} {unit}"] * 3)


def _relative(file: str, out: Path) -> str:
    """Return the path of a file from the folder of the cell file, as every system reads it."""
    try:
        return Path(os.path.relpath(file, out.parent)).as_posix()
    except ValueError:  # on another drive
        return Path(file).resolve().as_posix()


def _quoted(text: object) -> str:
    """Return a text as YAML; what is JSON is YAML."""
    return json.dumps(str(text), ensure_ascii=False)


def _listed(text: str) -> str:
    return f"[{', '.join(_quoted(part.strip()) for part in text.split(','))}]"


def _frame(text: str) -> str:
    parse_frame(text)
    parts = [part.strip() for part in text.split(",")]
    return f"{{xyz: {_listed(','.join(parts[:3]))}, abc: {_listed(','.join(parts[3:]))}}}"


def offered(settings: NewSettings, name: str) -> str:
    """Return what is guessed for a field of settings with robot and mesh."""
    if name == "flange":
        return settings.flange or _flange(str(settings.robot))
    return str(getattr(filled(settings), name))


def parse_answer(name: str, text: str) -> None:
    """Refuse an answer to a question of the wizard that is no value of its field.

    Raises
    ------
    ElastocalError
        Which says what is allowed.
    """
    if name == "robot":
        _flange(text)
        if not _is_urdf(text):
            catalogue.entry(text)
    elif name == "mesh":
        load_triangles(Path(text))
    elif name in ("place", "tcp"):
        parse_frame(text)
    elif name in ("tool_centre", "marker_place") or (name == "tracker" and text != NONE):
        parse_point(text)
    elif name in ("tool_mass", "press"):
        parse_quantity(text, "mass" if name == "tool_mass" else "force")
    elif name == "unit":
        parse_quantity(f"1 {text}", "length")
