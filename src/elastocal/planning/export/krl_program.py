"""Write a plan as a KRL program (hardware facts, section 2.2).

Approach poses are ``PTP`` by axis values, everything near the surface is ``LIN``. The program
stops (``HALT``) before it touches the surface and on it, so that a person or a force controller
decides. Nothing here was tried on a real robot, and the program says so: the comments at its head
say what a person has to check before it may run.
"""

import re
import textwrap
import unicodedata
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.errors import PlanningError
from elastocal.files import replacing
from elastocal.planning.export._krl_motion import (
    PoseTargets,
    Speeds,
    Target,
    build_targets,
    robot_of,
    speeds_of,
)
from elastocal.planning.plan_result import PlanResult, check_plan
from elastocal.robot import Robot, T_from_xyzabc, parse_urdf, xyzabc_from_T
from elastocal.robot.inverse import arm_base

_LONGEST_FILE_NAME = 24
"""With the suffix (hardware facts, section 2.2)."""
_SUFFIXES = (".src", ".dat")
_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*")
_KRL_WORDS = (
    "AND ANIN ANOUT AXIS B_AND B_EXOR B_NOT B_OR BAS BASE_DATA BOOL BRAKE CASE CHAR CIRC CIRC_REL"
    " CONFIRM CONST CONTINUE DATA DECL DEF DEFAULT DEFDAT DEFFCT DELAY DIGIN DO E6AXIS E6POS ELSE"
    " END ENDDAT ENDFCT ENDFOR ENDIF ENDLOOP ENDSWITCH ENDWHILE ENUM EXIT EXOR EXT EXTFCT FALSE"
    " FOR FRAME GLOBAL GOTO HALT IF IMPORT INT INTERRUPT IR_STOPM IS LIN LIN_REL LOOP MAXIMUM"
    " MINIMUM NOT OFF ON OR POS PRIO PTP PTP_REL PUBLIC PULSE REAL REPEAT RESUME RETURN SCIRC SEC"
    " SIGNAL SLIN SPLINE SPTP STRUC SWITCH THEN TO TOOL_DATA TRIGGER TRUE UNTIL WAIT WHEN WHILE"
)
_WINDOWS_NAMES = "AUX CON NUL PRN"
_RESERVED = frozenset(f"{_KRL_WORDS} {_WINDOWS_NAMES}".split())
"""Words that cannot name a program; the controller's disk is a Windows one."""
_HEADER = (
    "&ACCESS RVP",
    "&REL 1",
    r"&PARAM TEMPLATE = C:\KRC\Roboter\Template\vorgabe",
    "&PARAM EDITMASK = *",
)
_INI = (
    ";FOLD INI",
    "  ;FOLD BASISTECH INI",
    "    GLOBAL INTERRUPT DECL 3 WHEN $STOPMESS==TRUE DO IR_STOPM ( )",
    "    INTERRUPT ON 3",
    "    BAS (#INITMOV,0 )",
    "  ;ENDFOLD (BASISTECH INI)",
    ";ENDFOLD (INI)",
)
# WAIT SEC 0 keeps the interpreter from running ahead of the motion before it.
_STOP = ("WAIT SEC 0", "HALT")
_TOOL = _BASE = 1
"""Numbers of TOOL_DATA and BASE_DATA that the program uses."""
_WIDTH = 96
_LONGEST_TEXT = 80


def write_krl(folder: Path, plan: PlanResult, name: str = "calib") -> tuple[Path, Path]:
    """Write ``<name>.src`` and ``<name>.dat`` into a folder, both or none; return their paths.

    Parameters
    ----------
    folder : Path
        Where to write.
    plan : PlanResult
        The plan.
    name : str
        Of the program: at most 20 letters, digits and underscores, not beginning with a digit.

    Raises
    ------
    PlanningError
        If the name is not allowed, the robot is not a six-axis arm, or the joints of a pose
        contradict its frame.
    SchemaError
        If the plan contradicts itself.
    FileAccessError
        If a file cannot be written.
    """
    check_name(name)
    check_plan(plan)
    robot = robot_of(plan)
    targets = build_targets(plan, robot)
    positions = tuple(targets)
    check_name(name, frozenset(target.name for target in positions))
    program = _program(name, plan, _head_notes(plan, robot), targets.poses, targets.way_home)
    src, dat = (Path(folder) / f"{name}{suffix}" for suffix in _SUFFIXES)
    with replacing(src) as new_src, replacing(dat) as new_dat:
        new_src.write_bytes(_text(program))
        new_dat.write_bytes(_text(_data(name, positions)))
    return src, dat


def check_name(name: str, taken: frozenset[str] = frozenset()) -> None:
    """Refuse a name that a controller would.

    Parameters
    ----------
    name : str
        Of the program, and of its two files without suffix.
    taken : frozenset of str
        Names that the program uses itself, in capitals.

    Raises
    ------
    PlanningError
        If it is no KRL name, too long, or has a meaning already.
    """
    longest = _LONGEST_FILE_NAME - len(_SUFFIXES[0])
    if not _NAME.fullmatch(name) or len(name) > longest:
        raise PlanningError(
            f"{name!r} cannot name a KRL program: allowed are 1 to {longest} of the characters"
            " A-Z a-z 0-9 _, not beginning with a digit"
        )
    if name.upper() in _RESERVED | taken:
        raise PlanningError(f"{name!r} cannot name a KRL program: the word has a meaning in it")


def _program(
    name: str,
    plan: PlanResult,
    notes: list[str],
    poses: tuple[PoseTargets, ...],
    way_home: tuple[Target, ...],
) -> Iterator[str]:
    yield from _HEADER
    yield f"DEF {name}( )"
    # Not in a fold: a pendant shows folds closed.
    yield from notes
    yield from _INI
    yield f"$TOOL = TOOL_DATA[{_TOOL}]"
    yield f"$BASE = BASE_DATA[{_BASE}]"
    speeds = speeds_of(plan)
    yield f"BAS (#VEL_PTP,{speeds.ptp_percent} )"
    yield "PTP XHOME"
    cases = ", ".join(_comment_text(case) for case in plan.contact.load_cases)
    for place, stop in enumerate(poses, start=1):
        title = (
            f"POSE {stop.pose.id}, {place} of {len(poses)}: candidate {stop.pose.candidate},"
            f" about {speeds.contact_time(plan, stop.pose):.0f} s"
        )
        yield from _fold(title, _pose(stop, cases, speeds))
    for target in way_home:
        yield f"PTP {target.name}"
    yield "PTP XHOME"
    yield "END"


def _pose(stop: PoseTargets, cases: str, speeds: Speeds) -> Iterator[str]:
    if stop.pose.seen_by is not None:
        yield f"; marker seen by {_comment_text(stop.pose.seen_by)}"
    for target in (*stop.via, stop.approach):
        yield f"PTP {target.name}"
    yield _speed(speeds.lin)
    yield f"LIN {stop.near.name}"
    yield from _comment("Near contact: take the unloaded reading. Then contact, or force control.")
    yield from _STOP
    yield _speed(speeds.touch)
    yield f"LIN {stop.contact.name}"
    yield from _comment(f"In contact: apply the load cases {cases}.")
    yield from _STOP
    yield f"LIN {stop.near.name}"
    yield _speed(speeds.lin)
    yield f"LIN {stop.retreat.name}"


def _speed(metres_per_second: float) -> str:
    millimetres = 1e3 * metres_per_second
    return f"$VEL.CP = {metres_per_second:.5f} ; m/s, {millimetres:.4g} mm/s"


def _data(name: str, positions: tuple[Target, ...]) -> Iterator[str]:
    yield from _HEADER
    yield f"DEFDAT {name}"
    yield from _fold("BASISTECH EXT", ["EXT BAS (BAS_COMMAND :IN,REAL :IN )"])
    for target in positions:
        yield target.declaration
    yield "ENDDAT"


def _fold(title: str, lines: Iterable[str]) -> Iterator[str]:
    yield f";FOLD {title}"
    for line in lines:
        yield f"  {line}"
    yield f";ENDFOLD ({title})"


def _text(lines: Iterable[str]) -> bytes:
    return "".join(f"{line}\r\n" for line in lines).encode("ascii")


def _head_notes(plan: PlanResult, robot: Robot) -> list[str]:
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
    return [line for paragraph in paragraphs for line in _comment(paragraph)]


def _comment(text: str) -> list[str]:
    """Return a text as comment lines of bounded width."""
    return [f"; {line}" for line in textwrap.wrap(text, _WIDTH)]


def _comment_text(text: str) -> str:
    r"""Return a text that may stand in a comment: ASCII, one line, without fold parameters.

    >>> _comment_text("Höhe 5 %\nneu")
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
        f"Calibration poses, elastocal {_comment_text(plan.elastocal)}.",
        f"Cell: {_comment_text(plan.cell.name)},"
        f" fingerprint {_comment_text(plan.cell.fingerprint)}.",
        f"Robot: {_comment_text(plan.robot.name)}.",
        f"{len(plan.poses)} poses, about {speeds_of(plan).total_time(plan) / 60.0:.0f} min in all"
        " (estimated; below, for which speeds).",
    ]


def _axis_notes(robot: Robot) -> list[str]:
    names = robot.joint_names
    arm = names[robot.external_axes :]
    axes = [f"A{i} {_comment_text(name)}" for i, name in enumerate(arm, start=1)]
    external = [
        f"E{i} {_comment_text(name)} in {'deg' if robot.revolute[i - 1] else 'mm'}"
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
        f"TOOL_DATA[{_TOOL}] must hold {_frame(T)}: the tcp in link '{_comment_text(parent)}'. In"
        " elastocal's catalogue 'flange' is KUKA's $FLANGE. This program does not write it;"
        " change the number in its line if your tool has another.",
        f"$LOAD is not set here: see that LOAD_DATA[{_TOOL}] is that of the tool and in use.",
    ]


def _base_notes(plan: PlanResult, robot: Robot) -> list[str]:
    base = _comment_text(plan.robot.base)
    if not robot.external_axes:
        return [
            f"BASE_DATA[{_BASE}] must hold the frame of link '{base}' in $WORLD: in elastocal's"
            f" catalogue the foot of the robot, $ROBROOT; {_frame(np.eye(4))} while $ROBROOT is"
            " $WORLD."
        ]
    foot = arm_base(robot, np.zeros(robot.external_axes))
    return [
        f"BASE_DATA[{_BASE}] must hold the frame of link '{base}' in $WORLD: the frame of the rail,"
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
            f"{_comment_text(name)}: {x:.1f}, {y:.1f}, {z:.1f} N"
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
        f" for the cell file's speeds: {plan.total_time / 60.0:.0f} min in all."
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
