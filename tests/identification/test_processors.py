"""What is decided about a campaign is the same on every processor; see decision 107."""

import platform

import pytest

from support.decisions import CORE_TYPES, differences, furthest, under

pytestmark = pytest.mark.skipif(
    platform.machine() not in ("x86_64", "AMD64"), reason="core types of OpenBLAS on x86-64"
)


def test_three_core_types_decide_alike_on_published_and_simulated_readings():
    # The published readings of a FANUC (-1), and campaigns of few and of many poses, one with
    # bounds that leave the data no part, one cross-validated.
    numbers = (-1, 3, 9, 33, 51)
    first = under("Prescott", numbers)
    for core_type in ("Haswell", "Zen"):
        other = under(core_type, numbers)
        assert list(differences(first, other)) == []
        assert furthest(first, other)[0] < 0.05


@pytest.mark.slow
def test_five_core_types_decide_alike_on_two_hundred_campaigns():
    numbers = range(-1, 200)
    found = {core_type: under(core_type, numbers) for core_type in CORE_TYPES}
    first = found[CORE_TYPES[0]]
    lines = [
        f"{core_type}: {line}"
        for core_type, each in found.items()
        for line in differences(first, each)
    ]
    print({core_type: furthest(first, each) for core_type, each in found.items()})
    assert lines == []
