"""Strict readers of the programs that the writers write; they share no code with the writers.

A line that a reader does not know is an error, so that nothing is written that no test looks at.
URScript is read by Python's own parser: what is left without its ``end`` is Python.
"""

import ast
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from support import krl


@dataclass(frozen=True)
class Target:
    """Where a move goes: in the controller's units as it stands, and in ours."""

    arm: np.ndarray | None = None
    """Joints of the model's arm, in rad."""
    T: np.ndarray | None = None
    """In m."""
    external: tuple[float, ...] = ()
    """In mm or deg."""


@dataclass(frozen=True)
class Read:
    """What a program says."""

    name: str
    steps: list[tuple]
    """("axes", name), ("straight", name, m/s) and ("stop",), in order."""
    targets: Mapping[str, Target]
    tool: np.ndarray | None
    """In the flange, in m; None where the program only names one."""
    comments: list[str]
    axes_speed: float
    """As the program has it, in its own unit."""
    lines: list[str] = field(default_factory=list)


def lines_of(path: Path, end: str) -> list[str]:
    """Return the lines of an ASCII file whose every line ends in the same way."""
    text = path.read_bytes().decode("ascii")
    assert text.endswith(end)
    assert text.count("\n") == text.count(end)
    assert text.count("\r") == (text.count(end) if end == "\r\n" else 0)
    return text.split(end)[:-1]


def numbers(text: str) -> list[float]:
    """Return the numbers of a text of plain decimals, split at commas."""
    parts = text.split(",")
    assert all(re.fullmatch(r"-?\d+(\.\d+)?", part.strip()) for part in parts), text
    return [float(part) for part in parts]


def read_krl(files: tuple[Path, ...]) -> Read:
    """Return a program in KRL."""
    found = krl.read(*files)
    steps: list[tuple] = []
    speed = np.nan
    for kind, what in found.orders:
        if kind == "PTP":
            steps.append(("axes", what))
        elif kind == "LIN":
            steps.append(("straight", what, speed))
        elif kind == "VEL.CP":
            speed = what
        elif kind == "HALT":
            steps.append(("stop",))
    targets = {}
    for name, position in found.positions.items():
        external = tuple(position.external)
        if position.kind == "E6AXIS":
            targets[name] = Target(arm=np.radians(position.arm), external=external)
        else:
            targets[name] = Target(T=position.T, external=external)
    (percent,) = [line for line in found.setup if "#VEL_PTP" in line]
    speed = float(re.search(r",(\d+)", percent)[1])
    lines = [line for path in files for line in krl.lines_of(path)]
    comments = [line.removeprefix("; ") for line in found.comments]
    return Read(found.name, steps, targets, None, comments, speed, lines)


_RAPID_NUMBER = r"-?\d+(?:\.\d+)?(?:E\+\d+)?"
_LIST = rf"\[{_RAPID_NUMBER}(?:,{_RAPID_NUMBER})*\]"
_POSE = rf"\[({_LIST}),({_LIST})\]"
_RAPID = {
    "tool": re.compile(
        rf"PERS tooldata (\w+) := \[TRUE,{_POSE},\[-1,\[0,0,0\],\[1,0,0,0\],0,0,0\]\]"
    ),
    "object": re.compile(rf'PERS wobjdata (\w+) := \[FALSE,TRUE,"",{_POSE},{_POSE}\]'),
    "speed": re.compile(rf"CONST speeddata (\w+) := ({_LIST})"),
    "joints": re.compile(rf"CONST jointtarget (\w+) := \[({_LIST}),({_LIST})\]"),
    "frame": re.compile(rf"CONST robtarget (\w+) := \[({_LIST}),({_LIST}),\[0,0,0,0\],({_LIST})\]"),
    "axes": re.compile(r"MoveAbsJ (\w+),(\w+),fine,(\w+)\\WObj:=(\w+)"),
    "straight": re.compile(r"MoveL (\w+),(\w+),fine,(\w+)\\WObj:=(\w+)"),
    "stop": re.compile("Stop"),
    "configuration": re.compile(r"Conf[JL]\\Off"),
}


def read_rapid(files: tuple[Path, ...]) -> Read:
    """Return a program in RAPID: statements end in semicolons, line breaks do not count."""
    lines = lines_of(files[0], "\r\n")
    assert lines[:5] == ["%%%", "  VERSION:1", "  LANGUAGE:ENGLISH", "%%%", ""]
    comments = [line.strip()[1:].strip() for line in lines if line.strip().startswith("!")]
    code = " ".join(line.strip() for line in lines[5:] if not line.strip().startswith("!"))
    whole = re.fullmatch(r"MODULE (\w+) (.*;) PROC (\w+)\(\) (.*;) ENDPROC ENDMODULE", code)
    assert whole, code[:200]
    _, data, name, body = whole.groups()
    found = _RapidModule()
    for statement in (data + body).split(";")[:-1]:
        found.take(re.sub(r",\s+", ",", statement.strip()))
    assert found.speeds.keys() >= found.used_speeds
    return Read(
        name, found.steps, found.targets, found.tool, comments, found.speeds["vAxes"][0], lines
    )


class _RapidModule:
    def __init__(self) -> None:
        self.steps: list[tuple] = []
        self.targets: dict[str, Target] = {}
        self.speeds: dict[str, list[float]] = {}
        self.used_speeds: set[str] = set()
        self.frames: set[str] = set()
        self.tool = None

    def take(self, statement: str) -> None:
        for kind, pattern in _RAPID.items():
            if match := pattern.fullmatch(statement):
                getattr(self, f"_{kind}")(*match.groups())
                return
        raise AssertionError(statement)

    def _tool(self, name, place, quaternion):
        self.tool = _rapid_pose(place, quaternion)
        self.frames.add(name)

    def _object(self, name, *poses):
        assert [_list(each) for each in poses] == [[0] * 3, [1, 0, 0, 0]] * 2
        self.frames.add(name)

    def _speed(self, name, values):
        self.speeds[name] = _list(values)
        assert len(self.speeds[name]) == 4

    def _joints(self, name, arm, external):
        assert name not in self.targets
        self.targets[name] = Target(arm=np.radians(_list(arm)), external=_there(external))

    def _frame(self, name, place, quaternion, external):
        assert name not in self.targets
        self.targets[name] = Target(T=_rapid_pose(place, quaternion), external=_there(external))

    def _axes(self, name, speed, *frames):
        assert self.frames == set(frames)
        self.steps.append(("axes", name))
        assert speed == "vAxes"

    def _straight(self, name, speed, *frames):
        assert self.frames == set(frames)
        self.used_speeds.add(speed)
        self.steps.append(("straight", name, 1e-3 * self.speeds[speed][0]))

    def _stop(self):
        self.steps.append(("stop",))

    def _configuration(self):
        assert not self.steps


def _list(text: str) -> list[float]:
    return [float(part) for part in text.strip("[]").split(",")]


def _there(text: str) -> tuple[float, ...]:
    values = _list(text)
    assert len(values) == 6
    return tuple(value for value in values if value != 9e9)


def _rapid_pose(place: str, quaternion: str) -> np.ndarray:
    w, x, y, z = _list(quaternion)
    assert abs(np.linalg.norm((w, x, y, z)) - 1.0) < 1e-6
    return _T(np.array(_list(place)) / 1e3, Rotation.from_quat((x, y, z, w)))


def _T(place: np.ndarray, rotation: Rotation) -> np.ndarray:
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation.as_matrix(), place
    return T


_TP_POSITION = re.compile(
    r'P\[(\d+):"(\w{1,16})"\]\{\n   GP1:\n\tUF : 1, UT : 1,\n((?:\t.*\n)+)\};'
)
_TP_VALUE = re.compile(r"([JE]\d)= +(-?\d+\.\d+) +(deg|mm)")
_TP_MOVE = re.compile(r"([JL]) P\[(\d+)\] (\d+)(%|mm/sec) FINE")


def read_fanuc(files: tuple[Path, ...]) -> Read:
    """Return a program in the ASCII form of FANUC's teach pendant."""
    lines = lines_of(files[0], "\r\n")
    cuts = [lines.index(word) for word in ("/ATTR", "/APPL", "/MN", "/POS", "/END")]
    assert cuts == sorted(cuts)
    assert cuts[-1] == len(lines) - 1
    name = re.fullmatch(r"/PROG  ([A-Z]\w*)", lines[0])[1]
    orders, comments = _tp_orders(lines[cuts[2] + 1 : cuts[3]])
    assert f"LINE_COUNT\t= {cuts[3] - cuts[2] - 1};" in lines
    numbered = {}
    text = "\n".join(lines[cuts[3] + 1 : -1]) + "\n"
    for match in _TP_POSITION.finditer(text):
        assert int(match[1]) == len(numbered) + 1
        numbered[match[1]] = (match[2], _tp_target(match[3]))
    assert not _TP_POSITION.sub("", text).strip()
    assert orders[:2] == ["UFRAME_NUM=1", "UTOOL_NUM=1"]
    steps, percents = [], set()
    for order in orders[2:]:
        match = _TP_MOVE.fullmatch(order)
        if order == "PAUSE":
            steps.append(("stop",))
        elif match[1] == "J":
            percents.add(int(match[3]))
            steps.append(("axes", numbered[match[2]][0]))
        else:
            assert match[4] == "mm/sec"
            steps.append(("straight", numbered[match[2]][0], 1e-3 * int(match[3])))
    (percent,) = percents
    return Read(name.lower(), steps, dict(numbered.values()), None, comments, percent, lines)


def _tp_orders(lines: list[str]) -> tuple[list[str], list[str]]:
    orders, comments = [], []
    for number, line in enumerate(lines, start=1):
        match = re.fullmatch(r" *(\d+):(.*) ;", line)
        assert int(match[1]) == number
        order = match[2].strip()
        if order.startswith("!"):
            assert len(order) <= 33
            comments.append(order[1:])
        else:
            orders.append(order)
    return orders, comments


def _tp_target(text: str) -> Target:
    found = {match[1]: (float(match[2]), match[3]) for match in _TP_VALUE.finditer(text)}
    assert not re.sub(r"[,\s]", "", _TP_VALUE.sub("", text))
    arm = np.array([found[f"J{i}"][0] for i in range(1, 7)])
    # The pendant counts J3 from the horizontal, the model from the upper arm.
    arm[2] += arm[1]
    external = tuple(value for key, (value, _) in found.items() if key.startswith("E"))
    return Target(arm=np.radians(arm), external=external)


def read_urscript(files: tuple[Path, ...]) -> Read:
    """Return a program in URScript."""
    lines = lines_of(files[0], "\n")
    code = [re.sub(r"\bp\[", "pose[", line) for line in lines if line != "end"]
    source = "\n".join(code).replace("blocking=True", "blocking=1")
    definition, call = ast.parse(source).body
    assert isinstance(definition, ast.FunctionDef)
    assert ast.unparse(call) == f"{definition.name}()"
    steps, targets, speeds, tool = [], {}, set(), None
    for statement in definition.body:
        if isinstance(statement, ast.Assign):
            (name,) = statement.targets
            targets[name.id] = _ur_target(statement.value)
            continue
        function = statement.value.func.id
        first, options = statement.value.args[0], statement.value.keywords
        given = {option.arg: ast.literal_eval(option.value) for option in options}
        if function == "set_tcp":
            tool = _ur_target(first).T
        elif function == "popup":
            assert given == {"title": "elastocal", "blocking": 1}
            steps.append(("stop",))
        elif function == "movej":
            steps.append(("axes", first.id))
            speeds.add(given["v"])
        else:
            assert function == "movel"
            steps.append(("straight", first.id, given["v"]))
    (speed,) = speeds
    comments = [line.strip()[2:] for line in lines if line.strip().startswith("#")]
    return Read(definition.name, steps, targets, tool, comments, speed, lines)


def _ur_target(value: ast.expr) -> Target:
    if isinstance(value, ast.List):
        return Target(arm=np.array(ast.literal_eval(value)))
    assert value.value.id == "pose"
    x, y, z, *turn = ast.literal_eval(value.slice)
    return Target(T=_T(np.array((x, y, z)), Rotation.from_rotvec(turn)))


def read_as(files: tuple[Path, ...]) -> Read:
    """Return a program in the AS language."""
    lines = lines_of(files[0], "\r\n")
    name = re.fullmatch(r"\.PROGRAM ([A-Za-z]\w{0,14})\(\)", lines[0])[1]
    assert lines[-1] == ".END"
    body = [line.removeprefix("  ") for line in lines[1:-1]]
    comments = [line[2:] for line in body if line.startswith(";")]
    orders = [line for line in body if not line.startswith(";")]
    tool = re.fullmatch(r"TOOL TRANS\((.*)\)", orders[0])[1]
    assert orders[1] == "ACCURACY 1 ALWAYS"
    x, y, z, *turn = numbers(tool)
    T = _T(np.array((x, y, z)) / 1e3, Rotation.from_euler("ZYZ", turn, degrees=True))
    steps, targets, percents, speed = [], {}, set(), None
    for order, following in zip(orders[2:], [*orders[3:], ""], strict=True):
        if match := re.fullmatch(r"POINT #(\w{1,15}) = #PPOINT\((.*)\)", order):
            assert not steps
            values = numbers(match[2])
            targets[match[1]] = Target(arm=np.radians(values[:6]), external=tuple(values[6:]))
        elif match := re.fullmatch(r"SPEED (\d+) ALWAYS", order):
            percents.add(int(match[1]))
            speed = None
        elif match := re.fullmatch(r"SPEED (\d+\.\d+) MM/S ALWAYS", order):
            speed = 1e-3 * float(match[1])
        elif match := re.fullmatch(r"([JL])MOVE #(\w+)", order):
            assert following == "BREAK"
            assert (match[1] == "J") == (speed is None)
            steps.append(("axes", match[2]) if speed is None else ("straight", match[2], speed))
        elif order == "PAUSE":
            steps.append(("stop",))
        else:
            assert order == "BREAK", order
    (percent,) = percents
    return Read(name, steps, targets, T, comments, percent, lines)


READERS: Mapping[str, Callable[[tuple[Path, ...]], Read]] = {
    "krl": read_krl,
    "rapid": read_rapid,
    "fanuc": read_fanuc,
    "urscript": read_urscript,
    "as": read_as,
}
