"""Indices of training sets, and whether they foretell accuracy."""

import csv
from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import spearmanr

from elastocal.codec import (
    INDICES,
    IndexValues,
    Variant,
    analyse,
    cross_validate,
    write_index_table,
)
from elastocal.codec._prepared import prepared_variants
from elastocal.codec.indices import (
    STATISTICS,
    _at_equal_size,
    _at_equal_size_and_split,
    _growth,
    correlate,
    index_values,
)
from elastocal.elastic import layout
from elastocal.errors import CodecError
from elastocal.identification import factor, observability
from elastocal.planning.search import Candidates, build_information, o1
from support.cells import Cell, rich_truth, robot
from support.codecs import POSES, judged

BEARING = 1


@pytest.fixture(scope="module")
def known():
    return judged()


def planted(known, goodness) -> dict[tuple[str, str], float]:
    """Return correlations of one planted index with the mean error of the first variant."""
    values = IndexValues("actuated", dict.fromkeys(INDICES, goodness))
    return {
        (each.index, each.kind): each
        for each in correlate(known.data, values)
        if each.error == "mean"
    }


# indices -----------------------------------------------------------------------------------


def rows_of(trainee, poses):
    return trainee.rows(np.asarray(poses), trainee.trains).reshape(-1, trainee.problem.columns)


@pytest.mark.slow
@pytest.mark.parametrize(("cv", "n"), [(0, 1), (3, 4), (9, 7)])
def test_indices_are_those_of_the_singular_values(known, cv, n):
    trainee, found = known.trainees[BEARING], known.insight.indices[BEARING].values
    pool = Candidates(
        known.data.contact, trainee.rows(np.arange(POSES), np.ones_like(trainee.trains))
    )
    information = build_information(pool)
    chosen = known.data.chosen[BEARING, cv, n - 1, :n]
    seen = rows_of(trainee, chosen) / information.scale @ information.basis
    s = np.sqrt(np.linalg.eigvalsh(seen.T @ seen + 1e-6 * np.eye(information.rank)))
    expected = {
        "o2": s[0] / s[-1],
        "o3": s[0],
        "o4": s[0] ** 2 / s[-1],
        "o5": 1.0 / np.sum(1.0 / s),
        "d": np.exp(np.log(s).mean()),
        "a": -np.sum(s**-2.0),
        "e": s[0] ** 2,
        "o1": o1(information, chosen),
    }
    for name, value in expected.items():
        assert found[name][cv, n - 1] == pytest.approx(value, rel=1e-6), name


def test_i_is_the_variance_of_what_the_verification_poses_deflect(known):
    trainee, cv, n = known.trainees[BEARING], 2, 6
    everything = np.ones_like(trainee.trains)
    pool = Candidates(known.data.contact, trainee.rows(np.arange(POSES), everything))
    information = build_information(pool)
    S = information.matrix(known.data.chosen[BEARING, cv, n - 1, :n])
    z = rows_of(trainee, known.data.verification[cv]) / information.scale @ information.basis
    variance = np.mean([row @ np.linalg.solve(S, row) for row in z])
    assert known.insight.indices[BEARING].values["i"][cv, n - 1] == pytest.approx(
        -variance, rel=1e-6
    )


def test_covering_radius_is_that_over_all_poses_in_metres(known):
    cv, n = 1, 3
    points = known.data.contact
    chosen = known.data.chosen[0, cv, n - 1, :n]
    gaps = np.linalg.norm(points[:, None] - points[None, chosen], axis=2)
    found = known.insight.indices[0].values["covering_radius"][cv, n - 1]
    assert found == pytest.approx(gaps.min(axis=1).max())
    assert known.insight.indices[0].goodness("covering_radius")[cv, n - 1] == -found


@pytest.mark.slow
def test_training_load_cases_decide_the_indices():
    readings = Cell(rich_truth(), poses=POSES, seed=4).readings()
    variants = [Variant("one", load_cases="normal"), Variant("five")]
    data = cross_validate(robot(), readings, variants)
    one, five = (index_values(data, each) for each in prepared_variants(robot(), readings, data))
    assert not np.allclose(one.values["i"], five.values["i"], rtol=0.1)


def test_indices_are_worked_out_only_when_asked_for(known):
    found = analyse(robot(), known.readings, known.data)
    assert len(found.seen) == 2
    assert (found.indices, found.correlations) == ((), ())


# statistics --------------------------------------------------------------------------------


def test_growth_and_equal_size_are_means_of_spearmans(known):
    goodness = known.insight.indices[BEARING].goodness("o1")
    accuracy = -known.data.errors("bearing")
    rows = [spearmanr(a, b).statistic for a, b in zip(goodness, accuracy, strict=True)]
    columns = [spearmanr(a, b).statistic for a, b in zip(goodness.T, accuracy.T, strict=True)]
    assert _growth(goodness, accuracy) == pytest.approx(np.mean(rows))
    assert _at_equal_size(goodness, accuracy) == pytest.approx(np.mean(columns))


def test_an_index_that_is_the_accuracy_correlates_fully(known):
    found = planted(known, -known.data.errors("actuated"))
    for kind in STATISTICS:
        assert found["o1", kind].correlation == pytest.approx(1.0)
        assert found["o1", kind].low > 0.99
        assert found["covering_radius", kind].correlation == pytest.approx(-1.0)


def test_the_number_of_poses_alone_correlates_over_sizes_only(known):
    size = np.broadcast_to(known.data.n_train.astype(float), known.data.errors("actuated").shape)
    found = planted(known, size)
    assert found["o1", "growth"].correlation > 0.2
    for kind in ("size", "size_and_split"):
        assert (found["o1", kind].correlation, found["o1", kind].low) == (None, None)


def test_a_hard_verification_set_is_not_taken_for_the_index():
    rng = np.random.default_rng(0)
    hard = 100.0 * rng.random((31, 1))
    accuracy, index = -hard + rng.random((31, 22)), -hard + rng.random((31, 22))
    assert _at_equal_size(index, accuracy) > 0.95
    assert abs(_at_equal_size_and_split(index, accuracy)) < 0.2


def test_indices_that_differ_by_round_off_are_ties(known):
    rng = np.random.default_rng(1)
    shape = known.data.errors("actuated").shape
    found = planted(known, 1e-6 * (1.0 + 1e-10 * rng.standard_normal(shape)))
    assert all(each.correlation is None for each in found.values())


def test_intervals_hold_their_value_and_widen_with_what_splits_share(known):
    alike = np.array(known.data.verification)
    alike[1:] = alike[0]
    apart = np.array([[k % POSES] for k in range(len(alike))])
    goodness = known.insight.indices[BEARING]
    found = {
        name: {
            (e.index, e.error, e.kind): e
            for e in correlate(replace(known.data, verification=sets), goodness)
        }
        for name, sets in (("alike", alike), ("apart", apart), ("as is", known.data.verification))
    }
    for key, each in found["as is"].items():
        assert each.low <= each.correlation <= each.high
        narrow = found["apart"][key]
        assert narrow.high - narrow.low < each.high - each.low
        assert found["alike"][key].low is None


def test_every_index_error_and_kind_has_a_correlation(known):
    keys = {(e.variant, e.index, e.error, e.kind) for e in known.insight.correlations}
    assert len(keys) == len(known.insight.correlations) == 2 * len(INDICES) * 2 * len(STATISTICS)
    assert all(-1.0 <= e.low <= e.high <= 1.0 for e in known.insight.correlations)


# systems built again -----------------------------------------------------------------------


def test_readings_of_another_campaign_are_refused(known):
    other = Cell(rich_truth(), poses=POSES, seed=5).readings()
    with pytest.raises(CodecError, match="not those of the codec: they have 10 poses"):
        prepared_variants(robot(), other, known.data)


def test_a_layout_that_changed_is_refused(known):
    swapped = replace(known.data, layouts=known.data.layouts[::-1])
    with pytest.raises(CodecError, match="variant 'actuated' was made with 6 springs"):
        prepared_variants(robot(), known.readings, swapped)


def test_springs_told_apart_are_those_of_the_calibration(known):
    trainee, seen = known.trainees[BEARING], known.insight.seen[BEARING]
    found = observability(factor(trainee.problem), layout(robot(), "bearing"))
    assert (~seen.never).tolist() == list(found.observable)
    assert seen.groups == found.unobservable
    assert not known.insight.seen[0].never.any()
    assert known.insight.seen[0].groups == ()


def test_one_pose_tells_less_apart_than_many(known):
    share = known.insight.seen[BEARING].share
    assert share.shape == (known.data.n_train[-1], 18)
    assert share[0].sum() < share[-1].sum()
    assert set(np.unique(share[-1])) == {0.0, 1.0}


# files -------------------------------------------------------------------------------------


def test_table_has_a_row_for_every_training_set_without_loss(known, tmp_path):
    path = write_index_table(tmp_path, known.data, known.insight.indices)
    with path.open(encoding="utf-8", newline="") as text:
        rows = list(csv.DictReader(text))
    splits, sizes = known.data.errors("bearing").shape
    assert len(rows) == 2 * splits * sizes
    row = rows[splits * sizes + 3 * sizes + 4]
    assert (row["variant"], row["seed_pose"], row["n_train"]) == ("bearing", "3", "5")
    assert float(row["o1"]) == known.insight.indices[1].values["o1"][3, 4]
    assert float(row["error_max[m]"]) == known.data.errors("bearing", "max")[3, 4]
    assert (
        float(row["covering_radius[m]"]) == known.insight.indices[1].values["covering_radius"][3, 4]
    )


def test_the_table_names_poses_as_the_dataset_does(known, tmp_path):
    labels = tuple((100 + place,) for place in range(len(known.data.pose_labels)))
    data = replace(known.data, pose_labels=labels)
    path = write_index_table(tmp_path, data, known.insight.indices)
    rows = list(csv.DictReader(path.read_text().splitlines()))
    assert {int(row["seed_pose"]) for row in rows} == set((100 + known.data.seed_pose).tolist())
