"""Two true arms that press on each other, as their controllers and force sensors record it.

The second controller holds its joints; the first one follows until the *deformed* arms hold both
tips where the contact has them. With the tips' real positions ``x_1``, ``x_2`` in the first base,
the force ``f`` on the first arm and the compliance ``C`` of the tips at this meeting,

    x_1(q_1, f) - x_2(q_2, -f) = -C f + creep + (what it was at the light touch).

Every position is that of an arm at its exact loaded equilibrium, under gravity where it has masses
(`elastocal.sim.arm`). No equation of the estimator is used.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.dataset import Dataset
from elastocal.errors import SpringError, UnreachableError
from elastocal.sim.arm import (
    AXIAL_STIFFNESS,
    LINK_BENDING,
    ElasticArm,
    Linkage,
    bearing_truth,
    solve_inverse,
    with_link_bending,
    with_stiffening_gears,
)

_ROUNDS = 4
"""Iterations in which the joints follow the deflection; each gains three digits."""
_LONG_LINKS = (1, 2)
"""Joints in front of the two long links of an arm."""


@dataclass(frozen=True)
class Tips:
    """The contact of both tips, and the errors of what is recorded."""

    normal: float
    """Stiffness along the normal, in N/m."""
    across: float
    """Stiffness across it, in N/m."""
    spread: float = 0.0
    """Standard deviation of a meeting from these, as a share."""
    stop: float = 0.0
    """Standard deviation of a position of either controller, in m."""
    slip: float = 0.0
    """Standard deviation of the creep from press to press, in m."""
    force_noise: float = 0.0
    """Standard deviation of a component of either force sensor, in N."""
    marker: float | None = None
    """Standard deviation of a marker's displacement, in m; None: no tracker."""


def true_arm(
    urdf: str,
    tip: str,
    base: str,
    softness: float = 1.0,
    stiffening: float = 0.0,
    bending: bool = False,
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> ElasticArm:
    """Return the truth of an arm with six joints.

    Parameters
    ----------
    urdf, tip, base : str
        Its description, tcp and base link.
    softness : float
        Its compliance over that of an arm of 1.1 t (`AXIAL_STIFFNESS`).
    stiffening : float
        Part of a gear's stiffness at high torque that is missing at rest.
    bending : bool
        Whether its two long links bend.
    gravity : tuple of float
        Acceleration in its base, in m/s².

    Raises
    ------
    SpringError
        If it has another number of joints.
    """
    linkage = Linkage.from_urdf(urdf, tip, base)
    joints = linkage.joint_names
    if len(joints) != len(AXIAL_STIFFNESS):
        raise SpringError(
            f"robot {linkage.name!r} has {len(joints)} joints: the simulated pair has arms with"
            f" {len(AXIAL_STIFFNESS)}"
        )
    arm = bearing_truth(linkage, np.array(AXIAL_STIFFNESS) / softness, gravity=gravity)
    if stiffening > 0.0:
        arm = with_stiffening_gears(arm, stiffening)
    if bending:
        arm = with_link_bending(arm, {joints[j]: LINK_BENDING / softness for j in _LONG_LINKS})
    return arm


def press_together(
    arms: tuple[ElasticArm, ElasticArm],
    T_first_second: FloatArray,
    q: tuple[FloatArray, FloatArray],
    loads: Mapping[str, FloatArray],
    light: float,
    tips: Tips,
    rng: np.random.Generator,
) -> tuple[Dataset, Dataset]:
    """Return what each arm records of presses at some meetings.

    Parameters
    ----------
    arms : tuple of ElasticArm
        The truth of both.
    T_first_second : ndarray, shape (4, 4)
        True base of the second arm in that of the first.
    q : tuple of ndarray, shape (pose, joint)
        Joints of each arm at which they touch, in rad.
    loads : mapping
        Force on the first arm in its tcp frame by load case, shape (3,), in N.
    light : float
        Force of the light touch where the zero is read, in N.
    tips : Tips
        The contact, and the errors of what is recorded.
    rng : numpy.random.Generator
        Source of the errors.

    Raises
    ------
    UnreachableError
        If an arm cannot follow the load.
    """
    meeting = _Meeting.of(arms, T_first_second, q, light, tips, rng)
    cases = [meeting.press(np.asarray(load, dtype=float)) for load in loads.values()]
    first, second = (
        meeting.dataset(number, [case[number] for case in cases], tuple(loads)) for number in (0, 1)
    )
    return first, second


@dataclass
class _Press:
    """What one arm records of a load case at all meetings, and how its tip really moved."""

    joints: FloatArray
    force: FloatArray
    moved: FloatArray


@dataclass
class _Meeting:
    """Both arms at all meetings at once; creep adds up from press to press."""

    arms: tuple[ElasticArm, ElasticArm]
    T: FloatArray
    tips: Tips
    rng: np.random.Generator
    q: tuple[FloatArray, FloatArray]
    compliance: FloatArray
    """Of the tips at each meeting, shape (pose, 3, 3), in m/N."""
    light: FloatArray
    """Force of the light touch on the first arm in its base, shape (pose, 3), in N."""
    offset: FloatArray
    """Distance of the tips at the light touch and the contact's give, shape (pose, 3), in m."""
    crept: FloatArray
    zero: tuple[FloatArray, FloatArray]
    """Real tips at the light touch, in the first base, shape (pose, 3), in m."""
    read: tuple[FloatArray, FloatArray]
    """Joints that each controller says at the light touch, shape (pose, joint), in rad."""

    @classmethod
    def of(
        cls,
        arms: tuple[ElasticArm, ElasticArm],
        T: FloatArray,
        q: tuple[FloatArray, FloatArray],
        light: float,
        tips: Tips,
        rng: np.random.Generator,
    ) -> "_Meeting":
        n = arms[0].linkage.forward(q[0])[:, :3, 2]
        along = n[:, :, None] * n[:, None, :]
        give = 1.0 + tips.spread * rng.standard_normal((2, len(n), 1, 1))
        C = give[0] * along / tips.normal + give[1] * (np.eye(3) - along) / tips.across
        f = -light * n
        made = cls(arms, T, tips, rng, q, C, f, f, np.zeros_like(f), (f, f), q)
        zero = made.real(0, q[0], f), made.real(1, q[1], f)
        made.offset = zero[0] - zero[1] + (C @ f[..., None])[..., 0]
        made.zero = zero
        made.read = made.shown(0, q[0]), made.shown(1, q[1])
        return made

    def real(self, arm: int, q: FloatArray, force: FloatArray) -> FloatArray:
        """Return real tips in the first base under the force on the first arm, (pose, 3), in m."""
        if arm == 0:
            return self.arms[0].equilibrium(q, force).tcp_position
        tips = self.arms[1].equilibrium(q, -force @ self.T[:3, :3]).tcp_position
        return np.asarray(tips @ self.T[:3, :3].T + self.T[:3, 3])

    def shown(self, arm: int, q: FloatArray) -> FloatArray:
        """Return the joints that a controller says, whose tip is off by its error."""
        T = self.arms[arm].linkage.forward(q)
        T[:, :3, 3] += self.tips.stop * self.rng.standard_normal((len(q), 3))
        return _joints_at(self.arms[arm].linkage, T, q)

    def press(self, load_tcp: FloatArray) -> tuple[_Press, _Press]:
        """Press at every meeting with one load case."""
        R = self.arms[0].linkage.forward(self.q[0])[:, :3, :3]
        f = R @ load_tcp
        creep = self.tips.slip * self.rng.standard_normal(f.shape)
        normal = R[:, :, 2]
        self.crept = self.crept + creep - np.sum(creep * normal, axis=1, keepdims=True) * normal
        x_2 = self.real(1, self.q[1], f)
        goal = x_2 - (self.compliance @ f[..., None])[..., 0] + self.offset + self.crept
        q_1 = self.q[0]
        for _ in range(_ROUNDS):
            T = self.arms[0].linkage.forward(q_1)
            T[:, :3, :3] = R
            T[:, :3, 3] += goal - self.real(0, q_1, f)
            q_1 = _joints_at(self.arms[0].linkage, T, q_1)
        noise = self.tips.force_noise * self.rng.standard_normal((2, *f.shape))
        first = _Press(self.shown(0, q_1), f + noise[0], goal - self.zero[0])
        turned = -f @ self.T[:3, :3] + noise[1]
        moved = (x_2 - self.zero[1]) @ self.T[:3, :3]
        return first, _Press(self.shown(1, self.q[1]), turned, moved)

    def dataset(self, arm: int, presses: list[_Press], load_cases: tuple[str, ...]) -> Dataset:
        """Return the readings of one arm in its own base."""
        linkage, gravity = self.arms[arm].linkage, self.arms[arm].gravity
        zero = linkage.forward(self.read[arm])[:, :3, 3]
        joints = np.stack([each.joints for each in presses], axis=1)
        shape = (*joints.shape[:2], 3)
        shown = linkage.forward(joints.reshape(-1, joints.shape[2]))[:, :3, 3].reshape(shape)
        moved = np.stack([each.moved for each in presses], axis=1)
        light = self.light if arm == 0 else -self.light @ self.T[:3, :3]
        seen = None
        if self.tips.marker is not None:
            seen = moved + self.tips.marker * self.rng.standard_normal(shape)
        upright = (0.0, 0.0, -9.80665)
        return Dataset.from_arrays(
            joint_position=joints,
            force=np.stack([each.force for each in presses], axis=1),
            controller_displacement=shown - zero[:, None],
            marker_displacement=seen,
            joint_names=linkage.joint_names,
            load_cases=load_cases,
            tcp_position=zero,
            reference_joint_position=self.read[arm],
            reference_force=light,
            gravity=gravity if any(gravity) and gravity != upright else None,
            robot_name=linkage.name,
            robot_urdf=linkage.urdf,
            tcp_frame=linkage.tip,
            provenance="simulated by elastocal.sim.two_arms",
        )


def _joints_at(linkage: Linkage, T_base_tcp: FloatArray, start: FloatArray) -> FloatArray:
    found = solve_inverse(linkage, T_base_tcp, start)
    if not found.ok.all():
        raise UnreachableError(
            f"simulated arm {linkage.name!r} cannot follow the press at meeting"
            f" {int(np.argmin(found.ok))}"
        )
    return found.q
