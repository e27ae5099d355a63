"""Ways between HOME and approach poses: straight in joint space, or by way of a few via poses."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import numpy as np

from elastocal.arrays import FloatArray
from elastocal.planning.motion.mover import Mover

HOME = 0
"""Number of HOME among the nodes; pose ``i`` is node ``i + 1``."""


@dataclass(frozen=True, eq=False)
class Way:
    """A free way between two nodes, with a stop at each via pose."""

    via: FloatArray
    """Joint positions in between, shape (via, joint), in rad or m; read-only."""
    duration: float
    """In s."""

    def back(self) -> "Way":
        """Return the same way in the other direction."""
        return Way(self.via[::-1], self.duration)


@dataclass(eq=False)
class Ways:
    """The ways between nodes, found when they are asked for and remembered.

    The *stem* of a pose is its free way to HOME with at most one via pose: none, the pose lifted
    off along its normal, a point about the way, or another pose that leads straight to HOME. A
    pose without a stem cannot be visited. Two poses with stems always have a way: through HOME,
    with at most three via poses.
    """

    mover: Mover
    q: FloatArray
    """Joint positions of the nodes, shape (node, joint): HOME, then the approach poses."""
    normal: FloatArray
    """Outward unit normal of the surface at each pose, shape (pose, 3)."""
    stems: dict[int, Way] = field(default_factory=dict, init=False)
    _known: dict[tuple[int, int], Way] = field(default_factory=dict, init=False)
    _lifts: dict[int, FloatArray] = field(default_factory=dict, init=False)

    def __post_init__(self) -> None:
        home = np.broadcast_to(self.q[HOME], self.q[1:].shape)
        straight = 1 + np.flatnonzero(self.mover.sweep.free(self.q[1:], home))
        self.stems.update(
            (int(pose), self._way(int(pose), HOME, self._none())) for pose in straight
        )
        for pose in sorted(set(range(1, len(self.q))) - set(self.stems)):
            stem = self._first_free(pose, HOME, self._single_vias(pose, HOME))
            stem = stem or self._first_free(pose, HOME, [self.q[[gate]] for gate in straight])
            if stem:
                self.stems[pose] = stem

    def known(self, start: int, end: int) -> Way | None:
        """Return the way between two nodes if it has been asked for before."""
        way = self._known.get((min(start, end), max(start, end)))
        return way.back() if way is not None and start > end else way

    def find(self, start: int, end: int) -> Way:
        """Return the quickest free way of those tried between two nodes with stems.

        Tried are straight, then, the quickest first: one end lifted, or both; the mean in joint
        space of both lifted; a point about the way; and through HOME, which is free in any case.
        """
        first, last = min(start, end), max(start, end)
        if (first, last) not in self._known:
            self._known[first, last] = self._find(first, last)
        known = self.known(start, end)
        assert known is not None
        return known

    def _find(self, first: int, last: int) -> Way:
        straight = self._first_free(first, last, [self._none()])
        if straight is not None:
            return straight
        through_home = self._through_home(first, last)
        vias = [*self._single_vias(first, last), *self._double_vias(first, last), through_home]
        # Known to be free from its stems, even if rounding should tell otherwise on the way back.
        return self._first_free(first, last, vias) or self._way(first, last, through_home)

    def _none(self) -> FloatArray:
        return self.q[:0]

    def _lift(self, node: int) -> FloatArray:
        """Return the lifted postures of a node, the least lifted first; none of HOME."""
        if node == HOME:
            return self._none()
        if node not in self._lifts:
            self._lifts[node] = self.mover.lifted(self.q[node], self.normal[node - 1])
        return self._lifts[node]

    def _single_vias(self, first: int, last: int) -> Iterator[FloatArray]:
        here, there = self._lift(first), self._lift(last)
        means = [0.5 * (a + b) for a, b in zip(here, there, strict=False)]
        about = self.mover.detours(self.q[first], self.q[last])
        return (via[None] for via in (*here, *there, *means, *about))

    def _double_vias(self, first: int, last: int) -> Iterator[FloatArray]:
        return map(np.array, zip(self._lift(first), self._lift(last), strict=False))

    def _through_home(self, first: int, last: int) -> FloatArray:
        """Return the via poses through HOME; those of the stem if HOME is an end."""
        if first == HOME:
            return self.stems[last].via[::-1]
        return np.concatenate([self.stems[first].via, self.q[[HOME]], self.stems[last].via[::-1]])

    def _way(self, start: int, end: int, via: FloatArray) -> Way:
        duration = self.mover.axes.along(self._chain(start, end, via))
        via.setflags(write=False)
        return Way(via, duration)

    def _chain(self, start: int, end: int, via: FloatArray) -> FloatArray:
        return np.concatenate([self.q[[start]], via, self.q[[end]]])

    def _first_free(self, start: int, end: int, vias: Iterable[FloatArray]) -> Way | None:
        """Return the quickest of some ways that is free; ties: the one given first."""
        ways = [self._way(start, end, via) for via in vias]
        for way in sorted(ways, key=lambda way: way.duration):
            if self.mover.sweep.along(self._chain(start, end, way.via)):
                return way
        return None
