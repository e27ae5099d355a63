import csv

import pytest

from elastocal.codec.study import Sample, read_study, study_summary, write_study
from elastocal.errors import CodecError, SchemaError
from support.studies import settings, simulate

RESULTS = [simulate(Sample(3, number)) for number in range(4)]


def rows(path):
    with path.open() as file:
        return list(csv.DictReader(file))


@pytest.fixture
def folder(tmp_path):
    write_study(tmp_path, settings(), RESULTS, study_summary(settings(), RESULTS, 5e-5))
    return tmp_path


def test_the_table_has_a_row_a_sample_and_condition_without_loss(folder):
    found = rows(folder / "study.csv")
    assert len(found) == 8
    assert found[3]["poses"] == "10"
    assert float(found[3]["error_max[m]"]) == RESULTS[1].outcomes[1].error_max
    assert found[0]["tracker_noise[1]"] == "1"


def test_compliances_are_kept_with_their_units(folder):
    found = rows(folder / "compliance.csv")
    assert found[2]["spring"] == "joint_1.axial"
    assert found[2]["unit"] == "rad/(N*m)"
    assert float(found[2]["compliance"]) == RESULTS[1].outcomes[0].compliance[0]


def test_the_record_is_read_back(folder):
    record = read_study(folder)
    assert record == study_summary(settings(), RESULTS, 5e-5)
    assert record.varied == ("poses",)
    assert record.conditions[0].name == "poses 5"


def test_a_record_of_another_version_is_refused(folder):
    path = folder / "study.json"
    path.write_text(path.read_text().replace("elastocal.study/1", "elastocal.study/2"))
    with pytest.raises(SchemaError, match=r"elastocal\.study/2"):
        read_study(folder)


@pytest.mark.parametrize("target", [0.0, -1e-3, float("nan")])
def test_a_target_that_is_no_length_is_refused(target):
    with pytest.raises(CodecError, match="must be above 0"):
        study_summary(settings(), RESULTS, target)
