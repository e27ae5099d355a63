"""``new``: a cell file for a robot and a mesh, with sane defaults, that ``check`` passes."""

import json
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import numpy as np

from elastocal import planning
from elastocal.arrays import FloatArray
from elastocal.cell import Cell, load_cell
from elastocal.errors import ElastocalError, PlanningError, SchemaError, of_kind
from elastocal.files import path_from, replacing
from elastocal.planning.checks import TorqueCheck
from elastocal.planning.motion import Mover, mover_for
from elastocal.planning.surface import Surface, SurfaceError, sample_uniform
from elastocal.progress import Progress
from elastocal.results import Result
from elastocal.robot import Robot
from elastocal.robot.inverse import inverse_for
from elastocal.templating import templates
from elastocal.units import in_unit, parse_quantity, quantity
from elastocal.workflows._file_kinds import cell_file
from elastocal.workflows._inputs import parse_frame
from elastocal.workflows._workflow import workflow
from elastocal.workflows.new_settings import NONE, NewSettings

_AHEAD, _ABOVE = (0.55, 0.65, 0.45, 0.75), (0.15, 0.3, 0.0, 0.45)
"""Positions tried for a surface, in reaches of the arm: its middle ahead of the base, its lowest
point above it."""
_RETREATS = (0.25, 0.15, 0.4)
"""Distances of HOME from the surface that are tried, in m."""
_TRIED, _TURNS = 40, 8
"""Points before which HOME is looked for, and turns of the tool at each."""
_PARTS = 12
"""Parts in which they are solved for, which is what progress counts."""
_MOST_POSTURES = 40
"""Postures that are tried as HOME for collisions."""
_REMARK, _COLUMN = re.compile(r"(?m)^(?=[^#\n]*\S)(.*?\S) +(# .*)$"), 38
"""A line with a remark behind it, and where remarks begin."""


@dataclass(frozen=True, repr=False)
class NewResult(Result):
    """A cell file that was begun."""

    cell: Path
    robot: str
    findings: tuple[str, ...]
    """Findings of ``check``."""


@workflow(NewSettings)
def new(settings: NewSettings, progress: Progress) -> NewResult:
    """Write a cell file for a robot and a mesh, which ``check`` passes.

    Positions of the surface are tried, unless given, until the arm reaches it. HOME is a posture
    before the surface that is free of collisions.

    Raises
    ------
    ElastocalError
        If ``check`` refuses the cell wherever the surface is tried, with its first reason.
    FileAccessError
        If the file is there already, or a file cannot be read or written.

    Examples
    --------
    >>> import elastocal as ec
    >>> _ = ec.init("cell")
    >>> made = ec.new("own.yaml", robot="KR 120 R2700 extra HA", mesh="cell/dome.stl")
    >>> made.facts()[:2]
    (('cell', 'own.yaml'), ('robot', 'KR 120 R2700 extra HA'))
    """
    settings.require_free()
    out, known = Path(settings.out), settings.filled()
    refused: ElastocalError | None = None
    with settings.in_its_folder(), replacing(out) as temporary:
        tries = _tries(settings, known)
        for number, (place, flip) in enumerate(tries):
            progress("positions of the surface", number, len(tries))
            trial = replace(known, place=place)
            cell = _begun(temporary, out, trial, flip)
            try:
                surface, home = _prepared(cell, progress)
            except (PlanningError, SurfaceError) as error:  # of the place; the rest it cannot mend
                refused = refused or error
                continue
            text = _text(out, trial, home, flip)
            temporary.write_text(text, encoding="utf-8", newline="\n")
            try:
                return NewResult(out, str(known.robot), _findings(temporary, cell, surface))
            except ElastocalError as error:
                refused = error
                break
        reason = str(refused).replace(str(temporary), str(out))
        size = f"(the surface is {known.extent}; --unit takes another)"
        raise SchemaError(f"no cell that check passes: {reason} {size}") from refused


def _tries(settings: NewSettings, known: NewSettings) -> list[tuple[str, bool]]:
    """Return the positions tried for the surface, and whether its normals are reversed."""
    if settings.place is not None:
        return [(settings.place, False), (settings.place, True)]
    tries = product(_ABOVE, _AHEAD, (False, True))
    return [(known.place_before(ahead, above), flip) for above, ahead, flip in tries]


def _begun(temporary: Path, out: Path, settings: NewSettings, flip: bool) -> Cell:
    """Return the cell with HOME amid the limits of the joints."""
    limits = settings.arm.limits
    middle = 0.5 * (limits.lower + limits.upper)
    text = _text(out, settings, np.array([*settings.rail_home, *middle]), flip)
    temporary.write_text(text, encoding="utf-8")
    return load_cell(temporary)


def _prepared(cell: Cell, progress: Progress) -> tuple[Surface, FloatArray]:
    """Return the surface, which the arm comes to, and a HOME before it."""
    surface = planning.cell_surface(cell)
    planning.surface_findings(cell, surface, np.random.default_rng(cell.file.search.seed))
    mover = mover_for(cell, planning.collision_scene(cell, surface))
    home = _home(cell, surface, mover, progress)
    return surface, home


def _findings(path: Path, cell: Cell, surface: Surface) -> tuple[str, ...]:
    """Return the findings of ``check``, and presses that the joints do not bear; or refuse it."""
    found = of_kind(cell_file(path)[1]["findings"], list, "findings")
    return (*found, *_unbearable(cell, surface))


def _unbearable(cell: Cell, surface: Surface) -> tuple[str, ...]:
    """Return a finding if the joints do not bear the presses at half of the points tried."""
    check = TorqueCheck.of(cell, surface)
    if check is None or not cell.robot.has_masses:
        return ()
    T = _places(surface, 0.0)
    inverse = inverse_for(cell.robot).quick()
    q = inverse.solve_many(T.reshape(-1, 4, 4), _on_the_rail(cell)).q
    point, turn, branch = np.nonzero(np.isfinite(q.reshape(*T.shape[:2], -1, q.shape[-1])).all(-1))
    q = q.reshape(*T.shape[:2], -1, q.shape[-1])[point, turn, branch]
    at = T[point, turn]
    borne = check.bearable(planning.Postures(at, -at[:, :3, 2], q, q, point))
    best = np.array([borne[point == each].max() for each in np.unique(point)])
    if not np.median(best) < 1.0:
        return ()
    fits = float(f"{max(0.0, float(np.median(best))) * cell.file.load_cases.fz:.2g}")
    return (
        f"the joints bear the load cases at {int(np.sum(best >= 1.0))} of {len(best)} points of"
        f" the surface that were tried; at half of them they bear a press of {fits:g} N",
    )


def _home(cell: Cell, surface: Surface, mover: Mover, progress: Progress) -> FloatArray:
    """Return a posture before the surface that is far from its limits and free of collisions."""
    places = np.concatenate([_places(surface, retreat) for retreat in _RETREATS])
    external, inverse = _on_the_rail(cell), inverse_for(cell.robot).quick()
    parts = np.array_split(places.reshape(-1, 4, 4), _PARTS)
    solved = []
    for number, part in enumerate(parts):
        progress("postures for HOME", number, len(parts))
        solved.append(inverse.solve_many(part, external).q)
    found = np.concatenate(solved)
    q = in_unit(found[np.isfinite(found).all(axis=-1)], "deg")
    q = np.radians(np.round(q, 1))
    q[:, : len(external)] = external
    if not len(q):
        raise PlanningError("the arm comes to no point before the surface: move it by --place")
    lower, upper = cell.robot.limits.lower, cell.robot.limits.upper
    room = np.minimum(q - lower, upper - q)[:, len(external) :].min(axis=1)
    for posture in q[np.argsort(-room)][:_MOST_POSTURES]:
        if mover.sweep.free(posture[None], posture[None])[0]:
            return np.asarray(posture)
    raise PlanningError("no posture before the surface is free of collisions and within the limits")


def _on_the_rail(cell: Cell) -> FloatArray:
    """Return where the robot stands on its rail while HOME is looked for, shape (0,) or (1,)."""
    return cell.home[: cell.robot.external_axes]


def _places(surface: Surface, retreat: float) -> FloatArray:
    """Return tcp frames before some points of the surface, shape (point, turn, 4, 4)."""
    points = sample_uniform(surface, _TRIED, np.random.default_rng(0))
    turns = np.arange(_TURNS) * 2.0 * np.pi / _TURNS
    both = zip(points.position, points.normal, strict=True)
    return np.array([[_before(at, normal, retreat, turn) for turn in turns] for at, normal in both])


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


def _text(out: Path, settings: NewSettings, home: FloatArray, flip: bool) -> str:
    """Return the text of the cell file; paths in it are relative to the file."""
    robot = settings.arm
    effort = np.where(np.isfinite(robot.limits.effort), robot.limits.effort, 100.0)
    torques = zip(robot.joint_names, effort, strict=True)
    low, high = settings.bounds
    process, tolerance = str(settings.process), str(settings.accepted)
    press = parse_quantity(settings.press, "force")
    text = templates("elastocal.cell").get_template("new.yaml").render(
        name=_quoted(out.stem if out.stem.isidentifier() else "cell"),
        urdf=_quoted(path_from(out.parent, str(settings.robot))) if settings.is_urdf else "",
        robot=_quoted(robot.name),
        flange=_quoted(settings.flange),
        masses=_masses(robot),
        tcp=_frame(str(settings.tcp), "--tcp"),
        tool_mass=_quoted(settings.tool_mass),
        tool_centre=_listed(str(settings.tool_centre)),
        shape=_shape(settings.tip, 2.0 * settings.disk_radius),
        force_range="" if settings.force_range == NONE else _listed(str(settings.force_range)),
        moment_range=_listed(str(settings.moment_range)),
        tracker="" if settings.tracker == NONE else _listed(str(settings.tracker)),
        marker=_listed(str(settings.marker_place)),
        mesh=_quoted(path_from(out.parent, str(settings.mesh))),
        unit=settings.unit,
        place=_frame(str(settings.place), "--place"),
        low=_listed(", ".join(f"{x:.4g} {settings.unit}" for x in low)),
        high=_listed(", ".join(f"{x:.4g} {settings.unit}" for x in high)),
        flip=flip,
        floor=quantity(min(0.0, settings.lowest) - 0.1, "mm", ".0f"),
        side=_quoted(f"{_two_digits(press / 3.0)} N"),
        press=_quoted(settings.press),
        contact=_quoted(f"{_two_digits(min(60.0, max(10.0, 0.2 * press)))} N"),
        ramp=_quoted(f"{_two_digits(min(400.0, max(20.0, 0.4 * press)))} N/s"),
        disk=_quoted(f"{settings.disk_radius:g} mm"),
        payload=_quoted(f"{2.0 * parse_quantity(settings.tool_mass, 'mass'):g} kg"),
        torques=", ".join(f'{_quoted(name)}: "{value:g} N*m"' for name, value in torques),
        home=_home_entry(settings, home),
        speed=_speed_entry(settings),
        rail=_rail(settings.travel),
        poses=settings.poses,
        process="" if process == NONE else _quoted(path_from(out.parent, process)),
        tolerance="" if tolerance == NONE else _quoted(tolerance),
    )  # fmt: skip
    return _REMARK.sub(lambda found: f"{found[1]:<{_COLUMN - 3}}   {found[2]}", text)


def _home_entry(settings: NewSettings, home: FloatArray) -> str:
    """Return the joints of HOME, a rail first."""
    rails, names = len(settings.rail_home), settings.arm.joint_names
    shown = [("rail", quantity(q, "mm", ".0f")) for q in home[:rails]]
    arm = zip(names, home[rails:], strict=True)
    return _named(shown + [(name, quantity(q, "deg", ".1f")) for name, q in arm])


def _speed_entry(settings: NewSettings) -> str:
    """Return assumed speeds of the rail, and of joints of which none are known."""
    robot = settings.arm
    known = bool(np.isfinite(robot.limits.velocity).all())
    arm = [] if known else [(name, "90 deg/s") for name in robot.joint_names]
    return _named([("rail", "0.5 m/s") for _ in settings.rail_home] + arm)


def _named(texts: Sequence[tuple[str, str]]) -> str:
    return ", ".join(f'{_quoted(name)}: "{text}"' for name, text in texts)


def _rail(travel: tuple[str, str, str] | None) -> str:
    """Return the entry of a rail; empty without one."""
    if travel is None:
        return ""
    axis, low, high = travel
    return f"{{axis: {[int(each == axis) for each in 'xyz']}, travel: {_listed(f'{low}, {high}')}}}"


def _masses(robot: Robot) -> str:
    """Return where the masses of an arm of one's own come from, for a remark in the file."""
    if gap := robot.chain.weight_gap:
        return (
            f"{gap} (<inertial>), so torques of the arm's own weight are wrong or left out; the"
            " maker's data sheet, or `elastocal robots NAME` of a like arm, has some"
        )
    moved = sum(joint.mass for joint in robot.chain.joints)
    return f"its moved links weigh {moved:.4g} kg together, by <inertial> of the URDF: not checked"


def _shape(tip: FloatArray, radius: float) -> str:
    """Return a solid for the tool: a rod towards the tip, or a ball if that is at the flange.

    Parameters
    ----------
    tip : ndarray, shape (3,)
        In the flange, in m.
    radius : float
        In mm.
    """
    length = in_unit(float(np.linalg.norm(tip)), "mm")
    if length < 1.0:
        return f'{{name: tool, sphere: {{radius: "{radius:.0f} mm"}}}}'
    middle = ", ".join(f'"{420.0 * x:.0f} mm"' for x in tip)
    rod = f'{{radius: "{radius:.0f} mm", length: "{0.8 * length:.0f} mm"}}'
    aside = math.hypot(tip[0], tip[1])
    a = in_unit(math.atan2(tip[1], tip[0]) if aside > 1e-6 else 0.0, "deg")
    b = in_unit(math.atan2(aside, tip[2]), "deg")
    turn = "" if b < 0.5 else f', abc: ["{a:.1f} deg", "{b:.1f} deg", "0 deg"]'
    return f"{{name: tool, cylinder: {rod}, pose: {{xyz: [{middle}]{turn}}}}}"


def _two_digits(value: float) -> str:
    """Return a number with two significant digits and no exponent.

    >>> _two_digits(333.3), _two_digits(16.7), _two_digits(8.333), _two_digits(1e5 / 3)
    ('330', '17', '8.3', '33000')
    """
    return f"{float(f'{value:.2g}'):.12g}"


def _quoted(text: object) -> str:
    """Return a text as YAML; what is JSON is YAML."""
    return json.dumps(str(text), ensure_ascii=False)


def _listed(text: str) -> str:
    return f"[{', '.join(_quoted(part.strip()) for part in text.split(','))}]"


def _frame(text: str, name: str) -> str:
    parse_frame(text, name)
    parts = [part.strip() for part in text.split(",")]
    return f"{{xyz: {_listed(','.join(parts[:3]))}, abc: {_listed(','.join(parts[3:]))}}}"
