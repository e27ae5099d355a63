"""The interactive view of a plan: a Plotly figure whose frames are the postures of the robot."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import plotly.graph_objects as go

from elastocal.cell import Cell
from elastocal.planning import PlanResult, PoolData
from elastocal.planning.surface import Surface
from elastocal.report import style
from elastocal.report.camera import Bounds, bounds_of, cameras_of
from elastocal.report.layers import Layer, still_layers, tool_path
from elastocal.report.moving import moving_parts


@dataclass(frozen=True, eq=False)
class View:
    """A figure, its layers and its camera places."""

    figure: Any
    """Plotly figure; frame 0 is HOME, frame i + 1 is pose i."""
    layers: tuple[Layer, ...]
    """Which traces of the figure go on and off together, in its order."""
    cameras: dict[str, dict[str, Any]]
    """Plotly cameras by name; the first is the initial one."""


def plan_view(cell: Cell, surface: Surface, plan: PlanResult, pool: PoolData) -> View:
    """Return the interactive view of a plan.

    Parameters
    ----------
    cell, surface, plan, pool
        Which belong together; the plan has at least one pose.
    """
    moving = moving_parts(cell, surface, plan)
    layers = (*moving.layers(1), *still_layers(cell, surface, plan, pool))
    traces = [trace.update(visible=layer.shown) for layer in layers for trace in layer.traces]
    reach = [*(robot.vertices for robot in moving.robot), tool_path(cell, plan)]
    bounds = bounds_of(cell, surface, np.concatenate(reach))
    cameras = cameras_of(cell, surface, moving.robot[1].vertices, bounds)
    layout = _layout(bounds, next(iter(cameras.values())))
    return View(go.Figure(traces, layout, moving.frames()), layers, cameras)


def _layout(bounds: Bounds, camera: dict[str, Any]) -> dict[str, Any]:
    axes = {
        f"{name}axis": {
            "title": {"text": f"{name} of base in m"}, "range": [float(low), float(high)],
            "backgroundcolor": "#f7f7f5", "gridcolor": "#dcdcdc", "showbackground": True,
            "zeroline": False, "showspikes": False, "dtick": 1.0,
        }
        for name, low, high in zip("xyz", bounds.low, bounds.high, strict=True)
    }  # fmt: skip
    # Plotly's aspect mode "data" would follow the whole floor; this is the same, of what is shown.
    scene = {"aspectmode": "manual", "aspectratio": bounds.sides, "camera": camera, **axes}
    return {
        "scene": scene,
        "margin": {"l": 0, "r": 0, "t": 0, "b": 62},
        "showlegend": False,
        "paper_bgcolor": style.PAPER,
        "font": {"family": "system-ui, sans-serif", "color": style.INK},
        "hoverlabel": {"align": "left", "bgcolor": style.PAPER, "font": {"color": style.INK}},
        "template": "none",
    }
