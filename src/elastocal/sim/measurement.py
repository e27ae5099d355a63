"""What Procedure 1 of the paper would record on the true arm.

The tool is stopped a few millimetres before contact and read (paper steps 7-9), then pressed until
the load case stands, and read again (13-17). In between the controller drives through the gap and
on against the arm's own compliance; the marker moves through the gap, and by what the friction
disk gives and slips. Their difference is the deflection (Eq. 12, with our signs).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from elastocal.dataset import Dataset
from elastocal.errors import DatasetError, UnreachableError
from elastocal.sim.reach import reach
from elastocal.sim.scene import LOAD_CASES
from elastocal.sim.screws import FloatArray
from elastocal.sim.truth import ElasticArm

_SETTLING_ROUNDS = 2
"""How often the commanded joints follow the deflection. Millimetres of travel change it by some
micrometres, those by nanometres."""


@dataclass(frozen=True)
class Noise:
    """Standard deviations of one reading, per component; all zero by default."""

    force: float = 0.0
    """Wrist force sensor, in N."""
    marker: float = 0.0
    """Laser tracker, one position, in m. A displacement is the difference of two."""
    controller: float = 0.0
    """Stops of the arm that its own encoders do not see (repeatability), in m."""


SHOP_FLOOR = Noise(force=5.0, marker=20e-6, controller=20e-6)
"""A noise of plausible size. Assumptions, none from a data sheet: a 2 kN sensor good to 0.25 % of
its range, a tracker a few metres away, a third of a repeatability of ±0.06 mm."""


@dataclass(frozen=True)
class Contact:
    """The tool tip against the tooling (paper section 2.2, the four phenomena)."""

    gap: float = 3e-3
    """Free travel before contact, in m."""
    normal_stiffness: float = 4e6
    """Of the friction disk, in N/m: 0.3 mm at 1.1 kN. An assumption, as is the next."""
    shear_stiffness: float = 1.5e6
    """Of the friction disk, in N/m: 0.2 mm at 280 N."""
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
    """What is added to the marker displacement, in base, in m."""


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
    displacement is exactly the deflection of the arm at the recorded joints.

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
    joints, deflection = _press(arm, q, T_base_touch, unloaded, travel, force)
    seen = _difference_of_readings(noise.marker, force.shape, rng)
    stops = _difference_of_readings(noise.controller, force.shape, rng)
    return Dataset.from_arrays(
        joint_position=joints,
        force=force + noise.force * rng.standard_normal(force.shape),
        controller_displacement=travel - deflection + stops,
        marker_displacement=travel + seen + _offsets(blunders, force.shape, load_cases),
        joint_names=arm.linkage.joint_names,
        load_cases=load_cases,
        joint_units=["rad" if turns else "m" for turns in arm.linkage.revolute],
        force_sigma=noise.force or None,
        marker_sigma=float(np.hypot(noise.marker, noise.controller) * np.sqrt(2.0)) or None,
        tcp_position=unloaded,
        robot_name=arm.linkage.name,
        robot_urdf=arm.linkage.urdf,
        tcp_frame=arm.linkage.tip,
        provenance="simulated by elastocal.sim.measurement",
    )


def _marker_travel(
    T_base_touch: FloatArray, force: FloatArray, contact: Contact, slip: FloatArray
) -> FloatArray:
    """Return how far the tool tip truly moves, shape (pose, load_case, 3), in m.

    The disk yields against the force on the robot: the tip sinks in and is dragged sideways.
    """
    R_base_tcp = T_base_touch[:, None, :3, :3]
    force_tcp = (R_base_tcp.swapaxes(-1, -2) @ force[..., None])[..., 0]
    give = np.array([contact.shear_stiffness, contact.shear_stiffness, contact.normal_stiffness])
    travel_tcp = -force_tcp / give
    travel_tcp[..., :2] += slip
    travel_tcp[..., 2] += contact.gap
    travel: FloatArray = (R_base_tcp @ travel_tcp[..., None])[..., 0]
    return travel


def _press(
    arm: ElasticArm,
    q: FloatArray,
    T_base_touch: FloatArray,
    unloaded: FloatArray,
    travel: FloatArray,
    force: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Return commanded joints under load, and the deflection there.

    The controller keeps the orientation and pushes on until the tip is where the contact holds
    it, ``unloaded + travel``, despite the deflection, which depends on the joints in turn.
    """
    poses, cases = force.shape[:2]
    joints = np.repeat(q[:, None, :], cases, axis=1)
    goals = np.repeat(T_base_touch[:, None], cases, axis=1)
    deflection = arm.equilibrium(joints, force).deflection
    for _ in range(_SETTLING_ROUNDS):
        goals[..., :3, 3] = unloaded[:, None] + travel - deflection
        found = reach(arm.linkage, goals.reshape(-1, 4, 4), joints.reshape(poses * cases, -1))
        if not found.ok.all():
            pose = int(np.argmin(found.ok)) // cases
            raise UnreachableError(f"pose {pose}: the arm cannot follow its load case")
        joints = found.q.reshape(joints.shape)
        deflection = arm.equilibrium(joints, force).deflection
    return joints, deflection


def _difference_of_readings(
    sigma: float, shape: tuple[int, ...], rng: np.random.Generator
) -> FloatArray:
    """Return the error of loaded minus unloaded reading; a pose has one unloaded reading."""
    unloaded = rng.standard_normal((shape[0], 1, 3))
    errors: FloatArray = sigma * (rng.standard_normal(shape) - unloaded)
    return errors


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
