"""What stands under the arm in the cell file: pairs that are refused, bounds that follow."""

import math

import pytest

from elastocal.drivers.kuka_rsi import RsiSettings, bounds_of
from elastocal.drivers.kuka_rsi.settings import require_pair
from elastocal.errors import ElastocalError
from elastocal.records import validate
from support.simulated import example_cell


def read(**told: object) -> RsiSettings:
    return validate(told, RsiSettings, "devices.arm")


def test_by_default_it_listens_on_this_machine_and_moves_nothing():
    settings = read()
    assert settings.mode == "measure"
    assert (settings.address, settings.robot) == ("127.0.0.1", "127.0.0.1")


@pytest.mark.parametrize(
    ("told", "reason"),
    [
        ({"mode": "contact", "hold_on": 1}, "relative corrections need HOLDON 0, not 1.*run away"),
        (
            {"mode": "compensation", "hold_on": 0},
            "absolute corrections need HOLDON 1.*a jump to zero",
        ),
        ({"mode": "contact", "correction": "absolute"}, "contact takes relative corrections"),
        ({"mode": "compensation", "correction": "relative"}, "takes absolute corrections"),
        ({"cycle": "8 ms"}, "4 ms .#IPO_FAST. or 12 ms"),
        ({"correction_speed": "300 mm/s"}, "equal to 250 mm/s"),
        ({"signs": [1, 1, 1]}, "one for each of A1 to A6"),
        ({"signs": [1, 1, 1, 2, 1, 1]}, "signs"),
        ({"sentype": 'A"><x'}, "sentype"),
        ({"adress": "10.0.0.1"}, "unknown key 'adress'; did you mean 'address'"),
        ({"delay": 0.02}, "delay"),
    ],
)
def test_what_does_not_fit_is_refused(told, reason):
    with pytest.raises(ElastocalError, match=reason):
        read(**told)


def test_right_pairs_are_taken():
    assert read(mode="contact", correction="relative", hold_on=0).hold_on == 0
    assert read(mode="compensation", correction="absolute", hold_on=1).hold_on == 1
    for pair in (("absolute", 1), ("relative", 0)):
        require_pair(*pair)


def test_bounds_follow_from_the_cell_and_lie_in_order():
    cell = example_cell("afp")
    bounds = bounds_of(cell, read(mode="contact"))
    engagement, procedure = cell.file.engagement, cell.file.procedure
    assert bounds.correction == pytest.approx(
        engagement.approach_distance + procedure.travel_limit + 0.005
    )
    assert bounds.correction < bounds.poscorr < bounds.monitor
    assert bounds.force == pytest.approx(
        1.2 * 1.3 * max(math.hypot(*force) for force in cell.file.presses.values())
    )
    path = bounds_of(cell, read(mode="compensation"))
    assert path.correction == 0.003
    own = bounds_of(cell, read(mode="contact", largest_correction="40 mm"))
    assert own.correction == 0.04
    assert own.poscorr == pytest.approx(0.0422)
