"""Write a plan as a KRL program (docs/how-to/plan-poses.md); its text is in ``templates``.

Approach poses are ``PTP`` by axis values, everything near the surface is ``LIN``. The program
stops (``HALT``) before it touches the surface and on it, so that a person or a force controller
decides. Nothing here was tried on a real robot, and the program says so: the comments at its head
say what a person has to check before it may run.
"""

import re
import textwrap
import unicodedata
import xml.etree.ElementTree as ElementTree
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.errors import PlanningError
from elastocal.files import replacing
from elastocal.planning.export._krl_motion import Targets, build_targets, robot_of, speeds_of
from elastocal.planning.plan_result import PlanResult, check_plan
from elastocal.robot import Robot, T_from_xyzabc, parse_urdf, xyzabc_from_T
from elastocal.robot.inverse import arm_base

if TYPE_CHECKING:
    from jinja2 import Environment

_LONGEST_FILE_NAME = 24
"""With the suffix, as the KUKA System Software has it; not verified on a controller."""
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
    check_name(name, frozenset(target.name for target in targets))
    src, dat = (Path(folder) / f"{name}{suffix}" for suffix in _SUFFIXES)
    with replacing(src) as new_src, replacing(dat) as new_dat:
        new_src.write_bytes(_controller_text(_program(name, plan, robot, targets)))
        new_dat.write_bytes(_controller_text(_render("program.dat", name=name, targets=targets)))
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


def _program(name: str, plan: PlanResult, robot: Robot, targets: Targets) -> str:
    cases = ", ".join(_comment_text(case) for case in plan.contact.load_cases)
    return _render(
        "program.src",
        name=name,
        plan=plan,
        notes=_head_notes(plan, robot),
        in_contact=_comment(f"In contact: apply the load cases {cases}."),
        speeds=speeds_of(plan),
        targets=targets,
    )


def _head_notes(plan: PlanResult, robot: Robot) -> list[str]:
    """Return the notes of a program, as comment lines."""
    arm, external = robot.joint_names[robot.external_axes :], robot.external_axes
    axes = [f"A{i} {_comment_text(name)}" for i, name in enumerate(arm, start=1)]
    for i, rail in enumerate(robot.joint_names[:external], start=1):
        unit = "deg" if robot.revolute[i - 1] else "mm"
        axes.append(f"E{i} {_comment_text(rail)} in {unit}")
    tool_parent, T_parent_tcp = _tool_in_parent(plan, robot)
    text = _render(
        "notes.txt",
        plan=plan,
        speeds=speeds_of(plan),
        axes=axes,
        tool_parent=tool_parent,
        T_parent_tcp=T_parent_tcp,
        T_base_foot=arm_base(robot, np.zeros(external)) if external else None,
        T_world=np.eye(4),
        near=f"{1e3 * plan.contact.near_contact:.1f}",
    )
    paragraphs = re.split(r"\n\s*\n", text.strip())
    return [line for paragraph in paragraphs for line in _comment(" ".join(paragraph.split()))]


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
    xyz, rpy = (map(float, origin.get(key, "0 0 0").split()) for key in ("xyz", "rpy"))
    return T_from_xyzabc(*xyz, *reversed([*rpy]))


def _frame(T: FloatArray) -> str:
    xyzabc = xyzabc_from_T(T)
    values = [*(1e3 * xyzabc[:3]), *np.degrees(xyzabc[3:])]
    parts = (f"{key} {round(v, 3) + 0.0:.3f}" for key, v in zip("XYZABC", values, strict=True))
    return f"{{{', '.join(parts)}}}"


def _render(template: str, **values: object) -> str:
    return _environment().get_template(template).render(values)


@cache
def _environment() -> "Environment":
    # Takes long to import, and few commands write programs.
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("elastocal.planning.export"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters |= {"plain": _comment_text, "frame": _frame}
    return environment


def _controller_text(text: str) -> bytes:
    return text.replace("\n", "\r\n").encode("ascii")
