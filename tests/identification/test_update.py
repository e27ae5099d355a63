"""Springs brought up to date by tracked production, on a simulated arm of other equations."""

import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest

from elastocal.dataset import read, write
from elastocal.errors import ConventionError, DatasetError, IdentificationError
from elastocal.identification import CalibrateResult, calibrate, update_springs
from elastocal.records import read_json
from elastocal.workflows import calibrate as calibrate_files
from support import problems
from support.by_day import some_by_day
from support.cells import Cell, linear_truth, unseen
from support.cli import elastocal

COURSES = 6


def readings_of(poses, seed):
    return problems.campaign(poses, seed)


def production(seed=1, softer=1.0, shift=0.2e-3, noise=10e-6):
    """Return readings of an arm in six courses, each counted from a place of its own."""
    readings, rng = readings_of(31, seed), np.random.default_rng(seed)
    order = np.argsort(readings.joint_position[:, 0], kind="stable")
    readings = readings.take(order)
    course = np.arange(len(readings)) * COURSES // len(readings)
    place = shift * rng.normal(size=(COURSES, 3))[course]
    deflection = softer * readings.deflection + place + noise * rng.normal(size=(len(readings), 3))
    return replace(
        readings,
        marker_displacement=readings.controller_displacement + deflection,
        campaign=np.array([f"course {number}" for number in course]),
    )


@pytest.fixture(scope="module")
def few():
    """A model of five poses, which doubts much."""
    model = problems.elastic("bearing")
    return calibrate(model, readings_of(5, 0), np.random.default_rng(0)).calibrated


def error(calibrated, readings):
    found = calibrated.predict(readings.joint_position, readings.force).deflection
    return float(np.linalg.norm(found - readings.deflection, axis=1).mean())


def worn_unseen(softer):
    """Return readings without noise at poses that nothing has seen, of an arm that got softer."""
    readings = unseen(linear_truth())
    marker = readings.controller_displacement + softer * readings.deflection
    return replace(readings, marker_displacement=marker)


@pytest.mark.slow
@pytest.mark.parametrize("poses", some_by_day([5, 31]))
def test_an_arm_that_got_softer_is_followed_at_poses_that_nothing_has_seen(poses):
    model = problems.elastic("bearing")
    old = calibrate(model, readings_of(poses, 0), np.random.default_rng(0)).calibrated
    there = worn_unseen(1.1)
    for seed in (1, 2, 3, 4):
        moved, worth = update_springs(old, production(seed, 1.1), np.random.default_rng(1))
        assert worth.taken
        assert worth.after < worth.before
        assert error(moved, there) < 0.7 * error(old, there)
        assert np.all(moved.compliance >= 0.0)
        assert moved.draws.shape == old.draws.shape
        assert np.all(moved.draws >= 0.0)


def test_what_is_known_better_has_tighter_intervals(few):
    there = worn_unseen(1.1)
    moved, _ = update_springs(few, production(1, 1.1), np.random.default_rng(1))
    old, new = (
        float((each.high - each.low).mean())
        for each in (c.predict(there.joint_position, there.force) for c in (few, moved))
    )
    assert new < old


def test_springs_that_would_predict_left_out_courses_worse_stay_as_they_were(few):
    moved, worth = update_springs(few, production(), np.random.default_rng(1))
    assert not worth.taken
    assert moved is few
    facts = dict(worth.facts())
    assert facts["springs"] == "left as they were"
    assert facts["warning"].kind == "update.no-gain"


def test_the_place_that_a_course_is_counted_from_does_not_matter(few):
    near, far = (
        update_springs(few, production(1, 1.1, shift), np.random.default_rng(1))[0].compliance
        for shift in (0.0, 5e-3)
    )
    np.testing.assert_allclose(near, far, rtol=1e-6, atol=1e-12)


def test_springs_move_no_farther_than_the_calibration_doubted():
    model = problems.elastic("bearing")
    sure = calibrate(model, readings_of(31, 0), np.random.default_rng(0)).calibrated
    _, worth = update_springs(sure, production(softer=1.1), np.random.default_rng(1))
    assert worth.farthest == pytest.approx(3.0)


def _of_force(change):
    return lambda readings: replace(readings, force=change(readings.force))


def _inches(readings):
    seen = readings.controller_displacement + readings.deflection / 25.4
    return replace(readings, marker_displacement=seen)


def _degrees(readings):
    return replace(readings, joint_position=np.degrees(readings.joint_position))


@pytest.mark.parametrize(
    ("mistake", "said"),
    [
        (_of_force(np.negative), "has its sign turned"),
        (_of_force(lambda f: f / 9.80665), "times as much as its forces say: another unit"),
        (_of_force(lambda f: f / 1e3), "another unit of force or displacement"),
        (_inches, "another unit of force or displacement"),
        (_degrees, "degrees, another joint order, or another robot"),
    ],
    ids=["sign", "kgf", "kN", "inches", "degrees"],
)
def test_mistaken_production_is_refused_with_the_mistake(few, mistake, said):
    with pytest.raises((ConventionError, DatasetError), match=said):
        update_springs(few, mistake(production()), np.random.default_rng(1))


@pytest.mark.parametrize(
    ("mistake", "kind"),
    [
        (_of_force(lambda f: 1.3 * f), "update.no-arm-changes-so-much"),
        (_of_force(lambda f: f * [1.0, 1.0, 0.0]), "update.read-otherwise"),
        (_of_force(lambda f: f[:, [1, 0, 2]]), "update.unexplained"),
    ],
    ids=["gain", "dead axis", "swapped axes"],
)
def test_production_that_the_model_hardly_explains_moves_no_spring(few, mistake, kind):
    moved, worth = update_springs(few, mistake(production()), np.random.default_rng(1))
    assert moved is few
    assert worth.refusal.kind == kind


def _weight_left_in(readings):
    return replace(readings, force=readings.force - [0.0, 0.0, 600.0])


def _forces_lag(readings):
    late = 0.7 * readings.force + 0.3 * np.roll(readings.force, 1, axis=0)
    return replace(readings, force=late)


def _a_row_of_markers_late(readings):
    late = np.roll(readings.marker_displacement, 1, axis=0)
    return replace(readings, marker_displacement=late)


def _marker_y_dead(readings):
    return replace(readings, marker_displacement=readings.marker_displacement * [1.0, 0.0, 1.0])


@pytest.mark.parametrize(
    ("mistake", "said"),
    [
        (_weight_left_in, "hold a constant force too much or too little in the base frame"),
        (_forces_lag, "hold forces that lag"),
        (_a_row_of_markers_late, "hold marker displacements that run ahead"),
        (_marker_y_dead, "marker_displacement_y does not change along courses"),
    ],
)
def test_springs_learn_nothing_from_production_with_a_mistake(few, mistake, said):
    """They moved predictions of a model of five poses by 6 to 11 %."""
    moved, worth = update_springs(few, mistake(production(softer=1.25)), np.random.default_rng(1))
    assert moved is few
    assert said in worth.refusal


@pytest.mark.slow
@pytest.mark.parametrize("softer", [0.9, 1.0, 1.25])
def test_an_arm_that_has_worn_or_not_is_no_mistake(few, softer):
    for seed in (2, 3):
        _, worth = update_springs(few, production(seed, softer), np.random.default_rng(1))
        assert worth.refusal is None or worth.refusal.kind == "update.no-gain"


@pytest.mark.slow
def test_noise_alone_moves_nothing_or_next_to_nothing(few):
    readings = production(noise=0.0)
    rng = np.random.default_rng(3)
    predicted = few.predict(readings.joint_position, readings.force).deflection
    kept = 0
    for _ in range(10):
        noise = 0.3e-3 * rng.normal(size=predicted.shape)
        told = replace(
            readings, marker_displacement=readings.controller_displacement + predicted + noise
        )
        moved, worth = update_springs(few, told, rng)
        kept += not worth.taken
        off = moved.predict(readings.joint_position, readings.force).deflection - predicted
        assert np.linalg.norm(off, axis=1).mean() < 0.2e-3
    assert kept >= 3


@pytest.mark.parametrize("name", [None, "only"])
def test_one_course_is_not_enough(few, name):
    readings = production()
    campaign = None if name is None else np.full(len(readings), name)
    with pytest.raises(IdentificationError, match="1 course of production"):
        update_springs(few, replace(readings, campaign=campaign), np.random.default_rng(0))


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Datasets of one arm on three days, and a model of the first."""
    folder = tmp_path_factory.mktemp("update")
    for name, seed in (("old", 0), ("monday", 1), ("tuesday", 2)):
        write(Cell(linear_truth(), poses=12, seed=seed).measure(), folder / f"{name}.nc")
    calibrate_files(folder / "old.nc", springs="bearing", draws=40, out=folder / "model.json")
    return folder


class TestTheCommand:
    def test_files_are_courses_and_the_model_says_what_it_was_made_of(self, files):
        result = calibrate_files(
            [files / "monday.nc", files / "tuesday.nc"], update=files / "model.json"
        )
        assert result.update.courses == ("monday", "tuesday")
        # They changed nothing, so that they count when there are more.
        assert not result.update.taken
        assert [name.rsplit("/", 1)[-1] for name in result.made_from] == ["old.nc"]
        assert result.update.made_from == {}
        assert "left-out courses" in str(result)
        done = elastocal(
            *("calibrate", files / "monday.nc", files / "tuesday.nc", "--update"),
            *(files / "model.json", "--out", files / "new.json"),
        )
        assert done.code == 0, done.err
        assert "at left-out courses" in done.err
        assert elastocal("check", files / "new.json").code == 0

    @pytest.mark.parametrize(
        "option",
        [
            *(("--budget",), ("--springs", "axial"), ("--loss", "huber")),
            *(("--free-frame", "campaign"), ("--keep-blunders",)),
        ],
    )
    def test_options_of_a_calibration_are_refused(self, files, option):
        done = elastocal(
            *("calibrate", files / "monday.nc", "--update", files / "model.json"),
            *("--out", files / "no.json", *option),
        )
        assert done.code == 1
        assert f"{option[0]} goes with a calibration, not with --update" in done.err
        assert not (files / "no.json").exists()

    def test_readings_that_have_made_the_model_do_not_count_twice(self, files):
        with pytest.raises(IdentificationError, match="was made from these readings already"):
            calibrate_files([files / "monday.nc", files / "old.nc"], update=files / "model.json")

    def test_production_that_moved_the_springs_is_kept_apart_and_counts_once(self, files):
        """A report makes the calibration again, from what that was made from alone."""
        worn = []
        for day, seed in enumerate((1, 2, 3)):
            dataset = Cell(linear_truth(), poses=12, seed=seed).measure()
            deflected = dataset.marker_displacement - dataset.controller_displacement
            there = dataset.marker_displacement + 0.1 * deflected
            write(replace(dataset, marker_displacement=there), files / f"worn{day}.nc")
            worn.append(files / f"worn{day}.nc")
        before, once = read_json(files / "model.json", CalibrateResult), files / "once.json"
        result = calibrate_files(worn, update=files / "model.json", out=once)
        assert result.update.taken
        assert "updated by" in result.provenance
        assert result.made_from == before.made_from
        assert [*result.update.made_from] == [str(each) for each in worn]
        with pytest.raises(IdentificationError, match=r"once\.json was made from these readings"):
            calibrate_files(worn[1:], update=once)
        # What changes nothing afterwards leaves them counted.
        days = [files / "monday.nc", files / "tuesday.nc"]
        again = calibrate_files(days, update=once)
        assert [*result.update.made_from][:3] == [*again.update.made_from][:3]
        assert again.made_from == before.made_from
        for each in (result, again):
            assert each.update.calibrated == tuple(before.compliance.tolist())

    @pytest.mark.parametrize(
        ("link", "message"),
        [("link_3", "are of different robots"), ("link_6", "have other tools")],
    )
    def test_production_of_another_arm_or_tool_is_refused(self, files, tmp_path, link, message):
        days = []
        for name in ("monday", "tuesday"):
            dataset = read(files / f"{name}.nc")
            urdf = ET.fromstring(dataset.robot_urdf)
            (joint,) = (j for j in urdf.iter("joint") if j.find("parent").get("link") == link)
            origin = joint.find("origin")
            x, y, z = map(float, origin.get("xyz").split())
            origin.set("xyz", f"{x} {y} {z + 0.02}")
            changed = dataset.attributes | {"robot_urdf": ET.tostring(urdf, encoding="unicode")}
            write(replace(dataset, attributes=changed), tmp_path / f"{name}.nc")
            days.append(tmp_path / f"{name}.nc")
        with pytest.raises(IdentificationError, match=message):
            calibrate_files(days, update=files / "model.json")

    @pytest.mark.slow
    def test_the_tool_is_given_as_in_the_calibration(self, files, tmp_path):
        # Readings that state the place of their tcp leave no choice.
        for name in ("old", "monday", "tuesday"):
            dataset = read(files / f"{name}.nc")
            write(replace(dataset, tcp_position=None), tmp_path / f"{name}.nc")
        days, model = [tmp_path / "monday.nc", tmp_path / "tuesday.nc"], tmp_path / "model.json"
        calibrate_files(tmp_path / "old.nc", springs="bearing", draws=40, tcp="link_6", out=model)
        with pytest.raises(
            IdentificationError, match="give --tcp and --tool as in the calibration"
        ):
            calibrate_files(days, update=model)
        assert calibrate_files(days, update=model, tcp="link_6").update is not None
