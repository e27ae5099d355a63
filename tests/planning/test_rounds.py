"""Rounds of a plan: each begins where the one before ends, at HOME."""

from itertools import pairwise

import numpy as np

from elastocal.planning.motion import Route
from elastocal.planning.motion.route import Move
from elastocal.planning.postures import Postures
from elastocal.planning.rounds import Round, joined_moves

HOME = (0.0, 1.0)
NO_VIA = np.empty((0, 2))


def round_of(chosen: list[int], order: list[int]) -> Round:
    ends = [None, *order, None]
    moves = tuple(Move(a, b, NO_VIA, 1.0) for a, b in pairwise(ends))
    frames, q = np.tile(np.eye(4), (len(chosen), 1, 1)), np.zeros((len(chosen), 2))
    postures = Postures(frames, frames[:, 2, :3], q, q, np.arange(len(chosen)))
    route = Route(np.array(order), moves, np.empty(0, dtype=int), True)
    return Round(np.array(chosen), postures, route)


def test_one_round_has_its_moves_by_the_poses_in_visiting_order():
    moves = joined_moves([round_of([0, 1, 2], [2, 0, 1])], HOME)
    assert [(each.start, each.end) for each in moves] == [(None, 0), (0, 1), (1, 2), (2, None)]
    assert all(each.via == () for each in moves)


def test_a_further_round_is_reached_by_way_of_home_and_numbered_on():
    rounds = [round_of([0, 1, 2], [2, 0, 1]), round_of([1], [0]), round_of([2, 0], [1, 0])]
    moves = joined_moves(rounds, HOME)
    ends = [(each.start, each.end) for each in moves]
    assert ends == [(None, 0), (0, 1), (1, 2), (2, 3), (3, 4), (4, 5), (5, None)]
    assert [each.via for each in moves] == [(), (), (), (HOME,), (HOME,), (), ()]
    assert sum(each.duration for each in moves) == 9.0
    assert rounds[2].order.tolist() == [0, 2]
