"""Mistakes in tables of static postures, and what `tool` says of them.

Harm is the largest error of the weight and bias taken off at postures that the table does not hold:
of the force over the tool's weight, of the moment over the weight times the distance of its centre.
"""

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

import elastocal as ec
from elastocal.compensation.conditioning import StaticPostures, ToolResult, fit_tool
from elastocal.compensation.conditioning.tool_fit import ToolFit
from elastocal.errors import ElastocalError
from support.mistake_table import Outcome, judged
from support.static_postures import GRAVITY, PlantedTool, posture_table, turned

_POUND, _KILOPOND = 4.4482216, 9.80665


@dataclass(frozen=True)
class Table:
    """A sound table: so many postures, turned by about an angle (rad), of a tool in kg."""

    postures: int = 12
    mass: float = 40.0
    angle: float = 1.0
    seed: int = 0
    cross_talk: float = 0.0

    @property
    def title(self) -> str:
        """Return what it is called in the table of mistakes."""
        return f"{self.postures} postures, {self.mass:g} kg"

    @property
    def tool(self) -> PlantedTool:
        return PlantedTool(mass=self.mass)

    def made(self) -> StaticPostures:
        rng = np.random.default_rng(self.seed)
        matrix = PlantedTool.cross_talk(self.cross_talk, rng)
        return replace(self.tool, matrix=matrix).raw(turned(self.postures, rng, self.angle), rng)


Change = Callable[[StaticPostures], StaticPostures]


@dataclass(frozen=True)
class ToolMistake:
    """A mistake in a table, and patterns of the messages that name it rightly."""

    name: str
    named: tuple[str, ...]
    make: Change


def _scaled(force: object = 1.0, moment: object = 1.0) -> Change:
    return lambda p: p.read_as(p.force * np.array(force), p.moment * np.array(moment))


def _columns(force: list[int], moment: list[int] | None = None) -> Change:
    return lambda p: p.read_as(p.force[:, force], p.moment[:, moment or [0, 1, 2]])


def _turned_by(axis: str, degrees: float) -> Change:
    R = Rotation.from_euler(axis, degrees, degrees=True).as_matrix()
    return lambda p: p.read_as(p.force @ R, p.moment @ R)


def _orientations(change: Callable[[np.ndarray], np.ndarray]) -> Change:
    return lambda p: p.read_as(R_base_flange=change(p.R_base_flange))


def _rows(change: Callable[[int], np.ndarray], scale: float = 1.0) -> Change:
    """Return the change of forces by rows: a wrench of shape (posture, 6) is added."""

    def made(p: StaticPostures) -> StaticPostures:
        more = scale * change(len(p))
        return p.read_as(p.force + more[:, :3], p.moment + more[:, 3:])

    return made


def _at(row: int, wrench: list[float]) -> Change:
    return _rows(lambda n: np.outer(np.arange(n) == row, wrench))


def _other_tool(p: StaticPostures) -> StaticPostures:
    half = np.where(np.arange(len(p)) >= len(p) // 2, 0.5, 1.0)[:, None]
    bias = PlantedTool()
    force, moment = p.force - bias.force_bias, p.moment - bias.moment_bias
    return p.read_as(bias.force_bias + half * force, bias.moment_bias + half * moment)


def _base_tilted(degrees: float) -> Change:
    tilt = Rotation.from_euler("x", degrees, degrees=True).as_matrix()
    return _orientations(lambda R: tilt @ R)


def _angles_meant_as(order: str) -> Change:
    def change(R: np.ndarray) -> np.ndarray:
        return Rotation.from_euler("ZYX", Rotation.from_matrix(R).as_euler(order)).as_matrix()

    return _orientations(change)


_SHIFTED = np.array([0, 0, -60.0, 4.0, 0, 0])
_SENSOR, _GRAVITY = "sensor is not turned as stated", "gravity comes out"
_SIGN = "the sign of the wrenches is turned"
_DEAD, _TURNED, _GAIN = "channel dead", "sign turned", "gain or unit another"

TOOL_MISTAKES = (
    ToolMistake("forces in kgf", ("are the forces in kgf",), _scaled(1 / _KILOPOND)),
    ToolMistake("forces in lbf", ("are the forces in lbf",), _scaled(1 / _POUND)),
    ToolMistake(
        "forces and moments in kgf, kgf m",
        ("are the forces in kgf",),
        _scaled(1 / _KILOPOND, 1 / _KILOPOND),
    ),
    ToolMistake("forces in kN", ("forces or moments in another unit",), _scaled(1e-3)),
    ToolMistake("moments in N mm", ("forces or moments in another unit",), _scaled(1.0, 1e3)),
    ToolMistake("force_x dead", (f"force_x .*{_DEAD}",), _scaled([0, 1, 1])),
    ToolMistake("force_z dead", (f"force_z .*{_DEAD}",), _scaled([1, 1, 0])),
    ToolMistake("force_y frozen with noise", (f"force_y .*{_DEAD}",), _scaled([1, 1e-3, 1])),
    ToolMistake("force_x reversed", (f"force_x .*{_TURNED}",), _scaled([-1, 1, 1])),
    ToolMistake("force_z reversed", (f"force_z .*{_TURNED}",), _scaled([1, 1, -1])),
    ToolMistake("all reversed", (_SIGN,), _scaled(-1.0, -1.0)),
    ToolMistake(
        "force x, y exchanged", ("force_x and force_y are exchanged",), _columns([1, 0, 2])
    ),
    ToolMistake(
        "force y, z exchanged", ("force_y and force_z are exchanged",), _columns([0, 2, 1])
    ),
    ToolMistake("force_x 1.4 of its size", (f"force_x .*{_GAIN}",), _scaled([1.4, 1, 1])),
    ToolMistake("force_z 0.7 of its size", (f"force_z .*{_GAIN}",), _scaled([1, 1, 0.7])),
    ToolMistake("all forces 1.3 of their size", ("another unit or gain",), _scaled(1.3)),
    ToolMistake("moment_y dead", (f"moment_y .*{_DEAD}",), _scaled(1.0, [1, 0, 1])),
    ToolMistake("moment_x reversed", (f"moment_x .*{_TURNED}",), _scaled(1.0, [-1, 1, 1])),
    ToolMistake("sensor turned by 90 deg", (f"{_SENSOR}.*90.. deg",), _turned_by("z", 90.0)),
    ToolMistake("sensor turned by 10 deg", (f"{_SENSOR}.*10.. deg",), _turned_by("z", 10.0)),
    ToolMistake("sensor upside down", (f"{_SENSOR}.*1(79|80).. deg",), _turned_by("x", 180.0)),
    ToolMistake("contact in one posture", ("posture 4",), _at(3, [30, 0, -120, 0, 9, 0])),
    ToolMistake(
        "contact in every third posture",
        ("was it touched",),
        _rows(lambda n: np.outer(np.arange(n) % 3 == 0, [30, 0, -120, 0, 9, 0])),
    ),
    ToolMistake(
        "zero pressed half way",
        ("was the sensor zeroed",),
        _rows(lambda n: np.outer(np.arange(n) >= n // 2, _SHIFTED)),
    ),
    ToolMistake(
        "bias drifts by 60 N",
        ("the bias drifts",),
        _rows(lambda n: np.outer(np.arange(n) / n, _SHIFTED)),
    ),
    ToolMistake("half the weight from half way on", ("was it changed",), _other_tool),
    ToolMistake("base tilted by 10 deg", (f"{_GRAVITY} 10 deg",), _base_tilted(10.0)),
    ToolMistake("base on the wall", (f"{_GRAVITY} 90 deg",), _base_tilted(90.0)),
    ToolMistake("base upside down", (f"{_SIGN}.*or gravity",), _base_tilted(180.0)),
    ToolMistake(
        "orientations inverted", ("invert them",), _orientations(lambda R: R.transpose(0, 2, 1))
    ),
    ToolMistake("angles about x, y, z", ("turned X, turned Y, turned Z",), _angles_meant_as("XYZ")),
    ToolMistake(
        "orientations of the row before",
        ("orientations of the row after",),
        _orientations(lambda R: np.roll(R, 1, axis=0)),
    ),
    ToolMistake(
        "postures all alike",
        ("turn the tool about two axes",),
        lambda p: replace(
            p,
            R_base_flange=np.repeat(p.R_base_flange[:1], len(p), axis=0),
            force=p.force[:1] + 0.5 * np.random.default_rng(5).normal(size=p.force.shape),
            moment=p.moment[:1] + 0.05 * np.random.default_rng(6).normal(size=p.moment.shape),
        ),
    ),
)


def tool_outcome(table: Table, mistake: ToolMistake) -> Outcome:
    """Return what `tool` says of a table in which a mistake is made, and its harm."""
    refused, said, harm = _say(table, mistake.make(table.made()))
    before = {each[:24] for each in _say(table, table.made())[1]}
    news = tuple(text for text in said if refused or text[:24] not in before)
    return judged(mistake.name, mistake.named, harm, refused, news)


def tool_alarms(table: Table) -> tuple[str, ...]:
    """Return what `tool` says of a sound table."""
    return _say(table, table.made())[1]


_NO_ALARMS = ("intervals widened by", "their intervals reach")
"""Notes on figures that are less certain than they seem: no mistake is said to be made."""


def _say(table: Table, postures: StaticPostures) -> tuple[bool, tuple[str, ...], float]:
    with tempfile.TemporaryDirectory() as folder:
        path = posture_table(Path(folder) / "postures.csv", postures)
        a, b, c = Rotation.from_matrix(table.tool.R_flange_sensor).as_euler("ZYX", degrees=True)
        try:
            sensor = f"0 mm, 0 mm, 0 mm, {a} deg, {b} deg, {c} deg"
            found = ec.tool(path, sensor=sensor, mass=f"{table.mass} kg")
        except ElastocalError as error:
            fit = fit_tool(postures, table.tool.R_flange_sensor)
            return True, (str(error),), _harm(table, fit)
    unknown = (f"undetermined: {', '.join(found.undetermined)}",) if found.undetermined else ()
    aside = (f"posture {each.posture} is set aside" for each in found.set_aside)
    notes = (text for text in found.notes if not any(part in text for part in _NO_ALARMS))
    return False, (*notes, *unknown, *aside), _harm(table, found)


def _harm(table: Table, found: ToolFit | ToolResult) -> float:
    truth, R = table.tool, turned(100, np.random.default_rng(77))

    def taken_off(tool: PlantedTool | ToolFit | ToolResult) -> tuple[np.ndarray, np.ndarray]:
        weight = GRAVITY @ R @ np.array(tool.R_flange_sensor) * tool.mass
        moment = np.cross(np.array(tool.centre), weight)
        return weight + tool.force_bias, moment + tool.moment_bias

    off = (a - b for a, b in zip(taken_off(truth), taken_off(found), strict=True))
    force, moment = (float(np.linalg.norm(part, axis=1).max()) for part in off)
    weight = 9.80665 * truth.mass
    return max(force / weight, moment / (weight * float(np.linalg.norm(truth.centre))))
