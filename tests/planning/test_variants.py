"""What every variant of a plan keeps; what each does is tested with its command."""

import inspect

import pytest

from elastocal import planning
from elastocal.planning.variant import PlanVariant

VARIANTS = (planning.AddedTo, planning.Untracked)
STEPS = ("pool", "choose", "further_rounds", "findings")


def test_every_variant_is_here():
    assert set(PlanVariant.__subclasses__()) == set(VARIANTS)


@pytest.mark.parametrize("variant", VARIANTS)
class TestEveryVariant:
    def test_it_does_some_step_otherwise_and_adds_none(self, variant):
        own = {name for name, each in vars(variant).items() if inspect.isfunction(each)}
        public = {name for name in own if not name.startswith("_")}
        assert public
        assert public <= set(STEPS)

    @pytest.mark.parametrize("step", STEPS)
    def test_a_step_takes_what_that_of_the_plain_plan_takes(self, variant, step):
        wanted = inspect.signature(getattr(PlanVariant, step))
        assert inspect.signature(getattr(variant, step)) == wanted

    def test_it_says_what_a_run_does_without(self, variant):
        assert set(variant.without) <= {"tracker"}
        assert isinstance(variant.complete, bool)
