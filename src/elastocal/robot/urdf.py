"""Reader of published URDFs: elements are checked by name, then Pinocchio builds the chain.

Only the joints from the base to the requested tip are a robot here. Every other joint of any kind
is fixed at zero (a mimicking piston, a gripper's fingers), so that the links behind it keep their
position and weight; frames beside the chain (``base``, copies of the flange) do no harm.

The checks come before Pinocchio because its parser reports problems on the C++ error stream; a user
of elastocal gets one line that names the link, the joint and the allowed ones. Pinocchio gets a
copy (`serial_urdf`) reduced to what the computation needs: statics needs masses and their centres,
no inertia tensor.

The elements of a URDF, checked by name: links, joints, and the joints of a chain.
"""

import codecs
import contextlib
import math
import re
import reprlib
import xml.etree.ElementTree as ElementTree
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin

from elastocal.errors import FileAccessError, RobotError, nearest
from elastocal.files import read_bytes
from elastocal.robot.chain import ChainJoint, SerialChain
from elastocal.robot.dh_table import urdf_of_table
from elastocal.units import impossible, parse_number
from elastocal.wording import listed, phrase

_NUMBERS = {
    "origin": {"xyz": 3, "rpy": 3},
    "axis": {"xyz": 3},
    "limit": {"lower": 1, "upper": 1, "effort": 1, "velocity": 1},
    "mass": {"value": 1},
    "box": {"size": 3},
    "sphere": {"radius": 1},
    "cylinder": {"radius": 1, "length": 1},
    "mesh": {"scale": 3},
}
"""Number of values of each attribute of each element (ROS wiki, urdf/XML)."""
_DIMENSIONS = {
    ("origin", "xyz"): "length",
    ("origin", "rpy"): "angle",
    ("mass", "value"): "mass",
    ("box", "size"): "length",
    ("sphere", "radius"): "length",
    ("cylinder", "radius"): "length",
    ("cylinder", "length"): "length",
}
"""Attributes of those whose size is bounded: limits of joints often hold 1e16 for "none"."""
_AXIS_LENGTHS = (1e-6, 1e6)
"""Lengths of a joint's axis: its square must neither vanish nor overflow when it is normed."""
_MOVABLE = ("revolute", "continuous", "prismatic")


def check_elements(root: ElementTree.Element) -> None:
    """Refuse invalid numbers, and names that are missing or repeated.

    Elements for display only are not checked; axes and limits are checked for joints that move.

    Raises
    ------
    RobotError
        With the link or joint, the element and its value.
    """
    for kind in ("link", "joint"):
        _check_names(root, kind)
    for link in root.findall("link"):
        for part in (*link.findall("inertial"), *link.findall("collision")):
            for element in part.iter():
                _check_numbers(f"link {link.get('name')!r}", element)
    for joint in root.findall("joint"):
        for element in joint.findall("origin"):
            _check_numbers(f"joint {joint.get('name')!r}", element)


def _check_names(root: ElementTree.Element, kind: str) -> None:
    names = [element.get("name", "") for element in root.findall(kind)]
    unnamed = [index for index, name in enumerate(names) if not name.strip()]
    if unnamed:
        raise RobotError(f"URDF: {_place(root, kind, unnamed[0])} has no name")
    twice = sorted(name for name, times in Counter(names).items() if times > 1)
    if twice:
        raise RobotError(f"URDF has two {kind}s named {twice[0]!r}")


def _place(root: ElementTree.Element, kind: str, index: int) -> str:
    """Return the position of a link or joint without a name, in words."""
    element = root.findall(kind)[index]
    ends = (element.find(role) for role in ("parent", "child"))
    linked = " to ".join(repr(end.get("link", "")) for end in ends if end is not None)
    return f"{kind} {index + 1} of the file{f', from {linked},' if linked else ''}"


def _check_numbers(owner: str, element: ElementTree.Element) -> None:
    for name, count in _NUMBERS.get(element.tag, {}).items():
        text = element.get(name)
        if text is None:
            continue
        values = _floats(text)
        # A limit may be infinite, as several exporters write "none".
        finite = all(map(math.isfinite, values)) or element.tag == "limit"
        # A single number with a space beside it is none to urdfdom, which then drops the inertia.
        spaced = count == 1 and text != text.strip()
        if len(values) != count or spaced or not finite or any(map(math.isnan, values)):
            what = "a finite number" if count == 1 else f"{count} finite numbers"
            raise RobotError(f"URDF {owner}: <{element.tag} {name}={text!r}> must be {what}")
        if element.tag == "axis" and not any(values):
            raise RobotError(f"URDF {owner}: <axis xyz={text!r}> must not be zero")
        low, high = _AXIS_LENGTHS
        if element.tag == "axis" and not low <= math.hypot(*values) <= high:
            raise RobotError(
                f"URDF {owner}: <axis xyz={text!r}> must have a length from {low:g} to {high:g}"
            )
        dimension = _DIMENSIONS.get((element.tag, name))
        problem = impossible(dimension, *values) if dimension else None
        if problem is not None:
            raise RobotError(f"URDF {owner}: <{element.tag} {name}={text!r}> is {problem}")


def _floats(text: str) -> list[float]:
    """Return the numbers of an attribute; none where Python is alone in reading one."""
    if "_" in text or not text.isascii():
        return []
    try:
        return [parse_number(part) for part in text.split()]
    except ValueError:
        return []


def link_names(root: ElementTree.Element) -> list[str]:
    """Return the names of the links of a URDF."""
    return [link.get("name", "") for link in root.findall("link")]


def link_of(joint: ElementTree.Element, role: str) -> str:
    """Return the name of the parent or the child link of a joint; `RobotError` without one."""
    element = joint.find(role)
    if element is None or not element.get("link"):
        raise RobotError(f"URDF joint {joint.get('name')!r} has no {role} link")
    return element.get("link", "")


def joints_by_child(root: ElementTree.Element) -> dict[str, ElementTree.Element]:
    """Return the joint that carries each link, by the name of the link.

    Raises
    ------
    RobotError
        If two joints carry the same, or a joint names a link that is not there.
    """
    links = dict.fromkeys(link_names(root))
    joint_to: dict[str, ElementTree.Element] = {}
    for joint in root.findall("joint"):
        for role in ("parent", "child"):
            name = link_of(joint, role)
            if name not in links:
                raise RobotError(
                    f"URDF joint {joint.get('name')!r}: no link {name!r} ({role})"
                    f"{nearest(name, links)} (links: {listed(list(links))})"
                )
        first = joint_to.setdefault(link_of(joint, "child"), joint)
        if first is not joint:
            raise RobotError(
                f"URDF link {link_of(joint, 'child')!r} is the child of two joints,"
                f" {first.get('name')!r} and {joint.get('name')!r}: links must form a tree"
            )
    return joint_to


def joints_between(
    joint_to: dict[str, ElementTree.Element], base: str, tip: str
) -> list[ElementTree.Element]:
    """Return the movable joints from base to tip, checked one by one."""
    joints: list[ElementTree.Element] = []
    link, seen = tip, set[str]()
    while link != base:
        joint = joint_to.get(link)
        if joint is None or link in seen:
            raise RobotError(f"URDF has no chain from base link {base!r} to tip link {tip!r}")
        seen.add(link)
        if is_movable(joint):
            joints.append(joint)
        link = link_of(joint, "parent")
    if not joints:
        raise RobotError(f"URDF has no movable joint between {base!r} and {tip!r}")
    return joints[::-1]


def is_movable(joint: ElementTree.Element) -> bool:
    """Return whether a joint of a chain moves.

    Raises
    ------
    RobotError
        If its type is not allowed in a chain.
    """
    name, kind, limit = joint.get("name"), joint.get("type"), joint.find("limit")
    if kind == "fixed":
        return False
    if kind not in _MOVABLE:
        raise RobotError(
            f"URDF joint {name!r} is {kind}: the chain may have revolute, continuous, prismatic"
            " and fixed joints"
        )
    if joint.find("mimic") is not None:
        raise RobotError(f"URDF joint {name!r} mimics another one: not possible inside the chain")
    if kind != "continuous" and limit is None:
        raise RobotError(f"URDF joint {name!r} is {kind} and has no <limit>")
    for element in joint:
        _check_numbers(f"joint {name!r}", element)
    limits = limits_of(joint)
    if not limits["lower"] <= limits["upper"]:
        raise RobotError(
            f"URDF joint {name!r}: <limit lower={limits['lower']:g} upper={limits['upper']:g}>:"
            " lower must not be above upper"
        )
    return True


def limits_of(joint: ElementTree.Element) -> dict[str, float]:
    """Return the limits of a movable joint in rad or m; infinite or NaN where not known."""
    limit = joint.find("limit")
    texts = {} if limit is None else limit.attrib
    lower, upper, velocity, effort = (
        float(texts.get(name, "0")) for name in ("lower", "upper", "velocity", "effort")
    )
    if joint.get("type") == "continuous":
        lower, upper = -math.inf, math.inf
    return {
        "lower": lower,
        "upper": upper,
        "velocity": velocity if 0.0 < velocity < math.inf else math.nan,
        "effort": effort if 0.0 < effort < math.inf else math.nan,
    }


_ENCODING = re.compile(rb"<\?xml[^>]*?encoding\s*=\s*[\"']([\w.-]+)")
_BEFORE_ROOT = re.compile(r"\A(?:\ufeff|\s|<!--.*?-->)*(?:<\?xml\b.*?\?>)?", re.S)
"""Text that authors put before the XML declaration, where XML allows none; and the declaration."""
_FEWEST_OF_AN_ARM, _MOST_OF_A_FINGER = 3, 4
"""Joints before a gripper, and of one of its fingers."""
_FEWEST_AXES = 6
"""Turning joints of an arm whose efforts are compared with each other."""
_TOOL_LINKS = ("flange", "tool0", "tool_0")
"""Links that carry the tool in URDFs as they are published."""
_NO_INERTIA = dict.fromkeys(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), "0")
_ANY_LIMIT = dict.fromkeys(("lower", "upper", "effort", "velocity"), "0")
"""Pinocchio wants limits; `_joint_of` takes them from where they were written."""
_XACRO = (
    "this is a xacro template, not a URDF: expand it (ROS package xacro) with"
    " `xacro FILE.xacro > ROBOT.urdf` and give ROBOT.urdf"
)


@dataclass(frozen=True)
class Assumption:
    """A number of a robot description that has no source.

    Read from the element ``<assumption field="…" reason="…"/>`` that the catalogue writes into its
    URDFs; every use of such a number must be reported.
    """

    field: str
    """Field that is assumed: ``dimension``, ``position``, ``velocity``, ``effort``, ``inertia`` or
    ``shape``."""
    reason: str
    """Origin of the value, in words."""


@contextlib.contextmanager
def refusals_naming(path: Path) -> Iterator[None]:
    """Name the file in what is refused of its URDF in the block."""
    try:
        yield
    except RobotError as error:
        raise RobotError(f"{path}: {error}") from error


def read_urdf(path: Path) -> str:
    """Return the text of a URDF file, in the encoding that it declares (UTF-8 by default).

    Of a table of Denavit and Hartenberg's numbers, ``.csv``, that of its arm
    (`elastocal.robot.dh_table`).

    Raises
    ------
    FileAccessError
        If the file is missing, unreadable, or not text in that encoding.
    """
    if path.suffix.lower() == ".csv":
        return urdf_of_table(path)
    data = read_bytes(path)
    for encoding in _encodings(data):
        try:
            text = data.decode(encoding).removeprefix("\ufeff")
        except (UnicodeError, LookupError):
            continue
        if text.strip():
            return text
        raise FileAccessError(f"cannot read {path}: the file is empty")
    raise FileAccessError(f"cannot read {path}: not a UTF-8 text file")


def _encodings(data: bytes) -> Iterator[str]:
    """Yield how a URDF may be encoded: as its mark or declaration says, UTF-8, western comments."""
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        yield "utf-16"
    declared = _ENCODING.search(data[:1000])
    if declared:
        yield declared[1].decode()
    yield "utf-8"
    if b"<robot" in data:
        yield "latin-1"


def parse_urdf(text: str, comments: bool = False) -> ElementTree.Element:
    """Return the root element of a URDF.

    Parameters
    ----------
    text : str
        The URDF; blank lines and comments may precede its XML declaration.
    comments : bool
        Whether comments are kept.

    Raises
    ------
    RobotError
        If the text is not XML, its root is not ``<robot>``, or it is a xacro template.
    """
    builder = ElementTree.TreeBuilder(insert_comments=comments)
    try:
        # Line breaks stay, so that the parser's messages name the line of the file.
        bare = _BEFORE_ROOT.sub(lambda found: "\n" * found[0].count("\n"), text, count=1)
        root = ElementTree.fromstring(bare, ElementTree.XMLParser(target=builder))
    except ElementTree.ParseError as error:
        if "<xacro:" in text:
            raise RobotError(_XACRO) from error
        if "<" not in text:
            raise RobotError(
                f"a URDF is a text with an element <robot>, not {reprlib.repr(text)}"
                " (Robot.from_file reads a file)"
            ) from error
        raise RobotError(f"URDF is not valid XML: {error}") from error
    if root.find("link") is None and root.find("group") is not None:
        raise RobotError(
            "this is an SRDF, which groups the joints of a robot: give the URDF that it is of"
        )
    namespace = root.tag.removesuffix("robot")
    if namespace not in ("", f"{{{namespace[1:-1]}}}"):
        raise RobotError(f"URDF root element is <{root.tag}>, not <robot>")
    for element in root.iter():
        if isinstance(element.tag, str):  # that of a comment is a function
            _refuse_template(element)
            element.tag = element.tag.removeprefix(namespace)
    return root


def _refuse_template(element: ElementTree.Element) -> None:
    """Refuse what xacro replaces.

    Raises
    ------
    RobotError
        With the command that does it.
    """
    values = element.attrib.values()
    if "xacro}" in element.tag or any("${" in value or "$(" in value for value in values):
        raise RobotError(_XACRO)


def robot_name(root: ElementTree.Element) -> str:
    """Return the name attribute of a URDF, or ``"unnamed"``."""
    return root.get("name") or "unnamed"


def root_link(root: ElementTree.Element) -> str:
    """Return the link without a parent.

    Raises
    ------
    RobotError
        If the links do not form one tree.
    """
    return _links_downward(root)[0]


def _links_downward(root: ElementTree.Element) -> list[str]:
    """Return the links, each behind the one that it hangs on."""
    links, joint_to = link_names(root), joints_by_child(root)
    roots = [link for link in links if link not in joint_to]
    if len(roots) != 1:
        raise RobotError(f"URDF must have exactly one root link, has {roots or 'none'}")
    children: dict[str, list[str]] = {}
    for child, joint in joint_to.items():
        children.setdefault(link_of(joint, "parent"), []).append(child)
    downward = list(roots)
    for link in downward:
        downward += children.get(link, [])
    loose = sorted(set(links) - set(downward))
    if loose:
        raise RobotError(f"URDF joints form a loop: {listed(loose)} do not hang on {roots[0]!r}")
    return downward


def leaf_links(root: ElementTree.Element) -> list[str]:
    """Return the links that have no child."""
    parents = {link_of(joint, "parent") for joint in root.findall("joint")}
    return [link for link in link_names(root) if link not in parents]


def tip_links(root: ElementTree.Element) -> dict[str, int]:
    """Return the candidates for a tool centre point: leaf links that a serial chain moves.

    The link that carries a gripper's fingers replaces them.

    Returns
    -------
    dict of int
        The number of joints of each chain from the root.

    Raises
    ------
    RobotError
        If there is none, with the reason; or if the URDF is damaged.
    """
    check_elements(root)
    moved, refusal = _moved(root)
    fingers = _fingers(root, moved)
    ends = dict.fromkeys(fingers.get(leaf, leaf) for leaf in leaf_links(root))
    tips = {link: moved[link] for link in ends if moved.get(link)}
    if not tips:
        raise refusal
    return tips


def _moved(root: ElementTree.Element) -> tuple[dict[str, int], RobotError]:
    """Return the number of joints of the chain to each link, and why others have none."""
    joint_to, refusal = joints_by_child(root), RobotError("URDF has no joint that moves")
    first, *others = _links_downward(root)
    moved = {first: 0}
    for link in others:
        joint = joint_to[link]
        before = moved.get(link_of(joint, "parent"))
        try:
            if before is not None:
                moved[link] = before + is_movable(joint)
        except RobotError as error:
            refusal = error
    return moved, refusal


def _fingers(root: ElementTree.Element, moved: Mapping[str, int]) -> dict[str, str]:
    """Return the links of grippers' fingers, each with the link that carries its fingers.

    That is one at the end of an arm from which two or more chains go on, few joints each: as many
    in each, or of which one mimics another. The arms of a torso have more; a wrist beside which
    something turns ends in a link of a name that tools are mounted on, or has another number of
    joints.

    Parameters
    ----------
    root : Element
        The robot.
    moved : mapping of str to int
        Number of joints of the chain to each link that a chain moves.
    """
    joint_to, downward = joints_by_child(root), _links_downward(root)
    # Movable joints behind each link, and the chains that go on from it.
    behind = dict.fromkeys(downward, 0)
    branches: dict[str, list[str]] = {link: [] for link in downward}
    for link in reversed(downward[1:]):
        own = behind[link] + (joint_to[link].get("type") != "fixed")
        parent = link_of(joint_to[link], "parent")
        behind[parent] += own
        if own:
            branches[parent].append(link)
    # Links with a tool's link behind them, by its name.
    named = set[str]()
    for link in filter(set(_TOOL_LINKS).__contains__, downward):
        above: str | None = link
        while above is not None:
            named.add(above)
            above = link_of(joint_to[above], "parent") if above in joint_to else None
    mimics = {link for link, joint in joint_to.items() if joint.find("mimic") is not None}
    coupled = set[str]()
    for link in reversed(downward[1:]):
        if link in mimics or link in coupled:
            coupled.add(link_of(joint_to[link], "parent"))
    hands = {
        link
        for link, inner in branches.items()
        if len(inner) > 1
        and (len({behind[each] for each in inner}) == 1 or link in coupled)
        and max(behind[each] for each in inner) < _MOST_OF_A_FINGER
        and moved.get(link, 0) >= _FEWEST_OF_AN_ARM
        and not named & set(inner)
    }
    hand_of: dict[str, str] = {}
    for link in downward[1:]:
        parent = link_of(joint_to[link], "parent")
        if parent in hand_of:
            hand_of[link] = hand_of[parent]
        elif parent in hands and link in branches[parent]:
            hand_of[link] = parent
    return hand_of


def tool_link(text: str) -> str:
    """Return the link of a URDF on which a tool is mounted, by names and axes.

    That is ``flange``, ``tool0``, or else the leaf behind the most joints; of several behind
    equally many joints, one whose z axis points out of the arm. In ROS-Industrial the x axis of
    ``flange`` points there, and the z axis of ``tool0``.

    Raises
    ------
    RobotError
        If no serial chain moves a leaf link, or the URDF is damaged.
    """
    tips = tip_links(parse_urdf(text))
    known = [name for name in _TOOL_LINKS if name in tips]
    first = known[0] if known else max(tips, key=lambda tip: tips[tip])
    alike = [tip for tip in dict.fromkeys((first, *known, *tips)) if tips[tip] == tips[first]]
    straight = (tip for tip in alike if read_chain(text, tip).points_out)
    return next(straight, first)


def assumptions(root: ElementTree.Element, chain: SerialChain) -> tuple[Assumption, ...]:
    """Return the values that the URDF itself marks as having no source, or that are fillers."""
    marked = tuple(
        Assumption(element.get("field", ""), element.get("reason", ""))
        for element in root.iter("assumption")
    )
    names = {joint.name for joint in chain.joints}
    filler = _filler_effort(each for each in root.findall("joint") if each.get("name") in names)
    if filler is None:
        return marked
    reason = phrase(
        "unknown: the URDF gives every joint the same, {effort} N*m, as no arm has;"
        " limits.torque.values of the cell file takes those of the data sheet",
        effort=f"{filler:g}",
    )
    return (*marked, Assumption("effort", reason))


def _filler_effort(joints: Iterable[ElementTree.Element]) -> float | None:
    """Return the effort that all joints of an arm share: exporters write one that is none.

    An arm's shoulder has several times the torque of its wrist. None if efforts differ or are not
    known, or for fewer joints than an arm has.
    """
    turning = [each for each in joints if each.get("type") in ("revolute", "continuous")]
    efforts = {limits_of(each)["effort"] for each in turning}
    common = next(iter(efforts), math.nan)
    same = len(turning) >= _FEWEST_AXES and len(efforts) == 1 and math.isfinite(common)
    return common if same else None


def read_chain(text: str, tip: str, base: str | None = None) -> SerialChain:
    """Return the serial chain from ``base`` to ``tip``.

    Joints of a gripper's finger are no axes of the arm: with a tip on one they are fixed at zero,
    as they are with one on the hand.

    Parameters
    ----------
    text : str
        The URDF.
    tip : str
        Name of the last link, e.g. the tool centre point.
    base : str, optional
        Name of the first link; the root of the tree by default.

    Raises
    ------
    RobotError
        If the URDF cannot be parsed, a link is missing, or the chain is not serial.
    """
    root = parse_urdf(text)
    check_elements(root)
    links = link_names(root)
    base = base or root_link(root)
    for role, link in (("tip", tip), ("base", base)):
        if link not in links:
            raise RobotError(
                f"URDF of {robot_name(root)} has no {role} link {link!r}{nearest(link, links)}"
                f" (links: {listed(links)})"
            )
    root_link(root)
    fingers = _fingers(root, _moved(root)[0])
    joints = joints_between(joints_by_child(root), base, fingers.get(tip, tip))
    serial = serial_urdf(root, [joint.get("name", "") for joint in joints])
    try:
        model = pin.buildModelFromXML(serial)
    except ValueError as error:
        raise RobotError(f"URDF of {robot_name(root)} is refused by Pinocchio: {error}") from error
    return _chain_of(model, joints, base, tip)


def serial_urdf(root: ElementTree.Element, joints: Iterable[str], shapes: bool = False) -> str:
    """Return a URDF in which only the named joints move: what Pinocchio is to compute with.

    Parameters
    ----------
    root : Element
        A URDF that `read_chain` accepts.
    joints : iterable of str
        Names of the joints that move, each by one number: a continuous one becomes a revolute one.
        The others are fixed at zero. Limits are left out.
    shapes : bool
        Whether links keep their collision shapes.
    """
    serial, moving = ElementTree.Element("robot", name=robot_name(root)), set(joints)
    for link in root.findall("link"):
        copy = ElementTree.SubElement(serial, "link", name=link.get("name", ""))
        _copy_mass(link, copy)
        copy.extend(link.findall("collision") if shapes else ())
    for joint in root.findall("joint"):
        name = joint.get("name", "")
        slides = joint.get("type") == "prismatic"
        kind = ("prismatic" if slides else "revolute") if name in moving else "fixed"
        copy = ElementTree.SubElement(serial, "joint", name=name, type=kind)
        parts = ("origin", "parent", "child", *(("axis",) if name in moving else ()))
        for tag in parts:
            copy.extend(joint.findall(tag)[:1])
        if name in moving:
            ElementTree.SubElement(copy, "limit", _ANY_LIMIT)
    return ElementTree.tostring(serial, encoding="unicode")


def _copy_mass(link: ElementTree.Element, copy: ElementTree.Element) -> None:
    """Copy mass and centre of a link, if it has them."""
    mass = link.find("inertial/mass")
    if mass is None or mass.get("value") is None:
        return
    inertial = ElementTree.SubElement(copy, "inertial")
    inertial.extend(link.findall("inertial/origin")[:1])
    inertial.append(mass)
    ElementTree.SubElement(inertial, "inertia", _NO_INERTIA)


def _chain_of(
    model: pin.Model, joints: list[ElementTree.Element], base: str, tip: str
) -> SerialChain:
    """Return the chain of the joints that move in a model, with the limits of the URDF."""
    T_root_base = _placement_in_joint(model, base)
    unknown = {} if _filler_effort(joints) is None else {"effort": math.nan}
    chain = []
    for index, joint in enumerate(joints):
        joint_id = model.getJointId(joint.get("name", ""))
        placement = model.jointPlacements[joint_id]
        if index == 0:
            placement = T_root_base.actInv(placement)
        chain.append(_joint_of(model, joint_id, placement, limits_of(joint) | unknown))
    return SerialChain(tuple(chain), base, tip, _placement_in_joint(model, tip).homogeneous)


def _placement_in_joint(model: pin.Model, link: str) -> pin.SE3:
    return model.frames[model.getFrameId(link, pin.FrameType.BODY)].placement


def _joint_of(
    model: pin.Model, joint_id: int, placement: pin.SE3, limits: dict[str, float]
) -> ChainJoint:
    motion = np.asarray(model.joints[joint_id].createData().S).ravel()
    revolute = bool(np.any(motion[3:]))
    inertia = model.inertias[joint_id]
    return ChainJoint(
        name=model.names[joint_id],
        revolute=revolute,
        axis=motion[3:] if revolute else motion[:3],
        placement=placement.homogeneous,
        mass=inertia.mass,
        centre_of_mass=inertia.lever,
        **limits,
    )


def fixed_joint_of(urdf: str, link: str) -> str | None:
    """Return the name of the fixed joint that carries a link; none where a moving one does.

    Raises
    ------
    RobotError
        If the URDF cannot be read.
    """
    joint = joints_by_child(parse_urdf(urdf)).get(link)
    return joint.get("name") if joint is not None and joint.get("type") == "fixed" else None
