"""`elastocal study` on a small pool of the fibre placement cell."""

import csv
import json
from functools import cache

import numpy as np
import pytest

from elastocal.cell import load_cell
from elastocal.codec.study import Sample, StudyStore, batch_executor, run_study
from elastocal.codec.study.sampling import ONE_AFTER_THE_OTHER
from elastocal.elastic import ElasticModel, layout
from elastocal.identification import calibrate
from elastocal.sim.workcell import ErrorDraws, ErrorScales
from elastocal.workflows.study import _prepare_study, study_conditions
from support.cli import elastocal
from support.simulated import example_cell
from support.studies import numbers

POOL = 60
SEARCH = {"technique": "cover", "pool": POOL, "seed": 1}


def cell_path(**sections):
    return example_cell("afp", search=SEARCH, **sections).path


@cache
def prepared(*vary, cell=None):
    cell = load_cell(cell or cell_path())
    return _prepare_study(cell, study_conditions(cell, vary), seed=0, verification=12, jobs=1)


def errors(simulation, samples, which="error_mean"):
    """Errors of some samples, shape (sample, condition)."""
    found = [simulation(Sample(0, number)) for number in range(samples)]
    return np.array([[getattr(o, which) for o in each.outcomes] for each in found])


def study(out, *options, cell=None):
    return elastocal("study", cell or cell_path(), "--out", out, "--verification", 12, *options)


def test_the_command_writes_tables_record_and_charts(tmp_path):
    options = ("--samples", 3, "--vary", "poses=5,12", "--vary", "springs=actuated,bearing",
               "--target", "0.1 mm", "--jobs", 1)  # fmt: skip
    found = study(tmp_path / "study", *options, "--json")
    assert found.code == 0, found.err
    said = json.loads(found.out)
    assert [each["name"] for each in said["conditions"]][:2] == [
        "poses 5, springs actuated", "poses 5, springs bearing",
    ]  # fmt: skip
    with (tmp_path / "study" / "study.csv").open() as file:
        assert len(list(csv.DictReader(file))) == 12
    assert all((tmp_path / "study" / name).is_file() for name in said["files"])
    assert {"study.svg", "study.html"} <= set(said["files"])
    page = (tmp_path / "study" / "study.html").read_text(encoding="utf-8")
    assert "<img src=" in page
    assert all(f">{number}</td>" in page for number in ("bearing", "actuated"))
    for path in (*(tmp_path / "study").rglob("*.[cj]s*"), tmp_path / "study"):
        assert elastocal("check", path).code == 0, path
    part = min((tmp_path / "study" / "samples").iterdir())
    held = json.loads(elastocal("check", part, "--json").out)
    assert (held["samples"], held["conditions"]) == ([0], 4)
    held = json.loads(elastocal("check", tmp_path / "study", "--json").out)
    assert (held["kind"], held["samples"]) == ("study", 3)
    part.write_text(part.read_text().replace('"error_max": 0', '"error_max": 1', 1))
    assert "was edited" in elastocal("check", tmp_path / "study").reason
    part.unlink()
    again = study(tmp_path / "study", *options)
    assert again.code == 0
    assert "No condition is shown" in " ".join(again.err.split())


@pytest.mark.slow
def test_a_sample_is_calibrated_as_the_dataset_of_a_run_would_be():
    study = prepared("poses=12", "springs=bearing")
    simulate, sample = study.simulate, Sample(0, 0)
    found = simulate(sample).outcomes[0]
    rng = sample.generator(0)
    stiffness, balancer = rng.standard_normal(simulate.truth.springs), rng.standard_normal()
    arm = simulate.truth.stiffened(np.exp(0.2 * stiffness), np.exp(0.2 * balancer))
    poses = np.sort(simulate.chosen[0].order)
    count = len(simulate.measured)
    draws = ErrorDraws.of(POOL, count, sample.generator(1)).take(poses, np.arange(count))
    settled = arm.settle(simulate.places(poses), np.array([*simulate.presses.values()]))
    readings = simulate.errors.readings(
        settled, draws, ErrorScales(), simulate.pool.station[poses], simulate.measured
    )
    readings = readings.set_aside(readings.load_case == "normal_75")
    robot = load_cell(cell_path()).robot
    model = ElasticModel(robot, layout(robot, "bearing"))
    full = calibrate(model, readings, np.random.default_rng(0), marker_offset=simulate.marker)
    assert full.used.all()
    np.testing.assert_allclose(full.calibrated.compliance, found.compliance, rtol=1e-9)


def test_springs_that_readings_decide_are_chosen_for_each_arm_and_not_tabulated():
    study = prepared("poses=12", "springs=bearing,tensor,gears,auto")
    assert study.design.springs["auto"] == study.design.springs["gears"] == ()
    bearing, tensor, gears, auto = study.simulate(Sample(0, 0)).outcomes
    assert len(tensor.compliance) > len(bearing.compliance) > len(auto.compliance) == 0
    assert gears.error_mean != bearing.error_mean
    assert auto.error_mean < 0.1 * auto.deflection_mean


@pytest.mark.slow
def test_verification_poses_are_never_chosen():
    simulate = prepared("poses=12,48", "search=cover,ioops,random").simulate
    aside = set(simulate.pool.verification.tolist())
    assert len(aside) == 12
    for number in range(3):
        rng = Sample(0, number).generator(2)
        for chosen, condition in zip(simulate.chosen, simulate.conditions, strict=True):
            poses = chosen.of(rng).tolist()
            assert len(set(poses)) == condition.poses
            assert not aside & set(poses)


def test_only_random_chooses_anew_for_every_sample():
    simulate = prepared("poses=12", "search=cover,random").simulate
    cover, drawn = simulate.chosen
    rngs = [Sample(0, number).generator(2) for number in (0, 1)]
    assert np.array_equal(*(cover.of(rng) for rng in rngs))
    assert not np.array_equal(*(drawn.of(rng) for rng in rngs))


@pytest.mark.slow
def test_conditions_of_a_sample_share_arm_and_noise():
    one = prepared("poses=12").simulate(Sample(0, 4)).outcomes[0]
    two = prepared("poses=6,12").simulate(Sample(0, 4)).outcomes[1]
    assert one.deflection_mean == two.deflection_mean
    assert one.error_mean == pytest.approx(two.error_mean, rel=1e-6)


@pytest.mark.slow
def test_more_noise_of_either_instrument_is_worse():
    for factor in ("tracker_noise", "force_noise"):
        found = errors(prepared("poses=6", f"{factor}=0,30").simulate, 4)
        assert np.all(found[:, 1] > found[:, 0])


@pytest.mark.slow
def test_arms_of_no_spread_are_the_cell_files():
    found = errors(prepared("poses=6", "truth=0,0.3").simulate, 3, "deflection_mean")
    assert np.ptp(found[:, 0]) == 0.0
    assert np.ptp(found[:, 1]) > 1e-5


@pytest.mark.slow
def test_loads_that_press_only_show_less():
    found = errors(prepared("poses=12", "load_cases=normal,all").simulate, 4)
    assert found[:, 0].mean() > found[:, 1].mean()


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        (("--vary", "pose=3"), "unknown factor 'pose'; did you mean 'poses'? (known: poses, "),
        (("--vary", "poses=many"), "'many' is not a number of calibration poses"),
        (("--vary", "springs=bering"), "unknown spring layout 'bering'; did you mean 'bearing'?"),
        (("--vary", "load_cases=norml"), "no load case 'norml'; did you mean 'normal'?"),
        (("--vary", "poses=10,49"), "poses=49: the pool has 48 valid poses"),
        (("--samples", "0"), "0 samples: must be at least 1"),
        (("--target", "0.05"), "is not a length with its unit"),
        (("--target", "0 mm"), "must be above 0"),
    ],
)
def test_what_cannot_be_studied_is_refused_in_one_line_and_nothing_is_written(
    tmp_path, options, reason
):
    assert reason in study(tmp_path / "study", *options).reason
    assert not (tmp_path / "study").exists()


def test_more_verification_poses_than_the_pool_holds_are_refused(tmp_path):
    found = elastocal("study", cell_path(), "--out", tmp_path / "s", "--verification", 60)
    assert "60 verification poses: must be at least 1, and fewer than the 60" in found.reason


@pytest.mark.slow
def test_another_truth_in_the_same_folder_is_refused(tmp_path):
    options = ("--samples", 2, "--vary", "poses=5", "--jobs", 1)
    assert study(tmp_path / "s", *options).code == 0
    other = cell_path(simulation={"truth": {"gears": 1.1}})
    assert "another study (simulation fingerprint" in study(
        tmp_path / "s", *options, cell=other
    ).reason  # fmt: skip


@pytest.mark.slow
def test_cores_and_a_dask_cluster_give_the_same_numbers_bit_for_bit(tmp_path):
    distributed = pytest.importorskip("distributed")
    made = prepared("poses=8,20", "search=cover,random", "springs=actuated,bearing")

    def run(name, spread):
        store = StudyStore(tmp_path / name)
        return numbers(run_study(store, made.design, 12, made.simulate, spread))

    here = run("here", ONE_AFTER_THE_OTHER)
    for jobs in (1, 2):
        with batch_executor(jobs, None) as spread:
            assert run(f"{jobs} jobs", spread) == here
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None
    ) as cluster:
        address = cluster.scheduler_address
        with batch_executor(None, address) as spread:
            assert run("dask", spread) == here
