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
from elastocal.planning.motion import load_case_time
from elastocal.sim.workcell._contact import Contact, ContactLaw
from elastocal.sim.workcell._imperfections import SensorHysteresis, VisitChance
from elastocal.sim.workcell._instruments import sensor_range
from elastocal.sim.workcell._quasistatics import Quasistatics
from elastocal.sim.workcell._robot import TrueRobot
from elastocal.sim.workcell._timeline import RobotState, posture_key

_CLOSED = 1e-6
"""How far a tool may end from where the contact holds it, in m: nanometres of deflection."""
_ROUNDS = 8


class ContactPoses(NamedTuple):
    """Where to press."""

    q: FloatArray
    """Planned joints in contact, shape (place, joint), in rad or m."""
    normal: FloatArray
    """Outward unit normals of the tooling in base, shape (place, 3)."""


@dataclass(frozen=True, eq=False)
class TrueReadings:
    """Truth where the arm stands still: near contact without load, and under each load."""

    q: FloatArray
    """Joints of the controller under load, shape (place, load, joint), in rad or m."""
    force: FloatArray
    """Force on the robot in base, shape (place, load, 3), in N."""
    deflection: FloatArray
    """Deflection of the tool in base against touching without force, (place, load, 3), in m."""
    controller_displacement: FloatArray
    """Displacement of the marker by the controller against near contact, (place, load, 3), in m."""
    marker_displacement: FloatArray
    """True one of the marker, likewise."""
    marker: FloatArray
    """Marker near contact in base, shape (place, 3), in m."""
    felt: FloatArray
    """Change of the force at the sensor against near contact, with the weight that has turned and
    the sensor's hysteresis, in its true frame, shape (place, load, 3), in N."""
    R_base_sensor: FloatArray
    """Orientation of the sensor by the controller, shape (place, 3, 3)."""

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
    """How far the tooling stands from where the cell file puts it, shape (3,), in m."""
    hysteresis: tuple[float, FloatArray]
    """Of the force sensor, and its ranges (6,) in N and N·m; see `SensorHysteresis`."""

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
            np.array(cell.file.simulation.contact.surface_offset),
            (cell.file.simulation.sensor.hysteresis, sensor_range(cell)),
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
    ) -> TrueReadings:
        """Return what is true at every place under every load case, in this order.

        Parameters
        ----------
        places : ContactPoses
            Where.
        force_tcp : ndarray, shape (load, 3)
            Wanted readings of the sensor, tcp frame, in N.
        seed : int
            Of what differs from visit to visit.
        visits : VisitChance, optional
            That itself, with a leading axis of places, in place of what the seed gives.

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
            places, force_tcp, visits
        )

    def _pressed(
        self, places: ContactPoses, force_tcp: FloatArray, visits: VisitChance
    ) -> TrueReadings:
        """Return what is true in visits whose chance the statics have."""
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
        return self._settled(near, touch, states)

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
        self, near: RobotState, touch: RobotState, states: list[RobotState]
    ) -> TrueReadings:
        weight, statics = self.statics.weight, self.statics
        q, twist, force = (
            np.stack([getattr(state, name) for state in states], axis=1)
            for name in ("q", "twist", "force")
        )
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
        return TrueReadings(
            q=q,
            force=force,
            deflection=twist[..., :3] - touch.twist[:, None, :3],
            controller_displacement=loaded[0] - unloaded[0][:, None],
            marker_displacement=loaded[1] - unloaded[1][:, None],
            marker=unloaded[1],
            felt=felt,
            R_base_sensor=R,
        )


class ErrorScales(NamedTuple):
    """Factors on the errors of the instruments; 1 is the cell file's."""

    tracker: float = 1.0
    force: float = 1.0


@dataclass(frozen=True, eq=False)
class ErrorDraws:
    """Unit normals behind all errors of one campaign, whatever part of it is measured."""

    marker: FloatArray
    """Shape (place, 1 + load, 3); the first is the unloaded reading."""
    sensor: FloatArray
    """Likewise."""
    stop: FloatArray
    """Likewise."""
    drift: FloatArray
    """Shape (place, 3)."""
    cross_talk: FloatArray
    """Shape (6, 6)."""

    def __repr__(self) -> str:
        places, readings, _ = self.marker.shape
        return f"ErrorDraws({places} places, {readings - 1} loads)"

    @classmethod
    def of(cls, places: int, loads: int, rng: np.random.Generator) -> "ErrorDraws":
        """Draw for some places under some load cases."""
        marker, sensor, stop = rng.standard_normal((3, places, 1 + loads, 3))
        return cls(
            marker, sensor, stop, rng.standard_normal((places, 3)), rng.standard_normal((6, 6))
        )

    def take(self, places: IndexArray, loads: IndexArray) -> "ErrorDraws":
        """Return the draws of some places and load cases."""
        rows = np.ix_(places, np.concatenate([[0], 1 + loads]))
        return ErrorDraws(
            self.marker[rows], self.sensor[rows], self.stop[rows], self.drift[places],
            self.cross_talk,
        )  # fmt: skip


@brief_repr
@dataclass(frozen=True, eq=False)
class CampaignErrors:
    """Standard deviations of averaged readings; make one with `of`."""

    noise: float
    """Noise of a sample of the tracker at no distance, in m."""
    noise_per_metre: float
    average: float
    """Standard deviation of a loaded average of the tracker over that of a sample."""
    unloaded_average: float
    """The same of an unloaded one."""
    force: tuple[float, float]
    """Noise of an unloaded and of a loaded average of the sensor, in N."""
    drift: FloatArray
    """Drift of each force axis per load case, in N, shape (3,)."""
    gain: FloatArray = field(repr=False)
    """Change of the gain per unit of cross-talk, shape (3, 3, 6, 6)."""
    repeatability: float
    """Error of a stop, in m."""

    @classmethod
    def of(cls, cell: Cell) -> "CampaignErrors":
        """Return the errors of a cell's instruments.

        Raises
        ------
        DeviceError
            If the cell has no force sensor.
        """
        entry, procedure = cell.file.simulation, cell.file.procedure
        tracker, sensor, ranges = entry.tracker, entry.sensor, sensor_range(cell)
        times = (procedure.unloaded_average, procedure.average)
        drift = sensor.drift / 60.0 * load_case_time(cell)
        averages = [averaged_noise(tracker.turbulence, time, tracker.rate) for time in times]
        force = [sensor.force_noise / math.sqrt(max(time * sensor.rate, 1.0)) for time in times]
        return cls(
            noise=tracker.noise / COVERAGE,
            noise_per_metre=tracker.noise_per_metre / COVERAGE,
            average=averages[1],
            unloaded_average=averages[0],
            force=(force[0], force[1]),
            drift=drift * ranges[:3] / ranges[0],
            gain=sensor.cross_talk * _gain(cell, ranges),
            repeatability=entry.controller.repeatability,
        )

    def readings(
        self,
        settled: TrueReadings,
        draws: ErrorDraws,
        scales: ErrorScales,
        station: FloatArray,
        load_cases: tuple[str, ...],
    ) -> Readings:
        """Return the truth as the instruments show it, places numbered from 0.

        Parameters
        ----------
        settled : TrueReadings
            The truth.
        draws : ErrorDraws
            Of these places and load cases.
        scales : ErrorScales
            How large the errors are.
        station : ndarray, shape (place, 3)
            Tracker station that looks at each place, in base, in m.
        load_cases : tuple of str
            Names of the loads.
        """
        places, loads = settled.force.shape[:2]
        distance = np.linalg.norm(settled.marker - station, axis=1)[:, None, None]
        sigma = scales.tracker * (self.noise + self.noise_per_metre * distance)
        marker = sigma * (
            self.average * draws.marker[:, 1:] - self.unloaded_average * draws.marker[:, :1]
        )
        # The encoders do not see where the arm truly stops; the tracker does.
        marker += self.repeatability * (draws.stop[:, 1:] - draws.stop[:, :1])
        rows = (places * loads, -1)
        return Readings(
            pose=np.repeat(np.arange(places), loads),
            load_case=np.tile(load_cases, places),
            joint_position=settled.q.reshape(rows),
            force=self._force(settled, draws, scales.force).reshape(rows),
            controller_displacement=settled.controller_displacement.reshape(rows),
            marker_displacement=(settled.marker_displacement + marker).reshape(rows),
        )

    def _force(self, settled: TrueReadings, draws: ErrorDraws, scale: float) -> FloatArray:
        """Return the force in base as the sensor shows it, shape (place, load, 3), in N."""
        gain = np.eye(3) + scale * np.einsum("ijkl,kl->ij", self.gain, draws.cross_talk)
        noise = self.force[1] * draws.sensor[:, 1:] - self.force[0] * draws.sensor[:, :1]
        since = np.arange(1, settled.force.shape[1] + 1)[:, None]
        noise = noise + since * self.drift * draws.drift[:, None]
        shown = settled.felt @ gain.T + scale * noise
        force: FloatArray = np.einsum("pij,plj->pli", settled.R_base_sensor, shown)
        return force


def _gain(cell: Cell, ranges: FloatArray) -> FloatArray:
    """Return d gain / d cross-talk; see `force_gain`. Shape (3, 3, 6, 6)."""
    T_sensor_tcp = cell.T_sensor_tcp
    assert T_sensor_tcp is not None
    wrench = np.vstack([np.eye(3), np.cross(T_sensor_tcp[:3, 3], np.eye(3)).T])
    ratio = np.divide.outer(ranges, ranges)
    gain: FloatArray = np.einsum("ik,kl,lj->ijkl", np.eye(3, 6), ratio, wrench)
    return gain
