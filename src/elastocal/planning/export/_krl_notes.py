"""The comments at the head of the program: what a person has to check before it may run."""

import textwrap
import unicodedata
import xml.etree.ElementTree as ElementTree
from collections.abc import Sequence

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.planning.export._krl_motion import speeds_of
from elastocal.planning.plan_result import PlanResult
from elastocal.robot import Robot, T_from_xyzabc, parse_urdf, xyzabc_from_T
from elastocal.robot.inverse import arm_base

TOOL = BASE = 1
"""Numbers of TOOL_DATA and BASE_DATA that the program uses."""
_WIDTH = 96
_LONGEST_TEXT = 80


def head_notes(plan: PlanResult, robot: Robot) -> list[str]:
    """Return the notes of a program, as comment lines.

    Parameters
    ----------
    plan : PlanResult
        The plan.
    robot : Robot
        Its robot.
    """
    paragraphs = [
        *_origin(plan),
        "NOT TRIED ON A ROBOT. This program was written by software and has not run on any"
        " controller. Check it line by line, then step through it in T1 with a hand on the"
        " enabling switch.",
        *_axis_notes(robot),
        *_tool_notes(plan, robot),
        *_base_notes(plan, robot),
        *_contact_notes(plan),
        *_time_notes(plan),
    ]
    return [line for paragraph in paragraphs for line in comment(paragraph)]


def comment(text: str) -> list[str]:
    """Return a text as comment lines of bounded width."""
    return [f"; {line}" for line in textwrap.wrap(text, _WIDTH)]


def comment_text(text: str) -> str:
    r"""Return a text that may stand in a comment: ASCII, one line, without fold parameters.

    >>> comment_text("Höhe 5 %\nneu")
    'Hohe 5 ? neu'
    """
    plain = unicodedata.normalize("NFKD", text)
    plain = "".join(sign for sign in plain if not unicodedata.combining(sign))
    line = " ".join(plain.encode("ascii", "replace").decode("ascii").split())
    # In the title of a fold a percent sign begins its hidden parameters.
    line = "".join(sign if sign.isprintable() and sign != "%" else "?" for sign in line)
    return line[:_LONGEST_TEXT]


def _origin(plan: PlanResult) -> list[str]:
    return [
        f"Calibration poses, elastocal {comment_text(plan.elastocal)}.",
        f"Cell: {comment_text(plan.cell.name)}, fingerprint {comment_text(plan.cell.fingerprint)}.",
        f"Robot: {comment_text(plan.robot.name)}.",
        f"{len(plan.poses)} poses, about {speeds_of(plan).total_time(plan) / 60.0:.0f} min in all"
        " (estimated; below, for which speeds).",
    ]


def _axis_notes(robot: Robot) -> list[str]:
    names = robot.joint_names
    arm = names[robot.external_axes :]
    axes = [f"A{i} {comment_text(name)}" for i, name in enumerate(arm, start=1)]
    external = [
        f"E{i} {comment_text(name)} in {'deg' if robot.revolute[i - 1] else 'mm'}"
        for i, name in enumerate(names[: robot.external_axes], start=1)
    ]
    return [
        f"Axes and joints of the model: {', '.join([*axes, *external])}.",
        "Signs and zeros: the axis values are the joint positions of the model's URDF as they"
        " stand. Those of elastocal's catalogue have the signs and zeros of the KUKA pendant;"
        " those of another URDF may not. Compare before the first motion: drive to one pose"
        " with the pendant, and hold its axis values against position and A, B, C of that pose.",
    ]


def _tool_notes(plan: PlanResult, robot: Robot) -> list[str]:
    parent, T = _tool_in_parent(plan, robot)
    return [
        f"TOOL_DATA[{TOOL}] must hold {_frame(T)}: the tcp in link '{comment_text(parent)}'. In"
        " elastocal's catalogue 'flange' is KUKA's $FLANGE. This program does not write it;"
        " change the number in its line if your tool has another.",
        f"$LOAD is not set here: see that LOAD_DATA[{TOOL}] is that of the tool and in use.",
    ]


def _base_notes(plan: PlanResult, robot: Robot) -> list[str]:
    base = comment_text(plan.robot.base)
    if not robot.external_axes:
        return [
            f"BASE_DATA[{BASE}] must hold the frame of link '{base}' in $WORLD: in elastocal's"
            f" catalogue the foot of the robot, $ROBROOT; {_frame(np.eye(4))} while $ROBROOT is"
            " $WORLD."
        ]
    foot = arm_base(robot, np.zeros(robot.external_axes))
    return [
        f"BASE_DATA[{BASE}] must hold the frame of link '{base}' in $WORLD: the frame of the rail,"
        " which does not move with it, not the foot of the robot. With all external axes at 0"
        f" the foot (the link behind them) stands at {_frame(foot)} in it.",
        "The controller must know the rail as a kinematic system that carries the robot"
        " (machine data, $ET1_TA1KR), with the zero and the sense of the model; else LIN with"
        " E1 goes elsewhere.",
    ]


def _contact_notes(plan: PlanResult) -> list[str]:
    contact = plan.contact
    return [
        "Each pose: PTP to the approach pose by axis values, which choose the posture; LIN to"
        f" {1e3 * contact.near_contact:.1f} mm off the surface; HALT. After START: LIN to the"
        " surface as it was modelled, slowly; HALT for the load cases; back. The surface is not"
        " where the model has it: decide at the first HALT whether to go on, or let the force"
        " controller make the contact and leave out that LIN. Frames have no S and T: they are"
        " only for LIN.",
        "Load cases, force on the robot in the tcp frame, z into the surface:",
        *(
            f"{comment_text(name)}: {x:.1f}, {y:.1f}, {z:.1f} N"
            for name, (x, y, z) in contact.load_cases.items()
        ),
    ]


def _time_notes(plan: PlanResult) -> list[str]:
    speeds, contact = speeds_of(plan), plan.contact
    return [
        f"Speeds: PTP at {speeds.ptp_percent} percent, LIN at {1e3 * speeds.lin:.4g} mm/s and, for"
        f" the last {1e3 * contact.near_contact:.1f} mm, at {1e3 * speeds.touch:.4g} mm/s: never"
        f" faster than the cell file has it ({100.0 * contact.axis_override:.4g} percent,"
        f" {1e3 * contact.contact_speed:.4g} mm/s). The times here are for these speeds at an"
        " override of 100 percent, without the waiting at HALT. Those of the plan's other files are"
        f" for the cell file's speeds: {plan.total_time / 60.0:.0f} min in all.",
    ]


def _tool_in_parent(plan: PlanResult, robot: Robot) -> tuple[str, FloatArray]:
    """Return the link that the tcp is fixed to, and the tcp in it."""
    root = parse_urdf(plan.robot.urdf)
    for joint in root.findall("joint"):
        child, parent = joint.find("child"), joint.find("parent")
        if child is None or parent is None or child.get("link") != robot.tip:
            continue
        if joint.get("type") == "fixed":
            return parent.get("link", ""), _origin_of(joint)
    return robot.tip, np.eye(4)


def _origin_of(joint: ElementTree.Element) -> FloatArray:
    origin = joint.find("origin")
    if origin is None:
        return np.eye(4)
    xyz, rpy = (_numbers(origin.get(key, "0 0 0")) for key in ("xyz", "rpy"))
    return T_from_xyzabc(*xyz, *reversed(rpy))


def _numbers(text: str) -> Sequence[float]:
    return [float(number) for number in text.split()]


def _frame(T: FloatArray) -> str:
    xyzabc = xyzabc_from_T(T)
    values = [*(1e3 * xyzabc[:3]), *np.degrees(xyzabc[3:])]
    parts = (f"{key} {round(v, 3) + 0.0:.3f}" for key, v in zip("XYZABC", values, strict=True))
    return f"{{{', '.join(parts)}}}"
