"""Procedure 1 of the paper on the true arm: poses on a dome, five load cases, and the readings.

For tests and demonstrations, without a planner: poses are spread evenly over a spherical cap, with
the free spin about the tool axis drawn at random. The inverse kinematics is the simulator's own.

The tool is stopped a few millimetres before contact and read (paper steps 7-9), then pressed until
the load case is reached, and read again (13-17). In between the controller moves through the gap
and on against the arm's own compliance; the marker moves through the gap, and by the yielding and
slip of the friction disk. Their difference is the deflection (Eq. 12, with our signs), plus the
difference of the arm's sag between the loaded joints and those of the first reading.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from elastocal.arrays import FloatArray
from elastocal.dataset import Dataset
from elastocal.errors import DatasetError, UnreachableError, present
from elastocal.sim.arm.elastic_arm import GRAVITY, ElasticArm
from elastocal.sim.arm.linkage import Linkage, solve_inverse

LOAD_CASES = ("normal", "north", "south", "east", "west")
"""The load cases of paper section 4.1."""
START = (0.0, -1.75, 1.9, 0.0, 1.0, 0.0)
"""Elbow-up posture above the dome of a KUKA-like arm (zero: stretched forward), in rad."""
_GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))
_ATTEMPTS = 40
_SETTLED = 1e-6
"""Change in m from which on the commanded joints have followed the deflection. Millimetres of
travel change it by some micrometres, those by nanometres; with the wrist near axis 1 of a soft arm
each round leaves two fifths."""
_MOST_ROUNDS = 40


@dataclass(frozen=True)
class Noise:
    """Standard deviations of one reading, per component; all zero by default."""

    force: float = 0.0
    """Wrist force sensor, in N."""
    marker: float = 0.0
    """Laser tracker, one position, in m. A displacement is the difference of two."""
    controller: float = 0.0
    """Stops of the arm that its own encoders do not see (repeatability), in m."""
    encoder: float | None = None
    """Secondary encoders, one position, in rad or m; None: there are none."""


SHOP_FLOOR = Noise(force=5.0, marker=20e-6, controller=20e-6)
"""A noise of plausible size. Assumptions, none from a data sheet: a 2 kN sensor good to 0.25 % of
its range, a tracker a few metres away, a third of a repeatability of ±0.06 mm."""


@dataclass(frozen=True)
class Contact:
    """The tool tip against the tooling (paper section 2.2, the four phenomena)."""

    gap: float = 3e-3
    """Free travel before contact, in m."""
    normal_stiffness: float = 4e6
    """Normal stiffness of the disk, in N/m: 0.3 mm at 1.1 kN. An assumption, as is the next."""
    shear_stiffness: float = 1.5e6
    """Shear stiffness of the friction disk, in N/m: 0.2 mm at 280 N."""
    micro_slip: float = 20e-6
    """Standard deviation of lateral slip while a load builds up, in m. It is true motion."""


@dataclass(frozen=True)
class Blunder:
    """A gross error of one marker displacement, such as a broken beam."""

    pose: int
    """Index of the pose."""
    load_case: str
    """Name of the load case."""
    offset: tuple[float, float, float]
    """Offset that is added to the marker displacement, in base, in m."""


def measure(
    arm: ElasticArm,
    q: ArrayLike,
    force: ArrayLike,
    noise: Noise,
    rng: np.random.Generator,
    *,
    load_cases: Sequence[str] = LOAD_CASES,
    contact: Contact | None = None,
    blunders: Sequence[Blunder] = (),
) -> Dataset:
    """Return the readings of Procedure 1.

    The recorded joints are those the controller commands under load, so their forward kinematics
    is ``tcp_position + controller_displacement``. Without noise, marker minus controller
    displacement is exactly the deflection of the arm at the recorded joints; under gravity, plus
    the change of its sag since the reference joints, recorded too.

    Parameters
    ----------
    arm : ElasticArm
        The truth. Its tip is the TCP, z out of the tool, and carries the marker.
    q : array_like, shape (pose, joint)
        Joints at which the rigid arm touches the surface, in rad or m.
    force : array_like, shape (pose, load_case, 3)
        True force on the robot at the TCP, in base, in N.
    noise : Noise
        What the instruments add.
    rng : numpy.random.Generator
        Source of noise and slip. The draws do not depend on their sizes.
    load_cases : sequence of str
        Names of the load cases.
    contact : Contact, optional
        The tool tip on the surface.
    blunders : sequence of Blunder
        Gross errors to add.

    Raises
    ------
    DatasetError
        If shapes do not fit or a blunder names no reading.
    UnreachableError
        If the arm cannot follow the load while keeping its orientation.
    """
    contact = Contact() if contact is None else contact
    q, force = np.asarray(q, dtype=float), np.asarray(force, dtype=float)
    if q.ndim != 2 or force.shape != (len(q), len(load_cases), 3):
        raise DatasetError(
            f"joints of shape {q.shape} and forces of shape {force.shape}: must be (pose, joint)"
            f" and (pose, {len(load_cases)} load cases, 3)"
        )
    T_base_touch = arm.linkage.forward(q)
    unloaded = T_base_touch[:, :3, 3] - contact.gap * T_base_touch[:, :3, 2]
    slip = contact.micro_slip * rng.standard_normal((*force.shape[:2], 2))
    travel = _marker_travel(T_base_touch, force, contact, slip)
    reference = None
    if any(arm.gravity) or noise.encoder is not None:
        reference = _reference_joints(arm, q, T_base_touch, unloaded)
    joints, shown = _press(arm, q, T_base_touch, unloaded, travel, force, reference)
    seen = _difference_of_readings(noise.marker, force.shape, rng)
    stops = _difference_of_readings(noise.controller, force.shape, rng)
    link, link_reference = None, None
    if noise.encoder is not None:
        still = present(reference, "reference")
        link = _links(arm, joints, force, noise.encoder, rng)
        link_reference = _links(arm, still, np.zeros((len(q), 3)), noise.encoder, rng)
    return Dataset.from_arrays(
        joint_position=joints,
        force=force + noise.force * rng.standard_normal(force.shape),
        controller_displacement=travel - shown + stops,
        marker_displacement=travel + seen + _offsets(blunders, force.shape, load_cases),
        joint_names=arm.linkage.joint_names,
        load_cases=load_cases,
        joint_units=["rad" if turns else "m" for turns in arm.linkage.revolute],
        force_sigma=noise.force or None,
        marker_sigma=float(np.hypot(noise.marker, noise.controller) * np.sqrt(2.0)) or None,
        tcp_position=unloaded,
        reference_joint_position=reference,
        link_joint_position=link,
        reference_link_joint_position=link_reference,
        gravity=None if reference is None or arm.gravity == GRAVITY else arm.gravity,
        robot_name=arm.linkage.name,
        robot_urdf=arm.linkage.urdf,
        tcp_frame=arm.linkage.tip,
        provenance="simulated by elastocal.sim.measurement",
    )


def _marker_travel(
    T_base_touch: FloatArray, force: FloatArray, contact: Contact, slip: FloatArray
) -> FloatArray:
    """Return the true motion of the tool tip, shape (pose, load_case, 3), in m.

    The disk deforms: the tip sinks in and is displaced sideways.
    """
    R_base_tcp = T_base_touch[:, None, :3, :3]
    force_tcp = (R_base_tcp.swapaxes(-1, -2) @ force[..., None])[..., 0]
    give = np.array([contact.shear_stiffness, contact.shear_stiffness, contact.normal_stiffness])
    travel_tcp = -force_tcp / give
    travel_tcp[..., :2] += slip
    travel_tcp[..., 2] += contact.gap
    travel: FloatArray = (R_base_tcp @ travel_tcp[..., None])[..., 0]
    return travel


def _links(
    arm: ElasticArm, q: FloatArray, force: FloatArray, sigma: float, rng: np.random.Generator
) -> FloatArray:
    """Return positions of the links as encoders behind the gears read them, shape (..., joint)."""
    theta = arm.equilibrium(q, force).theta
    links = q + sigma * rng.standard_normal(q.shape)
    for number, joint in enumerate(arm.axial_joints):
        if joint is not None:
            links[..., joint] += theta[..., number]
    return links


def _reference_joints(
    arm: ElasticArm, q: FloatArray, T_base_touch: FloatArray, unloaded: FloatArray
) -> FloatArray:
    """Return commanded joints of the unloaded reading."""
    goals = T_base_touch.copy()
    goals[:, :3, 3] = unloaded
    found = solve_inverse(arm.linkage, goals, q)
    if not found.ok.all():
        pose = int(np.argmin(found.ok))
        raise UnreachableError(f"pose {pose}: the arm cannot stop off the surface")
    return found.q


def _press(
    arm: ElasticArm,
    q: FloatArray,
    T_base_touch: FloatArray,
    unloaded: FloatArray,
    travel: FloatArray,
    force: FloatArray,
    reference: FloatArray | None,
) -> tuple[FloatArray, FloatArray]:
    """Return commanded joints under load, and by how much more the tip moves than they say.

    The controller keeps the orientation and pushes on until the tip has moved by ``travel`` in
    truth, despite the deflection and the sag, which depend on the joints in turn.
    """
    poses, cases = force.shape[:2]
    sag = 0.0 if reference is None else _sag(arm, reference)[:, None]

    def shown(joints: FloatArray) -> FloatArray:
        deflection = arm.equilibrium(joints, force).deflection
        return deflection if reference is None else deflection + _sag(arm, joints) - sag

    joints = np.repeat(q[:, None, :], cases, axis=1)
    goals = np.repeat(T_base_touch[:, None], cases, axis=1)
    more = shown(joints)
    for number in range(_MOST_ROUNDS):
        goals[..., :3, 3] = unloaded[:, None] + travel - more
        found = solve_inverse(
            arm.linkage, goals.reshape(-1, 4, 4), joints.reshape(poses * cases, -1)
        )
        if not found.ok.all():
            pose = int(np.argmin(found.ok)) // cases
            raise UnreachableError(f"pose {pose}: the arm cannot follow its load case")
        joints = found.q.reshape(joints.shape)
        before, more = more, shown(joints)
        change = np.linalg.norm(more - before, axis=-1)
        if number and change.max() < _SETTLED:
            return joints, more
    pose = int(np.argmax(change.max(axis=1)))
    raise UnreachableError(f"pose {pose}: the arm does not settle under its load cases")


def _sag(arm: ElasticArm, q: FloatArray) -> FloatArray:
    """Return the sag of the unloaded tip below its nominal position, shape (..., 3)."""
    hanging = arm.equilibrium(q, np.zeros(3)).tcp_position
    return hanging - arm.linkage.forward(q)[..., :3, 3]


def _difference_of_readings(
    sigma: float, shape: tuple[int, ...], rng: np.random.Generator
) -> FloatArray:
    """Return the error of loaded minus unloaded reading; a pose has one unloaded reading."""
    unloaded = rng.standard_normal((shape[0], 1, 3))
    return sigma * (rng.standard_normal(shape) - unloaded)


def _offsets(
    blunders: Sequence[Blunder], shape: tuple[int, ...], load_cases: Sequence[str]
) -> FloatArray:
    offsets = np.zeros(shape)
    for blunder in blunders:
        if not 0 <= blunder.pose < shape[0] or blunder.load_case not in load_cases:
            raise DatasetError(
                f"blunder at pose {blunder.pose}, load case {blunder.load_case!r}: poses are"
                f" 0 to {shape[0] - 1}, load cases {', '.join(load_cases)}"
            )
        offsets[blunder.pose, list(load_cases).index(blunder.load_case)] += blunder.offset
    return offsets


@dataclass(frozen=True)
class SphericalCap:
    """A dome to press on. The default is in front of a 2.7 m arm and leans towards it."""

    apex: tuple[float, float, float] = (1.6, 0.0, 0.75)
    """Middle of the dome in base, in m."""
    normal: tuple[float, float, float] = (-0.3, 0.0, 1.0)
    """Outward direction at the apex, in base; any length."""
    radius: float = 1.6
    """Radius of curvature, in m."""
    width: float = 1.2
    """Diameter of the rim, in m."""

    def spread(self, count: int, phase: float) -> tuple[FloatArray, FloatArray]:
        """Return points spread evenly over the cap by Vogel's sunflower, with their normals.

        Vogel, "A better way to construct the sunflower head", Mathematical Biosciences 44 (1979).

        Parameters
        ----------
        count : int
            Number of points.
        phase : float
            Turns the pattern about the apex, in rad.

        Returns
        -------
        points : ndarray, shape (count, 3)
        normals : ndarray, shape (count, 3)
            In base, in m; outward unit vectors.
        """
        index = np.arange(count)
        away = 0.5 * self.width * np.sqrt((index + 0.5) / count)
        turn = phase + index * _GOLDEN_ANGLE
        out = np.sqrt(self.radius**2 - away**2)
        local = np.stack([away * np.cos(turn), away * np.sin(turn), out], axis=1) / self.radius
        normals = local @ _frame_along(np.array(self.normal)).T
        apex_normal = np.array(self.normal) / np.linalg.norm(self.normal)
        return np.array(self.apex) + self.radius * (normals - apex_normal), normals


@dataclass(frozen=True)
class PressPoses:
    """Poses at which the tool touches the surface."""

    joints: FloatArray
    """Shape (pose, joint), in rad or m."""
    T_base_tcp: FloatArray
    """TCP frames with z into the surface, shape (pose, 4, 4)."""

    def __repr__(self) -> str:
        return f"PressPoses({len(self.joints)} poses)"


def press_poses(
    linkage: Linkage,
    count: int,
    rng: np.random.Generator,
    surface: SphericalCap | None = None,
    start: ArrayLike = START,
    spin: float = np.pi,
) -> PressPoses:
    """Return poses spread over a surface, the tool pressing along its normals.

    Parameters
    ----------
    linkage : Linkage
        The arm; its tip is the TCP, z out of the tool.
    count : int
        Number of poses.
    rng : numpy.random.Generator
        Turns the pattern and spins the tool.
    surface : SphericalCap, optional
        What to press on.
    start : array_like, shape (joint,)
        Posture near which solutions are sought, in rad or m.
    spin : float
        Largest rotation of the tool about its axis in either sense, in rad.

    Raises
    ------
    UnreachableError
        If a point cannot be reached within the joint limits at any of the spins tried.
    """
    surface = SphericalCap() if surface is None else surface
    points, normals = surface.spread(count, float(rng.uniform(0.0, 2.0 * np.pi)))
    frames = np.array([_frame_along(-normal) for normal in normals])
    start = np.broadcast_to(np.asarray(start, dtype=float), (count, len(linkage.joint_names)))
    goals = np.tile(np.eye(4), (count, 1, 1))
    goals[:, :3, 3] = points
    joints = np.full(start.shape, np.nan)
    for _ in range(_ATTEMPTS):
        open_poses = np.flatnonzero(np.isnan(joints[:, 0]))
        if not len(open_poses):
            break
        turn = _about_z(rng.uniform(-spin, spin, len(open_poses)))
        goals[open_poses, :3, :3] = frames[open_poses] @ turn
        found = solve_inverse(linkage, goals[open_poses], start[open_poses])
        inside = np.all((found.q >= linkage.lower) & (found.q <= linkage.upper), axis=1)
        usable = found.ok & inside
        joints[open_poses[usable]] = found.q[usable]
    missing = np.flatnonzero(np.isnan(joints[:, 0]))
    if len(missing):
        where = ", ".join(f"{value:.3f}" for value in points[missing[0]])
        raise UnreachableError(
            f"{linkage.name} cannot press at ({where}) m within its joint limits: none of"
            f" {_ATTEMPTS} spins is reached, and so for {len(missing)} of {count} points;"
            " surface and start (a posture before it) must be this arm's"
        )
    return PressPoses(joints, goals)


def press_forces(
    T_base_tcp: FloatArray, fx: float = 280.0, fy: float = 280.0, fz: float = 1100.0
) -> FloatArray:
    """Return the forces on the robot of the five load cases (paper section 4.1, Fig. 8).

    In the tcp frame: (0, 0, -fz), (+fx, 0, -fz), (-fx, 0, -fz), (0, -fy, -fz), (0, +fy, -fz).

    Parameters
    ----------
    T_base_tcp : ndarray, shape (pose, 4, 4)
        TCP frames.
    fx, fy, fz : float
        Magnitudes in N.

    Returns
    -------
    ndarray, shape (pose, load_case, 3)
        In base, in N, in the order of `LOAD_CASES`.
    """
    lateral = np.array([[0, 0], [fx, 0], [-fx, 0], [0, -fy], [0, fy]], dtype=float)
    force_tcp = np.column_stack([lateral, np.full(len(lateral), -fz)])
    forces: FloatArray = np.einsum("pij,lj->pli", T_base_tcp[:, :3, :3], force_tcp)
    return forces


def _frame_along(direction: FloatArray) -> FloatArray:
    """Return a rotation whose z is a direction and whose x is nearest to base x (or z)."""
    z = direction / np.linalg.norm(direction)
    helper = np.eye(3)[0 if abs(z[0]) < 0.9 else 2]
    x = (helper - z * (z @ helper)) / np.linalg.norm(helper - z * (z @ helper))
    return np.column_stack([x, np.cross(z, x), z])


def _about_z(angles: FloatArray) -> FloatArray:
    c, s, o = np.cos(angles), np.sin(angles), np.zeros_like(angles)
    return np.stack([c, -s, o, s, c, o, o, o, o + 1.0], axis=-1).reshape(-1, 3, 3)
