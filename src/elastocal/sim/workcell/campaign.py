"""Readings of a whole plan from the hidden truth, without stepping the devices through time.

All places are computed side by side: near contact, touch, and the load cases one after the other,
so that the gears remember. Robot, contact and controller are those of `simulated_devices`. What
is left out moves a deflection by well under a micrometre: the force of the guarded touch (a larger
one wipes it from the gears' memory), the curvature of the tooling within the few millimetres
beside a touch, what stop errors do to the place that is touched, and cross-talk of the moment that
an uneven contact makes. No fault is injected.

Then `CampaignErrors` adds what the instruments do.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.arrays import FloatArray
from elastocal.cell import Cell
from elastocal.errors import DeviceError
from elastocal.sim.truth import truth_of
from elastocal.sim.workcell._contact import Contact, ContactLaw
from elastocal.sim.workcell._imperfections import SensorHysteresis, VisitChance
from elastocal.sim.workcell._instruments import sensor_range
from elastocal.sim.workcell._quasistatics import Quasistatics
from elastocal.sim.workcell._robot import TrueRobot
from elastocal.sim.workcell._timeline import RobotState, posture_key

_CLOSED = 1e-6
"""Largest distance of a tool from the position that the contact gives, in m: nanometres of
deflection."""
_ROUNDS = 8


class ContactPoses(NamedTuple):
    """Poses and loads of presses."""

    q: FloatArray
    """Planned joints in contact, shape (place, joint), in rad or m."""
    normal: FloatArray
    """Outward unit normals of the tooling in base, shape (place, 3)."""


@dataclass(frozen=True, eq=False)
class TrueReadings:
    """True values where the arm is at rest: near contact without load, and under each load."""

    q: FloatArray
    """Joints of the controller under load, shape (place, load, joint), in rad or m."""
    force: FloatArray
    """Force on the robot in base, shape (place, load, 3), in N."""
    deflection: FloatArray
    """Deflection of the tool in base against touching without force, (place, load, 3), in m."""
    controller_displacement: FloatArray
    """Displacement of the marker by the controller against the reference, (place, load, 3), in m:
    near contact, or light contact."""
    marker_displacement: FloatArray
    """True displacement of the marker, of the same shape and unit."""
    marker: FloatArray
    """Marker near contact in base, shape (place, 3), in m."""
    felt: FloatArray
    """Change of the force at the sensor against near contact, with the weight that has turned and
    the sensor's hysteresis, in its true frame, shape (place, load, 3), in N."""
    R_base_sensor: FloatArray
    """Orientation of the sensor by the controller, shape (place, 3, 3)."""
    reference_q: FloatArray
    """Joints of the controller where the displacements count from, shape (place, joint), in rad
    or m: near contact, or in light contact."""
    reference_felt: FloatArray
    """As `felt`, near contact, shape (place, 3), in N."""
    gears: FloatArray
    """How far the links are from where their motors have them, shape (place, load, joint), in
    rad."""
    reference_gears: FloatArray
    """The same where the displacements count from, shape (place, joint)."""

    def __repr__(self) -> str:
        return "TrueReadings({} places, {} loads)".format(*self.force.shape)


@dataclass(frozen=True, eq=False)
class CampaignSimulator:
    """The truth of a cell; make one with `of`. It can be sent to another process."""

    statics: Quasistatics
    law: ContactLaw
    near: float
    """Height of near contact, in m."""
    offset: FloatArray
    """Deviation of the tooling's position from the cell file, shape (3,), in m."""
    hysteresis: tuple[float, FloatArray]
    """Hysteresis of the force sensor, and its ranges (6,) in N and N·m; see `SensorHysteresis`."""

    def __repr__(self) -> str:
        return f"CampaignSimulator({self.statics.robot.linkage.name!r}, {self.springs} springs)"

    @classmethod
    def of(cls, cell: Cell) -> "CampaignSimulator":
        """Return the truth of a cell.

        Raises
        ------
        DeviceError, RobotError
            If the simulator has no arm for it.
        """
        return cls(
            Quasistatics.of(cell, TrueRobot.of(cell)),
            ContactLaw.of(cell),
            cell.file.engagement.near_contact,
            np.array(truth_of(cell).contact.surface_offset),
            (truth_of(cell).sensor.hysteresis, sensor_range(cell)),
        )

    @property
    def springs(self) -> int:
        """Number of springs of the robot, the balancer not counted."""
        return len(self.statics.robot.springs.stiffness)

    def stiffened(self, factor: FloatArray, balancer: float = 1.0) -> "CampaignSimulator":
        """Return the cell with another arm of the same make.

        Parameters
        ----------
        factor : ndarray, shape (spring,)
            On the stiffness of each spring; friction and play of a gear change with it.
        balancer : float
            On the rate of the balancer.
        """
        robot = self.statics.robot
        springs, gears, pull = robot.springs, robot.springs.gears, robot.springs.balancer
        own = factor[gears.which, None]
        scaled = replace(
            springs,
            stiffness=springs.stiffness * factor,
            gears=replace(gears, loss=gears.loss * own, stop_stiffness=gears.stop_stiffness * own),
            balancer=None if pull is None else replace(pull, rate=balancer * pull.rate),
        )
        return replace(self, statics=replace(self.statics, robot=replace(robot, springs=scaled)))

    def settle(
        self,
        places: ContactPoses,
        force_tcp: FloatArray,
        seed: int = 0,
        visits: VisitChance | None = None,
        reference: int | None = None,
    ) -> TrueReadings:
        """Return the true readings at every place under every load case, in this order.

        Parameters
        ----------
        places : ContactPoses
            Where.
        force_tcp : ndarray, shape (load, 3)
            Wanted readings of the sensor, tcp frame, in N.
        seed : int
            Seed of what differs from visit to visit.
        visits : VisitChance, optional
            That itself, with a leading axis of places, in place of what the seed gives.
        reference : int, optional
            Number of the press that the displacements count from, in place of near contact; it is
            no load case of its own.

        Raises
        ------
        DeviceError
            If the arm cannot follow.
        EquilibriumError
            If the robot cannot carry a load.
        """
        if visits is None:
            each = [VisitChance.of(seed, posture_key(q)) for q in places.q]
            visits = VisitChance.stack(each)
        return replace(self, statics=self.statics.visited(visits))._pressed(
            places, force_tcp, visits, reference
        )

    def _pressed(
        self,
        places: ContactPoses,
        force_tcp: FloatArray,
        visits: VisitChance,
        reference: int | None,
    ) -> TrueReadings:
        """Return the true readings of visits whose random errors the statics have."""
        T = self.statics.robot.forward(places.q)
        near = self._free(self._along(places.q, T, self.near * places.normal), None)
        touch, contacts = self._touch(places, T, near)
        zero, weight = self.statics.R_base_sensor(near.q, near.twist), self.statics.weight
        state, states = touch, []
        for number, wanted in enumerate(force_tcp):
            # The controller has zeroed the sensor near contact; the arm turns it under load.
            held = self.statics.robot.T_tcp_sensor[:3, :3].T @ self.law.held(wanted)
            attack = self.law.attack(wanted, visits.load(number))
            state = self._press(state, contacts, held + weight @ zero, attack)
            states.append(state)
        return self._settled(near, touch, states, reference)

    def _press(
        self,
        start: RobotState,
        contacts: list[Contact],
        reading: FloatArray,
        attack: FloatArray | None,
    ) -> RobotState:
        """Return the robot where the sensor reads a force, shape (place, 3), sensor frame.

        See `pressed_state`.
        """
        statics, weight = self.statics, self.statics.weight
        q, reached = start.q, start
        for _ in range(_ROUNDS):
            R_base_sensor = statics.R_base_sensor(reached.q, reached.twist)
            force = np.einsum("pij,pj->pi", R_base_sensor, reading) - weight
            before = replace(start, theta=reached.theta)
            reached = statics.loaded(before, q, force, np.zeros(3), attack)
            goal = [c.tool_position(f) for c, f in zip(contacts, force, strict=True)]
            missed = np.array(goal) - statics.tool_position(reached)
            if np.linalg.norm(missed, axis=1).max() < _CLOSED:
                break
            q = self._along(q, statics.robot.forward(q), missed)
        return reached

    def _touch(
        self, places: ContactPoses, T: FloatArray, near: RobotState
    ) -> tuple[RobotState, list[Contact]]:
        """Return the robot touching the tooling without force; see `touching_state`."""
        beside = self.statics.tool_position(near) - (T[:, :3, 3] + self.offset)
        height = np.sum(beside * places.normal, axis=1, keepdims=True)
        anchor = self.statics.tool_position(near) - height * places.normal
        reached = near
        for _ in range(_ROUNDS):
            missed = anchor - self.statics.tool_position(reached)
            if np.linalg.norm(missed, axis=1).max() < _CLOSED:
                break
            forward = self.statics.robot.forward(reached.q)
            reached = self._free(self._along(reached.q, forward, missed), reached.theta)
        each = zip(anchor, T[:, :3, :3], places.normal, reached.q, strict=True)
        return reached, [Contact(self.law, *parts, np.zeros(4)) for parts in each]

    def _free(self, q: FloatArray, start: FloatArray | None) -> RobotState:
        """Return the robot free of contact; see `Quasistatics.free`."""
        statics = self.statics
        state = statics.free(q, np.zeros(3), start)
        left = (1.0 - statics.compensation) * state.sag
        return replace(state, twist=statics.deviation(q, left))

    def _along(self, q: FloatArray, T: FloatArray, shift: FloatArray) -> FloatArray:
        """Return joints that move the undeformed tool from T by a shift, orientation kept."""
        goal = T.copy()
        goal[:, :3, 3] += shift
        found = self.statics.robot.solve(goal, q)
        if not found.ok.all():
            place = int(np.flatnonzero(~found.ok)[0])
            raise DeviceError(
                f"the arm cannot follow to {np.round(goal[place, :3, 3], 4).tolist()} m:"
                " a singularity or the end of its reach"
            )
        return found.q

    def _markers(self, q: FloatArray, twist: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the marker by the controller and where it truly is, each (..., 3), in m."""
        T = self.statics.robot.forward(q)
        lever = T[..., :3, :3] @ self.statics.marker_tcp
        turn = Rotation.from_rotvec(twist[..., 3:6].reshape(-1, 3))
        turned = turn.apply(lever.reshape(-1, 3)).reshape(lever.shape)
        return T[..., :3, 3] + lever, T[..., :3, 3] + twist[..., :3] + turned

    def _settled(
        self, near: RobotState, touch: RobotState, states: list[RobotState], reference: int | None
    ) -> TrueReadings:
        weight, statics = self.statics.weight, self.statics
        q, twist, force, theta = (
            np.stack([getattr(state, name) for state in states], axis=1)
            for name in ("q", "twist", "force", "theta")
        )
        gears, zero_gears = map(statics.robot.gear_angles, (theta, near.theta))
        unloaded, loaded = self._markers(near.q, near.twist), self._markers(q, twist)
        tare = weight @ statics.R_base_sensor(near.q, near.twist)
        carried = np.einsum("plji,plj->pli", statics.R_base_sensor(q, twist), force + weight)
        R = statics.robot.forward(near.q)[:, :3, :3] @ statics.robot.T_tcp_sensor[:3, :3]
        share, ranges = self.hysteresis
        felt = carried - tare[:, None]
        if share > 0.0:
            loads = np.zeros((1 + len(states), len(felt), 6))
            loads[1:, :, :3] = felt.swapaxes(0, 1)
            felt = felt + SensorHysteresis(share, ranges).lag(loads)[1:, :, :3].swapaxes(0, 1)
        kept, zero, zero_q, zero_felt = slice(None), unloaded, near.q, np.zeros_like(unloaded[0])
        if reference is not None:
            kept = np.arange(len(states)) != reference
            zero, zero_q = (loaded[0][:, reference], loaded[1][:, reference]), q[:, reference]
            zero_felt, zero_gears = felt[:, reference], gears[:, reference]
        return TrueReadings(
            q=q[:, kept],
            force=force[:, kept],
            deflection=twist[:, kept, :3] - touch.twist[:, None, :3],
            controller_displacement=loaded[0][:, kept] - zero[0][:, None],
            marker_displacement=loaded[1][:, kept] - zero[1][:, None],
            marker=unloaded[1],
            felt=felt[:, kept],
            R_base_sensor=R,
            reference_q=zero_q,
            reference_felt=zero_felt,
            gears=gears[:, kept],
            reference_gears=zero_gears,
        )
