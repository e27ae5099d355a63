"""What KRL allows: names, and text in comments."""

import re
import unicodedata

from elastocal.errors import PlanningError

LONGEST_FILE_NAME = 24
"""With the suffix (hardware facts, section 2.2)."""
SUFFIXES = (".src", ".dat")
_LONGEST_COMMENT_TEXT = 80

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
    longest = LONGEST_FILE_NAME - len(SUFFIXES[0])
    if not _NAME.fullmatch(name) or len(name) > longest:
        raise PlanningError(
            f"{name!r} cannot name a KRL program: allowed are 1 to {longest} of the characters"
            " A-Z a-z 0-9 _, not beginning with a digit"
        )
    if name.upper() in _RESERVED | taken:
        raise PlanningError(f"{name!r} cannot name a KRL program: the word has a meaning in it")


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
    return line[:_LONGEST_COMMENT_TEXT]
