"""Write a plan as a KRL program (hardware facts, section 2.2).

Approach poses are ``PTP`` by axis values, everything near the surface is ``LIN``. The program
stops (``HALT``) before it touches the surface and on it, so that a person or a force controller
decides. Nothing here was tried on a real robot, and the program says so.
"""

import re
from collections.abc import Iterable, Iterator
from pathlib import Path

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
from elastocal.planning.export._krl_notes import BASE, TOOL, comment, comment_text, head_notes
from elastocal.planning.plan_result import PlanResult, check_plan

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
    program = _program(name, plan, head_notes(plan, robot), targets.poses, targets.way_home)
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
    yield f"$TOOL = TOOL_DATA[{TOOL}]"
    yield f"$BASE = BASE_DATA[{BASE}]"
    speeds = speeds_of(plan)
    yield f"BAS (#VEL_PTP,{speeds.ptp_percent} )"
    yield "PTP XHOME"
    cases = ", ".join(comment_text(case) for case in plan.contact.load_cases)
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
        yield f"; marker seen by {comment_text(stop.pose.seen_by)}"
    for target in (*stop.via, stop.approach):
        yield f"PTP {target.name}"
    yield _speed(speeds.lin)
    yield f"LIN {stop.near.name}"
    yield from comment("Near contact: take the unloaded reading. Then contact, or force control.")
    yield from _STOP
    yield _speed(speeds.touch)
    yield f"LIN {stop.contact.name}"
    yield from comment(f"In contact: apply the load cases {cases}.")
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
