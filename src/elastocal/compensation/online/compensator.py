"""The online compensator: a pure step from state and reading to state and correction.

Its first half conditions a raw reading into the filtered wrench on the robot at the tool centre
point; its second corrects the deflection that the model predicts from that wrench.
"""

import math
from collections.abc import Sequence

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.cell import SensorLoad
from elastocal.compensation.growth import ArmGrowth
from elastocal.compensation.kernel import Function, ModelFunctions
from elastocal.compensation.online.design import JOINT_RANGE, LONG_AGO, MOST_BEYOND, Design, design
from elastocal.compensation.online.state import Correction, Reading, State, Status, Triple
from elastocal.compensation.settings import CompensatorSettings
from elastocal.identification import CalibratedModel


class Conditioner:
    """Bias and weight removed, moved to the tcp, median, filters; one call a reading.

    The C of `elastocal_condition` does the same in the same order.
    """

    def __init__(self, design: Design, orientation: Function) -> None:
        self._orientation = orientation
        self._bias = (*design.load.force_bias.tolist(), *design.load.moment_bias.tolist())
        self._range = (*design.settings.sensor.force, *design.settings.sensor.moment)
        self._gravity = tuple(design.gravity.tolist())
        rows = np.hstack([design.sensor_matrix, design.weight_response])
        self._rows = tuple(tuple(row) for row in rows.tolist())
        self._origin = tuple(design.sensor_origin.tolist())
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
        # A clock that was reset costs one reading, not all that follow.
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
        # Second-order sections in the transposed direct form II, in series, the six components in
        # parallel. Products and sums are in the order of the C export, so that both round alike.
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
        # Unrolled by hand: arrays of six would take longer than the products, and the C reads
        # line by line the same. First gravity in tcp axes.
        rxx, rxy, rxz, ryx, ryy, ryz, rzx, rzy, rzz = self._orientation(reading.q)
        ux, uy, uz = self._gravity
        gx = rxx * ux + ryx * uy + rzx * uz
        gy = rxy * ux + ryy * uy + rzy * uz
        gz = rxz * ux + ryz * uy + rzz * uz
        # The bias is the sensor's own: it goes before the sensor's matrix and axes.
        b0, b1, b2, b3, b4, b5 = self._bias
        x0, x1, x2 = reading.force
        x3, x4, x5 = reading.moment
        x0, x1, x2, x3, x4, x5 = x0 - b0, x1 - b1, x2 - b2, x3 - b3, x4 - b4, x5 - b5
        # [f; t] = D (y - b) - K g, both D and K in tcp axes.
        fx, fy, fz, tx, ty, tz = [
            (s0 * x0 + s1 * x1 + s2 * x2 + s3 * x3 + s4 * x4 + s5 * x5)
            - (k0 * gx + k1 * gy + k2 * gz)
            for s0, s1, s2, s3, s4, s5, k0, k1, k2 in self._rows
        ]
        # m = t + p x f: the weight's moment is about the sensor's origin, so it is gone before the
        # moment is moved to the tcp, by the force without weight.
        px, py, pz = self._origin
        return (
            fx,
            fy,
            fz,
            tx + (py * fz - pz * fy),
            ty + (pz * fx - px * fz),
            tz + (px * fy - py * fx),
        )


_ORIGIN: Triple = (0.0, 0.0, 0.0)
_Load = tuple[Triple, Triple]
"""Force and moment on the robot at the tool centre point, in base."""


class Compensator:
    """Corrects the deflection that a model predicts from joints and measured wrench (Fig. 5).

    The length of the correction never exceeds its limit, and from one step to the next it never
    moves farther than the rate allows, for any readings. The C export uses the same arithmetic in
    the same order.

    Parameters
    ----------
    numbers : Design
        Design of the compensator.
    functions : ModelFunctions, optional
        Functions of the model; by default the compiled kernel.
    """

    def __init__(self, numbers: Design, functions: ModelFunctions | None = None) -> None:
        self.design = numbers
        limits, functions = numbers.settings.limits, functions or numbers.functions()
        self._conditioner = Conditioner(numbers, functions.orientation)
        self._block = functions.block
        self._orientation, self._rest = functions.orientation, functions.rest
        self._growth = functions.growth
        self._spread = np.ascontiguousarray(numbers.spread)
        compliance = numbers.calibrated.compliance
        self._weighted = np.ascontiguousarray(np.column_stack([compliance, numbers.spread]))
        self._shape = (3, len(numbers.spread))
        self._frame = tuple(numbers.frame.ravel().tolist())
        self._in_tcp = numbers.in_tcp
        self._largest, self._step = limits.correction, numbers.largest_step
        self._fade, self._hold = numbers.fade_step, numbers.settings.hold_cycles
        self._deadband, self._slope = numbers.settings.deadband, numbers.deadband_slope
        self._gain, self._uncertain = numbers.settings.gain, numbers.settings.uncertain_above
        self._light, self._free = numbers.light_loads, numbers.settings.free_cycles
        self._farthest = limits.offset
        self._links, self._share = functions.links, numbers.settings.encoder_share
        names = numbers.calibrated.model.robot.joint_names
        self._encoders = [names.index(joint) for joint in numbers.settings.encoders.joints]
        self._sees_friction = numbers.encoders_see_friction
        rest = numbers.rest_spread
        self._rest_spread = self._spread if rest is None else np.ascontiguousarray(rest)
        self._rest_weighted = np.ascontiguousarray(np.column_stack([compliance, self._rest_spread]))

    @classmethod
    def of(
        cls,
        calibrated: CalibratedModel,
        settings: CompensatorSettings | None = None,
        load: SensorLoad | None = None,
        state: ArmGrowth | None = None,
    ) -> "Compensator":
        """Return the compensator of a model; see `elastocal.compensation.online.design.design`."""
        return cls(design(calibrated, settings, load, state))

    def start(self) -> State:
        """Return the state before the first reading: no correction, filters at rest."""
        # Before the first reading it has missed more than it holds: no correction is to be held.
        still = (0.0,) * 6
        filters = self.design.filters
        return State(
            time=LONG_AGO,
            fresh=False,
            problem=Status.STALE.value,
            missed=self._hold + 1,
            window=(still,) * (filters.median - 1),
            memory=tuple(([0.0] * 6, [0.0] * 6) for _ in filters.sections),
            wrench=still,
            correction=_ORIGIN,
            deflection=_ORIGIN,
            half_width=0.0,
            # Without friction nothing is remembered, and nothing asks whether the arm is free.
            unloaded=self._free,
        )

    def step(self, state: State, reading: Reading) -> tuple[State, Correction]:
        """Take a reading and return the correction: `condition`, then `correct`."""
        return self.correct(self._conditioner.step(state, reading), reading.q, reading.links)

    def condition(self, state: State, reading: Reading) -> State:
        """Take a reading only: for a sensor that is quicker than the controller's cycle."""
        return self._conditioner.step(state, reading)

    def correct(
        self, state: State, q: Sequence[float], links: Sequence[float] | None = None
    ) -> tuple[State, Correction]:
        """Return the correction of a cycle.

        Secondary encoders, once zeroed (`zero_encoders`), take the place of the model about the
        axes of their joints: what they see beyond it moves the tool by ``J (delta - theta)``.

        Parameters
        ----------
        state : State
            After the readings of the cycle.
        q : sequence of float
            Joint positions, in rad or m.
        links : sequence of float, optional
            Positions of the links by secondary encoders, in the order of the settings, in rad or m.
        """
        # Both early returns precede the model: it must not be evaluated at invalid joints, nor with
        # a wrench that no reading of this cycle supports.
        if not _are_joints(q):
            return self._without_reading(state, state.problem | Status.INVALID.value)
        if not state.fresh:
            return self._without_reading(state, state.problem)
        rotation = self._orientation(q)
        load = _in_base(rotation, state.wrench)
        beyond, shift, unread = self._seen(state, q, load, links)
        spread = self._rest_spread if state.zero else self._spread
        if self._light:
            deflection, half_width, friction, unloaded = self._remembering(q, load, state, spread)
        else:
            deflection, half_width = self._predicted(q, load, spread)
            friction, unloaded = (), self._free
        deflection = _sum(deflection, shift)
        off = self._off(deflection, state.offset, q)
        target, status = self._target(off, rotation)
        status |= unread
        if half_width > self._uncertain:
            status |= Status.UNCERTAIN.value
        # The rate limit is last, from the correction before: whatever the model, the deadband or
        # the end of a gap asks for, the arm moves no farther than a step.
        correction, late = _towards(state.correction, target, self._step)
        status |= late | state.problem | state.refused
        answer = Correction(correction, deflection, half_width, status)
        return State(
            state.time,
            False,
            state.problem,
            0,
            *state[4:7],
            correction,
            deflection,
            half_width,
            friction,
            unloaded,
            state.offset,
            state.refused,
            beyond,
            state.zero,
        ), answer

    def zero_encoders(self, state: State) -> State:
        """Return the state with the secondary encoders zeroed: the arm is in the air, or touches.

        What they see beyond the model there, the errors of their mounting among it, is what they
        count from. The sag of the arm on its way is the model's. Without a reading of theirs, or
        of the force, nothing changes.

        Parameters
        ----------
        state : State
            After a correction with positions of the links.
        """
        known = not state.missed and not state.problem
        return state._replace(zero=state.beyond) if known else state

    def _seen(
        self, state: State, q: Sequence[float], load: _Load, links: Sequence[float] | None
    ) -> tuple[tuple[float, ...], Triple, int]:
        """Return what encoders see beyond the model, how that moves the tool, and a flag."""
        if self._links is None:
            return (), _ORIGIN, 0
        own, arguments = self._encoders, (q, *load)
        if self._light:
            free = state.unloaded >= self._free
            out = self._links(*arguments, self._rest(q) if free else state.friction)
        else:
            out = self._links(*arguments)
        beyond, unread = state.beyond, 0
        seen: tuple[float, ...] = ()
        if links is not None and len(links) == len(own) and _are_joints(links):
            seen = tuple(
                [x - q[n] - y for x, n, y in zip(links, own, out[: len(own)], strict=True)]
            )
        if seen and _are_near(seen, state.zero):
            before, share = beyond or seen, self._share
            pairs = zip(before, seen, strict=True)
            beyond = tuple([b + share * (s - b) for b, s in pairs])
        else:
            unread = Status.ENCODER.value
        x, y, z = _ORIGIN
        place = len(own)
        for b, zero in zip(beyond, state.zero, strict=False):
            change = b - zero
            x += change * out[place]
            y += change * out[place + 1]
            z += change * out[place + 2]
            place += 3
        return beyond, (x, y, z), unread

    def begin_course(self, state: State, q: Sequence[float], deviation: Sequence[float]) -> State:
        """Take what marker and controller show in light contact at the start of a course.

        The offset of the course is what they show beyond the predicted deflection and growth,

            o = d - C(q) f - g(q),

        and is corrected until the next course begins. The correction goes there at its rate, as
        everywhere. A reading is not taken, and the offset stays what it was, where it or the
        present wrench is not known, or where it asks for more than ``limits.offset``.

        Parameters
        ----------
        state : State
            In light contact, after a correction of the present load.
        q : sequence of float
            Joint positions, in rad or m.
        deviation : sequence of float
            Displacement of the marker less that of the controller since the path was taught, in
            base, in m.
        """
        known = _are_joints(q) and not state.missed and not state.problem
        if not known:
            return state._replace(refused=Status.OFFSET.value)
        px, py, pz = self._off(state.deflection, _ORIGIN, q)
        x, y, z = deviation
        x, y, z = x - px, y - py, z - pz
        # A NaN fails the test.
        if not math.sqrt(x * x + y * y + z * z) <= self._farthest:
            return state._replace(refused=Status.OFFSET.value)
        return state._replace(offset=(x, y, z), refused=0)

    def end_course(self, state: State) -> State:
        """Return the state without the offset of a course; the correction loses it at its rate."""
        return state._replace(offset=_ORIGIN, refused=0)

    def _off(self, deflection: Triple, offset: Triple, q: Sequence[float]) -> Triple:
        """Return how far the tool is off: by the load, by the arm's growth, and in this course."""
        known = _sum(deflection, offset)
        return known if self._growth is None else _sum(known, self._growth(q))

    def _predicted(
        self, q: Sequence[float], load: _Load, spread: FloatArray
    ) -> tuple[Triple, float]:
        """Return the deflection in base, and half its 95 % interval where that is widest."""
        # O L has the interval's half widths as lengths of its rows: products of a fixed number, in
        # every cycle the same time, where percentiles of the draws would need a sort. The
        # deflection is the block times the compliances: the model need not be asked twice.
        weighted = self._weighted if spread is self._spread else self._rest_weighted
        rows = np.array(self._block(q, *load)).reshape(self._shape) @ weighted
        dx, dy, dz = rows[:, 0].tolist()
        return (dx, dy, dz), math.sqrt(max(_squares(rows[:, 1:])))

    def _remembering(
        self, q: Sequence[float], load: _Load, state: State, spread: FloatArray
    ) -> tuple[Triple, float, tuple[float, ...], int]:
        """Return the same of a model with friction, its memory, and how long nothing has loaded it.

        The half width holds what friction may still bear from before the arm was free: nothing is
        known of it but its limits, so it is added in full.
        """
        free = state.unloaded >= self._free
        block = self._block(q, *load, self._rest(q) if free else state.friction)
        size = self._shape[0] * self._shape[1]
        weighted = self._weighted if spread is self._spread else self._rest_weighted
        rows = np.array(block[:size]).reshape(self._shape) @ weighted
        dx, dy, dz = rows[:, 0].tolist()
        earlier = block[size : size + 3]
        if weighted is not self._weighted and self._sees_friction:
            earlier = (0.0, 0.0, 0.0)
        pairs = zip(_squares(rows[:, 1:]), earlier, strict=True)
        half_width = max([math.sqrt(variance) + unknown for variance, unknown in pairs])
        friction = block[size + 3 :]
        unloaded = 0
        if _below(friction[-len(self._light) :], self._light):
            # Counted no farther than needed, as the readings missed are.
            unloaded = min(state.unloaded + 1, self._free)
        return (dx, dy, dz), half_width, friction, unloaded

    def _target(self, off: Triple, rotation: tuple[float, ...]) -> tuple[Triple, int]:
        """Return minus what the tool is off by in the correction's frame, in deadband and limit."""
        dx, dy, dz = off
        length = math.sqrt(dx * dx + dy * dy + dz * dz)
        # From none at the deadband to all at twice it: no jump at its edge.
        share = (length - self._deadband) * self._slope
        status = 0
        if share < 1.0:
            status |= Status.DEADBAND.value
        # The gain before the limit: the limit holds for what is commanded.
        share = min(max(share, 0.0), 1.0) * self._gain
        if length * share > self._largest:
            share = self._largest / length
            status |= Status.LIMITED.value
        fxx, fxy, fxz, fyx, fyy, fyz, fzx, fzy, fzz = rotation if self._in_tcp else self._frame
        return (
            -share * (fxx * dx + fyx * dy + fzx * dz),
            -share * (fxy * dx + fyy * dy + fzy * dz),
            -share * (fxz * dx + fyz * dy + fzz * dz),
        ), status

    def _without_reading(self, state: State, problem: int) -> tuple[State, Correction]:
        """Hold, then fade: the correction, and with it what the filters remember.

        Otherwise the first readings after a gap would be corrected by the wrench before it.
        """
        # Counted no farther than needed: a counter that grows for days would overflow in C.
        missed = min(state.missed + 1, self._hold + 1)
        faded = missed > self._hold
        # Towards zero along a straight line and never past it, slower than the rate limit.
        share = _faded_share(state.correction, self._fade) if faded else 1.0
        x, y, z = state.correction
        correction = (share * x, share * y, share * z)
        remembered, offset = state[4:7], state.offset
        if faded:
            # Where the arm is when readings come again is not known: its course may be over.
            offset = _ORIGIN
            remembered = (
                tuple([_scaled(values, share) for values in state.window]),
                tuple([([*_scaled(a, share)], [*_scaled(b, share)]) for a, b in state.memory]),
                _scaled(state.wrench, share),
            )
        status = (Status.FADED if faded else Status.HELD).value | problem | state.refused
        answer = Correction(correction, state.deflection, state.half_width, status)
        # The load while nothing was measured is not known, so friction is as unknown as at the
        # start.
        unloaded = self._free if faded else state.unloaded
        return State(
            state.time,
            False,
            state.problem,
            missed,
            *remembered,
            correction,
            *state[8:11],
            unloaded,
            offset,
            state.refused,
            state.beyond,
            state.zero,
        ), answer


def _in_base(rotation: tuple[float, ...], wrench: tuple[float, ...]) -> _Load:
    """Return force and moment of a wrench in tcp axes, in base.

    The wrench is filtered in tcp axes, which turn with it, and turned to base only here.
    """
    rxx, rxy, rxz, ryx, ryy, ryz, rzx, rzy, rzz = rotation
    ax, ay, az, nx, ny, nz = wrench
    return (
        (
            rxx * ax + rxy * ay + rxz * az,
            ryx * ax + ryy * ay + ryz * az,
            rzx * ax + rzy * ay + rzz * az,
        ),
        (
            rxx * nx + rxy * ny + rxz * nz,
            ryx * nx + ryy * ny + ryz * nz,
            rzx * nx + rzy * ny + rzz * nz,
        ),
    )


def _sum(one: Triple, other: Sequence[float]) -> Triple:
    (x, y, z), (u, v, w) = one, other
    return x + u, y + v, z + w


def _squares(rows: FloatArray) -> list[float]:
    """Return the squared length of each row."""
    lengths: list[float] = np.einsum("ij,ij->i", rows, rows).tolist()
    return lengths


def _below(loads: Sequence[float], limits: Sequence[float]) -> bool:
    """Return whether every load is smaller than its limit."""
    for load, limit in zip(loads, limits, strict=True):  # noqa: SIM110, as above
        if not -limit < load < limit:
            return False
    return True


def _are_joints(q: Sequence[float]) -> bool:
    """Return whether positions can be a joint's; a NaN cannot."""
    for x in q:  # noqa: SIM110, a generator takes twice the time
        if not -JOINT_RANGE < x < JOINT_RANGE:
            return False
    return True


def _are_near(seen: Sequence[float], zero: Sequence[float]) -> bool:
    """Return whether encoders see no more beyond their zeros than gears turn; none: they do."""
    for x, y in zip(seen, zero, strict=False):  # noqa: SIM110, as above
        if not -MOST_BEYOND <= x - y <= MOST_BEYOND:
            return False
    return True


def _faded_share(here: Triple, largest: float) -> float:
    """Return the share of a correction that is left when it fades by a step; 0 at the end."""
    x, y, z = here
    distance = math.sqrt(x * x + y * y + z * z)
    return (distance - largest) / distance if distance > largest else 0.0


def _scaled(values: Sequence[float], share: float) -> tuple[float, ...]:
    return tuple([share * value for value in values])


def _towards(here: Triple, target: Triple, largest: float) -> tuple[Triple, int]:
    """Return the point at most a step towards a target, and whether the target is farther."""
    x, y, z = here
    dx, dy, dz = target[0] - x, target[1] - y, target[2] - z
    distance = math.sqrt(dx * dx + dy * dy + dz * dz)
    if distance > largest:
        share = largest / distance
        return (x + share * dx, y + share * dy, z + share * dz), Status.RATE.value
    return target, 0
