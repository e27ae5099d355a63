"""Rounds of a plan: poses that are visited one after another, from HOME and back."""

from collections.abc import Sequence
from dataclasses import dataclass

from elastocal.arrays import IndexArray
from elastocal.planning.motion import Route
from elastocal.planning.plan_result import MoveRecord
from elastocal.planning.postures import Postures


@dataclass(frozen=True, eq=False)
class Round:
    """Some of the selected poses, and the way through them."""

    chosen: IndexArray
    """Numbers in the selection, shape (pose,)."""
    postures: Postures
    """In which they are pressed."""
    route: Route
    """Its order counts in ``chosen``."""

    @property
    def order(self) -> IndexArray:
        """Numbers in the selection, in visiting order, shape (pose,)."""
        return self.chosen[self.route.order]


def move_records(route: Route, first: int = 0) -> tuple[MoveRecord, ...]:
    """Return the moves of a round, whose poses are numbered from the first in visiting order."""
    place = {int(chosen): number for number, chosen in enumerate(route.order, start=first)}
    return tuple(
        MoveRecord(
            start=None if move.start is None else place[move.start],
            end=None if move.end is None else place[move.end],
            via=tuple(tuple(joints.tolist()) for joints in move.via),
            duration=move.duration,
        )
        for move in route.moves
    )


def joined_moves(rounds: Sequence[Round], home: tuple[float, ...]) -> tuple[MoveRecord, ...]:
    """Return the moves of rounds, of which each begins where the one before ends, at HOME.

    Parameters
    ----------
    rounds : sequence of Round
        One at least.
    home : tuple of float
        Joint positions of HOME, in rad or m.
    """
    moves: list[MoveRecord] = []
    first = 0
    for each in rounds:
        out, *others = move_records(each.route, first)
        if moves:
            back = moves.pop()
            via, duration = (*back.via, home, *out.via), back.duration + out.duration
            out = MoveRecord(back.start, out.end, via, duration)
        moves += [out, *others]
        first += len(each.chosen)
    return tuple(moves)
