import dataclasses

import numpy as np

from elastocal.report.plots import (
    weakest_margins,
)


def _with(pool, margin):
    return dataclasses.replace(pool, margin=margin, check_units=("m", "rad"))


def test_weakest_check_is_the_smallest_part_of_its_median(pool):
    margin = np.ones((2, len(pool)))
    margin[0] *= 0.2
    margin[0, 3], margin[1, 4] = 0.05, 0.1
    found = weakest_margins(_with(pool, margin))
    assert (found.check[3], found.check[4]) == (0, 1)
    np.testing.assert_allclose(found.share[[3, 4]], [0.25, 0.1])
    assert found.label[3] == "joint limits 50 mm"
    assert found.label[4] == f"{pool.check_names[1]} 5.73°"


def test_infinite_margins_are_never_the_weakest(pool):
    margin = np.ones((2, len(pool)))
    margin[0] = np.inf
    found = weakest_margins(_with(pool, margin))
    assert np.all(found.check == 1)
    assert np.all(np.isfinite(found.share))


def test_a_pool_without_checks_has_no_weakest_one(pool):
    bare = dataclasses.replace(
        pool, margin=np.zeros((0, len(pool))), check_names=(), check_units=()
    )
    found = weakest_margins(bare)
    assert set(found.label) == {"none"}
    np.testing.assert_array_equal(found.share, 1.0)
