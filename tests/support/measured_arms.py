"""Arms with planted geometric errors, measured by a tracker; no equation of the fit is used."""

from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.geometry import Positions
from elastocal.robot import Robot, catalogue, with_joint_origins

MARKERS = np.array([[0.10, 0.20, 0.30], [0.30, -0.10, 0.20], [-0.10, -0.20, 0.40]])


@dataclass(frozen=True, eq=False)
class Measured:
    """What a tracker saw, and what it was made from."""

    robot: Robot
    """The nominal arm."""
    truth: Robot
    """The arm as it was built."""
    data: Positions
    blunders: frozenset[int]
    T_station_base: np.ndarray
    """Base in the frame of each station, shape (station, 4, 4)."""


def measure(  # noqa: PLR0913 (a campaign has as many properties)
    robot: Robot,
    rows: int,
    *,
    seed: int = 0,
    error: float = 5e-4,
    noise: float = 3e-5,
    markers: int = 3,
    stations: int = 2,
    payloads: tuple[float, ...] = (0.0,),
    compliance: float = 0.0,
    bearings: float = 0.0,
    gears: float = 0.0,
    functions: float = 0.0,
    blunders: int = 0,
    span: float = 0.0,
    joints: np.ndarray | None = None,
) -> Measured:
    """Return positions of markers on an arm whose joints stand and turn elsewhere than drawn.

    Joints go all over their range, or as far as `span` from one posture, or are given. Joints and
    their bearings may yield, in rad/(N·m). Gears and encoders may err by functions of their joint,
    of so many rad at most.
    """
    rng = np.random.default_rng(seed)
    truth = Robot.from_urdf(
        with_joint_origins(robot.urdf, {n: random_errors(rng, error) for n in robot.joint_names}),
        robot.tip,
    )
    low, high = np.maximum(robot.limits.lower, -2.0), np.minimum(robot.limits.upper, 2.0)
    q = rng.uniform(low, high, (rows, len(low)))
    if span:
        q = 0.5 * q[0] + span * (2.0 * (q - low) / (high - low) - 1.0)
    q = q if joints is None else joints
    payload = np.resize(payloads, rows).astype(float)
    yielded = q + compliance * weight_torque(robot, q, payload)
    for turn, (a, b) in enumerate(
        gears * np.random.default_rng(seed).normal(size=(2, 2, q.shape[1]))
    ):
        yielded = yielded + a * np.sin((turn + 1) * q) + b * np.cos((turn + 1) * q)
    yielded = yielded + planted_functions(q, functions, seed)
    T = _bent(truth, yielded, bearings, payload) if bearings else truth.forward(yielded)
    points = T[:, None, :3, 3] + np.einsum("nij,mj->nmi", T[:, :3, :3], MARKERS[:markers])
    station = np.arange(rows) % stations
    T_station_base = np.tile(np.eye(4), (stations, 1, 1))
    T_station_base[:, :3, :3] = Rotation.random(stations, random_state=seed).as_matrix()
    T_station_base[:, :3, 3] = rng.uniform(-4.0, 4.0, (stations, 3))
    R, t = T_station_base[station, :3, :3], T_station_base[station, :3, 3]
    seen = t[:, None] + np.einsum("nij,nmj->nmi", R, points) + rng.normal(0.0, noise, points.shape)
    wrong = rng.choice(rows, blunders, replace=False)
    seen[wrong] += rng.normal(0.0, 0.05, (blunders, 1, 3))
    data = Positions(
        q=q,
        markers=seen,
        station=np.array([f"s{number}" for number in station]),
        pose=np.arange(rows),
        campaign=np.full(rows, ""),
        payload=payload,
        payload_centre=np.zeros((rows, 3)),
        force=np.zeros((rows, 3)),
    )
    return Measured(robot, truth, data, frozenset(wrong.tolist()), T_station_base)


def _bent(truth: Robot, q: np.ndarray, bearings: float, payload: np.ndarray) -> np.ndarray:
    """Return the tool of an arm whose bearings are joints of their own, which weight turns."""
    bent = Robot.from_urdf(with_bearings(truth), truth.tip)
    own = [bent.joint_names.index(name) for name in truth.joint_names]
    every = np.zeros((len(q), len(bent.joint_names)))
    every[:, own] = q
    turned = bearings * weight_torque(bent, every, payload)
    turned[:, own] = 0.0
    return bent.forward(every + turned)


def with_bearings(robot: Robot) -> str:
    """Return the URDF of a robot with two more joints before each, across its axis."""
    root = ElementTree.fromstring(robot.urdf)
    for joint in robot.chain.joints:
        own = root.find(f"joint[@name='{joint.name}']")
        parent, origin = own.find("parent"), own.find("origin")
        for number, axis in enumerate(np.eye(3)[np.abs(joint.axis) < 0.5]):
            link = f"{joint.name}_bearing_{number}"
            root.append(ElementTree.Element("link", name=link))
            hinge = ElementTree.SubElement(root, "joint", name=f"{link}_axis", type="revolute")
            if origin is not None:
                own.remove(origin)
                hinge.append(origin)
                origin = None
            ElementTree.SubElement(hinge, "parent", link=parent.get("link"))
            ElementTree.SubElement(hinge, "child", link=link)
            ElementTree.SubElement(hinge, "axis", xyz=" ".join(map(str, axis)))
            ElementTree.SubElement(hinge, "limit", lower="-1", upper="1", effort="0", velocity="0")
            parent.set("link", link)
    return ElementTree.tostring(root, encoding="unicode")


def planted_functions(q: np.ndarray, largest: float, seed: int) -> np.ndarray:
    """Return how much farther joints turn than they say: three waves of 8 to 30 a turn each."""
    rng, found = np.random.default_rng([seed, 8]), np.zeros_like(q)
    for joint in range(q.shape[1]):
        for order in rng.choice(np.arange(8, 31), 3, replace=False):
            phase = rng.uniform(0.0, 2.0 * np.pi)
            found[:, joint] += largest / 3.0 * np.sin(order * q[:, joint] + phase)
    return found


def write_positions(path: Path, measured: Measured) -> Path:
    """Write the table of a campaign; return its path."""
    data, names = measured.data, measured.robot.joint_names
    markers = data.markers.shape[1]
    heads = [f"{name}[deg]" for name in names] + ["station", "payload[kg]"]
    heads += [f"marker{m}_{a}[mm]" for m in range(1, markers + 1) for a in "xyz"]
    q = np.degrees(data.q)
    lines = [
        ",".join(
            [*map(repr, row.tolist()), s, repr(float(p)), *map(repr, (1e3 * m).ravel().tolist())]
        )
        for row, s, p, m in zip(q, data.station, data.payload, data.markers, strict=True)
    ]
    path.write_text("\n".join([",".join(heads), *lines]) + "\n", encoding="utf-8")
    return path


def random_errors(rng: np.random.Generator, error: float) -> np.ndarray:
    """Return a small shift and turn of a joint, shape (4, 4), in m and rad."""
    T = np.eye(4)
    T[:3, :3] = Rotation.from_rotvec(rng.normal(0.0, error, 3)).as_matrix()
    T[:3, 3] = rng.normal(0.0, error, 3)
    return T


def weight_torque(robot: Robot, q: np.ndarray, payload: np.ndarray) -> np.ndarray:
    """Return the torque of weight and payload, the latter by central differences of its height."""
    torque = -robot.gravity_torques(q) if robot.has_masses else np.zeros_like(q)
    step = 1e-6
    for joint in range(q.shape[1]):
        to = np.zeros(q.shape[1])
        to[joint] = step
        rise = (robot.forward(q + to)[:, 2, 3] - robot.forward(q - to)[:, 2, 3]) / (2.0 * step)
        torque[:, joint] -= payload * 9.80665 * rise
    return torque


_CHAIN = """<robot name="parallel"><link name="l0"/>{}<link name="tcp"/>
<joint name="tip" type="fixed"><parent link="l6"/><child link="tcp"/>
<origin xyz="0 0 0.09"/></joint></robot>"""
_JOINT = """<link name="l{n}"/><joint name="j{n}" type="revolute"><parent link="l{m}"/>
<child link="l{n}"/><origin xyz="{xyz}" rpy="{rpy}"/><axis xyz="{axis}"/>
<limit lower="-3" upper="3" effort="0" velocity="0"/></joint>"""


def chain(*joints: tuple[str, str] | tuple[str, str, str]) -> Robot:
    """Return an arm of revolute joints: place in the link before, axis, turn in the link before."""
    parts = [
        _JOINT.format(n=n, m=n - 1, xyz=xyz, axis=axis, rpy="".join(turn) or "0 0 0")
        for n, (xyz, axis, *turn) in enumerate(joints, 1)
    ]
    text = _CHAIN.format("".join(parts)).replace('"l6"/><child', f'"l{len(joints)}"/><child')
    return Robot.from_urdf(text, "tcp")


def kuka() -> Robot:
    """Return six axes with a spherical wrist."""
    return catalogue.load("KR 210 R2700-2")


def universal() -> Robot:
    """Return six axes of which the second, third and fourth are parallel."""
    z, y = "0 0 1", "0 1 0"
    return chain(
        ("0 0 0.13", z), ("0 0.14 0", y), ("0 -0.12 0.61", y), ("0 0 0.57", y),
        ("0 0.12 0", z), ("0 0 0.12", y),
    )  # fmt: skip


def seven_axes() -> Robot:
    """Return seven axes, each square to the next."""
    z, y = "0 0 1", "0 1 0"
    return chain(
        ("0 0 0.16", z), ("0 0 0.2", y), ("0 0 0.2", z), ("0 0 0.22", y), ("0 0 0.2", z),
        ("0 0 0.2", y), ("0 0 0.1", z),
    )  # fmt: skip


def rounded(quarter: str) -> Robot:
    """Return six axes whose quarter turns are as exact as a drawing writes them."""
    z, q = "0 0 1", quarter
    return chain(
        ("0 0 0.1345", z), ("0 0.0062 0", z, f"0 -{q} -{q}"), ("0.411 0 0", z, f"0 0 {q}"),
        ("0 -0.368 0", z, f"{q} 0 0"), ("0 0 0", z, f"-{q} 0 0"), ("0 -0.121 0", z, f"{q} 0 0"),
    )  # fmt: skip


_LAYOUTS = (
    ("0", "{q}", "0", "0", "{q}", "-{q}"),
    ("0", "-{q}", "0", "-{q}", "{q}", "-{q}"),
    ("0", "-{q}", "0", "{q}", "-{q}", "{q}"),
    ("0", "-{q}", "{q}", "-{q}", "{q}", "-{q}", "{q}"),
)
"""Turns about x between the axes: three parallel ones, spherical wrists, seven axes."""


def made_up(seed: int) -> Robot:
    """Return an arm of links drawn at random, whose file rounds quarter turns to some digits."""
    rng, z = np.random.default_rng([seed, 31]), "0 0 1"
    q, layout = ("1.5708", "1.571")[seed % 2], _LAYOUTS[seed // 2 % len(_LAYOUTS)]
    joints = []
    for turn in layout:
        place = np.zeros(3)
        place[rng.integers(3)] = rng.uniform(0.1, 0.6)
        place[rng.integers(3)] += rng.choice([0.0, 0.05])
        yaw = rng.choice(["0", "{q}", "-{q}"])
        joints.append((" ".join(map(str, place.tolist())), z, f"{turn} 0 {yaw}".format(q=q)))
    return chain(*joints)


ARMS = {"spherical wrist": kuka, "parallel axes": universal, "seven axes": seven_axes}
