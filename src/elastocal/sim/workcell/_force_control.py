"""Force control of the simulated arm: builds up a load case, holds it, lets it go.

The force that the wrist sensor shows follows the wanted one along a straight ramp with a
first-order lag; what is commanded moves so that robot, disk and tooling are in equilibrium under
it. A lateral force beyond the friction limit is not reached: the contact slides.
"""

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import Fault, Motion
from elastocal.errors import DeviceError
from elastocal.sim.workcell._contact import Contact
from elastocal.sim.workcell._paths import force_path, pressed_state
from elastocal.sim.workcell._plant import Plant
from elastocal.sim.workcell._quasistatics import ForceReading, RobotState
from elastocal.sim.workcell._sampling import generator
from elastocal.sim.workcell._timeline import Ripple, Segment, SettlingRamp, TimeLaw, Uniform

SLIP_TIME = 0.1
"""Time that an injected slip takes, in s."""
_UNREST = (7.3, 11.9)
"""Frequencies of the unrest of a held force, in Hz. An assumption."""
_NEVER_AT_REST = (0.9, 1.7)
"""Frequencies of a force that never comes to rest, in Hz."""


class ForceControl:
    """The controller in force control."""

    def __init__(self, plant: Plant, gain: FloatArray) -> None:
        """Control with a sensor of some gain (`ForceReading.gain`)."""
        self._plant, self._gain = plant, gain
        self.load = -1
        self._wanted: FloatArray = np.zeros(3)
        self._rate = 1.0
        self.begin_visit()

    def begin_visit(self) -> None:
        """Zero the sensor and count load cases from 0."""
        plant = self._plant
        state, statics = plant.robot_state(), plant.statics
        self.load = -1
        self._reading = ForceReading(
            self._gain,
            statics.robot.T_tcp_sensor[:3, :3],
            statics.R_base_sensor(state.q, state.twist),
            statics.weight,
        )

    @property
    def reading(self) -> ForceReading:
        """How the controller reads the sensor in this visit."""
        return self._reading

    def hold(self, wanted_tcp: FloatArray, rate: float) -> None:
        """Build up and hold a reading of the sensor, tcp frame, in N, at a rate in N/s."""
        plant, contact = self._plant, self._plant.contact
        if contact is None:
            raise DeviceError("simulated arm: no contact to hold a force in")
        self.load += 1
        self._wanted, self._rate = contact.law.held(wanted_tcp), rate
        slides = contact.law.effort(wanted_tcp) > 1.0
        slip = plant.slip(self.load) * contact.law.slip_sigma(wanted_tcp)
        segment = self._press(slip)
        if slides:
            ramp = segment.law
            assert isinstance(ramp, SettlingRamp)
            after = segment.begin + round(1e6 * (ramp.ramp + 5.0 * ramp.tau))
            plant.later(after, lambda: self._slide(segment))

    def release(self, rate: float) -> None:
        """Ramp the force to zero."""
        plant, contact = self._plant, self._plant.contact
        if contact is None:
            raise DeviceError("simulated arm: no contact to release")
        start = plant.robot_state()
        end = pressed_state(
            plant.statics, start, contact, lambda _: np.zeros(3), plant.stop_error()
        )
        law = Uniform(float(np.linalg.norm(start.force)) / rate)
        path = force_path(plant.statics, start, end)
        plant.run(path, law, (Motion.RELEASING, Motion.IDLE), start)

    def let_slip(self, fault: Fault, held: Segment) -> None:
        """Let the contact slip against the lateral force, unless the load case is over."""
        if self._plant.segment is held:
            self._press(fault.distance * self._away(), SLIP_TIME)

    def _press(self, slip: FloatArray, least: float = 0.0) -> Segment:
        """Go for the wanted force, the contact slipping meanwhile; tcp frame, shape (2,), in m."""
        plant, contact = self._plant, self._plant.contact
        assert contact is not None
        start = plant.robot_state()
        contact = contact.slipped(slip)
        end = self._equilibrium(start, contact)
        plant.contact = contact
        ramp = max(float(np.linalg.norm(end.force - start.force)) / self._rate, least)
        law: TimeLaw = SettlingRamp(ramp, plant.cell.file.simulation.controller.settling)
        path = force_path(plant.statics, start, end)
        ripple = self._ripple()
        return plant.run(path, law, (Motion.HOLDING, Motion.HOLDING), start, ripple=ripple)

    def _slide(self, held: Segment) -> None:
        """Slide at a steady speed until the controller has had enough."""
        plant, entry = self._plant, self._plant.cell.file.simulation
        contact = plant.contact
        if plant.segment is not held or contact is None:
            return
        start, slide = plant.robot_state(), entry.controller.travel_limit
        plant.contact = contact = contact.slipped(slide * self._away())
        end = self._equilibrium(start, contact)
        plant.run(
            force_path(plant.statics, start, end),
            Uniform(slide / entry.contact.slide_speed),
            (Motion.HOLDING, Motion.STOPPED),
            start,
            fault=f"force control gave up: the contact slid by {1e3 * slide:g} mm",
        )

    def _equilibrium(self, start: RobotState, contact: Contact) -> RobotState:
        """Return the robot where the sensor reads the wanted force."""
        plant, wanted, reading = self._plant, self._wanted, self._reading

        def force(R_base_sensor: FloatArray) -> FloatArray:
            return reading.true_force(wanted, R_base_sensor)

        return pressed_state(plant.statics, start, contact, force, plant.stop_error())

    def _away(self) -> FloatArray:
        """Return the direction in which the contact gives way, tcp frame, shape (2,)."""
        lateral = self._wanted[:2]
        length = float(np.linalg.norm(lateral))
        return -lateral / length if length else np.array([1.0, 0.0])

    def _ripple(self) -> Ripple:
        plant = self._plant
        amplitude, frequency = plant.cell.file.simulation.controller.ripple, _UNREST
        for fault in plant.schedule.at(plant.visit):
            if fault.kind == "never_stable" and fault.load == self.load:
                amplitude, frequency = fault.amplitude, _NEVER_AT_REST
        phase = generator(plant.seed, "ripple", plant.key, self.load).uniform(0.0, 2 * np.pi, 2)
        return Ripple(amplitude, frequency, (float(phase[0]), float(phase[1])))
