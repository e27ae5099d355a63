"""One HTML page that shows where two robots press on each other: a view to turn, and a table."""

from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np

from elastocal import __version__
from elastocal.arrays import FloatArray
from elastocal.errors import RobotError
from elastocal.files import write_text
from elastocal.planning import CollisionScene
from elastocal.report.language import ENGLISH, Language
from elastocal.report.pages.templating import render
from elastocal.report.plots import style
from elastocal.robot import Robot, inverse_transform
from elastocal.shapes import Body, Cylinder, Sphere
from elastocal.two_robots import PairCell, PairPlan
from elastocal.viewer import (
    Layer,
    RobotSolids,
    Strokes,
    Tags,
    arms_scene,
    packed,
    robot_solids,
    scene_data,
    triangles_of,
)
from elastocal.wording import millimetres, phrase

_ROD = 0.02
"""Radius of the rod that a tool is drawn as, in m."""


def write_pair_plan_page(
    path: Path, cell: PairCell, plan: PairPlan, language: Language = ENGLISH
) -> Path:
    """Write the interactive page of a plan of two robots, atomically; return its path.

    Parameters
    ----------
    path : Path
        An HTML file.
    cell, plan : PairCell, PairPlan
        That belong together.
    language : Language
        Language of the page's words.

    Raises
    ------
    FileAccessError
        If the page cannot be written.
    """
    bases = np.eye(4), cell.T_first_second
    arms = [
        (name, _solids(robot, entry.tcp.T, q[[0, *range(len(q))]]), T)
        for name, robot, entry, q, T in zip(
            cell.arms, cell.robots, cell.file.robots, plan.q(), bases, strict=True
        )
    ]
    points = np.array([each.point for each in plan.meetings])
    gravity = np.array(cell.robots[0].gravity)
    scene = arms_scene(arms, points, -gravity / np.linalg.norm(gravity))
    hints = tuple(
        phrase("Meeting {pose}: {place} mm", pose=each.id, place=millimetres(each.point))
        for each in plan.meetings
    )
    numbers = tuple(str(each.id) for each in plan.meetings)
    # No surface hides a meeting: every tag is drawn as one that faces the reader.
    tags = Tags(points, numbers, style.BLUE, hints, np.tile(scene.up, (len(points), 1)))
    feet = Tags(np.array([T[:3, 3] for T in bases]), plan.arms, "--ink", plan.arms)
    layers = (
        *scene.layers,
        Layer(phrase("Names of the arms"), "--ink", (feet,)),
        Layer(phrase("Meetings, in visiting order"), style.BLUE, (tags,)),
        Layer(phrase("Volume in which the tips meet"), "--region", (_volume(cell),)),
    )
    data = scene_data(replace(scene, layers=layers), language.say) | {
        "sight": packed(np.full((len(points) + 1, 2, 3), np.nan)),
        # The slider begins at the first meeting: posture 0 is that of it.
        "postures": [language.say(each) for each in (hints[0], *hints)],
    }
    page = render(
        "pair_plan.html",
        language,
        title=phrase("Plan of two robots: {cell}", cell=plan.cell),
        subtitle=phrase("Lengths in the base frame of {arm}.", arm=plan.arms[0]),
        styles=("page.css", "viewer.css"),
        scripts=("viewer.js", "postures.js", "plan.js"),
        data=data,
        plan=plan,
        notes=[
            phrase("Tools are drawn as rods from the flange to the tip."),
            *dict.fromkeys(layer.note for layer in layers if layer.note),
        ],
        version=__version__,
    )
    write_text(path, page)
    return Path(path)


def _solids(robot: Robot, T_flange_tcp: FloatArray, q: FloatArray) -> RobotSolids:
    """Return an arm with its tool at postures; the tool alone where the arm has no shapes."""
    tool = _tool(T_flange_tcp)
    try:
        return robot_solids(CollisionScene(robot, (tool,), ()), q)
    except RobotError:
        places = (robot.forward(q) @ tool.T_frame_body)[:, None]
        note = phrase("An arm whose description has no collision shapes is drawn as its tool.")
        return RobotSolids((triangles_of(tool.solid),), 0, places, note)


def _tool(T_flange_tcp: FloatArray) -> Body:
    """Return the rod from flange to tip in the tcp frame; a ball where the tip is at the flange."""
    flange = inverse_transform(T_flange_tcp)[:3, 3]
    length = float(np.linalg.norm(flange))
    if not length > _ROD:
        return Body("tool", Sphere(_ROD), np.eye(4))
    T, z = np.eye(4), flange / length
    x = np.cross(np.eye(3)[int(np.argmin(np.abs(z)))], z)
    x /= np.linalg.norm(x)
    T[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    T[:3, 3] = 0.5 * flange
    return Body("tool", Cylinder(_ROD, length), T)


def _volume(cell: PairCell) -> Strokes:
    """Return the edges of the box in which the tips meet."""
    volume = cell.file.volume
    corners = np.array(list(product((-0.5, 0.5), repeat=3)))
    ends = [
        (a, b) for a, b in product(corners, corners) if np.sum(a != b) == 1 and np.sum(b - a) > 0.0
    ]
    return Strokes(np.array(ends) * volume.size + np.array(volume.centre), "--region", 1.5)
