"""The error tree: one base class, one line a message.

Every message names the offending thing, its value and what is allowed, so that the command line can
print it unchanged. Each error is also the builtin that a caller would expect (`ValueError`,
`OSError`), so that library users need not import this module to catch one.
"""

import difflib
import reprlib
from collections.abc import Iterable
from numbers import Number
from typing import TypeVar

_T = TypeVar("_T")


class ElastocalError(Exception):
    """Base of every error that elastocal raises on purpose."""


class UnitError(ElastocalError, ValueError):
    """A quantity has no unit, an unknown one, or one of the wrong dimension."""


class RobotError(ElastocalError, ValueError):
    """A robot description that cannot be used: bad URDF, missing frame, unknown catalogue name."""


class UnreachableError(ElastocalError, ValueError):
    """No joint configuration reaches the pose that was asked for."""


class SpringError(ElastocalError, ValueError):
    """A spring layout that does not fit the robot or does not make sense."""


class DatasetError(ElastocalError, ValueError):
    """Measurements that break the dataset contract."""


class SchemaError(ElastocalError, ValueError):
    """A file of an unknown kind or schema version."""


class IdentificationError(ElastocalError, ValueError):
    """A fit that cannot be made: too few poses, impossible bounds, nothing to fit."""


class ConventionError(IdentificationError):
    """Data that are explained only when a sign or a frame is read otherwise than stated."""


class PlanningError(ElastocalError, ValueError):
    """A search for poses that cannot be made: too small a pool, missing rows, unknown technique."""


class CodecError(ElastocalError, ValueError):
    """A cross-validation that cannot be made: too few poses, unknown variant, nothing fitted."""


class DeviceError(ElastocalError, RuntimeError):
    """A device refuses a command, is not configured, or does not answer."""


class ProcedureError(ElastocalError, RuntimeError):
    """The calibration procedure cannot start or go on."""


class LogError(ElastocalError, ValueError):
    """A log of another program that cannot be used: its form, its columns, its clock."""


class GeometryError(ElastocalError, ValueError):
    """Positions from which no geometry can be found."""


class CompensationError(ElastocalError, ValueError):
    """A correction that cannot be made: bad limits, a filter beyond Nyquist, an unknown tool."""


class PathError(CompensationError):
    """A programmed path that cannot be corrected; the message names its line or point."""


class ReportError(ElastocalError, ValueError):
    """A picture or page that cannot be made."""


class VerificationError(ElastocalError, ValueError):
    """A file that is not what it was when it was made, or not signed as it should be."""


class PluginError(ElastocalError, RuntimeError):
    """A plug-in of another package that cannot be used; the message names its distribution."""


class FileAccessError(ElastocalError, OSError):
    """A file that cannot be read or written."""


class InternalError(ElastocalError, RuntimeError):
    """Something that elastocal itself makes sure of is not so: a mistake in elastocal."""


def present(value: _T | None, name: str) -> _T:
    """Return a value that its caller has made sure of.

    Raises
    ------
    InternalError
        If it is None.

    >>> present(2.0, "force")
    2.0
    """
    if value is None:
        raise InternalError(f"{name}: missing, which is a mistake in elastocal: please report it")
    return value


def of_kind(value: object, kind: type[_T], name: str) -> _T:
    """Return a value whose kind its caller has made sure of.

    Raises
    ------
    InternalError
        If it is of another kind.
    """
    if not isinstance(value, kind):
        raise InternalError(
            f"{name} is a {type(value).__name__}, not a {kind.__name__},"
            " which is a mistake in elastocal: please report it"
        )
    return value


def require_type(value: object, kinds: type | tuple[type, ...], name: str, allowed: str) -> None:
    """Refuse an argument of a public function that is of another type.

    Raises
    ------
    TypeError
        It names the argument, what it is, and what is allowed.
    """
    if not isinstance(value, kinds):
        raise TypeError(f"{name} is {described_type(value)} (allowed: {allowed})")


def described_type(value: object) -> str:
    """Return what an argument of a wrong type is, on one line.

    >>> described_type("60 mm"), described_type([60.0])
    ("'60 mm', of type str", 'of type list')
    """
    kind = f"of type {type(value).__name__}"
    return f"{reprlib.repr(value)}, {kind}" if isinstance(value, str | Number) else kind


def nearest(name: str, allowed: Iterable[str]) -> str:
    """Return ``"; did you mean 'x'?"`` for the closest allowed name, or an empty string.

    Capitals and small letters count as the same.

    >>> nearest("bering", ["actuated", "bearing"])
    "; did you mean 'bearing'?"
    """
    folded = {known.casefold(): known for known in allowed}
    matches = difflib.get_close_matches(name.casefold(), list(folded), n=1)
    return f"; did you mean {folded[matches[0]]!r}?" if matches else ""
