"""The files of somebody else's campaign: URDF, tooling, logs of robot, force sensor and tracker.

Nothing of elastocal is used: chain, elasticity, sensor and tracker are written here once more, so
that whatever comes out at the other end is held against equations of another hand. Dimensions and
limits are those of the makers' data sheets; masses and compliances are made up.
"""

import csv
import datetime as dt
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

GRAVITY = np.array([0.0, 0.0, -9.81])
UNITS = dict(zip("xyz", np.eye(3), strict=True))
STEP = 0.01
"""Of everything that happens, in s."""
START = dt.datetime(2026, 11, 20, 9, 14, 2, 400000)


@dataclass(frozen=True)
class Arm:
    """Six axes as ROS-Industrial writes them: no rotation between the joints, then tool0."""

    name: str
    origins: tuple[tuple[float, float, float], ...]
    """Of each joint in the one before, in m."""
    axes: str
    """A letter each."""
    limits: tuple[tuple[int, int], ...]
    """In deg."""
    speeds: tuple[int, ...]
    """In deg/s."""
    tool0: float
    """Turn about y from the last link, in deg."""
    masses: tuple[float, ...]
    """Of the moving links, in kg; each is in the middle of its link."""
    compliance: tuple[float, ...]
    """What is planted: of each joint about its axis, in rad/(N·m)."""
    press: float
    """In N."""
    home: tuple[float, ...]
    """In deg."""
    place: tuple[float, float, float]
    """Apex of the tooling in base, in m."""
    dome: tuple[float, float]
    """Radius and half width of the tooling, in m."""
    tcp: float
    """Length of the tool, in m."""
    tool: tuple[float, tuple[float, float, float]]
    """Mass in kg and its centre in tool0, in m."""
    noise: tuple[float, float]
    """Of a sample of the force in N, of the moment in N·m."""


ARMS = {
    "irb6700": Arm(
        name="abb_irb6700_150_320",
        origins=((0, 0, 0.78), (0.32, 0, 0), (0, 0, 1.28),
                 (0, 0, 0.2), (1.5925, 0, 0), (0.2, 0, 0)),
        axes="zyyxyx",
        limits=((-170, 170), (-65, 85), (-180, 70), (-300, 300), (-130, 130), (-360, 360)),
        speeds=(100, 90, 90, 170, 120, 190),
        tool0=90.0,
        masses=(300, 220, 150, 60, 30, 10),
        compliance=(0.28e-6, 0.33e-6, 0.47e-6, 1.6e-6, 1.9e-6, 3.2e-6),
        press=900.0,
        home=(0, -20, 20, 0, 60, 0),
        place=(2.05, 0.0, 0.95),
        dome=(2.2, 0.55),
        tcp=0.32,
        tool=(26.0, (0.01, 0.0, 0.17)),
        noise=(1.2, 0.15),
    ),
    "tx2_90": Arm(
        name="staubli_tx2_90",
        origins=((0, 0, 0.478), (0.05, 0, 0), (0, 0.05, 0.425),
                 (0, 0, 0), (0, 0, 0.425), (0, 0, 0.1)),
        axes="zyyzyz",
        limits=((-180, 180), (-130, 147), (-145, 145), (-270, 270), (-115, 140), (-270, 270)),
        speeds=(400, 400, 430, 540, 475, 760),
        tool0=0.0,
        masses=(30, 25, 15, 8, 4, 1),
        compliance=(8e-6, 9e-6, 14e-6, 60e-6, 70e-6, 120e-6),
        press=120.0,
        home=(0, 10, 90, 0, 80, 0),
        place=(0.58, 0.05, 0.25),
        dome=(0.8, 0.14),
        tcp=0.15,
        tool=(3.2, (0.004, 0.0, 0.07)),
        noise=(0.15, 0.01),
    ),
}  # fmt: skip

SENSOR_TURN = 30.0
"""Of the sensor about z of tool0, in deg."""
SENSOR_HEIGHT = 0.025
MARKER = np.array([0.115, 0.012, -0.082])
"""In the tcp, in m; its drawing is some millimetres off."""
DRAWN_MARKER = np.array([0.115, 0.010, -0.080])
TRACKER = np.array([4.1, -3.2, 1.35])
_BIAS = np.array([41.3, -17.9, 88.4, 3.1, -2.2, 0.9])
_SPOTS = [(-0.7, -0.7, -50), (-0.7, 0.1, 35), (-0.65, 0.75, 80), (0, -0.75, 10), (0.05, 0, -20),
          (-0.1, 0.7, 60), (0.7, -0.7, -75), (0.7, 0.05, 25), (0.75, 0.7, -40), (0.4, 0.4, 70),
          (-0.4, -0.4, -5), (0.4, -0.4, 45)]  # fmt: skip
"""Poses: place on the tooling as parts of its half width, turn about the normal in deg."""


def turns(axis: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Return rotations about an axis by angles (n,), shape (n, 3, 3)."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    sin, cos = np.sin(angle)[..., None, None], np.cos(angle)[..., None, None]
    return np.eye(3) + sin * cross + (1.0 - cos) * cross @ cross


@dataclass(frozen=True)
class Chain:
    """The arm at many postures: tool0, and each joint's axis, point and mass, in base."""

    R: np.ndarray
    p: np.ndarray
    axes: np.ndarray
    points: np.ndarray
    centres: np.ndarray

    def tip(self, length: float) -> np.ndarray:
        """Return the tool centre point."""
        return self.p + length * self.R[:, :, 2]


def chain(arm: Arm, q: np.ndarray) -> Chain:
    """Return the arm at postures (n, 6), in rad."""
    R, p = np.broadcast_to(np.eye(3), (len(q), 3, 3)), np.zeros((len(q), 3))
    axes, points, centres = [], [], []
    for k, (origin, letter) in enumerate(zip(arm.origins, arm.axes, strict=True)):
        p = p + R @ np.array(origin, float)
        axes.append(R @ UNITS[letter])
        points.append(p)
        R = R @ turns(UNITS[letter], q[:, k])
        centres.append(p + R @ middle(arm, k + 1))
    R = R @ turns(UNITS["y"], np.radians(np.array([arm.tool0])))
    return Chain(R, p, *(np.stack(each, 1) for each in (axes, points, centres)))


def middle(arm: Arm, link: int) -> np.ndarray:
    """Return the middle of a moving link, 1 to 6, in its own frame."""
    return 0.5 * np.array(arm.origins[link] if link < 6 else (0.0, 0.0, 0.0), float)


def yields(arm: Arm, at: Chain, place: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Return how places (n, 3) on the tool give way under forces (n, 3) at its tip and weights."""
    torque = np.einsum("nij,nj->ni", np.cross(at.axes, at.tip(arm.tcp)[:, None] - at.points), force)
    tool = at.p + at.R @ np.array(arm.tool[1])
    heavy = [*zip(arm.masses, np.moveaxis(at.centres, 1, 0), range(6), strict=True)]
    for mass, centre, last in [*heavy, (arm.tool[0], tool, 5)]:
        bears = slice(0, last + 1)
        lever = np.cross(at.axes[:, bears], centre[:, None] - at.points[:, bears])
        torque[:, bears] += lever @ (mass * GRAVITY)
    moved = np.cross(at.axes, place[:, None] - at.points)
    return np.einsum("nij,ni->nj", moved, torque * np.array(arm.compliance))


def posture(arm: Arm, R: np.ndarray, tip: np.ndarray, seed: np.ndarray) -> np.ndarray:
    """Return the posture (6,) whose tool is there, by Newton's method."""
    q = np.array(seed, float)
    for _ in range(200):
        at = chain(arm, q[None])
        D = R @ at.R[0].T
        turn = 0.5 * np.array([D[2, 1] - D[1, 2], D[0, 2] - D[2, 0], D[1, 0] - D[0, 1]])
        found = at.tip(arm.tcp)[0]
        error = np.r_[tip - found, turn]
        if np.abs(error).max() < 1e-12:
            break
        jacobian = np.vstack([np.cross(at.axes[0], found - at.points[0]).T, at.axes[0].T])
        step = np.linalg.lstsq(jacobian, error)[0]
        q = q + step * min(1.0, 0.3 / np.abs(step).max())
    assert np.abs(error).max() < 1e-9, f"{arm.name} does not reach {tip}"
    return q


def load_cases(arm: Arm) -> dict[str, np.ndarray]:
    """Return the force on the robot in the tcp of each load case, in N."""
    press, aside = arm.press, 0.3 * arm.press
    return {
        "normal": np.array([0.0, 0.0, -press]),
        "north": np.array([aside, 0.0, -press]),
        "east": np.array([0.0, aside, -press]),
    }


def contacts(arm: Arm) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield attitude of the tool, z into the surface, and the place of each pose."""
    radius, half = arm.dome
    for u, v, spin in _SPOTS:
        x, y = half * u, half * v
        z = np.sqrt(radius**2 - x**2 - y**2)
        inward = -np.array([x, y, z]) / radius
        aside = UNITS["x"] - inward * inward[0]
        aside /= np.linalg.norm(aside)
        R = np.column_stack([aside, np.cross(inward, aside), inward])
        turned = R @ turns(UNITS["z"], np.radians(np.array([float(spin)])))[0]
        yield turned, np.array(arm.place) + np.array([x, y, z - radius])


def motion(arm: Arm) -> tuple[np.ndarray, np.ndarray]:
    """Return postures (n, 6) as commanded and forces (n, 3) on the robot in base, every `STEP`."""
    parts: list[tuple[np.ndarray, np.ndarray]] = []
    home, none = np.radians(np.array(arm.home, float)), np.zeros(3)

    def go(seconds: float, q: np.ndarray, force: np.ndarray = none) -> None:
        q0, f0 = (parts[-1][0][-1], parts[-1][1][-1]) if parts else (q, force)
        s = np.linspace(0.0, 1.0, round(seconds / STEP) + 1)[1:, None]
        s = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
        parts.append(((1.0 - s) * q0 + s * q, (1.0 - s) * f0 + s * force))

    go(3.0, home)
    above = home
    for R, contact in contacts(arm):
        above = posture(arm, R, contact - 0.08 * R[:, 2], above)
        above[5] = (above[5] + np.pi) % (2.0 * np.pi) - np.pi
        near = posture(arm, R, contact - 0.004 * R[:, 2], above)
        at, sag = chain(arm, near[None]), none[None]
        tip = at.tip(arm.tcp)
        for seconds, q in ((6.0, above), (3.0, near), (2.5, near)):
            go(seconds, q)
        for force in load_cases(arm).values():
            pushed = force / (arm.press / 0.36e-3 * np.array([0.36, 0.36, 1.0]))
            gives = yields(arm, at, tip, (R @ force)[None]) - yields(arm, at, tip, sag)
            loaded = posture(arm, R, contact - R @ pushed - gives[0], near)
            go(2.0, loaded, R @ force)
            go(2.5, loaded, R @ force)
        go(2.0, near)
        go(2.0, above)
    go(6.0, home)
    go(2.0, home)
    return np.concatenate([q for q, _ in parts]), np.concatenate([f for _, f in parts])


def write_campaign(name: str, folder: Path, *, masses: bool) -> dict[str, Path]:
    """Write URDF, mesh and three logs of a campaign; return them by what they are.

    Parameters
    ----------
    name : str
        Of `ARMS`.
    folder : Path
        Where to; it is made.
    masses : bool
        Whether the URDF has masses; those that makers publish mostly have none.
    """
    arm, rng = ARMS[name], np.random.default_rng(6700)
    folder.mkdir(parents=True, exist_ok=True)
    names = {"urdf": f"{arm.name}.urdf", "mesh": "tooling.stl", "robot": "robot.csv"}
    files = {key: folder / each for key, each in names.items()}
    files |= {"force": folder / "ati.csv", "tracker": folder / "tracker.txt"}
    files["urdf"].write_text(_urdf(arm, masses), encoding="utf-8")
    _write_dome(files["mesh"], arm)
    q, force = motion(arm)
    time, at = STEP * np.arange(len(q)), chain(arm, q)
    _write_robot(files["robot"], arm, time[300:], q[300:])
    _write_force(files["force"], arm, time, at, force, rng)
    marker = at.tip(arm.tcp) + at.R @ MARKER
    _write_tracker(files["tracker"], time, marker + yields(arm, at, marker, force), rng)
    return files


def _urdf(arm: Arm, masses: bool) -> str:
    links = ["base_link", *(f"link_{k}" for k in range(1, 7))]
    text = ['<?xml version="1.0" ?>', f'<robot name="{arm.name}">']
    for k, link in enumerate(links):
        reach = arm.origins[k] if k < 6 else (0.02, 0.02, 0.02)
        at = f'<origin xyz="{" ".join(f"{v:.5f}" for v in middle(arm, k) if k < 7)}" rpy="0 0 0"/>'
        thick = 0.16 * sum(map(sum, arm.origins)) / 4.0 / (1.0 + 0.3 * k)
        size = " ".join(f"{max(0.9 * abs(v), thick):.3f}" for v in reach)
        shape = f'{at}<geometry><box size="{size}"/></geometry>'
        heavy = (
            f'<inertial>{at}<mass value="{arm.masses[k - 1]}"/><inertia ixx="1" ixy="0" ixz="0"'
            ' iyy="1" iyz="0" izz="1"/></inertial>'
        )
        text.append(
            f'<link name="{link}">{heavy if masses and k else ""}<visual>{shape}</visual>'
            f"<collision>{shape}</collision></link>"
        )
    for k, letter in enumerate(arm.axes):
        low, high = np.radians(arm.limits[k])
        text.append(
            f'<joint name="joint_{k + 1}" type="revolute"><parent link="{links[k]}"/>'
            f'<child link="{links[k + 1]}"/><origin xyz="{" ".join(map(str, arm.origins[k]))}"'
            f' rpy="0 0 0"/><axis xyz="{" ".join(str(int(v)) for v in UNITS[letter])}"/>'
            f'<limit lower="{low:.6f}" upper="{high:.6f}" effort="0"'
            f' velocity="{np.radians(arm.speeds[k]):.4f}"/></joint>'
        )
    for name, parent, turn in (
        ("base", "base_link", 0.0),
        ("flange", "link_6", 0.0),
        ("tool0", "flange", np.radians(arm.tool0)),
    ):
        text.append(
            f'<link name="{name}"/><joint name="{parent}-{name}" type="fixed">'
            f'<parent link="{parent}"/><child link="{name}"/>'
            f'<origin xyz="0 0 0" rpy="0 {turn:.9f} 0"/></joint>'
        )
    return "\n".join([*text, "</robot>", ""])


def _write_dome(path: Path, arm: Arm, cells: int = 40) -> None:
    """Write the tooling as CAD exports it: binary, in mm, its apex at the origin."""
    radius, half = arm.dome
    x, y = np.meshgrid(*2 * [np.linspace(-half, half, cells + 1)], indexing="ij")
    v = 1e3 * np.stack([x, y, np.sqrt(radius**2 - x**2 - y**2) - radius], -1)
    a, b, c, d = v[:-1, :-1], v[1:, :-1], v[1:, 1:], v[:-1, 1:]
    faces = np.concatenate([np.stack([a, b, c], -2), np.stack([a, c, d], -2)]).reshape(-1, 3, 3)
    normals = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    data = [b"exported from CAD, mm".ljust(80), struct.pack("<I", len(faces))]
    for normal, face in zip(normals, faces, strict=True):
        data.append(struct.pack("<12fH", *normal, *face.ravel(), 0))
    path.write_bytes(b"".join(data))


def _write_robot(path: Path, arm: Arm, time: np.ndarray, q: np.ndarray) -> None:
    """Write 25 samples a second as a controller's signal recording: degrees, mm, quaternions."""
    time, q = time[::4] - time[0], q[::4]
    at = chain(arm, q)
    names = (*(f"J{k}" for k in range(1, 7)), "X", "Y", "Z", *(f"Q{k}" for k in range(1, 5)))
    with path.open("w", newline="", encoding="utf-8") as file:
        out = csv.writer(file, delimiter=";")
        out.writerow(["Time [s]", *(f"ROB_1 {name}" for name in names)])
        for t, angles, R, tip in zip(time, np.degrees(q), at.R, at.tip(arm.tcp), strict=True):
            turn = [f"{v:.6f}" for v in _quaternion(R)]
            joints, place = [f"{v:.4f}" for v in angles], [f"{v:.2f}" for v in 1e3 * tip]
            out.writerow([f"{t:.3f}", *joints, *place, *turn])


def _quaternion(R: np.ndarray) -> np.ndarray:
    """Return w, x, y, z: the eigenvector of the matrix of Bar-Itzhack (2000)."""
    K = np.zeros((4, 4))
    K[:3, :3] = R + R.T - np.trace(R) * np.eye(3)
    K[3, :3] = K[:3, 3] = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
    K[3, 3] = np.trace(R)
    x, y, z, w = np.linalg.eigh(K)[1][:, -1]
    return np.array([w, x, y, z])


def _write_force(
    path: Path, arm: Arm, time: np.ndarray, at: Chain, force: np.ndarray, rng: np.random.Generator
) -> None:
    """Write what the demo program of a sensor's box writes: a preamble, counts, time of day."""
    R_sensor = turns(UNITS["z"], np.radians(np.array([SENSOR_TURN])))[0]
    pressed = np.einsum("nji,nj->ni", at.R, force)
    weight = arm.tool[0] * np.einsum("nji,j->ni", at.R, GRAVITY)
    foot = np.array([0.0, 0.0, SENSOR_HEIGHT])
    moment = np.cross(np.array([0.0, 0.0, arm.tcp]) - foot, pressed)
    moment = moment + np.cross(np.array(arm.tool[1]) - foot, weight)
    wrench = np.hstack([(pressed + weight) @ R_sensor, moment @ R_sensor]) + _BIAS
    wrench += rng.normal(size=wrench.shape) * np.repeat(arm.noise, 3)
    head = [
        f"Start Time: {START:%m/%d/%Y %I:%M:%S %p}", "RDT Sample Rate: 100", "Force Units: N",
        "Counts per Unit Force: 1000000.0", "Torque Units: Nm",
        "Counts per Unit Torque: 1000000.0",
        "Status (hex),RDT Sequence,F/T Sequence,Fx,Fy,Fz,Tx,Ty,Tz,Time",
    ]  # fmt: skip
    with path.open("w", encoding="utf-8") as file:
        file.write("\n".join(head) + "\n")
        for k, (t, row) in enumerate(zip(time, np.round(1e6 * wrench), strict=True), 1):
            counts = ",".join(str(int(v)) for v in row)
            now = f"{START + dt.timedelta(seconds=float(t)):%H:%M:%S.%f}"[:-3]
            file.write(f"0x00000000,{k},{7 * k},{counts},{now}\n")


def _write_tracker(
    path: Path, time: np.ndarray, marker: np.ndarray, rng: np.random.Generator
) -> None:
    """Write 20 samples a second as a tracker's program does: tabs, mm, dates, CRLF."""
    R = turns(UNITS["z"], np.radians(np.array([128.0])))[0]
    R = R @ turns(UNITS["x"], np.radians(np.array([0.4])))[0]
    seen = (marker[100::5] - TRACKER) @ R
    seen += rng.normal(scale=8e-6, size=seen.shape)
    begin = START + dt.timedelta(seconds=1.7)
    with path.open("w", newline="\r\n", encoding="utf-8") as file:
        file.write("// continuous measurement\nName\tX[mm]\tY[mm]\tZ[mm]\tTimestamp\n")
        for k, (t, point) in enumerate(zip(time[100::5], 1e3 * seen, strict=True), 1):
            place = "\t".join(f"{v:.4f}" for v in point)
            now = f"{begin + dt.timedelta(seconds=float(t)):%Y-%m-%d %H:%M:%S.%f}"[:-3]
            file.write(f"P{k}\t{place}\t{now}\n")
