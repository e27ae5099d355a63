"""True positions of tool, marker and sensor, and the true load of the sensor.

The controller assumes the undeformed robot. Its error is the *twist*: shift and rotation of the
tool, and rotation of the sensor, in base. Assumption: the controller compensates a part of the sag
under weight that it knows from its load data, so this part is subtracted from the twist at the time
when the tool last was free. It does not know the true geometry, the temperature, and the point of
attack on the disk.
"""

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.arrays import FloatArray
from elastocal.cell import Cell
from elastocal.errors import DeviceError
from elastocal.robot import inverse_transform
from elastocal.sim.truth import truth_of
from elastocal.sim.workcell._imperfections import Growth, VisitChance
from elastocal.sim.workcell._robot import RobotEquilibrium, TrueRobot
from elastocal.sim.workcell._timeline import Knots, RobotPath, RobotState


@dataclass(frozen=True, eq=False)
class Quasistatics:
    """The robot with its tool, and how well the controller knows it."""

    robot: TrueRobot
    compensation: float
    """Part of the sag that the controller takes out."""
    marker_tcp: FloatArray
    """Shape (3,), in m."""
    weight: FloatArray
    """Weight of the tool that the sensor carries, in base, shape (3,), in N."""
    tcp_error: FloatArray
    """Error of the tool centre point, in the tcp frame, shape (3,), in m."""
    growth: Growth | None = None
    """Thermal growth of the arm."""
    warmth: FloatArray = field(default_factory=lambda: np.zeros(()))
    """Thermal state of the arm, from 0 to 1, shape () or (posture,)."""
    strain: FloatArray | None = None
    """Strains that friction keeps while the robot is free, shape (..., gear, stop), in rad."""
    stated_warmth: float | None = None
    """Warmth of the arm in every visit; None: by its random numbers."""

    @classmethod
    def of(cls, cell: Cell, robot: TrueRobot) -> "Quasistatics":
        """Return the statics of a cell, its arm cold and its gears without strain."""
        marker = np.zeros(3) if cell.file.marker is None else cell.file.marker.position_tcp
        simulation = truth_of(cell)
        drift, external = simulation.thermal.drift, robot.external
        growth = None
        if drift > 0.0:
            tool = robot.forward(cell.home)[:3, 3]
            growth = Growth.of(robot.linkage.screws, external, drift, cell.home, tool)
        # The tool's own error is the last of those that add up to that of the tip.
        ends = [linkage.T_base_tip[:3, 3] - linkage.T_base_joint[-1, :3, 3]
                for linkage in (robot.built, robot.linkage)]  # fmt: skip
        error = (ends[0] - ends[1]) @ robot.linkage.T_base_tip[:3, :3]
        weight = cell.file.tool.mass * cell.gravity_base
        compensation = simulation.controller.gravity_compensation
        warmth = simulation.thermal.warmth
        return cls(robot, compensation, marker, weight, error, growth, stated_warmth=warmth)

    def visited(self, chance: VisitChance, warmth: FloatArray | None = None) -> "Quasistatics":
        """Return the statics in a visit, or many; ``warmth`` in place of the visit's own."""
        if warmth is None:
            stated = self.stated_warmth
            warmth = chance.warmth if stated is None else np.full(chance.warmth.shape, stated)
        strain = self.robot.springs.gears.strain(chance.stroke)
        return replace(self, warmth=warmth, strain=strain)

    def heavier(self, mass: float) -> "Quasistatics":
        """Return the same with an additional mass in kg on the tool, unknown to the controller.

        Only the sensor measures it: the sag that it causes is the same with and without contact.
        """
        return replace(self, weight=self.weight + mass * self.robot.gravity)

    def twist(self, q: FloatArray, rest: RobotEquilibrium) -> FloatArray:
        """Return the deviation of a resting robot from the same one undeformed, shape (..., 9)."""
        _, T = self.robot.undeformed(q)
        R_sensor = T[..., :3, :3] @ self.robot.T_tcp_sensor[:3, :3]
        turns = np.stack(
            [
                rest.T_base_tcp[..., :3, :3] @ T[..., :3, :3].swapaxes(-1, -2),
                rest.T_base_sensor[..., :3, :3] @ R_sensor.swapaxes(-1, -2),
            ],
            axis=-3,
        )
        shift = rest.T_base_tcp[..., :3, 3] - T[..., :3, 3]
        vectors = Rotation.from_matrix(turns.reshape(-1, 3, 3)).as_rotvec()
        return np.concatenate([shift, vectors.reshape(*q.shape[:-1], 6)], axis=-1)

    def deviation(self, q: FloatArray, sag: FloatArray) -> FloatArray:
        """Return the twist of a robot that sags, with how it is built and how warm it is.

        Parameters
        ----------
        q : ndarray, shape (..., joint)
            In rad or m.
        sag : ndarray, shape (..., 9)
            What its springs make of it.
        """
        unsprung = self._unsprung(q)
        return sag.copy() if unsprung is None else sag + unsprung

    def _unsprung(self, q: FloatArray) -> FloatArray | None:
        """Return the errors of a rigid arm, shape (..., 9); None: none."""
        robot, off = self.robot, None
        if robot.built is not robot.linkage:
            off = np.zeros((*q.shape[:-1], 9))
            described, real = robot.undeformed(q)
            off[..., :3] = (real - described)[..., :3, 3]
        if self.growth is not None:
            off = np.zeros((*q.shape[:-1], 9)) if off is None else off
            tool = robot.forward(q)[..., :3, 3]
            off[..., :3] += self.warmth[..., None] * self.growth.shift(q, tool)
        return off

    def free(self, q: FloatArray, stop_error: FloatArray, start: FloatArray | None) -> RobotState:
        """Return the robot free of contact, its gears as a free move leaves them.

        Parameters
        ----------
        q : ndarray, shape (joint,)
            In rad or m.
        stop_error : ndarray, shape (3,)
            How far the tool stops from where it should, in base, in m.
        start : ndarray, shape (spring,), optional
            Spring positions near the result.
        """
        nothing = np.zeros((*q.shape[:-1], 3))
        rest = self.robot.rest(q, nothing, self.robot.springs.strained(self.strain), start)
        sag = self.twist(q, rest)
        twist = self._left(self.deviation(q, sag), sag, stop_error)
        return RobotState(q, twist, nothing, nothing, rest.springs, rest.theta, sag)

    def _left(self, twist: FloatArray, sag: FloatArray, stop_error: FloatArray) -> FloatArray:
        left = twist - self.compensation * sag
        left[..., :3] += stop_error
        return left

    def loaded(
        self,
        state: RobotState,
        q: FloatArray,
        force: FloatArray,
        error: FloatArray,
        attack_tcp: FloatArray | None = None,
    ) -> RobotState:
        """Return the robot under a force, from a state whose gears remember.

        Parameters
        ----------
        state : RobotState
            Where it comes from.
        q : ndarray, shape (joint,)
            In rad or m.
        force : ndarray, shape (3,)
            On the robot, in base, in N.
        error : ndarray, shape (3,)
            Error of the stop, in base, in m.
        attack_tcp : ndarray, shape (3,), optional
            Where on the disk the force acts, in the tcp frame, in m.
        """
        rest = self.robot.rest(q, force, state.springs, state.theta, attack_tcp)
        return self.rested(state, q, force, error, rest, attack_tcp)

    def rested(
        self,
        state: RobotState,
        q: FloatArray,
        force: FloatArray,
        error: FloatArray,
        rest: RobotEquilibrium,
        attack_tcp: FloatArray | None,
    ) -> RobotState:
        """Return the state of a robot at rest under a force; see `loaded`."""
        twist = self._left(self.deviation(q, self.twist(q, rest)), state.sag, error)
        lever = self.lever(attack_tcp)
        moment = np.zeros_like(force)
        if np.any(lever):
            R = self.robot.forward(q)[..., :3, :3]
            moment = np.cross((R @ lever[..., None])[..., 0], force)
        return replace(
            state, q=q, twist=twist, force=force, moment=moment, springs=rest.springs,
            theta=rest.theta,
        )  # fmt: skip

    def lever(self, attack_tcp: FloatArray | None) -> FloatArray:
        """Return the point of attack relative to the controller's tool, (..., 3), in m."""
        return self.tcp_error if attack_tcp is None else self.tcp_error + attack_tcp

    def R_base_sensor(self, q: FloatArray, twist: FloatArray) -> FloatArray:
        """Return the true orientation of the sensor, shape (..., 3, 3)."""
        nominal = self.robot.forward(q)[..., :3, :3] @ self.robot.T_tcp_sensor[:3, :3]
        turn = Rotation.from_rotvec(twist[..., 6:].reshape(-1, 3)).as_matrix()
        return turn.reshape(nominal.shape) @ nominal

    def tool_position(self, state: RobotState) -> FloatArray:
        """Return the true position of the tool centre point, in base, shape (..., 3), in m."""
        return self.robot.forward(state.q)[..., :3, 3] + state.twist[..., :3]

    def along(self, q: FloatArray, R_base_tcp: FloatArray, points: FloatArray) -> FloatArray:
        """Return joints that bring the undeformed tool to points, orientation kept.

        Parameters
        ----------
        q : ndarray, shape (joint,)
            Where to start; external axes stay there.
        R_base_tcp : ndarray, shape (3, 3)
            Orientation.
        points : ndarray, shape (point, 3)
            In base, in m.

        Returns
        -------
        ndarray, shape (point, joint)

        Raises
        ------
        DeviceError
            If it is out of the arm's reach.
        """
        goals = np.zeros((len(points), 4, 4))
        goals[:, :3, :3], goals[:, :3, 3], goals[:, 3, 3] = R_base_tcp, points, 1.0
        found = self.robot.solve(goals, np.repeat(q[None], len(points), axis=0))
        if not found.ok.all():
            raise DeviceError(
                f"the arm cannot follow a straight line to {np.round(points[-1], 4).tolist()} m:"
                " a singularity or the end of its reach"
            )
        return found.q

    def path(self, start: RobotState, end: RobotState) -> RobotPath:
        """Return the path on which joints, force and deviation change evenly together."""
        names = ("q", "twist", "force", "moment")
        columns = (np.stack([getattr(s, name) for s in (start, end)]) for name in names)
        return RobotPath(self.knots(np.array([0.0, 1.0]), *columns), start, end)

    def knots(
        self,
        progress: FloatArray,
        q: FloatArray,
        twist: FloatArray,
        force: FloatArray,
        moment: FloatArray,
    ) -> Knots:
        """Return knots with what instruments see there.

        Parameters
        ----------
        progress : ndarray, shape (knot,)
        q : ndarray, shape (knot, joint)
        twist : ndarray, shape (knot, 9)
        force, moment : ndarray, shape (knot, 3)
        """
        T = self.robot.forward(q)
        turn = Rotation.from_rotvec(twist[:, 3:].reshape(-1, 3)).as_matrix().reshape(-1, 2, 3, 3)
        R_tcp = turn[:, 0] @ T[:, :3, :3]
        marker = T[:, :3, 3] + twist[:, :3] + R_tcp @ self.marker_tcp
        R_sensor = turn[:, 1] @ T[:, :3, :3] @ self.robot.T_tcp_sensor[:3, :3]
        wrench = self._wrench(R_sensor, force)
        wrench[:, 3:] += np.einsum("kji,kj->ki", R_sensor, moment)
        seen = np.concatenate([marker, wrench], axis=1)
        return Knots(progress, q, twist, force, moment, seen)

    def _wrench(self, R_base_sensor: FloatArray, force_base: FloatArray) -> FloatArray:
        """Return force and moment at the sensor, in its frame, shape (knot, 6).

        The levers are those of the undeformed tool.
        """
        felt = np.einsum("kji,kj->ki", R_base_sensor, force_base)
        weight = np.einsum("kji,j->ki", R_base_sensor, self.weight)
        T_sensor_tcp = inverse_transform(self.robot.T_tcp_sensor)
        tip = T_sensor_tcp[:3, 3]
        centre = T_sensor_tcp[:3, :3] @ self.robot.tool_centre_tcp + tip
        moment = np.cross(tip, felt) + np.cross(centre, weight)
        return np.concatenate([felt + weight, moment], axis=1)
