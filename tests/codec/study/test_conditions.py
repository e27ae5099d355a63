import pytest

from elastocal.codec.study import Condition, make_conditions, read_variations
from elastocal.codec.study.conditions import FACTORS
from elastocal.errors import CodecError, PlanningError

BASE = Condition(poses=31)


def test_every_factor_is_a_field_of_a_condition():
    assert set(FACTORS) == set(Condition.__dataclass_fields__)


def test_conditions_are_every_combination():
    varied = read_variations(["springs=actuated,bearing", "poses=10, 20"])
    found = make_conditions(varied, BASE)
    assert [(c.poses, c.springs) for c in found] == [
        (10, "actuated"), (10, "bearing"), (20, "actuated"), (20, "bearing"),
    ]  # fmt: skip
    assert {c.search for c in found} == {"cover"}


def test_nothing_varied_is_one_condition():
    assert make_conditions({}, BASE) == (BASE,)


def test_an_unknown_factor_is_refused_with_the_known_ones():
    with pytest.raises(CodecError, match=r"'pose'; did you mean 'poses'\? \(known: poses, search"):
        read_variations(["pose=10"])


@pytest.mark.parametrize(
    "text",
    ["poses=0", "poses=ten", "poses=", "poses", "poses=5,,6", "tracker_noise=-1",
     "tracker_noise=nan", "force_noise=101", "truth=1.5", "poses=10,10"],
)  # fmt: skip
def test_a_value_that_cannot_be_one_is_refused_by_its_factor(text):
    with pytest.raises(CodecError, match=text.partition("=")[0]):
        read_variations([text])


def test_an_unknown_technique_is_refused_with_the_known_ones():
    with pytest.raises(PlanningError, match="unknown search technique 'cver'; did you mean"):
        read_variations(["search=cver"])


def test_a_factor_named_twice_is_refused():
    with pytest.raises(CodecError, match="poses stands twice"):
        read_variations(["poses=10", "poses=20"])
