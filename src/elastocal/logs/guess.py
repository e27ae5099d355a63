"""First map of logs, guessed from the names and sizes of their columns, for a person to correct."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.errors import LogError
from elastocal.logs.map import SCHEMA, UNKNOWN
from elastocal.logs.recordings import is_recording, read_recording, read_topics
from elastocal.logs.streams import read_table
from elastocal.logs.table import LogTable
from elastocal.results import brief_repr
from elastocal.units import MEANT
from elastocal.wording import listed

_UNIT = re.compile(r"[\[(]\s*([^\])]+?)\s*[\])]\s*$|_(mm|m|um|deg|rad|N|kN|Nm|s|ms)$")
_TIME = re.compile(
    r"(?i)(time|zeit|t|time ?stamp|stamp|date[ _]?time|ms|ipoc|uhrzeit|utc|(?:utc|local)[ _]?time)"
)
_DATE = re.compile(r"(?i)(date|datum|created)")
"""A date counts where no column is named after a time."""
_AXIS = re.compile(
    r"(?i)((?:.*[._ ])?(?:joint(?:_position)?|jnt|achse|axis|r?ax|jt|a|j|q|theta)[_ ]?a?)(\d)"
    r"(?:[_ ](?:angle|pos|position|act|actual))?"
)
"""Numbered: KUKA A1; FANUC, Staubli, Denso, Nachi J1; Kawasaki JT1; ABB rax_1; UR actual_q_0;
Doosan actual_joint_position_0."""
_LETTERED = {
    "Yaskawa": ("s", "l", "u", "r", "b", "t"),
    "Hyundai or Nachi": ("s", "h", "v", "r2", "b", "r1"),
}
"""Axes that makers name by letters, from the base on."""
_LETTER = re.compile(r"(?i)((?:.*[._ ])?)(r[12]|[slurbthv])(?:[-_ ]?(?:axis|ax))?")
_EXTERNAL = re.compile(r"(?i)(?:.*[._ ])?(?:e1|eax_a|rail|linear|track)")
_MADE_UP = 8e9
"""ABB writes 9E+09 for an external axis that is not there."""
_TURNS_OF = {
    "FANUC": ("r", "p", "w"),
    "Denso or Yaskawa": ("rz", "ry", "rx"),
}
"""Angles about z, y and x, in the order of the map's a, b, c, as makers name them."""
_TURN_OTHERWISE = {"Denso or Yaskawa": "; those of Staeubli turn otherwise: leave them out"}
"""A warning where another maker gives the same names to other angles."""
_TURN = re.compile(r"(?i)(.*?)(r[xyz]|[wpr])")
_NO_TIMES = ("deg", "rad", "mm", "m", "N", "kN", "N*m", "N*mm")
_TIMES = ("s", "ms", "us")
"""Units by which a column is a time, whatever it is called."""
_STATE = re.compile(r"(?i)(?:.*[./])?position\.(?![xyzw]$)")
_RATE = re.compile(r"(?i)(?:.*[./])?(?:velocity|effort)\.")
"""Places, velocities and efforts of joints by their names, as a JointState becomes columns."""
_FORCE = re.compile(r"(?i)(.*?)(?:f|force)[._ ]?([xyz])")
_MOMENT = re.compile(r"(?i)(.*?)(?:t|m|torque|moment)[._ ]?([xyz])")
_SIGMA = re.compile(r"(?i)(.*?)(?:u95|u|sigma|unc)[._ ]?([xyz])|()([xyz])[._ ]?(?:u95|unc)")
_POINT = re.compile(r"(?i)(.*?)([xyz])")
_ANGLE = re.compile(r"(?i)(.*?)([abc])")
_QUATERNION = re.compile(r"(?i)(.*?q[._ ]?)([wxyz]|[1-4])")
_COUNTS = re.compile(r"(?i)counts per unit (force|torque)\W+([\d.]+(?:e[+-]?\d+)?)")
_BOX_UNIT = re.compile(r"(?i)(force|torque) units?\W+([\w-]+)")
_STEP = re.compile(r"(?i)(step|reading|handshake|plateau|messpunkt)")
_LEAST_AXES = 5
"""Columns with numbers that are the joints of an arm."""
_SURELY_DEGREES = 7.0
"""A joint beyond this many units is not in rad."""
_SURELY_MM = 20.0
"""A place or rail beyond this many units is not in m."""
_SURELY_PLACED = 0.2
"""A coordinate below this many units decides nothing: the instruments are farther away in any
unit."""
_SURELY_NEWTONS = 20.0
"""A press of more than this many units is not in kN."""
_LARGEST_FORCE = 100e3
"""No press is larger, in N: what is has been counted, not converted."""
_LONGEST_LEVER = 5.0
"""Longest lever of a force about its sensor, in m: a moment beyond is in N mm."""


@brief_repr
@dataclass(frozen=True)
class GuessedColumns:
    """Guessed meaning of some columns of a log, with the reasons."""

    key: str
    """Key of the map."""
    columns: tuple[str, ...]
    unit: str | None
    """``?`` where a person must state it; None for dates and words."""
    why: str
    counts: float = 1.0
    """Number of counts in one unit."""

    @property
    def yaml(self) -> str:
        """The columns as the map has them."""
        names = ", ".join(quoted(name) for name in self.columns)
        if self.key == "handshake":
            return names
        if self.key == "pose.quaternion":
            return f"[{names}]"
        unit = "" if self.unit is None else f", unit: {quoted(self.unit)}"
        if self.key == "time":
            return f"{{column: {names}{unit}}}"
        counts = "" if self.counts == 1.0 else f", counts: {self.counts:.9g}"
        return f"{{columns: [{names}]{unit}{counts}}}"


@brief_repr
@dataclass(frozen=True)
class GuessedLog:
    """Guessed meaning of a log or of a topic of it."""

    log: str
    topic: str | None
    columns: tuple[GuessedColumns, ...] = ()
    unused: tuple[str, ...] = ()
    """Columns whose meaning is not known."""

    def lines(self) -> list[str]:
        """Return its entry of the map, with the reasons as comments."""
        topic = [] if self.topic is None else [f"    topic: {quoted(self.topic)}"]
        found = [f"  - log: {quoted(self.log)}", *topic]
        for key in ("time", "handshake", "joints", "pose", "force", "moment", "markers"):
            own = [each for each in self.columns if each.key.split(".")[0] == key]
            if key in ("joints", "markers") and own:
                found.append(f"    {key}:")
                found += [f"      - {each.yaml}  # {each.why}" for each in own]
            elif key == "pose" and own:
                found.append("    pose:")
                found += [f"      {e.key.split('.')[1]}: {e.yaml}  # {e.why}" for e in own]
            else:
                found += [f"    {key}: {each.yaml}  # {each.why}" for each in own]
        if self.unused:
            found.append(f"    # not used: {listed(self.unused)}")
        return found


Joints = Mapping[str, bool]
"""Names of an arm's joints in order, with whether each turns."""


def guess_logs(files: Sequence[Path], joints: Joints | None = None) -> tuple[GuessedLog, ...]:
    """Return the apparent kind of each log, and of each topic of a recording.

    Parameters
    ----------
    files : sequence of Path
        The logs.
    joints : mapping of str to bool, optional
        Joints of the arm, where it is known: columns of these names are joints, whatever they are
        called.

    Raises
    ------
    LogError
        If a log cannot be read, or none of them holds anything that is known.
    FileAccessError
        If a file cannot be read.
    """
    found = []
    for path in files:
        if not is_recording(path):
            found.append(guess_log(path.name, None, read_table(path, None), joints))
            continue
        for topic in read_topics(path):
            try:
                table = read_recording(path, topic)
            except LogError:
                continue  # no numbers in it: a log of texts, pictures
            found.append(guess_log(path.name, topic, table, joints))
    known = [any(c.key not in _ORDER for c in each.columns) for each in found]
    if not any(known):
        raise LogError("no column looks like joints, a force or a marker: write the map by hand")
    return tuple(
        each if is_known else replace(each, columns=(*each.columns, _UNSAID))
        for each, is_known in zip(found, known, strict=True)
        if is_known or each.topic is None
    )


_UNSAID = GuessedColumns(
    "markers",
    (UNKNOWN,) * 3,
    None,
    "no column looks like joints, a force or a marker: write what the log holds, or leave it out",
)


_ORDER = ("time", "handshake")
"""Kinds of columns that state a time, not a quantity."""


def guess_log(
    log: str, topic: str | None, table: LogTable, joints: Joints | None = None
) -> GuessedLog:
    """Return the apparent meaning of the columns of a table.

    Parameters
    ----------
    log : str
        Name of its file.
    topic : str or None
        Topic of a recording.
    table : LogTable
        Its columns.
    joints : mapping of str to bool, optional
        As for `guess_logs`.
    """
    if all(name.isdigit() for name in table.header):
        return GuessedLog(log, topic, _without_names(table))
    names = {name: _bare(name) for name in table.header}
    # Yaskawa's T is an axis, where no unit says that it is a time.
    named = _named_joints(table, names, joints or {})
    lettered = [] if named else _by_letters(table, names)
    when = _when(table, _without(names, [*named, *lettered]))
    rest = _without(names, when)
    arm = named or ([*_rail(table, rest), *lettered] if lettered else _joints(table, rest))
    arm = arm or _state(rest)
    rest = _without(_of_places(rest) if arm else rest, arm)
    force = _force(table, rest)
    rest = _without(rest, force)
    where = [] if force else _places(table, rest, of_tool=bool(arm))
    unused = tuple(_without(rest, where))
    when = when or [GuessedColumns("time", (UNKNOWN,), None, "no column looks like a time")]
    return GuessedLog(log, topic, (*when, *arm, *force, *where), unused)


def _without(names: dict[str, str], taken: Sequence[GuessedColumns]) -> dict[str, str]:
    """Return the columns that are not taken yet, with their names without units."""
    gone = {name for each in taken for name in each.columns}
    return {name: bare for name, bare in names.items() if name not in gone}


def _when(table: LogTable, names: dict[str, str]) -> list[GuessedColumns]:
    """Return the columns that say when a row was taken."""
    times = [
        name
        for heading in (_TIME, _DATE)
        for name, bare in names.items()
        if heading.fullmatch(bare) and _stated(name) not in _NO_TIMES
    ] or [name for name in names if _stated(name) in _TIMES and _rises(table, name)]
    times = times[:1]
    steps = [name for name, bare in names.items() if _STEP.fullmatch(bare)][:1]
    return [
        *(GuessedColumns("time", (name,), *_time_unit(table, name)) for name in times),
        *(GuessedColumns("handshake", (name,), None, "its name") for name in steps),
    ]


def _rises(table: LogTable, name: str) -> bool:
    """Return whether the numbers of a column only rise."""
    return bool(np.all(np.diff(_numbers(table, name)) > 0.0))


def _of_places(names: dict[str, str]) -> dict[str, str]:
    """Return the columns without velocities and efforts of joints, which are no forces."""
    return {name: bare for name, bare in names.items() if not _RATE.match(bare)}


def _named_joints(table: LogTable, names: dict[str, str], joints: Joints) -> list[GuessedColumns]:
    """Return the columns that are named as the joints of the arm, in its order; none if one is not.

    ``actual/position.elbow_joint`` is ``elbow_joint``.
    """
    columns = dict[str, str]()
    for name, bare in _of_places(names).items():
        own = next((joint for joint in joints if _is_named(bare, joint)), None)
        if own is not None:
            columns.setdefault(own, name)
    if not joints or len(columns) < len(joints):
        return []
    found = []
    for turns, group in groupby(joints, key=joints.__getitem__):
        own_columns = tuple(columns[joint] for joint in group)
        # As ROS has it: rad and m.
        stated = ("rad" if turns else "m", "named as the joints are, in SI as ROS has it")
        kind = "angle" if turns else "length"
        plain = all(_STATE.match(names[name]) for name in own_columns)
        unit = stated if plain else _unit(table, own_columns, kind)
        found.append(GuessedColumns("joints", own_columns, *unit))
    return found


def _is_named(column: str, joint: str) -> bool:
    """Return whether a column has the name of a joint, perhaps behind a path."""
    if column.lower() == joint.lower():
        return True
    path = column[: -len(joint)] if column.lower().endswith(joint.lower()) else ""
    return bool(path) and path[-1] in "./:"


def _state(names: dict[str, str]) -> list[GuessedColumns]:
    """Return the columns of a ``JointState`` whose joints have names of their own."""
    columns = tuple(name for name, bare in names.items() if _STATE.match(bare))
    if len(columns) < _LEAST_AXES:
        return []
    why = "a JointState, in its order: is it that of the arm's joints?"
    return [GuessedColumns("joints", columns, "rad", why)]


def _joints(table: LogTable, names: dict[str, str]) -> list[GuessedColumns]:
    """Return the columns of joints, a rail before the axes of the arm."""
    by_word: dict[str, list[tuple[str, str]]] = {}
    for name, bare in names.items():
        if match := _AXIS.fullmatch(bare):
            by_word.setdefault(match[1].lower(), []).append((match[2], name))
    # Measured angles before those that were aimed at.
    words = sorted(by_word, key=lambda word: ("target" in word or "cmd" in word, "act" not in word))
    word = max(words, key=lambda each: len(by_word[each]), default="")
    axes = by_word.get(word, [])
    # A seventh axis in mm is the rail below the arm, whatever its number.
    slides = tuple(name for _, name in axes if _stated(name) in ("mm", "m"))
    arm = tuple(name for _, name in sorted(axes) if name not in slides)
    if len(arm) < _LEAST_AXES:
        return []
    rail = [GuessedColumns("joints", slides, *_unit(table, slides, "length"))] if slides else []
    return [
        *(rail or _rail(table, names)),
        GuessedColumns("joints", arm, *_unit(table, arm, "angle")),
    ]


def _rail(table: LogTable, names: dict[str, str]) -> list[GuessedColumns]:
    """Return the column of the linear axis that carries the arm, if there is one."""
    found = tuple(
        name
        for name, bare in names.items()
        if _EXTERNAL.fullmatch(bare) and _largest(table, (name,)) < _MADE_UP
    )
    return [GuessedColumns("joints", found, *_unit(table, found, "length"))] if found else []


def _by_letters(table: LogTable, names: dict[str, str]) -> list[GuessedColumns]:
    """Return the columns of joints whose maker names them by letters, from the base on."""
    found = _of_makers(names, _LETTER, _LETTERED)
    if found is None:
        return []
    maker, arm = found
    unit, why = _unit(table, arm, "angle")
    return [GuessedColumns("joints", arm, unit, f"axes of {maker}, {why}")]


def _force(table: LogTable, names: dict[str, str]) -> list[GuessedColumns]:
    """Return the columns of a force and its moment."""
    forces, moments = _triples(_FORCE, names), _triples(_MOMENT, names)
    if not forces:
        return []
    boxed = _boxed(table, "force", forces[0]), _boxed(table, "moment", *moments[:1])
    if boxed[0] is not None:
        return [each for each in boxed if each is not None]
    unit, why = _unit(table, forces[0], "force")
    found = [GuessedColumns("force", forces[0], unit, why)]
    if moments:
        reason = _moment_unit(table, moments[0], forces[0], unit)
        found.append(GuessedColumns("moment", moments[0], *reason))
    return found


def _boxed(table: LogTable, key: str, columns: tuple[str, ...] = ()) -> GuessedColumns | None:
    """Return columns with the unit and the counts that a sensor's box wrote above them."""
    word = {"force": "force", "moment": "torque"}[key]
    counts = {kind.lower(): float(number) for kind, number in _COUNTS.findall(table.above)}
    units = {kind.lower(): unit for kind, unit in _BOX_UNIT.findall(table.above)}
    if not (columns and word in units and counts.get(word, 0.0) > 0.0):
        return None
    unit = MEANT.get(units[word].lower(), units[word])
    return GuessedColumns(key, columns, unit, "the lines above", counts[word])


def _places(table: LogTable, names: dict[str, str], *, of_tool: bool) -> list[GuessedColumns]:
    """Return the columns of the tool's frame beside joints, elsewhere those of markers."""
    sigmas = {name for columns in _triples(_SIGMA, names) for name in columns}
    places = _triples(_POINT, {n: bare for n, bare in names.items() if n not in sigmas})
    if not of_tool:
        return [GuessedColumns("markers", each, *_unit(table, each, "length")) for each in places]
    if not places:
        return []
    found = [GuessedColumns("pose.position", places[0], *_unit(table, places[0], "length"))]
    if angles := _triples(_ANGLE, names):
        found.append(GuessedColumns("pose.angles", angles[0], *_unit(table, angles[0], "angle")))
    elif turned := _of_makers(names, _TURN, _TURNS_OF):
        maker, columns = turned
        unit, why = _unit(table, columns, "angle")
        why = f"{why}; read as angles of {maker}{_TURN_OTHERWISE.get(maker, '')}"
        found.append(GuessedColumns("pose.angles", columns, unit, why))
    elif turns := _quaternion(names):
        found.append(GuessedColumns("pose.quaternion", turns, None, "w, x, y, z"))
    return found


def _of_makers(
    names: dict[str, str], pattern: re.Pattern[str], wanted: Mapping[str, tuple[str, ...]]
) -> tuple[str, tuple[str, ...]] | None:
    """Return the maker whose letters name columns with one prefix, and these in its order.

    The first group of the pattern is the prefix, the second the letter in any case.
    """
    groups: dict[str, dict[str, str]] = {}
    for name, bare in names.items():
        if match := pattern.fullmatch(bare):
            groups.setdefault(match[1].lower(), {})[match[2].lower()] = name
    for maker, letters in wanted.items():
        for own in groups.values():
            if all(letter in own for letter in letters):
                return maker, tuple(own[letter] for letter in letters)
    return None


def _quaternion(names: dict[str, str]) -> tuple[str, ...]:
    """Return the columns of a quaternion, w first: by their letters, or numbered as by ABB."""
    found = {m[2].lower(): n for n, bare in names.items() if (m := _QUATERNION.fullmatch(bare))}
    for order in ("wxyz", "1234"):
        if all(axis in found for axis in order):
            return tuple(found[axis] for axis in order)
    return ()


def _without_names(table: LogTable) -> tuple[GuessedColumns, ...]:
    """Return a point list: three numbers after texts; what only rises, or is dated, is the time."""
    numeric = [n for n in table.header if np.isfinite(_numbers(table, n)).all()]
    rising = [n for n in numeric if np.all(np.diff(table.numbers(n)) > 0.0)]
    places = [name for name in numeric if name not in rising][:3]
    found = []
    if rising:
        found.append(GuessedColumns("time", (rising[0],), *_time_unit(table, rising[0])))
    elif dated := next((n for n in table.header if n not in numeric and _is_dated(table, n)), None):
        found.append(GuessedColumns("time", (dated,), *_time_unit(table, dated)))
    if len(places) == 3:
        unit, why = _unit(table, places, "length")
        found.append(GuessedColumns("markers", tuple(places), unit, f"three numbers, {why}"))
    return tuple(found)


def write_guess(logs: Sequence[GuessedLog], cell: Sequence[str]) -> str:
    """Return the text of a map.

    Parameters
    ----------
    logs : sequence of GuessedLog
        What they were taken for.
    cell : sequence of str
        Lines that say robot, tool, sensor and marker, or the cell file.
    """
    head = [
        f"schema: {SCHEMA}",
        "# Guessed by names and sizes of columns: look at every line. A ? is yours to write.",
        *cell,
        "logs:",
    ]
    tail = [
        "# load_cases: {normal: ['0 N', '0 N', '-1100 N']}  # on the robot, in the tcp; in order",
    ]
    return "\n".join([*head, *(line for each in logs for line in each.lines()), *tail]) + "\n"


def _bare(name: str) -> str:
    """Return the name of a column without its unit."""
    return _UNIT.sub("", name).strip()


def _stated(name: str) -> str | None:
    match = _UNIT.search(name)
    if match is None:
        return None
    unit = (match[1] or match[2]).strip()
    return MEANT.get(unit.lower(), unit)


def _triples(pattern: re.Pattern[str], names: dict[str, str]) -> list[tuple[str, ...]]:
    """Return the columns of each x, y, z (or a, b, c) of equal prefix."""
    groups: dict[str, dict[str, str]] = {}
    for name, bare in names.items():
        if match := pattern.fullmatch(bare):
            prefix, axis = [part for part in match.groups() if part is not None][-2:]
            groups.setdefault(prefix, {})[axis.lower()] = name
    found = [[own[axis] for axis in sorted(own)] for own in groups.values()]
    return [tuple(columns) for columns in found if len(columns) == 3]


def _largest(table: LogTable, columns: Sequence[str]) -> float:
    values = np.abs(np.stack([_numbers(table, name) for name in columns]))
    return float(np.nanmax(values, initial=0.0)) if np.isfinite(values).any() else 0.0


def _is_dated(table: LogTable, name: str) -> bool:
    """Return whether the cells of a column are dates or times of day."""
    try:
        return bool(np.isfinite(table.seconds(name)).all())
    except LogError:
        return False


def _numbers(table: LogTable, name: str) -> FloatArray:
    try:
        return table.numbers(name)
    except LogError:
        return np.full(len(table), np.nan)


def _unit(table: LogTable, columns: Sequence[str], kind: str) -> tuple[str, str]:
    """Return the unit of some columns, and why: their header, else their size."""
    stated = {_stated(name) for name in columns}
    if len(stated) == 1 and (unit := stated.pop()) is not None:
        return unit, "the header's unit"
    largest = _largest(table, columns)
    why = f"up to {largest:.4g}"
    if kind == "angle":
        return (
            "deg" if largest > _SURELY_DEGREES else "rad" if 0.0 < largest <= 3.5 else UNKNOWN
        ), why
    if kind == "length":
        return ("mm" if largest > _SURELY_MM else "m" if largest > _SURELY_PLACED else UNKNOWN), why
    if largest > _LARGEST_FORCE:
        return UNKNOWN, f"{why}: counts? Write how many are a unit, counts: 1000000"
    return ("N" if largest > _SURELY_NEWTONS else UNKNOWN), why


def _moment_unit(
    table: LogTable, columns: Sequence[str], force: Sequence[str], force_unit: str
) -> tuple[str, str]:
    stated = {_stated(name) for name in columns}
    if len(stated) == 1 and (unit := stated.pop()) is not None:
        return unit, "the header's unit"
    if force_unit != "N":
        return UNKNOWN, "the force's unit says nothing of it"
    lever = _largest(table, columns) / max(_largest(table, force), 1e-9)
    unit = "N*mm" if lever > _LONGEST_LEVER else "N*m"
    return unit, f"{lever:.3g} times the force"


def _time_unit(table: LogTable, name: str) -> tuple[str | None, str]:
    stated = _stated(name) or ("ms" if _bare(name).lower() in ("ms", "ipoc") else None)
    if stated is not None:
        return stated, "its name"
    try:
        steps = np.diff(table.numbers(name))
    except LogError:
        return None, "a date, or a time of day"
    step = float(np.median(steps)) if len(steps) else np.nan
    # Instruments take from some to some thousand samples a second.
    unit = "s" if step <= 0.5 else "ms" if step <= 500.0 else UNKNOWN
    return unit, f"steps of {step:.4g}"


def quoted(text: str) -> str:
    """Return a text as one value of YAML, inside braces too.

    >>> quoted("../arms/own.urdf"), quoted("a, b.urdf")
    ('../arms/own.urdf', "'a, b.urdf'")
    """
    return (
        text
        if re.fullmatch(r"(?:\.\.?/)*[A-Za-z_][\w./-]*|\d+", text)
        else "'" + text.replace("'", "''") + "'"
    )
