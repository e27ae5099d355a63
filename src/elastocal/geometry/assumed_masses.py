"""Masses for an arm whose description has none: a bar from each joint to the next.

Without them what an arm yields to its own weight, a millimetre and more, is taken for errors of its
gears and joints. Bars have the right course over the postures, nearly; how much a joint yields to
them is fitted apart from what it yields to payloads (docs/decisions/0125-assumed-masses.md).
"""

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np

from elastocal.geometry.arm import arm_length
from elastocal.robot import Robot

DENSITY = 15.0
"""Mass of an arm in kg over the square of its length in m: a UR10 has 13, a KR 210 100."""


def with_assumed_masses(robot: Robot) -> Robot:
    """Return an arm with a bar from each joint to the next, to the tip at last.

    Their masses are in proportion to their lengths. External axes carry none.
    """
    joints = robot.chain.joints
    ways = [*(each.placement[:3, 3] for each in joints[1:]), robot.chain.T_last_tip[:3, 3]]
    length = arm_length(robot)
    root = ElementTree.fromstring(robot.urdf)
    children = {each.get("name"): each.find("child") for each in root.iter("joint")}
    links = {each.get("name"): each for each in root.iter("link")}
    for joint, way in list(zip(joints, ways, strict=True))[robot.external_axes :]:
        mass = DENSITY * length * float(np.linalg.norm(way))
        child = children[joint.name]
        if not mass or child is None:
            continue
        bar = ElementTree.SubElement(links[child.get("link")], "inertial")
        ElementTree.SubElement(bar, "origin", xyz=" ".join(repr(float(x)) for x in 0.5 * way))
        ElementTree.SubElement(bar, "mass", value=repr(mass))
        inertia = dict.fromkeys(("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), "0")
        ElementTree.SubElement(bar, "inertia", inertia)
    text = ElementTree.tostring(root, encoding="unicode")
    return replace(Robot.from_urdf(text, robot.tip, robot.base), gravity=robot.gravity)
