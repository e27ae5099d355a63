"""From a raw reading to the wrench on the robot at the tool centre point, filtered."""

import math

from elastocal.compensation.kernel import Function
from elastocal.compensation.online.design import JOINT_RANGE, Design
from elastocal.compensation.online.state import Reading, State, Status


class Conditioner:
    """Bias and weight removed, moved to the tcp, median, filters; one call a reading.

    The C of `elastocal_condition` does the same in the same order.
    """

    def __init__(self, design: Design, orientation: Function) -> None:
        self._orientation = orientation
        self._bias = (*design.load.force_bias.tolist(), *design.load.moment_bias.tolist())
        self._range = (*design.settings.sensor.force, *design.settings.sensor.moment)
        self._weight = tuple(design.weight.tolist())
        self._rotation = tuple(design.sensor_rotation.ravel().tolist())
        self._origin = tuple(design.sensor_origin.tolist())
        self._centre = tuple(design.centre.tolist())
        self._sections = design.filters.sections
        self._previous = design.filters.median - 1
        self._longest_gap = design.settings.hold

    def step(self, state: State, reading: Reading) -> State:
        """Return the state after a reading; one that cannot be used leaves the wrench as it is.

        Parameters
        ----------
        state : State
            Before.
        reading : Reading
            Any floats.
        """
        # Judged before anything is computed: one NaN in a filter's memory would stay for ever.
        problem = self._problem(state, reading)
        # A clock that was set anew costs one reading, not all that follow.
        time = reading.time if math.isfinite(reading.time) else state.time
        if problem:
            # `fresh` stays: an earlier reading of this cycle may still be corrected by.
            return State(time, state.fresh, problem, *state[3:])
        wrench = self._at_tcp(reading)
        window = state.window
        # The median comes first: a spike that a linear filter has seen rings on in it.
        if self._previous:
            recent = (wrench, *window)
            middle = len(recent) // 2
            wrench = tuple([sorted(values)[middle] for values in zip(*recent, strict=True)])
            window = recent[: self._previous]
        # Second-order sections in the transposed direct form II, one after the other, the six
        # components side by side. Products and sums stand in the order of the C export, so that
        # both round alike.
        x = list(wrench)
        memory = []
        for (b0, b1, b2, a1, a2), (z1, z2) in zip(self._sections, state.memory, strict=True):
            y = [b0 * u + z for u, z in zip(x, z1, strict=True)]
            memory.append(
                (
                    [b1 * u - a1 * v + z for u, v, z in zip(x, y, z2, strict=True)],
                    [b2 * u - a2 * v for u, v in zip(x, y, strict=True)],
                )
            )
            x = y
        return State(time, True, 0, state.missed, window, tuple(memory), tuple(x), *state[7:])

    def _problem(self, state: State, reading: Reading) -> int:
        """Return why a reading cannot be used, as status flags; 0 if it can.

        All limits are tests that a NaN fails.
        """
        problem = 0
        if not 0.0 < reading.time - state.time <= self._longest_gap:
            problem |= Status.STALE.value
        if not reading.ok:
            problem |= Status.SENSOR.value
        for x, limit in zip((*reading.force, *reading.moment), self._range, strict=True):
            if not -limit < x < limit:
                problem |= (Status.SATURATED if math.isfinite(x) else Status.INVALID).value
        for x in reading.q:
            if not -JOINT_RANGE < x < JOINT_RANGE:
                problem |= Status.INVALID.value
        return problem

    def _at_tcp(self, reading: Reading) -> tuple[float, ...]:
        """Return the wrench on the robot in the tcp frame, about the tool centre point."""
        # Unrolled by hand: arrays of three would take longer than the products, and the C reads
        # line by line the same. First the weight w = R_base_tcp^T (m g), in tcp axes.
        rxx, rxy, rxz, ryx, ryy, ryz, rzx, rzy, rzz = self._orientation(reading.q)
        gx, gy, gz = self._weight
        wx = rxx * gx + ryx * gy + rzx * gz
        wy = rxy * gx + ryy * gy + rzy * gz
        wz = rxz * gx + ryz * gy + rzz * gz
        # The bias is the sensor's own: it goes before the sensor's axes are turned.
        bx, by, bz, nx, ny, nz = self._bias
        ax, ay, az = reading.force
        ax, ay, az = ax - bx, ay - by, az - bz
        mx, my, mz = reading.moment
        mx, my, mz = mx - nx, my - ny, mz - nz
        sxx, sxy, sxz, syx, syy, syz, szx, szy, szz = self._rotation
        # f = R_tcp_sensor (F - b) - w
        fx = sxx * ax + sxy * ay + sxz * az - wx
        fy = syx * ax + syy * ay + syz * az - wy
        fz = szx * ax + szy * ay + szz * az - wz
        # m = R_tcp_sensor (M - b_m) - c x w + p x f: the weight's moment is about the sensor's
        # origin, so it goes before the moment is moved to the tcp, by the force without weight.
        cx, cy, cz = self._centre
        px, py, pz = self._origin
        return (
            fx,
            fy,
            fz,
            sxx * mx + sxy * my + sxz * mz - (cy * wz - cz * wy) + (py * fz - pz * fy),
            syx * mx + syy * my + syz * mz - (cz * wx - cx * wz) + (pz * fx - px * fz),
            szx * mx + szy * my + szz * mz - (cx * wy - cy * wx) + (px * fy - py * fx),
        )
