from dataclasses import replace

import numpy as np
import pytest

from elastocal.identification.domain import CalibrationDomain
from elastocal.identification.recertification.comparison import _load_note, _notes_on
from support.recertified import made_up

PLAN = "run.nc; elastocal run, started {}, plan 906f4cfadf15, cell 0587b5d5dbf5"


def notes(old: str, new: str, same_springs: bool = True, outside: int = 0) -> str:
    models = (replace(made_up(0), provenance=old), replace(made_up(1), provenance=new))
    return "; ".join(_notes_on(*models, same_springs, outside))


def test_two_runs_of_one_plan_need_no_word():
    assert notes(PLAN.format("in May"), PLAN.format("in June")) == ""


@pytest.mark.parametrize("old", ["", "a.nc", PLAN.format("in May").replace("906f", "aaaa")])
def test_without_one_plan_the_poses_may_differ(old):
    assert "same region under the same forces" in notes(old, PLAN.format("in June"))


def test_two_calibrations_of_one_dataset_are_not_independent():
    assert "are not independent" in notes("a.nc", "a.nc")


def test_two_campaigns_whose_files_have_equal_names_are_independent():
    old, new = (replace(made_up(seed), provenance="data.nc; import") for seed in (0, 1))
    domain = CalibrationDomain(
        joint_position=np.zeros((1, 6)),
        force=np.array([[1.25, 2.5, -900.125]]),
        moment=None,
        torque_low=np.zeros(6),
        torque_high=np.ones(6),
        reading_pose=np.zeros(1, int),
    )
    again = replace(domain, force=domain.force + 0.0625)
    old, part = replace(old, domain=domain), replace(new, domain=domain)
    assert "are not independent" in "; ".join(_notes_on(old, part, True, 0))
    assert "are not independent" not in "; ".join(
        _notes_on(old, replace(new, domain=again), True, 0)
    )


def test_other_springs_and_rows_beyond_the_limits_are_told():
    told = notes(PLAN.format("in May"), PLAN.format("in June"), False, 3)
    assert "the models have different springs" in told
    assert "3 rows outside the joint limits" in told


@pytest.mark.parametrize(("old", "new"), [(1e-3, 1.2e-3), (1e-3, None), (None, 1.0), (0.0, 1e-3)])
def test_like_loads_and_unknown_ones_need_no_word(old, new):
    assert _load_note(old, new) is None


@pytest.mark.parametrize(("old", "new"), [(1e-3, 2e-3), (2e-3, 1e-3)])
def test_other_loads_are_told_with_both_deflections(old, new):
    told = _load_note(old, new)
    assert told is not None
    assert "1.000 mm" in told
    assert "2.000 mm" in told
