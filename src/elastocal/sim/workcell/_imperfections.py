"""Imperfections of a robot and its sensor beyond their description, and variations between visits.

A robot is *built* slightly differently from its drawing; its temperature is between cold and warm;
its gears stop within their hysteresis loops; the disk does not lie flat, and its point of attack
varies; a force sensor has hysteresis. Sizes are those of the cell file, with their sources in
`elastocal.sim.truth`; random values depend on a seed and a visit only.
"""

from dataclasses import dataclass, replace

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.errors import present
from elastocal.results import brief_repr
from elastocal.sim.arm import Linkage, Screws, motions
from elastocal.sim.truth import Geometry
from elastocal.sim.workcell._timeline import generator

DRAWS = 64
"""Random load cases of a visit; further ones repeat them."""
_CYCLE = 0.2
"""Load over the range for which a sensor's hysteresis is stated: what a process uses of it."""
_THRESHOLDS = np.array([1.0, 2.0, 4.0]) * _CYCLE / 16.0
"""Loads at which the sensor's elements slide, over the range; half-way all are reversed."""


@brief_repr
@dataclass(frozen=True, eq=False)
class VisitChance:
    """Random numbers of a visit, or of many with a leading axis; make one with `of`."""

    stroke: FloatArray
    """Last stroke of each gear in standard deviations, shape (..., gear)."""
    tilt: FloatArray
    """Tilt of the disk about its two axes, in standard deviations, shape (..., 2)."""
    wander: FloatArray
    """Variation of the point of attack, in standard deviations, by load case, shape (..., load,
    2)."""
    warmth: FloatArray
    """Thermal state of the arm, from 0 (cold) to 1 (warm), shape (...)."""

    @classmethod
    def of(cls, seed: int, key: str) -> "VisitChance":
        """Return the random errors of a seed and a posture or course."""
        rng = generator(seed, "visit", key)
        stroke, tilt = rng.standard_normal(6), rng.standard_normal(2)
        return cls(stroke, tilt, rng.standard_normal((DRAWS, 2)), np.array(rng.uniform()))

    @classmethod
    def stack(cls, visits: list["VisitChance"]) -> "VisitChance":
        """Return many visits as one."""
        names = ("stroke", "tilt", "wander", "warmth")
        return cls(*(np.stack([getattr(visit, name) for visit in visits]) for name in names))

    def load(self, number: int) -> FloatArray:
        """Return tilt and wander of a load case, shape (..., 4)."""
        return np.concatenate([self.tilt, self.wander[..., number % DRAWS, :]], axis=-1)


def built(linkage: Linkage, entry: Geometry, external: int, seed: int) -> Linkage:
    """Return the linkage as it is built: links and tool a little longer, shorter, aside.

    Parameters
    ----------
    linkage : Linkage
        As described.
    entry : Geometry
        How large the errors are.
    external : int
        Number of joints before the arm, which are right.
    seed : int
        Seed of the cell: a robot stays what it is.
    """
    if entry.tcp == 0.0 and entry.links == 0.0:
        return linkage
    count = len(linkage.joint_names)
    errors = generator(seed, "geometry").standard_normal((count + 1, 3))
    errors /= np.linalg.norm(errors, axis=1, keepdims=True)
    errors *= np.concatenate([np.full(count, entry.links), [entry.tcp]])[:, None]
    errors[: external + 1] = 0.0
    shift = np.cumsum(errors, axis=0)
    T_base_joint, T_base_tip = linkage.T_base_joint.copy(), linkage.T_base_tip.copy()
    T_base_joint[:, :3, 3] += shift[:-1]
    T_base_tip[:3, 3] += shift[-1]
    masses = tuple(replace(b, centre=b.centre + shift[b.joint - 1]) for b in linkage.masses)
    return replace(linkage, T_base_joint=T_base_joint, T_base_tip=T_base_tip, masses=masses)


@dataclass(frozen=True, eq=False)
class Growth:
    """An arm that grows evenly away from its foot as it warms up."""

    screws: Screws
    """Axes before the arm."""
    foot: FloatArray
    """Point of axis 1 with those axes at zero, shape (4,): a point, and 1."""
    share: float
    """Growth when warm, over length."""

    @classmethod
    def of(
        cls, screws: Screws, external: int, drift: float, home: FloatArray, tool: FloatArray
    ) -> "Growth":
        """Return the growth that moves the tool (3,) by so much, in m, at HOME (joint,)."""
        before = Screws(screws.axis[:external], screws.point[:external], screws.revolute[:external])
        growth = cls(before, np.append(screws.point[external], 1.0), 1.0)
        return replace(growth, share=drift / float(np.linalg.norm(growth.shift(home, tool))))

    def shift(self, q: FloatArray, tool: FloatArray) -> FloatArray:
        """Return the shift of the tool of a warm arm from that of a cold one, shape (..., 3), in m.

        Parameters
        ----------
        q : ndarray, shape (..., joint)
            In rad or m.
        tool : ndarray, shape (..., 3)
            Tool centre point there, in base, in m.
        """
        count = len(self.screws.axis)
        if count == 0:
            return self.share * (tool - self.foot[:3])
        total = motions(self.screws, q.reshape(-1, q.shape[-1])[:, :count])[-1]
        foot: FloatArray = (total @ self.foot)[:, :3].reshape(tool.shape)
        return self.share * (tool - foot)


@dataclass(frozen=True)
class ForceGain:
    """Readings of the force axes of a sensor, in its frame."""

    force: FloatArray
    """Per force at the tool centre point as described, shape (3, 3)."""
    moment: FloatArray
    """Per moment about that point, shape (3, 3), in N per N·m."""

    def beside(self, lever: FloatArray) -> FloatArray:
        """Return the gain (3, 3) for a force at a distance (3,) from that point, in m."""
        if not np.any(lever):
            return self.force
        gain: FloatArray = self.force + self.moment @ np.cross(lever, np.eye(3)).T
        return gain


class SensorHysteresis:
    """A force sensor with hysteresis: three elements for each axis that stick and slide.

    Their states are stop operators of the load, ``s = clip(s + change, -r, r)``; the axis reads
    ``sum eta s`` less than the load. After a load of a fifth of the range and unloading to half of
    it, all ``s`` have changed from ``r`` to ``-r``, so that the reading is ``2 eta sum r`` higher
    than during loading: that over the load is the figure of the cell file.
    """

    def __init__(self, share: float, ranges: FloatArray) -> None:
        """Take the figure of the cell file, and the ranges (6,) of the axes in N and N·m."""
        self._limit = np.multiply.outer(ranges, _THRESHOLDS)
        self._eta = share * _CYCLE / (2.0 * _THRESHOLDS.sum())
        self.relax()

    def relax(self) -> None:
        """Forget what was: the next load is the rest that it starts from."""
        self._state: FloatArray | None = None
        self._load = np.zeros(6)

    def lag(self, load: FloatArray) -> FloatArray:
        """Return the readings that the axes add to each load, in order in time, (..., 6) as given.

        Parameters
        ----------
        load : ndarray, shape (time, ..., 6)
            True wrenches in the sensor's frame, in N and N·m.
        """
        if self._state is None:
            self._state = np.zeros((*load.shape[1:], len(_THRESHOLDS)))
            self._load = load[0]
        way = np.diff(load, axis=0, prepend=self._load[None])
        # On a monotonic path one clip from its beginning equals all small ones.
        straight = bool(np.all((way >= 0.0).all(axis=0) | (way <= 0.0).all(axis=0)))
        return (
            self._follow(load) if straight else np.concatenate([*map(self._follow, load[:, None])])
        )

    def _follow(self, load: FloatArray) -> FloatArray:
        """Continue along a monotonic path, and return the error of the axes."""
        state = present(self._state, "state of the sensor's hysteresis")
        moved = np.clip(state + (load - self._load)[..., None], -self._limit, self._limit)
        self._state, self._load = moved[-1], load[-1]
        lag: FloatArray = -self._eta * moved.sum(axis=-1)
        return lag
