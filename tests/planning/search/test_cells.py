"""The fast field against the plain one: the same picks and distances, bit for bit."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra.numpy import arrays

from elastocal.planning.search.cover import CellField, PlainField
from support.pools import scattered


def picks(field, count, first=0):
    """Return what a field picks and how far each was."""
    chosen = []
    for _ in range(count):
        field.add(first)
        far = field.farthest()
        chosen.append(far)
        first = far.pose
    return chosen


def grid() -> np.ndarray:
    side = np.arange(7.0)
    return np.stack(np.meshgrid(side, side, side[:3]), axis=-1).reshape(-1, 3)


POOLS = {
    "a sheet": scattered(2000).contact,
    "a grid full of ties": grid(),
    "a grid, shuffled": np.random.default_rng(1).permutation(grid()),
    "all in one place": np.ones((300, 3)),
    "each twice": np.repeat(scattered(200).contact, 2, axis=0),
    "one very far away": np.concatenate([scattered(500).contact, [[1e6, 0.0, 0.0]]]),
    "a line": np.column_stack([np.linspace(0.0, 1.0, 400), np.zeros(400), np.zeros(400)]),
    "one": np.zeros((1, 3)),
}


@pytest.mark.parametrize("name", POOLS)
@pytest.mark.parametrize("size", [1, 5, 32, 4096])
def test_the_picks_are_those_of_the_plain_field(name, size):
    contact = POOLS[name]
    count = min(len(contact), 120)
    assert picks(CellField(contact, size), count) == picks(PlainField(contact), count)


@settings(max_examples=60, deadline=None)
@given(
    arrays(np.float64, st.tuples(st.integers(1, 60), st.just(3)), elements=st.integers(-3, 3)),
    st.integers(1, 9),
)
def test_the_picks_are_the_same_on_any_lattice(contact, size):
    cells, plain = CellField(contact, size), PlainField(contact)
    assert picks(cells, len(contact)) == picks(plain, len(contact))


@settings(max_examples=40, deadline=None)
@given(
    arrays(
        np.float64,
        st.tuples(st.integers(1, 40), st.just(3)),
        elements=st.floats(-1e3, 1e3, allow_subnormal=False),
    )
)
def test_the_picks_are_the_same_on_any_points(contact):
    cells, plain = CellField(contact, 4), PlainField(contact)
    assert picks(cells, len(contact)) == picks(plain, len(contact))
