"""What no log contains, asked of a person for a map of logs, or left in it to be written.

Asked for are the units that sizes do not tell, then robot, tool, sensor and marker.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from elastocal.asking import HELP, ask_in_turn
from elastocal.errors import ElastocalError, RobotError, UnitError
from elastocal.files import path_from
from elastocal.logs import UNKNOWN, GuessedLog, quoted, write_guess
from elastocal.robot import catalogue, parse_urdf, read_urdf, refusals_naming, tool_link
from elastocal.units import dimension_of_unit, factor, impossible, parse_point, parse_quantity
from elastocal.wording import listed
from elastocal.workflows._inputs import ROBOT_SUFFIXES, is_file, parse_frame

_ORIGIN = '["0 mm", "0 mm", "0 mm"]'
_ENTRIES = {
    "robot": (f'{{model: "{UNKNOWN}"}}', "of `elastocal robots`, or urdf: FILE, flange: LINK"),
    "tcp": (f"{{xyz: {_ORIGIN}}}", "in the flange, z out of the tool"),
    "tool": (f'{{mass: "0 kg", centre_of_mass: {_ORIGIN}}}', "in the flange"),
    "sensor": (f"{{xyz: {_ORIGIN}}}", "measuring frame in the flange"),
    "marker": (_ORIGIN, "in the tcp, roughly"),
}
"""Entries of a map about the cell: what stands there until somebody writes it, and what it is."""
_QUESTIONS = {
    "robot": "Robot: name of the catalogue, or a URDF file",
    "flange": "Link that carries the tool, its z axis out of the arm; Enter for {flange}",
    "tcp": "Tool tip in the flange, z out of the tool: x, y, z (, a, b, c), with units",
    "mass": "Mass of all that hangs on the flange; Enter where the sensor was tared",
    "centre": "Its centre in the flange: x, y, z",
    "sensor": "Measuring frame of the force sensor in the flange: x, y, z (, a, b, c)",
    "marker": "Marker from the tool tip, roughly: x, y, z",
}
"""Questions in their order."""

_THREE = '["{}", "{}", "{}"]'
_DIMENSIONS = {
    "time": "time", "force": "force", "moment": "moment", "markers": "length",
    "pose.position": "length", "pose.angles": "angle",
}  # fmt: skip
"""Dimension of columns by their key in a map; those of joints are angles or lengths."""


def map_text(
    logs: Sequence[GuessedLog], site: Mapping[str, str], cell: Path | None, folder: Path
) -> str:
    """Return the text of a map with the cell file, or with what is known about the cell.

    Parameters
    ----------
    logs : sequence of GuessedLog
        What the logs were taken for.
    site : mapping of str to str
        Entries of the map by key, as `answered` returns them; others are left to be written.
    cell : Path or None
        Cell file that says all of it.
    folder : Path
        Folder of the map, to which the file is relative in it.
    """
    if cell is not None:
        return write_guess(logs, [f"cell: {quoted(path_from(folder, cell))}"])
    lines = []
    for key, (blank, what) in _ENTRIES.items():
        left_out = "# " if key == "tool" and key not in site else ""
        lines.append(f"{left_out}{key}: {site.get(key, blank)}  # {what}")
    return write_guess(logs, lines)


def answered(
    logs: Sequence[GuessedLog], put: Callable[[str], str], folder: Path, *, about_cell: bool
) -> tuple[tuple[GuessedLog, ...], dict[str, str]]:
    """Return logs with the units that a person gave, and entries about the cell by their keys.

    Parameters
    ----------
    logs : sequence of GuessedLog
        What the logs were taken for.
    put : callable
        Puts a question and returns the answer; an empty one leaves the question open.
    folder : Path
        Folder of the map, to which the file of a robot is relative.
    about_cell : bool
        Whether robot, tool, sensor and marker are asked for.
    """
    asked = _Asked(put, list(logs), folder)
    units = [
        (number, place)
        for number, log in enumerate(logs)
        for place, each in enumerate(log.columns)
        if each.unit == UNKNOWN
    ]
    questions = [*units, *(_QUESTIONS if about_cell else ())]
    ask_in_turn(questions, asked.put, asked.take, asked.refuse)
    return tuple(asked.logs), asked.entries()


_Question = str | tuple[int, int]
"""Key of `_QUESTIONS`, or log and place of columns whose unit is asked for."""


class _Asked:
    """The answers so far."""

    def __init__(self, put: Callable[[str], str], logs: list[GuessedLog], folder: Path) -> None:
        self._put, self._folder, self._before = put, folder, f"{HELP}.\n"
        self.logs = logs
        self._said = dict[str, str]()
        self._links: tuple[str, ...] = ()
        self._flange = ""
        """Link that carries the tool by the URDF that was given; empty: there is none."""

    def put(self, question: _Question) -> str | None:
        if isinstance(question, str):
            if self._is_needless(question):
                return None
            text = _QUESTIONS[question].format(flange=self._flange)
        else:
            log = self.logs[question[0]]
            each = log.columns[question[1]]
            text = f"{log.log}: unit of {', '.join(each.columns)} ({each.key}, {each.why})"
        before, self._before = self._before, ""
        return self._put(f"{before}{text}")

    def take(self, question: _Question, answer: str) -> None:
        if not isinstance(question, str):
            self._take_unit(*question, answer)
        elif question == "robot":
            self._take_robot(answer)
        elif answer:
            self._said[question] = self._read(question, answer)
        else:
            self._said.pop(question, None)

    def refuse(self, error: ElastocalError) -> None:
        self._before = f"   {error}\n"

    def entries(self) -> dict[str, str]:
        """Return the entries of the map that were answered."""
        said = self._said
        found: dict[str, str] = {k: said[k] for k in ("tcp", "sensor", "marker") if k in said}
        if said.get("robot"):
            flange = said.get("flange", self._flange)
            link = f", flange: {quoted(flange)}" if flange else ""
            found["robot"] = f"{{{said['robot']}{link}}}"
        if "mass" in said:
            centre = said.get("centre", _ORIGIN)
            found["tool"] = f'{{mass: "{said["mass"]}", centre_of_mass: {centre}}}'
        return found

    def _is_needless(self, key: str) -> bool:
        if key == "flange":
            return not self._flange
        return key == "centre" and "mass" not in self._said

    def _take_unit(self, number: int, place: int, answer: str) -> None:
        log = self.logs[number]
        columns = list(log.columns)
        if answer:
            of_joint = "length" if dimension_of_unit(answer) == "length" else "angle"
            factor(answer, _DIMENSIONS.get(columns[place].key, of_joint))
        columns[place] = replace(columns[place], unit=answer or UNKNOWN)
        self.logs[number] = replace(log, columns=tuple(columns))

    def _read(self, key: str, answer: str) -> str:
        """Return an answer as the map has it."""
        if key == "flange":
            if answer not in self._links:
                raise RobotError(f"the robot has no link {answer!r} (links: {listed(self._links)})")
            return answer
        if key == "mass":
            wrong = impossible("mass", parse_quantity(answer, "mass"))
            if wrong is not None:
                raise UnitError(f"the mass is {wrong}")
            return answer
        parts = [part.strip() for part in answer.split(",")]
        if key in ("centre", "marker") or len(parts) == 3:
            parse_point(answer)
            point = _THREE.format(*parts)
            return point if key in ("centre", "marker") else f"{{xyz: {point}}}"
        parse_frame(answer, rule="must be three lengths, or three lengths and three angles")
        return f"{{xyz: {_THREE.format(*parts[:3])}, abc: {_THREE.format(*parts[3:])}}}"

    def _take_robot(self, answer: str) -> None:
        """Take a robot, or none; the link that carried the tool of another one is forgotten."""
        path, entry, flange, links = Path(answer), "", "", tuple[str, ...]()
        if path.suffix.lower() in ROBOT_SUFFIXES or is_file(path):
            urdf = read_urdf(path)
            with refusals_naming(path):
                flange = tool_link(urdf)
            links = tuple(link.get("name", "") for link in parse_urdf(urdf).findall("link"))
            entry = f"urdf: {quoted(path_from(self._folder, path))}"
        elif answer:
            entry = f'model: "{catalogue.entry(answer).name}"'
        self._said.pop("flange", None)
        self._said["robot"], self._flange, self._links = entry, flange, links
