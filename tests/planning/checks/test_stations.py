"""Which station measures which pose: none with fewer poses than its registration needs."""

import numpy as np
import pytest

from elastocal.planning.checks import (
    REGISTRATION_POSES,
    assign_stations,
    registration_shortages,
    station_shortage,
    unseen_bumps,
)

UNSEEN = -np.pi


def test_each_pose_goes_to_the_station_that_sees_it_best():
    margins = np.array([[0.3] * 4 + [0.1] * 4, [0.2] * 8])
    assert assign_stations(margins).tolist() == [0, 0, 0, 0, 1, 1, 1, 1]


def test_a_station_with_two_poses_gives_them_to_the_other():
    margins = np.array([[0.3] * 6 + [0.1] * 2, [0.2] * 8])
    assert assign_stations(margins).tolist() == [0] * 8


def test_a_station_that_alone_sees_a_pose_is_given_others_to_be_registered():
    alone = np.array([0.5, 0.5, 0.5, 0.5, 0.5, UNSEEN])
    other = np.array([0.1, 0.4, UNSEEN, 0.3, 0.2, 0.2])
    assert assign_stations(np.array([alone, other])).tolist() == [0, 1, 0, 1, 0, 1]


def test_where_nothing_helps_the_station_keeps_its_pose():
    margins = np.array([[0.5, 0.5, 0.5, UNSEEN], [0.1, UNSEEN, UNSEEN, 0.2]])
    assert assign_stations(margins).tolist() == [0, 0, 0, 1]


def test_a_pose_that_none_sees_has_no_station():
    assert assign_stations(np.array([[0.5, 0.5, 0.5, UNSEEN]])).tolist() == [0, 0, 0, -1]


@pytest.mark.parametrize("seed", range(20))
def test_who_keeps_too_few_poses_could_not_have_been_given_more(seed):
    rng = np.random.default_rng(seed)
    margins = np.where(rng.random((3, 7)) < 0.6, rng.random((3, 7)), UNSEEN)
    chosen = assign_stations(margins)
    seen = (margins > 0.0).any(axis=0)
    assert ((chosen >= 0) == seen).all()
    assert (margins[chosen[seen], np.flatnonzero(seen)] > 0.0).all()
    for station in np.flatnonzero(np.bincount(chosen[seen], minlength=3)):
        own = np.flatnonzero(chosen == station)
        if len(own) < REGISTRATION_POSES:
            others = np.delete(margins, station, axis=0)[:, own]
            assert not (others > 0.0).any(axis=0).all() or len(own) == np.count_nonzero(seen)


def test_few_poses_do_not_show_a_small_bump_and_many_do():
    assert "bumped by less than about 2 mm" in unseen_bumps(["a"] * 8)[0]
    assert unseen_bumps(["a"] * 30) == ()
    assert unseen_bumps([None] * 8) == ()


def test_a_shortage_names_station_and_poses():
    assert registration_shortages(["a", "b", "a", None, "a", "b"]) == {"b": (1, 5)}
    assert station_shortage("b", (1, 5)).startswith("station b sees 2 of the 3 poses")
