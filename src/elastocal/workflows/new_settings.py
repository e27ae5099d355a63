"""Settings of a new cell, and guesses of the rest from robot and mesh."""

import contextlib
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from os import PathLike
from pathlib import Path
from typing import Annotated

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import process_forces
from elastocal.errors import FileAccessError, RobotError, SchemaError, UnitError
from elastocal.meshes import load_triangles
from elastocal.options import Option
from elastocal.planning.surface import arm_reach
from elastocal.robot import Robot, catalogue, read_urdf, refusals_naming, tool_link, with_tool
from elastocal.units import in_unit, parse_point, parse_quantity
from elastocal.workflows._inputs import ROBOT_SUFFIXES, parse_frame

NONE = "none"
"""Value that leaves out sensor, tracker, process or tolerance."""
_LIKELY_SIZES = (1.0 / 200.0, 100.0)
"""Least and largest extent of a mesh, in reaches of the arm."""
_MOST_METRES = 25.0
"""Largest extent that a mesh is taken for metres up to; beyond, for millimetres."""
_INCH_SIZES = (0.1, 3.0)
"""Extents in reaches of the arm outside which neither mm nor m are likely, and inches are tried."""
_SIZES = ((1.4, 100.0, 3.0, 15.0), (2.2, 300.0, 10.0, 15.0), (math.inf, 1000.0, 40.0, 20.0))
"""Press in N, mass of the tool in kg and radius of the contact in mm of arms up to a reach in m."""
_ROUND = (1.0, 2.0, 3.0, 5.0, 8.0)
"""First digits of a press that is guessed."""
_AXES = "xyz"
_GRAVITY = 9.81
_ABOVE_PROCESS, _ASIDE = 1.05, 3.0
"""A press by what that of the process is, and by the part of it that is pressed aside."""


@dataclass(frozen=True)
class NewSettings:
    """Settings of a new cell; quantities are texts with their units, and None is guessed.

    `filled` states the guesses.
    """

    out: Annotated[str | PathLike[str], Option(metavar="CELL.yaml", ends=(".yaml", ".yml"))] = (
        "cell.yaml"
    )
    """Cell file to write."""
    robot: Annotated[str | None, Option(choices="robot")] = None
    """Name in the catalogue, or a URDF file."""
    mesh: str | PathLike[str] | None = None
    """Surface that the tool presses on: STL, OBJ or PLY."""
    flange: str | None = None
    """Link that carries the tool, its z axis out of the arm."""
    rail: str | None = None
    """Linear axis that carries the robot, its direction in base and both ends of its travel,
    ``"y, -1.5 m, 1.5 m"``, or ``none``."""
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
    process: str | PathLike[str] | None = None
    """Production path (.csv) that poses and presses are chosen for, or ``none``."""
    press: str | None = None
    """Largest force onto the surface; a third of it is pressed aside."""
    force_range: str | None = None
    """Largest forces of the sensor along its axes, ``"fx, fy, fz"``, or ``none``: no sensor."""
    moment_range: str | None = None
    """Range of its moments."""
    tracker: str | None = None
    """Place of the tracker in base, ``"x, y, z"``, or ``none``: no tracker."""
    marker_place: Annotated[str | None, Option("--marker")] = None
    """Marker in the tcp frame, ``"x, y, z"``."""
    accepted: Annotated[str | None, Option("--tolerance")] = None
    """Largest error of a predicted deflection that the report lets pass, or ``none``."""
    poses: Annotated[int, Option(least=1, most=100_000)] = 15
    """Number of poses."""
    force: bool = False
    """Replace a file that is there."""

    def require_free(self) -> None:
        """Require that a file can be written there, where no folder need be yet.

        Raises
        ------
        FileAccessError
            If the file is there and may not be replaced, or its folder cannot be made.
        """
        out = Path(self.out)
        if out.exists() and not self.force:
            raise FileAccessError(f"{out} is there already: give --force to replace it")
        with self.in_its_folder():
            pass

    @contextlib.contextmanager
    def in_its_folder(self) -> Iterator[None]:
        """Make the folder of the cell file; what was made goes where no file comes into it.

        Raises
        ------
        FileAccessError
            If the folder cannot be made.
        """
        folder = Path(self.out).parent
        made = [each for each in (folder, *folder.parents) if not each.exists()]
        try:
            try:
                folder.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                reason = error.strerror or error
                raise FileAccessError(f"cannot write {self.out}: {reason}") from error
            yield
        finally:
            for each in made:
                if each.is_dir() and not any(each.iterdir()):
                    each.rmdir()

    def filled(self) -> "NewSettings":
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
        if self.robot is None:
            raise RobotError("--robot is missing: a name of `elastocal robots`, or a URDF file")
        arm = replace(self, flange=self.flange or self._tool_link())
        if self.mesh is None:
            raise SchemaError("--mesh is missing: the surface that the tool presses on (.stl)")
        done = replace(
            arm,
            unit=self.unit or arm._likely_unit(),
            tcp=self.tcp or "0 mm, 0 mm, 200 mm, 0 deg, 0 deg, 0 deg",
            tool_mass=self.tool_mass or f"{arm._size[2]:g} kg",
            marker_place=self.marker_place or "70 mm, 0 mm, -110 mm",
            rail=self.rail or NONE,
            process=self.process or NONE,
            accepted=self.accepted or NONE,
        )
        done = replace(
            done,
            place=self.place or done.place_before(0.55, 0.15),
            press=self.press or f"{done._likely_press():g} N",
        )
        return done._with_devices()

    def _with_devices(self) -> "NewSettings":
        """Return settings with the sensor's ranges, twice its largest load, and the tracker."""
        centre = self.tool_centre or ", ".join(_rounded(500.0 * x, "mm", 0) for x in self.tip)
        force, weight = parse_quantity(self.press, "force"), _GRAVITY * self._mass
        lever = float(np.linalg.norm(self.tip)) + 0.1
        moment = force * lever + weight * float(np.linalg.norm(parse_point(centre)))
        x, _, z = parse_frame(str(self.place), "--place")[:3, 3]
        aside = -max(2.0, 1.2 * self.reach)
        return replace(
            self,
            tool_centre=centre,
            force_range=self.force_range or _thrice(_rounded_up(2.0 * (force + weight)), "N"),
            moment_range=self.moment_range or _thrice(_rounded_up(2.0 * moment), "N*m"),
            tracker=self.tracker
            or ", ".join(_rounded(each, "m", 1) for each in (x, aside, z + 1.0)),
        )

    def offered(self, name: str) -> str:
        """Return the value guessed for a field of settings with robot and mesh."""
        if name == "flange":
            return self.flange or self._tool_link()
        if name == "rail":  # asked for before there is a mesh
            return NONE
        return str(getattr(self.filled(), name))

    def require_answer(self, name: str, text: str) -> None:
        """Refuse an answer to a question of the wizard that is no value of its field.

        Raises
        ------
        ElastocalError
            Which says what is allowed.
        """
        if not text:
            raise SchemaError("nothing is offered here: an answer is needed")
        if text == NONE and name in ("force_range", "tracker", "process", "accepted", "rail"):
            return
        if name in ("robot", "flange"):
            _ = replace(self, **{name: text}).arm  # type: ignore[arg-type]
        elif name in ("mesh", "process"):
            load_triangles(Path(text)) if name == "mesh" else _require_file(Path(text))
        elif name == "rail":
            _ = replace(self, rail=text).travel
        elif name in ("place", "tcp"):
            parse_frame(text, name)
        elif name in ("tool_centre", "marker_place", "tracker"):
            parse_point(text)
        elif name in ("force_range", "moment_range"):
            _require_three(text, "force" if name == "force_range" else "moment")
        elif name == "unit":
            parse_quantity(f"1 {text}", "length")
            self._require_size()
        else:
            parse_quantity(text, {"tool_mass": "mass", "press": "force"}.get(name, "length"))

    @property
    def is_urdf(self) -> bool:
        """Whether the robot is a file."""
        return Path(str(self.robot)).suffix.lower() in ROBOT_SUFFIXES

    @cached_property
    def arm(self) -> Robot:
        """The robot up to its flange."""
        flange = self.flange or self._tool_link()
        if not self.is_urdf:
            return catalogue.load(str(self.robot), flange)
        with refusals_naming(Path(str(self.robot))):
            return Robot.from_urdf(read_urdf(Path(str(self.robot))), flange)

    @property
    def travel(self) -> tuple[str, str, str] | None:
        """Direction of the rail, and the ends of its travel as they were given; None without one.

        Raises
        ------
        UnitError
            If it is no direction with two lengths, the first the smaller.
        """
        if self.rail in (None, NONE):
            return None
        parts = [part.strip() for part in str(self.rail).split(",")]
        if len(parts) != 3 or parts[0].lower() not in _AXES:
            raise UnitError(
                f"--rail {self.rail!r}: must be x, y or z of base and both ends of the travel, e.g."
                " 'y, -1.5 m, 1.5 m', or none"
            )
        low, high = (parse_quantity(part, "length") for part in parts[1:])
        if not low < high:
            raise UnitError(
                f"--rail {self.rail!r}: the first end of the travel must be the smaller"
            )
        return parts[0].lower(), parts[1], parts[2]

    @property
    def rail_home(self) -> tuple[float, ...]:
        """Place of the robot on its rail from which the cell begins, in m; empty without a rail."""
        if self.travel is None:
            return ()
        low, high = (parse_quantity(end, "length") for end in self.travel[1:])
        return (min(max(0.0, low), high),)

    @cached_property
    def reach(self) -> float:
        """Reach of the arm, in m."""
        return arm_reach(self.arm)

    @cached_property
    def bounds(self) -> FloatArray:
        """Lowest and highest corner of the box about the mesh, shape (2, 3), in its numbers."""
        return np.array(load_triangles(Path(str(self.mesh))).bounds, dtype=float)

    @property
    def tip(self) -> FloatArray:
        """Tool tip in the flange, shape (3,), in m."""
        return np.asarray(parse_frame(str(self.tcp), "--tcp")[:3, 3])

    @property
    def disk_radius(self) -> float:
        """Radius of the contact in mm."""
        return self._size[3]

    @property
    def lowest(self) -> float:
        """Height of the lowest corner of the box about the mesh, in base in m."""
        T = parse_frame(str(self.place), "--place")
        corners = np.array(list(product(*(self.bounds * self._metres).T)))
        return float((corners @ T[2, :3] + T[2, 3]).min())

    @property
    def extent(self) -> str:
        """Size of the mesh in words."""
        size = in_unit(self._metres * np.ptp(self.bounds, axis=0), "mm")
        return (
            f"{size[0]:.4g} x {size[1]:.4g} x {size[2]:.4g} mm, its numbers taken for {self.unit}"
        )

    def _require_size(self) -> None:
        """Refuse a unit in which no arm of this reach works on the mesh.

        Raises
        ------
        SchemaError
            With the size that the mesh would have.
        """
        low, high = (each * self.reach for each in _LIKELY_SIZES)
        if not low <= self._metres * float(np.ptp(self.bounds, axis=0).max()) <= high:
            raise SchemaError(f"the surface would be {self.extent}: another unit is meant")

    def place_before(self, ahead: float, above: float) -> str:
        """Return a frame of the mesh: its middle ahead of the base, its lowest point at a height.

        Parameters
        ----------
        ahead, above : float
            In reaches of the arm.
        """
        low, high = self.bounds * self._metres
        x, y = ahead * self.reach - 0.5 * (low[0] + high[0]), -0.5 * (low[1] + high[1])
        x, y, z = np.round([x, y, above * self.reach - low[2]], 2) + 0.0
        return f"{x:.2f} m, {y:.2f} m, {z:.2f} m, 0 deg, 0 deg, 0 deg"

    @property
    def _tool(self) -> Robot:
        """The robot up to the tool tip."""
        T_flange_tip = parse_frame(str(self.tcp), "--tcp")
        return Robot.from_urdf(with_tool(self.arm.urdf, self.arm.tip, "tcp", T_flange_tip), "tcp")

    @property
    def _mass(self) -> float:
        return parse_quantity(self.tool_mass, "mass")

    @property
    def _metres(self) -> float:
        return parse_quantity(f"1 {self.unit}", "length")

    @property
    def _size(self) -> tuple[float, float, float, float]:
        return next(each for each in _SIZES if self.reach <= each[0])

    def _tool_link(self) -> str:
        if not self.is_urdf:
            catalogue.entry(str(self.robot))
            return "flange"
        with refusals_naming(Path(str(self.robot))):
            return tool_link(read_urdf(Path(str(self.robot))))

    def _likely_unit(self) -> str:
        """Return m or mm by the extent, or inches if the arm could not work on either."""
        extent, (low, high) = float(np.ptp(self.bounds, axis=0).max()), _INCH_SIZES
        shares = {"m": extent / self.reach, "mm": 1e-3 * extent / self.reach}
        inches = 25.4 * shares["mm"]
        if shares["m"] > high and shares["mm"] < low and low <= inches <= high:
            return "in"
        return "m" if extent <= _MOST_METRES else "mm"

    def _likely_press(self) -> float:
        """Return the press of the process; or one that suits the arm's reach and its torques.

        Torques count as far as they are known. A joint is asked to bear it across all that is
        behind the joint; the first is not, as its axis is upright, and a wrist may turn away.
        """
        if self.process not in (None, NONE):
            x, y, z = process_forces(Path(str(self.process)), self._tool).T
            return _rounded_up(_ABOVE_PROCESS * max(1.0, *-z, *(_ASIDE * np.hypot(x, y))))
        joints = self.arm.chain.joints[self.arm.external_axes :]
        behind = [float(np.linalg.norm(each.placement[:3, 3])) for each in joints[1:]]
        behind.append(float(np.linalg.norm(self.arm.chain.T_last_tip[:3, 3] + self.tip)))
        levers = np.array([sum(behind[i:]) for i in range(len(joints))])
        bends = slice(1, max(2, len(joints) - 3))  # shoulder and elbow
        effort = np.array([each.effort for each in joints])
        possible = effort[bends] / levers[bends]
        most = min([self._size[1], *possible[np.isfinite(possible)]])
        power = 10.0 ** math.floor(math.log10(most))
        return max(step for step in _ROUND if step * power <= most * (1.0 + 1e-9)) * power


def _require_file(path: Path) -> None:
    if not path.is_file():
        raise FileAccessError(f"cannot read {path}: there is no such file")


def _require_three(text: str, dimension: str) -> None:
    parts = text.split(",")
    if len(parts) != 3:
        raise UnitError(f"{text!r} must be three quantities, e.g. '200 N, 200 N, 400 N'")
    for part in parts:
        parse_quantity(part.strip(), dimension)


def _rounded_up(value: float) -> float:
    """Return a value rounded up to its second digit."""
    step = 10.0 ** (math.floor(math.log10(value)) - 1)
    return math.ceil(value / step - 1e-9) * step


def _rounded(value: float, unit: str, digits: int) -> str:
    """Return a rounded quantity, never a negative zero.

    >>> _rounded(-0.01, "m", 1), _rounded(-1.26, "m", 1), _rounded(-0.2, "mm", 0)
    ('0.0 m', '-1.3 m', '0 mm')
    """
    return f"{round(value, digits) + 0.0:.{digits}f} {unit}"


def _thrice(value: float, unit: str) -> str:
    return ", ".join([f"{value:g} {unit}"] * 3)
