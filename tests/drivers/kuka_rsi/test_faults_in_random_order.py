"""Random sequences of faults and recoveries: after a fault the tool never moves to the surface.

The bench shares no code with the driver. The height of the tool that is looked at is its own, and
the commanded one: a contact relaxes, and what was sent before a fault acts some cycles later. Who
supervises the arm here does what a run does: it looks every 48 ms, after a fault it releases and
retracts, and nothing else before a person says so.
"""

import contextlib

import numpy as np
import pytest

from elastocal.cell import Motion, SensorStatus
from elastocal.errors import DeviceError
from support.kuka_bench import Bench

LOOK = 4
"""Cycles between two looks of whoever supervises."""
BEYOND = 1e-4
"""Largest way to the surface after a fault, in m."""
STALE = 0.3
"""Age from which on a force is not trusted, in s."""
AWAY = 0.03
"""Height to which a tool retracts, in m."""
LARGEST = 400.0
"""Largest load, in N."""
CALM = (Motion.IDLE, Motion.HOLDING)


class Supervised:
    """A bench that is pressed with, and broken, at random."""

    def __init__(self, seed: int) -> None:
        self.bench, self.rng = Bench.of(), np.random.default_rng(seed)
        self.limit = self.bench.arm._settings.collision_force
        self.steps = self.faults = self.seen = 0
        self.lowest = self.added = 0.0
        self._floor: float | None = None
        """Commanded height of the tool when a fault was seen; None while all is well."""
        self._load, self._touch, self._broken, self._often = 0.0, 60.0, False, 0.0
        self.bench.ready()
        # How hard the tool touches when nothing fails.
        assert self.press()
        self._touch, self._often = self._touch + self.added, 0.03
        self.added, self._broken = 0.0, False

    @property
    def height(self) -> float:
        point, normal = self.bench.peer.surface
        return float((self.bench.peer.T[:3, 3] - point) @ normal)

    @property
    def commanded(self) -> float:
        """Height of the tool when all that was sent has acted."""
        return self.height + float(np.sum(self.bench.peer.queue, axis=0) @ self.bench.place.normal)

    @property
    def force(self) -> float:
        return float(np.linalg.norm(self.bench.peer.force_base))

    def pass_time(self, looks: int = 1) -> None:
        """Let cycles pass one by one, and look at the tool after each."""
        for _ in range(LOOK * looks):
            self.bench.clock.sleep(self.bench.peer.cycle)
            self.steps += 1
            if self._floor is not None:
                self.lowest = min(self.lowest, self.commanded - self._floor)
            if self._broken:
                self.added = max(self.added, self.force - self._load)

    def is_faulty(self) -> bool:
        """Return whether a run would see a fault now."""
        feed = self.bench.feed
        try:
            sample, state = feed.newest(), self.bench.arm.state()
        except DeviceError:
            return True
        old = sample is None or self.bench.clock.now() - sample.time > STALE
        stopped = state.fault is not None or state.motion is Motion.STOPPED
        return old or sample.status is not SensorStatus.OK or stopped

    def wait(self, *motions: Motion, most: int = 400) -> bool:
        """Let time pass until the arm is as wanted; return whether it came to that."""
        for _ in range(most):
            self.pass_time()
            if self.is_faulty():
                return False
            if self.bench.arm.state().motion in motions:
                return True
            if self.rng.random() < self._often:
                self.break_something()
        return False

    def break_something(self) -> None:
        """Let a device fail, as it happens to stand or move."""
        bench, rng = self.bench, self.rng
        self.faults += 1
        self._broken, self._load = True, max(self._load, self.force)
        kind = rng.integers(8)
        if kind == 0:
            bench.feed.silent = True
        elif kind == 1:
            bench.feed.status = SensorStatus.FAULT
        elif kind == 2:
            bench.feed.fails = DeviceError("the box means something else")
        elif kind == 3:
            bench.clock.lose = int(rng.integers(1, 40))
        elif kind == 4:
            bench.clock.quiet = True
        elif kind == 5:
            bench.peer.ipoc += int(rng.integers(1, 4000)) * 12
        elif kind == 6:
            bench.peer.restart()
            bench.peer.state, bench.peer.ipoc = 1, int(rng.integers(1, 9)) * 1200
        else:
            bench.peer.silent = int(rng.integers(1, 60))

    def _retract(self) -> None:
        """Leave the surface, as far as a run does."""
        if self.height < AWAY:
            self.bench.arm.retract(self.bench.place.normal, AWAY - self.height, 0.05)

    def back_off(self) -> None:
        """Do what a run does when it has seen a fault: release, retract, stop."""
        self.seen += 1
        self._floor, arm = self.commanded, self.bench.arm
        for act in (
            lambda: arm.release(2000.0),
            self._retract,
            arm.stop,
        ):
            with contextlib.suppress(DeviceError):
                act()
            for _ in range(40):
                self.pass_time()
                with contextlib.suppress(DeviceError):
                    if arm.state().motion in (*CALM, Motion.STOPPED):
                        break
        self.pass_time(int(self.rng.integers(1, 20)))

    def resume(self) -> None:
        """Let a person mend everything and say so: the tool leaves the surface first."""
        bench = self.bench
        bench.feed.silent, bench.feed.fails = False, None
        bench.feed.status = SensorStatus.OK
        bench.clock.quiet, bench.clock.lose, bench.peer.silent = False, 0, 0
        self.pass_time(8)
        bench.arm.enable()
        self.pass_time(4)
        self._retract()
        while bench.arm.state().motion is not Motion.IDLE:
            self.pass_time()
        assert self.height > 0.0
        self._floor, self._load, self._broken = None, 0.0, False

    def press(self) -> bool:
        """Touch, press, let go and leave; return whether nothing failed."""
        bench, normal = self.bench, self.bench.place.normal
        with contextlib.suppress(DeviceError):
            bench.arm.approach(-normal, self.height - 2e-3, 0.05, np.inf)
            if not self.wait(Motion.IDLE):
                return False
            self._load, self._broken = self._touch, self._broken or not self._often
            bench.arm.approach(-normal, 0.01, 0.005, 50.0)
            if not self.wait(Motion.IDLE):
                return False
            load = float(self.rng.uniform(100.0, LARGEST))
            aside = self.rng.uniform(-0.3, 0.3, 2) * load
            self._load = float(np.hypot(load, np.hypot(*aside)))
            bench.arm.hold(np.array([*aside, -load]), 400.0)
            if not self.wait(Motion.STOPPED, most=40) and self.is_faulty():
                return False
            bench.arm.release(400.0)
            if not self.wait(Motion.IDLE):
                return False
            self._retract()
            return self.wait(Motion.IDLE)
        return False


def pressed(seed: int, steps: int) -> Supervised:
    """Press for so many cycles of the controller, faults in between."""
    cell = Supervised(seed)
    while cell.steps < steps:
        if not cell.press():
            cell.back_off()
            cell.resume()
    return cell


@pytest.mark.parametrize(
    ("seed", "steps"),
    [(1, 2000), *(pytest.param(s, 10_000, marks=pytest.mark.slow) for s in (2, 3))],
)
def test_after_a_fault_nothing_pushes_until_a_person_says_so(seed, steps):
    cell = pressed(seed, steps)
    assert cell.faults >= cell.seen > steps / 1000
    assert cell.lowest >= -BEYOND
    assert cell.added <= cell.limit
