"""Visiting order and moves, around what stands in the way."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from elastocal.cell import load_cell
from elastocal.cell.examples import write_example
from elastocal.errors import PlanningError, RobotError
from elastocal.planning import cell_surface, collision_scene
from elastocal.planning.motion import mover_for, plan_route
from elastocal.planning.motion.route import _Roadmap
from elastocal.planning.pool import PoolBuilder
from elastocal.planning.postures import Postures
from elastocal.planning.surface import sample_uniform
from support.by_day import some_by_day
from support.moving import BALL, CLEARANCE, HOME, box, chain, dense, mover, pressed
from support.postures import arm

POINTS = [(1.7, -0.4, 0.7), (1.7, 0.4, 0.7), (1.5, -0.5, 0.7), (1.5, 0.5, 0.7)]
WALL = box("wall", (1.6, 0.05, 1.0), (1.8, 0.0, 0.5))


def check(route, postures, mover, home=HOME):
    """Every pose once, from HOME to HOME, all along free of collision by exact distances."""
    visited = [None, *route.order.tolist(), None]
    assert [(m.start, m.end) for m in route.moves] == list(itertools.pairwise(visited))
    assert sorted([*route.order, *route.unreachable]) == list(range(len(postures)))
    for move in route.moves:
        way = chain(move, postures, home)
        assert len(move.via) <= 3
        assert move.duration == pytest.approx(mover.axes.along(way))
        assert mover.sweep.scene.distances(dense(way)).min() >= CLEARANCE


def test_without_obstacles_all_moves_are_straight_and_no_order_is_quicker():
    postures, free = pressed(POINTS), mover()
    route = plan_route(HOME, postures, free)
    check(route, postures, free)
    assert not any(len(move.via) for move in route.moves)
    q = np.vstack([HOME, postures.q_approach])
    orders = [np.r_[0, order, 0] for order in itertools.permutations(range(1, 5))]
    assert route.duration == pytest.approx(min(free.axes.along(q[order]) for order in orders))
    assert route.shortest


def test_a_wall_between_poses_is_passed_by_way_of_via_poses():
    postures, walled = pressed(POINTS[:2]), mover(WALL)
    assert not walled.sweep.along(postures.q_approach)
    route = plan_route(HOME, postures, walled)
    check(route, postures, walled)
    assert len(route.moves[1].via)
    assert not len(route.unreachable)


def test_no_order_of_the_poses_is_quicker_around_a_wall():
    points = [(2.06, -0.19, 0.7), (1.56, 0.29, 0.7), (1.96, 0.23, 0.7), (1.51, 0.25, 0.7)]
    postures, walled = pressed(points), mover(box("wall", (0.05, 1.4, 1.0), (1.75, 0.0, 0.5)))
    ways = _Roadmap(walled, np.vstack([HOME, postures.q_approach]), postures.normal)

    def duration(order):
        return sum(ways.find(*leg).duration for leg in itertools.pairwise((0, *order, 0)))

    orders = list(itertools.permutations(range(1, 5)))
    straight = min(orders, key=lambda order: walled.axes.along(ways.q[[0, *order, 0]]))
    route = plan_route(HOME, postures, walled)
    assert route.duration == pytest.approx(min(duration(order) for order in orders))
    assert route.duration < duration(straight) - 1.0  # else the wall would not matter


def test_the_way_taken_is_the_quickest_free_one_of_those_tried():
    postures, walled = pressed(POINTS[:2]), mover(WALL)
    ways = _Roadmap(walled, np.vstack([HOME, postures.q_approach]), postures.normal)
    found = ways.find(1, 2)
    first, last = ways.q[1:]
    lifts = [v for q in (first, last) for v in walled.lifted(q, postures.normal[0])]
    others = [np.array([first, v, last]) for v in [*lifts, *walled.detours(first, last)]]
    free = [walled.axes.along(way) for way in others if walled.sweep.along(way)]
    assert len(free) > 3
    assert found.duration <= min(free) + 1e-12
    back = ways.find(2, 1)
    assert np.array_equal(back.via, found.via[::-1])
    assert back.duration == found.duration


def test_the_order_crosses_a_wall_as_seldom_as_it_can():
    postures, walled = pressed(POINTS), mover(WALL)
    route = plan_route(HOME, postures, walled)
    check(route, postures, walled)
    sides = np.sign(postures.contact[route.order, 1])
    assert np.count_nonzero(np.diff(sides)) == 1


def test_a_pose_that_is_boxed_in_is_unreachable_and_the_others_are_visited():
    postures = pressed(POINTS)
    boxed = 2
    centre = arm().forward(postures.q_approach[boxed])[:3, 3]
    inside, wall = BALL + 0.02, 0.01
    plates = []
    for axis, side in itertools.product(range(3), (-1.0, 1.0)):
        size, at = np.full(3, 2.0 * inside), centre.copy()
        size[axis], at[axis] = wall, at[axis] + side * inside
        plates.append(box(f"plate {axis}{side}", size, at))
    caged = mover(*plates)
    assert caged.sweep.free(*[postures.q_approach[[boxed]]] * 2)[0]
    route = plan_route(HOME, postures, caged)
    check(route, postures, caged)
    assert route.unreachable.tolist() == [boxed]


@pytest.mark.parametrize("count", [0, 1, 2])
def test_few_poses_are_visited_too(count):
    postures = pressed(POINTS).take(np.arange(count))
    route = plan_route(HOME, postures, mover())
    assert sorted(route.order) == list(range(count))
    assert len(route.moves) == (count + 1 if count else 0)


def test_poses_in_one_place_are_all_visited():
    postures = pressed([POINTS[0]] * 4)
    route = plan_route(HOME, postures, mover())
    check(route, postures, mover())
    assert [move.duration for move in route.moves[1:-1]] == [0.0] * 3


@pytest.mark.slow
def test_the_way_does_not_depend_on_how_poses_are_numbered():
    postures, walled = pressed(POINTS), mover(WALL)
    first = plan_route(HOME, postures, walled)
    again = plan_route(HOME, postures, walled)
    assert np.array_equal(first.order, again.order)
    turned = plan_route(HOME, postures.take([3, 1, 0, 2]), walled)
    assert turned.duration == pytest.approx(first.duration)


def test_progress_ends_with_all_moves_known():
    told: list[tuple[str, int, int]] = []
    plan_route(HOME, pressed(POINTS), mover(WALL), lambda *now: told.append(now))
    assert told[-1] == ("visiting order", 5, 5)
    assert told[0] == ("visiting order", 0, 5)


def test_a_home_in_collision_is_refused_with_what_touches():
    flange = arm().forward(HOME)[:3, 3]
    with pytest.raises(PlanningError, match=r"HOME is not free .*ball and lamp are .* mm apart"):
        plan_route(HOME, pressed(POINTS[:1]), mover(box("lamp", (0.1, 0.1, 0.02), flange)))


def test_a_home_of_another_robot_is_refused():
    with pytest.raises(RobotError, match="6 joints"):
        plan_route(np.zeros(7), pressed(POINTS[:1]), mover())


def example(like, folder, count) -> tuple:
    cell = load_cell(write_example(folder, like)[0])
    surface = cell_surface(cell)
    workshop = PoolBuilder.of(cell, surface)
    points = sample_uniform(surface, 60, np.random.default_rng(0))
    pool = workshop.pool(workshop.rank(points.take(np.arange(16))), points)
    return cell, surface, pool.postures.take(np.arange(min(count, len(pool.postures))))


@pytest.mark.slow
@pytest.mark.parametrize("like", some_by_day(["afp", "machining"]))
def test_the_poses_of_an_example_are_visited(like, tmp_path):
    cell, surface, postures = example(like, tmp_path, 6)
    robot = mover_for(cell, collision_scene(cell, surface))
    route = plan_route(cell.home, postures, robot)
    assert sorted(route.order) == list(range(6))
    for move in route.moves:
        way = dense(chain(move, postures, cell.home))
        keeps = robot.sweep.scene.keeps(way, cell.file.limits.clearance)
        assert keeps.all()


def test_the_speeds_of_the_cell_are_those_of_the_moves(tmp_path):
    cell, surface, _ = example("machining", tmp_path, 1)
    axes = mover_for(cell, collision_scene(cell, surface)).axes
    there = replace(axes).duration(cell.home, cell.home + np.r_[np.radians(105.4), np.zeros(5)])
    assert there == pytest.approx(5.0 + 0.5)


def test_an_empty_round_takes_no_time():
    route = plan_route(HOME, Postures.none(6), mover())
    assert route.duration == 0
