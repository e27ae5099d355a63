"""Read a URDF, as people publish them: check it by name, then let Pinocchio chain it.

Only the joints from the base to the asked tip are a robot here. Every other joint is fixed at zero,
whatever it is (a mimicking piston, a gripper's fingers), so that what hangs on it keeps its place
and its weight; frames beside the chain (``base``, twins of the flange) do no harm.

The checks come before Pinocchio because its parser reports problems on the C++ error stream;
a user of elastocal gets one line that names the link, the joint and the allowed ones. Pinocchio
gets a copy (`serial_urdf`) with nothing in it but what is computed with: statics needs masses and
their centres, no inertia tensor.
"""

import codecs
import contextlib
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin

from elastocal.errors import FileAccessError, RobotError, nearest
from elastocal.files import read_bytes
from elastocal.robot._urdf_elements import (
    check_elements,
    is_movable,
    joints_between,
    joints_by_child,
    limits_of,
    link_names,
    link_of,
)
from elastocal.robot.chain import ChainJoint, SerialChain
from elastocal.wording import listed

_ENCODING = re.compile(rb"<\?xml[^>]*?encoding\s*=\s*[\"']([\w.-]+)")
_BEFORE_ROOT = re.compile(r"\A(?:\ufeff|\s|<!--.*?-->)*(?:<\?xml\b.*?\?>)?", re.S)
"""What authors put before the XML declaration, where XML allows nothing; and the declaration."""
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

    Read from the element ``<assumption field="…" reason="…"/>`` that the catalogue writes into
    its URDFs; whoever uses such a number has to say so.
    """

    field: str
    """Field that is assumed: ``dimension``, ``position``, ``velocity``, ``effort``, ``inertia`` or
    ``shape``."""
    reason: str
    """Where the value comes from, in words."""


@contextlib.contextmanager
def refusals_naming(path: Path) -> Iterator[None]:
    """Name the file in what is refused of its URDF in the block."""
    try:
        yield
    except RobotError as error:
        raise RobotError(f"{path}: {error}") from error


def read_urdf(path: Path) -> str:
    """Return the text of a URDF file, in the encoding that it declares (UTF-8 by default).

    Raises
    ------
    FileAccessError
        If the file is missing, unreadable, or not text in that encoding.
    """
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
        The URDF; blank lines and comments may stand before its XML declaration.
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
        raise RobotError(f"URDF is not valid XML: {error}") from error
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
    """Return the link that is nobody's child.

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
    tips = {leaf: moved[leaf] for leaf in leaf_links(root) if moved.get(leaf)}
    if not tips:
        raise refusal
    return tips


def tool_link(text: str) -> str:
    """Return the link of a URDF that a tool is mounted on, as far as names and axes tell.

    That is ``flange``, ``tool0``, or else the leaf behind the most joints; of several behind as
    many joints, one whose z axis points out of the arm. ROS-Industrial's ``flange`` has its x axis
    there, its ``tool0`` the z axis.

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


def assumptions(root: ElementTree.Element) -> tuple[Assumption, ...]:
    """Return what the URDF itself marks as having no source."""
    return tuple(
        Assumption(element.get("field", ""), element.get("reason", ""))
        for element in root.iter("assumption")
    )


def read_chain(text: str, tip: str, base: str | None = None) -> SerialChain:
    """Return the serial chain from ``base`` to ``tip``.

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
    joints = joints_between(joints_by_child(root), base, tip)
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
        The others are fixed at zero. Limits are not told.
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
    """Give the copy of a link its mass and its centre, if it has one."""
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
    chain = []
    for index, joint in enumerate(joints):
        joint_id = model.getJointId(joint.get("name", ""))
        placement = model.jointPlacements[joint_id]
        if index == 0:
            placement = T_root_base.actInv(placement)
        chain.append(_joint_of(model, joint_id, placement, limits_of(joint)))
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
