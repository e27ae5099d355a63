"""One least-squares problem of frames, markers, and all errors of an arm."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.arrays import FloatArray
from elastocal.files import Limit
from elastocal.geometry.arm import (
    BENDS,
    KINDS,
    LOW_ORDERS,
    MOTION,
    ORDERS,
    ArmErrors,
    ArmFrames,
    frames,
    motion_names,
    motion_terms,
    point_motions,
)
from elastocal.geometry.assumed_masses import DENSITY, with_assumed_masses
from elastocal.geometry.derivatives import Derivatives
from elastocal.geometry.positions import Positions, joint_loads
from elastocal.results import brief_repr
from elastocal.robot import GRAVITY, ChainJoint, Robot
from elastocal.wording import phrases

RUNGS: tuple[str, ...] = phrases(
    "registration", "offsets", "geometry", "weight", "bearings", "harmonics", "joint-functions"
)
"""Rungs from the frames alone to functions of each joint, by names that pages say in other
languages; each includes all before, but the last no scales of joints that turn."""
CHAIN_RUNGS = RUNGS[:3]
"""Rungs with only poses and zeros of joints: what a URDF can express."""
_SIZES = {"shift": 1e-3, "turn": 1e-3, "offset": 1e-3, "scale": 1e-3}
"""Likely sizes in m, rad: a column is weighed by its parameter's."""
PRIOR_WIDTH = 3.0
"""Standard deviation of the prior of an error of the arm, in its likely sizes."""
_COARSEST = 1e-3
"""No noise of positions is larger, in m."""
_FRAME_WIDTH = 30.0
"""The same of frames and markers, about where they are."""
_YIELD = {True: 3e-3, False: 1e-3}
"""Rotation (shift) of a joint that turns (slides) under the load of its class, in rad (m): a KR
210's main axes 1 to 2 mrad, a UR10's 8, an iiwa's with torque sensors 6 to 14."""
_BEARING = 0.5
"""Compliance of a bearing across its joint's axis, as part of that of the joint about it."""
_LEAST_ARM = 0.1
"""Part of the arm's length that the load of a wrist's joints acts on at least."""
_OF_ANY_JOINT = ("offset", "scale", "compliance")
"""Errors of motion that linear axes have too."""
_GEAR_SIZE = 2e-4
"""Expected size of an error of a gear once or twice a turn, in rad."""
_WAVE_SIZE, _WAVE_ORDER = 3.5e-5, 20.0
"""The same of a higher order, in rad, and the order at which half of it is expected: all orders
together make functions of 0.4 mrad at three sizes, where gears and encoders of a UR10 have 0.1 to
0.35."""
_FIRST = 2 + 2 * LOW_ORDERS
"""Place of the first higher order among errors of motion."""
_BENT = len(KINDS) + len(MOTION)
"""Place of the bearings' compliances among the columns of `point_motions`."""
_MOST_NUMBERS = Limit("ELASTOCAL_MAX_FIT_MB", 150, "MB of derivatives")
"""Thirty thousand positions of two stations and three markers on six axes; a fit takes some times
as much."""
_FRAME_SIZE = 1e-2
"""Expected size of what frames and markers are off by after the first registration, in m and
rad."""


@dataclass(frozen=True)
class Unknown:
    """A number that is fitted."""

    name: str
    unit: str
    rung: str
    """The first one that has it."""
    size: float
    """Likely size, in SI."""


@brief_repr
@dataclass(frozen=True, eq=False)
class State:
    """Values of everything that is fitted."""

    T_station_base: FloatArray
    """Base in the frame of each station, shape (station, 4, 4), in m."""
    markers: FloatArray
    """Markers in the tcp, shape (marker, 3), in m."""
    errors: ArmErrors


class GeometryProblem:
    """Residuals and derivatives of positions, in the order of their seen markers.

    Parameters
    ----------
    robot : Robot
        The nominal arm.
    data : Positions
        What was measured.
    """

    def __init__(self, robot: Robot, data: Positions) -> None:
        self.robot, self.data = robot, data
        self.assumed = not robot.has_masses
        """Whether the arm has assumed masses, which its description lacks."""
        heavy = with_assumed_masses(robot) if self.assumed else robot
        self.loads = joint_loads(heavy, data, assumed=self.assumed)
        self._terms = motion_terms(data.q, self.loads.torque)
        self.row, self.marker = np.nonzero(data.seen)
        index = {name: n for n, name in enumerate(data.stations)}
        self.station = np.array([index[name] for name in data.station.tolist()])[self.row]
        self.measured = data.markers[self.row, self.marker]
        self.unknowns = unknowns(robot, data)
        self.dense = sum(each.rung != RUNGS[-1] for each in self.unknowns)
        """Number of unknowns without the higher orders of functions of the joints, which follow."""
        stations, markers = len(data.stations), data.markers.shape[1]
        _MOST_NUMBERS.require(
            3e-6 * len(self) * self.dense * np.dtype(float).itemsize,
            f"the fit of {len(self)} positions, {stations} stations and {markers} markers",
        )
        joints = robot.chain.joints
        # Joint and kind of each error of pose and of motion, in the order of their columns.
        self._placed = tuple(np.array(_placed(joints), dtype=np.intp).reshape(-1, 2).T)
        self._bent = tuple(np.array(_bent(joints), dtype=np.intp).T)
        self._sagging = np.arange(len(joints) if self.assumed else 0)
        low = np.array(_moving(joints), dtype=np.intp).T
        # The same of all, counted as `point_motions` does.
        parts = (
            (*self._placed,),
            (self._bent[0], _BENT + self._bent[1]),
            (self._sagging, np.full_like(self._sagging, _BENT + len(BENDS))),
            (low[0], len(KINDS) + low[1]),
        )
        self._errors = np.concatenate(parts, axis=1)
        self._waved = np.flatnonzero([joint.revolute for joint in joints])
        names = motion_names(ORDERS)
        kinds = [names.index(MOTION[kind]) for kind in low[1]]
        waves = [(j, k) for j in self._waved.tolist() for k in range(_FIRST, len(names) - 1)]
        joint, kind = np.array(waves, dtype=np.intp).reshape(-1, 2).T
        self._moving = np.concatenate([low[0], joint]), np.concatenate([kinds, kind])
        turned = self.dense - len(low[0]) + np.flatnonzero(low[1] == MOTION.index("offset"))
        self._turned = turned[self._waved]
        scaled = self.dense - len(low[0]) + np.flatnonzero(low[1] == MOTION.index("scale"))
        self.turn_scales = frozenset(scaled[self._waved].tolist())
        """Unknown scales of joints that turn: no function of an angle that comes back."""

    def __len__(self) -> int:
        """Return the number of seen markers."""
        return len(self.row)

    def residual(self, at: State) -> FloatArray:
        """Return measured minus expected markers, shape (point, 3), in m.

        They are in base, as all derivatives are; distances are the stations'.
        """
        return self._expected(at)[0]

    def linearise(self, at: State) -> tuple[FloatArray, Derivatives]:
        """Return residuals, and derivatives of what is expected by every unknown.

        ``J x = residual`` is the next step.
        """
        residual, arm, points, R = self._expected(at)
        stations, markers = len(self.data.stations), len(at.markers)
        start = 6 * stations + 3 * markers
        J = np.zeros((len(self), 3, self.dense))
        each, tool = np.arange(len(self)), arm.T_base_tcp[self.row]
        for axis in range(3):
            unit = R[:, axis]  # an axis of the station in base
            J[each, :, 6 * self.station + axis] = unit
            J[each, :, 6 * self.station + 3 + axis] = np.cross(unit, points)
            J[each, :, 6 * stations + 3 * self.marker + axis] = tool[:, :3, axis]
        joint, kind = self._errors
        motions = point_motions(self.robot, arm, self._terms, self.loads, points, self.row)
        for number, motion in enumerate(motions):
            own = np.flatnonzero(joint == number)
            J[:, :, start + own] = motion[:, :, kind[own]]
        return residual, Derivatives(J, self._turned, self.data.q[:, self._waved], self.row)

    def _expected(self, at: State) -> tuple[FloatArray, ArmFrames, FloatArray, FloatArray]:
        """Return residuals, frames, and by marker: places in base, directions of its station."""
        arm = frames(self.robot, self.data.q, self.loads, at.errors)
        T = arm.T_base_tcp[self.row]
        points = T[:, :3, 3] + np.einsum("nij,nj->ni", T[:, :3, :3], at.markers[self.marker])
        R, t = at.T_station_base[self.station, :3, :3], at.T_station_base[self.station, :3, 3]
        return np.einsum("nji,nj->ni", R, self.measured - t) - points, arm, points, R

    def moved(self, at: State, step: FloatArray) -> State:
        """Return the state after a step of all unknowns, shape (unknown,)."""
        stations, markers = len(self.data.stations), len(at.markers)
        frame = step[: 6 * stations].reshape(-1, 6)
        T = at.T_station_base.copy()
        T[:, :3, 3] += frame[:, :3]
        T[:, :3, :3] = Rotation.from_rotvec(frame[:, 3:]).as_matrix() @ T[:, :3, :3]
        start = 6 * stations
        shift = step[start : start + 3 * markers].reshape(-1, 3)
        arm = step[start + 3 * markers :]
        errors = at.errors.up_to(ORDERS)
        counts = len(self._placed[0]), len(self._bent[0]), len(self._sagging)
        placed, bent, sag, moving = np.split(arm, np.cumsum(counts))
        errors.place[self._placed] += placed
        errors.bend[self._bent] += bent
        errors.sag[self._sagging] += sag
        errors.motion[self._moving] += moving
        return State(T, at.markers + shift, errors)

    def values(self, at: State) -> FloatArray:
        """Return the value of each unknown, shape (unknown,); frames and markers count as 0."""
        errors = at.errors.up_to(ORDERS)
        bent, sag = errors.bend[self._bent], errors.sag[self._sagging]
        arm = np.concatenate([errors.place[self._placed], bent, sag, errors.motion[self._moving]])
        return np.concatenate([np.zeros(len(self.unknowns) - len(arm)), arm])


def _placed(joints: Sequence[ChainJoint]) -> list[tuple[int, int]]:
    """Return joint and kind of the errors of pose, without a rotation about the joint's own axis.

    The first joint's pose is that of the base, which the stations' frames determine.
    """
    return [
        (index, kind)
        for index, joint in enumerate(joints)
        for kind in range(len(KINDS))
        if index and not (kind >= 3 and _along(joint, kind - 3))
    ]


def _along(joint: ChainJoint, axis: int) -> bool:
    """Return whether a joint turns about an axis of its frame."""
    return joint.revolute and abs(float(joint.axis[axis])) > 1.0 - 1e-9


def _bent(joints: Sequence[ChainJoint]) -> list[tuple[int, int]]:
    """Return joint and axis of the compliances of bearings, without those of the joints' own."""
    return [
        (index, axis)
        for index, joint in enumerate(joints)
        for axis in range(len(BENDS))
        if not _along(joint, axis)
    ]


def _moving(joints: Sequence[ChainJoint]) -> list[tuple[int, int]]:
    """Return joint and kind of the errors of motion; a linear axis has none once a turn."""
    return [
        (number, kind)
        for kind, name in enumerate(MOTION)
        for number, joint in enumerate(joints)
        if joint.revolute or name in _OF_ANY_JOINT
    ]


def unknowns(robot: Robot, data: Positions) -> tuple[Unknown, ...]:
    """Return everything that may be fitted, in the order of the columns."""
    joints, found = robot.chain.joints, []
    for station in data.stations:
        found += [Unknown(f"{station}.{a}", "m", "registration", _FRAME_SIZE) for a in "xyz"]
        found += [Unknown(f"{station}.turn_{a}", "rad", "registration", _FRAME_SIZE) for a in "xyz"]
    for marker in range(data.markers.shape[1]):
        name = f"marker{marker + 1}" if data.markers.shape[1] > 1 else "marker"
        found += [Unknown(f"{name}.{a}", "m", "registration", _FRAME_SIZE) for a in "xyz"]
    for joint, kind in _placed(joints):
        size = _SIZES[KINDS[kind].split("_")[0]]
        unit = "m" if kind < 3 else "rad"
        found.append(Unknown(f"{joints[joint].name}.{KINDS[kind]}", unit, "geometry", size))
    yields = compliance_sizes(robot)
    for joint, axis in _bent(joints):
        size, name = _BEARING * float(yields[joint]), f"{joints[joint].name}.{BENDS[axis]}"
        found.append(Unknown(name, "rad/(N*m)", "bearings", size))
    for own, compliance in zip(() if robot.has_masses else joints, yields.tolist(), strict=False):
        unit = "rad/(N*m)" if own.revolute else "m/N"
        found.append(Unknown(f"{own.name}.sag", unit, "weight", compliance))
    for joint, kind in _moving(joints):
        found.append(_motion_unknown(joints[joint], MOTION[kind], float(yields[joint])))
    names, sizes = motion_names(ORDERS)[_FIRST:-1], np.repeat(wave_sizes(), 2).tolist()
    for each in joints:
        if each.revolute:
            waves = zip(names, sizes, strict=True)
            found += [Unknown(f"{each.name}.{n}", "rad", RUNGS[-1], size) for n, size in waves]
    return tuple(found)


def wave_sizes() -> FloatArray:
    """Return the likely size of each order of a joint's function above the low ones, in rad."""
    orders = np.arange(LOW_ORDERS + 1, ORDERS + 1)
    return np.asarray(_WAVE_SIZE / (1.0 + (orders / _WAVE_ORDER) ** 2))


def compliance_sizes(robot: Robot) -> FloatArray:
    """Return the likely compliance of each joint, by the class of the arm, shape (joint,).

    A joint is built for a quarter of the arm's weight at the length of the links behind it, and
    yields to it by `_YIELD`. In rad/(N·m), of linear axes in m/N.
    """
    joints = robot.chain.joints
    steps = [float(np.linalg.norm(each.placement[:3, 3])) for each in joints[1:]]
    steps.append(float(np.linalg.norm(robot.chain.T_last_tip[:3, 3])))
    behind = np.cumsum(steps[::-1])[::-1]
    length = max(float(behind[robot.external_axes]), _LEAST_ARM)
    masses = sum(each.mass for each in joints[robot.external_axes :])
    weight = float(np.linalg.norm(GRAVITY)) * max(masses, DENSITY * length**2)
    torque = 0.25 * weight * np.maximum(behind, _LEAST_ARM * length)
    turns = np.array([each.revolute for each in joints])
    return np.where(turns, _YIELD[True] / torque, _YIELD[False] / weight)


def prior_weight(problem: GeometryProblem, sigma: float) -> FloatArray:
    """Return the weight of the prior beside squares of positions, shape (unknown,), in m².

    It is ``sigma² / width²`` with the likely sizes. The residuals of a fit that has not converged
    are no noise: as ``sigma`` they would make the prior too strong. Frames and markers have hardly
    any prior: it only keeps those finite that left-out poses do not determine.

    Parameters
    ----------
    problem : GeometryProblem
        Problem with the unknowns.
    sigma : float
        Standard deviation of a coordinate, in m.
    """
    arm = np.array([each.rung != "registration" for each in problem.unknowns])
    width = np.where(arm, prior_width(problem), _FRAME_WIDTH)
    return np.asarray((min(sigma, _COARSEST) / width) ** 2)


def prior_width(problem: GeometryProblem) -> FloatArray:
    """Return the standard deviation of the prior of each unknown, in its likely sizes, (unknown,).

    0 of frames and markers, which have none.
    """
    arm = np.array([each.rung != "registration" for each in problem.unknowns])
    return np.where(arm, PRIOR_WIDTH, 0.0)


def _motion_unknown(joint: ChainJoint, kind: str, compliance: float) -> Unknown:
    unit = {"scale": "1", "compliance": "rad/(N*m)" if joint.revolute else "m/N"}
    length = "rad" if joint.revolute else "m"
    rung = {"offset": "offsets", "compliance": "weight"}.get(kind, "harmonics")
    size = compliance if kind == "compliance" else _SIZES.get(kind, _GEAR_SIZE)
    return Unknown(f"{joint.name}.{kind}", unit.get(kind, length), rung, size)
