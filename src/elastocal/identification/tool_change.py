"""Another tool than the one calibrated with: the same springs, seen from another tcp.

The springs belong to the arm, so that a longer cutter changes no compliance; it changes the lever
arms of the force, and where the deflection is looked at.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from elastocal.elastic import ElasticModel
from elastocal.errors import RobotError
from elastocal.records import record
from elastocal.robot import (
    Robot,
    T_from_xyzabc,
    parse_urdf,
    with_tool,
    without_tool_mass,
    xyzabc_from_T,
)

_LINK = "tool_tcp"
"""Name of the link at another tool's tcp; with a number where it is taken."""


@record()
class ToolChange:
    """The tool that a model is for, where it is another one than it was calibrated with."""

    calibrated_tcp: str
    """Link at the tool centre point that the model was calibrated with."""
    pose: tuple[float, float, float, float, float, float]
    """New tcp in that link's frame: x, y, z in m, a, b, c in rad (Z-Y'-X'')."""
    mass: float | None = None
    """Mass of the tool in kg; none: that of the calibrated tool."""
    centre: tuple[float, float, float] | None = None
    """Centre of that mass in the new tcp's frame, in m."""

    @property
    def sentence(self) -> str:
        """The tool in words."""
        lengths = ", ".join(f"{1e3 * value:.6g} mm" for value in self.pose[:3])
        angles = ", ".join(f"{np.degrees(value):.6g} deg" for value in self.pose[3:])
        mass = "" if self.mass is None else f", {self.mass:g} kg"
        return (
            f"another tool than calibrated with: tcp at {lengths}, {angles} in"
            f" {self.calibrated_tcp}{mass}"
        )


def change_tool(
    model: ElasticModel,
    before: ToolChange | None,
    T_tcp_tool: ArrayLike,
    mass: float | None = None,
    centre: ArrayLike | None = None,
) -> tuple[ElasticModel, ToolChange]:
    """Return the model at another tool's tcp, and what was changed.

    Parameters
    ----------
    model : ElasticModel
        Robot and springs.
    before : ToolChange or None
        What was changed already since the calibration.
    T_tcp_tool : array_like, shape (4, 4)
        New tcp in the model's tcp frame.
    mass : float, optional
        Mass of the new tool in kg, in place of what the tcp's link has.
    centre : array_like, shape (3,), optional
        Centre of that mass in the new tcp's frame, in m.

    Raises
    ------
    RobotError
        If the transform is not rigid, or mass and centre do not come together.
    """
    if (mass is None) != (centre is None):
        raise RobotError("a tool has both a mass and a centre of mass, or neither")
    robot = model.robot
    urdf = robot.urdf if mass is None else without_tool_mass(robot.urdf, robot.tip)
    link = _new_link(urdf)
    weight = () if mass is None or centre is None else (mass, centre)
    urdf = with_tool(urdf, robot.tip, link, T_tcp_tool, *weight)
    moved = Robot.from_urdf(urdf, link, robot.base, robot.meshes)
    moved = replace(moved, gravity=robot.gravity)
    T = np.asarray(T_tcp_tool, dtype=float)
    point = None if centre is None else np.asarray(centre, dtype=float)
    if before is not None:
        if mass is None and before.centre is not None:
            mass, point = before.mass, (np.linalg.inv(T) @ [*before.centre, 1.0])[:3]
        T = T_from_xyzabc(*before.pose) @ T
    x, y, z, a, b, c = xyzabc_from_T(T).tolist()
    change = ToolChange(
        robot.tip if before is None else before.calibrated_tcp,
        (x, y, z, a, b, c),
        mass,
        None if point is None else (float(point[0]), float(point[1]), float(point[2])),
    )
    return ElasticModel(moved, model.springs), change


def _new_link(urdf: str) -> str:
    """Return a name for a link that the URDF does not have."""
    taken = {element.get("name") for element in parse_urdf(urdf).iterfind("link")}
    number, link = 2, _LINK
    while link in taken:
        link, number = f"{_LINK}_{number}", number + 1
    return link
