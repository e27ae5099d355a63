"""What moves in the interactive view: the robot, and the line of sight to its marker."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import plotly.graph_objects as go

from elastocal.arrays import FloatArray, IndexArray
from elastocal.cell import Cell
from elastocal.planning import PlanResult
from elastocal.planning.surface import Surface
from elastocal.report import style
from elastocal.report.camera import light
from elastocal.report.coarse import MOST_OF_LINK, coarse
from elastocal.report.layers import Layer, segments
from elastocal.report.solid_traces import single, solid_trace, tones
from elastocal.report.solids import Solid, robot_solids

_COLOURS = (style.ARM, style.TOOL)


@dataclass(frozen=True, eq=False)
class MovingParts:
    """The robot at HOME and at every pose, with the lines of sight."""

    robot: tuple[Solid, ...]
    """HOME first."""
    on_tool: IndexArray
    """Which part each face of the robot belongs to, shape (face,): 0 the arm, 1 the tool."""
    light: FloatArray
    """Unit vector towards the light, shape (3,)."""
    sight: tuple[FloatArray, ...]
    """From marker to station and a gap, each of shape (3, 3); NaN where no station sees. Empty in
    a cell without stations."""
    note: str = ""
    """What is to be said of how the robot is drawn."""

    def layers(self, shown: int) -> tuple[Layer, ...]:
        """Return the layers at one posture (0: HOME)."""
        robot = solid_trace(self.robot[shown], self.light, "robot", _COLOURS, self.on_tool)
        layers = [Layer("Robot and tool", style.ARM, (robot,), note=self.note)]
        if self.sight:
            x, y, z = single(self.sight[shown])
            line = go.Scatter3d(
                x=x, y=y, z=z, mode="lines+markers", name="line of sight", hoverinfo="skip",
                line={"color": style.SIGHT, "width": 5}, marker={"color": style.SIGHT, "size": 4},
            )  # fmt: skip
            layers.append(Layer("Line of sight to the marker", style.SIGHT, (line,)))
        return tuple(layers)

    def frames(self) -> list[Any]:
        """Return a Plotly frame for every posture: what changes of the first traces."""
        return [self._frame(number) for number in range(len(self.robot))]

    def _frame(self, number: int) -> Any:
        x, y, z = single(self.robot[number].vertices)
        shade = tones(self.robot[number], self.light, self.on_tool, len(_COLOURS))
        data = [{"type": "mesh3d", "x": x, "y": y, "z": z, "intensity": shade}]
        if self.sight:
            x, y, z = single(self.sight[number])
            data.append({"type": "scatter3d", "x": x, "y": y, "z": z})
        return go.Frame(name=str(number), data=data, traces=list(range(len(data))))


def moving_parts(cell: Cell, surface: Surface, plan: PlanResult) -> MovingParts:
    """Return the robot at HOME and in contact at every pose of a plan."""
    q = np.array([plan.robot.home, *(pose.joints for pose in plan.poses)])
    whole = robot_solids(cell, surface)
    drawn = [coarse(part, MOST_OF_LINK) for part in whole.parts]
    solids = replace(whole, parts=tuple(part.solid for part in drawn))
    finer = any(part.note("A part") for part in drawn)
    note = "Parts of the robot with fine meshes are drawn coarser." if finer else ""
    seen = [None, *(pose.seen_by for pose in plan.poses)]
    sight: tuple[FloatArray, ...] = ()
    if any(seen):
        tcp = cell.robot.forward(q)
        sight = tuple(_sight(cell, T, name) for T, name in zip(tcp, seen, strict=True))
    part = solids.on_tool.astype(np.intp)
    return MovingParts(tuple(solids.at(q)), part, light(cell, surface), sight, note)


def _sight(cell: Cell, T_base_tcp: FloatArray, name: str | None) -> FloatArray:
    marker = cell.file.marker
    stations = {station.name: station.position_base for station in cell.file.trackers}
    if marker is None or name is None or name not in stations:
        return np.full((3, 3), np.nan)
    start = T_base_tcp[:3, :3] @ marker.position_tcp + T_base_tcp[:3, 3]
    return segments([(start, stations[name])])
