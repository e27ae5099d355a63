"""Calibration without a tracker: the tooling holds the tool, and gives way by itself."""

import json
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import elastocal as ec
from elastocal.dataset import Readings, write
from elastocal.elastic import ElasticModel, actuated
from elastocal.errors import ElastocalError, IdentificationError, SchemaError
from elastocal.findings import Grade
from elastocal.identification import (
    Contact,
    FitOptions,
    build,
    calibrate,
    choose_model,
    ladder as ladder_module,
    read_contact,
    rung_of,
    screen,
    solve,
    weigh_contact,
)
from elastocal.identification.contact import ContactFigure, untold_stacks, whitened
from elastocal.identification.ladder import climb
from elastocal.identification.mistakes.undoing import find_undone
from support.cli import elastocal
from support.held import PRESS, STIFFNESS, Held, held_by_contact, robot

SOFT = Held()
STATED = Contact(normal=SOFT.normal, lateral=SOFT.lateral)


@cache
def readings(how: Held = SOFT) -> Readings:
    return held_by_contact(how).readings(robot().joint_names)


@cache
def arm():
    return replace(robot(), gravity=(0.0, 0.0, 0.0))


def solved(contact: Contact, how: Held = SOFT):
    model = ElasticModel(arm(), actuated(arm()))
    problem = build(model, readings(how), FitOptions(contact=contact))
    return problem, solve(problem).compliance


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_wrong_presses_at_half_of_the_places_spoil_neither_noise_nor_the_others(seed):
    """What the presses of a place share is spoilt by one, and with it the median of all."""
    sound = readings(replace(SOFT, noise=5e-6))
    rng = np.random.default_rng(seed)
    places = rng.choice(np.unique(sound.pose), 8, replace=False)
    some = [rng.choice(np.flatnonzero(sound.pose == each)) for each in places]
    travel = sound.controller_displacement.copy()
    travel[some] += [0.0, 2e-3, 3e-3]
    wrong = replace(sound, controller_displacement=travel)
    options = weigh_contact(arm(), wrong, FitOptions(contact=Contact()))
    assert options.contact.noise < 6e-6
    problem = build(ElasticModel(arm(), actuated(arm())), wrong, options)
    found = screen(problem, most=0.2)
    assert np.flatnonzero(found.blunder).tolist() == sorted(some)
    assert np.flatnonzero(found.suspicious).tolist() == sorted(some)


@pytest.mark.parametrize("how", [SOFT, Held(tracked=4), Held(doubled=5)])
def test_a_free_contact_and_the_springs_are_found_to_a_percent(how):
    problem, found = solved(Contact(), how)
    np.testing.assert_allclose(1.0 / found[problem.springs], STIFFNESS, rtol=0.01)
    wanted = (how.normal, how.lateral)
    np.testing.assert_allclose(1.0 / found[problem.contact_columns], wanted, rtol=0.02)


def test_a_contact_that_is_taken_as_rigid_passes_for_softer_springs():
    rigid = Contact(normal=1e10, lateral=1e10, uncertainty=0.01)
    problem, found = solved(rigid)
    assert np.max(1.0 / found[problem.springs] / STIFFNESS) < 0.99


def test_readings_that_no_tracker_measured_are_refused_where_nothing_is_said_of_the_contact():
    model = ElasticModel(arm(), actuated(arm()))
    with pytest.raises(IdentificationError, match=r"no marker_displacement: .*--contact"):
        build(model, readings())
    with pytest.raises(IdentificationError, match=r"no number at pose 4 \(11 such poses\)"):
        build(model, readings(Held(tracked=4)))


@pytest.mark.slow
def test_gears_are_refused_by_name_where_the_normal_compliance_is_free():
    options = weigh_contact(arm(), readings(), FitOptions(contact=Contact()))
    with pytest.raises(IdentificationError, match=r"contact\.normal is free.*most: joint_a"):
        choose_model(arm(), readings(), "gears", options)


FREE = Held(noise=5e-6)


@cache
def climbed_free():
    options = weigh_contact(arm(), readings(FREE), FitOptions(contact=Contact()))
    rungs = tuple(rung_of(arm(), name) for name in ("bearing-gears", "gears"))
    return climb(arm(), readings(FREE), rungs, ("bearing-gears",), options), options


@pytest.mark.slow
def test_gears_that_a_free_contact_leaves_out_count_as_doubt():
    choice, options = climbed_free()
    assert [each.name for each in choice.ladder] == ["bearing-gears"]
    (gears,) = choice.lacked
    assert gears.name == "gears"
    assert gears.beside
    assert not gears.chosen
    options = replace(options, draws=40)
    rows = readings(FREE)
    alone, with_doubt = (
        calibrate(choice.model, rows, np.random.default_rng(0), options, ladder=ladder).calibrated
        for ladder in (choice.ladder, (*choice.ladder, *choice.lacked))
    )
    assert with_doubt.compliance == pytest.approx(alone.compliance)
    assert gears.apart > 0.0
    widths = []
    for found in (alone, with_doubt):
        predicted = found.predict(rows.joint_position, rows.force)
        widths.append(np.mean(predicted.high - predicted.low))
    assert widths[1] > 1.02 * widths[0]


def test_a_doubt_that_cannot_be_fitted_is_said_and_refuses_nothing(monkeypatch):
    def unsolved(*_):
        raise IdentificationError("the solver stopped short of the optimum")

    _, options = climbed_free()
    rungs = tuple(rung_of(arm(), name) for name in ("bearing", "gears"))
    monkeypatch.setattr(ladder_module, "_beside_contact_found", unsolved)
    choice = climb(arm(), readings(FREE), rungs, ("bearing",), options)
    assert choice.lacked == ()
    assert [each.kind for each in choice.refused] == ["ladder.refused", "ladder.undoubted"]
    assert "stopped short" in choice.refused[1]


@pytest.mark.slow
def test_presses_on_one_and_on_two_disks_leave_it_free_with_gears():
    how = Held(doubled=8, noise=5e-6)
    options = weigh_contact(arm(), readings(how), FitOptions(contact=Contact(spread=0.02)))
    choice = choose_model(arm(), readings(how), "gears", options)
    problem = build(choice.model, readings(how), options)
    found = solve(problem).compliance[problem.contact_columns]
    np.testing.assert_allclose(1.0 / found, (how.normal, how.lateral), rtol=0.05)


def test_presses_along_the_normal_alone_need_a_stated_normal_compliance_and_no_lateral_one():
    how = Held(sideways=False)
    with pytest.raises(IdentificationError, match="every press is along the normal on one disk"):
        solved(Contact(), how)
    problem, _ = solved(STATED, how)
    assert problem.contact == ("normal",)


def test_rows_are_whitened_by_what_a_block_shares():
    rng = np.random.default_rng(0)
    shared, block = rng.normal(size=(7, 3, 4)), np.array([0, 1, 0, 1, 1, 0, 0])
    for each in (0, 1):
        own = np.flatnonzero(block == each)
        G = shared[own].reshape(-1, 4)
        root = np.linalg.cholesky(np.eye(len(G)) + G @ G.T)
        rows = np.zeros((7, 3, len(G)))
        rows[own] = root.reshape(len(own), 3, -1)
        white = whitened(rows, shared, block)[own].reshape(len(G), -1)
        np.testing.assert_allclose(white @ white.T, np.eye(len(G)), atol=1e-12)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('contact: {normal: "50 N"}', "unit 'N' is not a translational stiffness"),
        ("contact: {normal: 50}", "is not a translational stiffness with its unit"),
        ('contact: {normal: "-5 N/um"}', "must lie between"),
        ('contact: {normal: "nan N/um"}', "is not a translational stiffness with its unit"),
        ('contact: {uncertainty: "0 %"}', "must be a percentage above 0 %"),
        ("contact: {uncertainty: 0.3}", "must be a percentage above 0 %"),
        ('contact: {stop: "1 m"}', "up to 1 mm"),
        ('contact: {norml: "5 N/um"}', "normal"),
        ("contact: 5", "contact"),
        ("{}", "contact"),
        ("[]", "contact.yaml"),
        ('schema: "elastocal.contact/9"\ncontact: {}', "elastocal.contact/9"),
    ],
)
def test_a_contact_file_that_does_not_fit_is_refused_in_a_line(tmp_path, text, message):
    path = tmp_path / "contact.yaml"
    path.write_text(text)
    with pytest.raises(SchemaError, match=message) as found:
        read_contact(path)
    assert "\n" not in str(found.value)


@pytest.mark.parametrize(
    "wrong",
    [{"normal": np.nan}, {"lateral": -1.0}, {"spread": 0.0}, {"stop": 1.0}, {"slip": np.inf}],
)
def test_a_contact_that_is_none_is_refused(wrong):
    with pytest.raises(IdentificationError, match=rf"contact\.{next(iter(wrong))} is"):
        Contact(**wrong)


def test_a_contact_file_of_one_line_states_what_is_known(tmp_path):
    path = tmp_path / "contact.yaml"
    path.write_text('contact: {normal: "50 N/um", uncertainty: "40 %"}\n')
    assert read_contact(path) == Contact(normal=50e6, uncertainty=0.4)


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("held")
    write(held_by_contact(Held(noise=5e-6, tracked=3)), folder / "data.nc")
    (folder / "contact.yaml").write_text('contact: {normal: "6 N/um", lateral: "3 N/um"}\n')
    return folder


def test_calibrate_states_where_its_zero_comes_from(files):
    model, springs = files / "model.json", ("--springs", "actuated", "--draws", "80")
    data, contact = files / "data.nc", ("--contact", files / "contact.yaml")
    said = elastocal("calibrate", data, *contact, "--out", model, *springs)
    assert said.code == 0, said.err
    figures = json.loads(model.read_text())["calibration"]["contact"]
    assert (figures["poses"], figures["tracked"], figures["doubled"]) == (12, 3, 0)
    normal, lateral = figures["figures"]
    assert normal["low"] < 1.0 / SOFT.normal < normal["high"]
    assert lateral["low"] < 1.0 / SOFT.lateral < lateral["high"]
    assert normal["stated"] == pytest.approx(1.0 / 6e6)
    assert 0.0 < figures["zero"] < 50e-6
    assert "The contact that held the tool" in said.err


def test_without_a_contact_file_it_refuses_in_a_line(files):
    said = elastocal("calibrate", files / "data.nc", "--out", files / "none.json")
    assert said.code == 1
    assert "marker_displacement has no number at pose 3 (12 such poses)" in said.reason
    with pytest.raises(ElastocalError, match="--budget"):
        ec.calibrate(files / "data.nc", contact=files / "contact.yaml", budget=True)


def test_statements_that_contradict_the_presses_are_not_blended_with_them_and_named():
    apart = Contact(normal=50e6, doubled=((2.6e-7, 1.8e-8), None)).known("normal")
    assert (apart.mean, apart.sigma) == (2.6e-7, 1.8e-8)
    near = Contact(normal=4e6, doubled=((2.6e-7, 1.8e-8), None)).known("normal")
    assert 2.5e-7 < near.mean < 2.6e-7
    found = ContactFigure("normal", 2.0e-7, 1.8e-7, 2.2e-7, stated=2e-8, doubled=None, outside=1.0)
    assert found.contradicts(0.3)
    assert not replace(found, stated=1.7e-7).contradicts(0.3)
    assert not replace(found, stated=None).contradicts(0.3)


def test_a_contact_file_of_another_tip_is_warned_of(files):
    path = files / "other.yaml"
    path.write_text('contact: {normal: "300 N/um", lateral: "3 N/um"}\n')
    found = ec.calibrate(files / "data.nc", contact=path, springs="actuated", draws=40)
    assert "does it describe this tip or disk, and are the forces in N?" in " ".join(
        found.calibration.warnings
    )


def sound_and(**changes):
    """Return readings of presses on one and two disks by a controller that scatters, changed."""
    return replace(readings(Held(doubled=8, noise=5e-6)), **changes)


def test_a_lost_column_of_stacks_is_seen_by_presses_that_repeat_a_load():
    assert untold_stacks(arm(), sound_and()) is None
    apart, poses = untold_stacks(arm(), sound_and(contacts=np.ones(len(sound_and()))))
    assert poses == 8
    assert apart == pytest.approx(0.95 * PRESS / SOFT.normal, rel=0.1)


def test_a_press_without_weight_has_an_error_and_spoils_no_other():
    """Redescending losses give a blunder no weight at all."""
    sound = readings(replace(SOFT, noise=5e-6))
    options = FitOptions(contact=Contact())
    problem = build(ElasticModel(arm(), actuated(arm())), sound, options)
    error = 1e-5 * np.random.default_rng(0).standard_normal(problem.d.shape)
    error[7, 2] = 2e-3
    factor = np.ones(len(problem))
    factor[7] = 0.0
    own = problem.own_errors(error, factor=factor)
    assert np.isfinite(own).all()
    assert np.linalg.norm(own[7]) > 1e-3
    assert np.linalg.norm(np.delete(own, 7, axis=0), axis=1).max() < 1e-4


def test_friction_that_a_larger_press_left_is_no_other_stack():
    """At 45 % before and after all others, as examples press: a tenth further after them."""
    sound = sound_and()
    normal = np.flatnonzero((sound.load_case == "normal") & (sound.disks == 1))
    levels = sound.take([*range(len(sound)), *normal, *normal])
    own = np.repeat([1.0, 0.45, 0.45 * 1.1], [len(sound), len(normal), len(normal)])[:, None]
    light = levels.reference_force
    force = light + np.minimum(own, np.where(own < 1.0, 0.45, 1.0)) * (levels.force - light)
    friction = {"force": force, "controller_displacement": own * levels.controller_displacement}
    assert untold_stacks(arm(), replace(levels, **friction)) is None
    lost = replace(levels, **friction, contacts=np.ones(len(levels)))
    assert untold_stacks(arm(), lost)[1] == 8


@pytest.mark.parametrize(
    ("lost", "kinds"),
    [
        pytest.param([], set(), marks=pytest.mark.slow),
        (
            ["contacts", "reference_force"],
            {"calibration.untold-stacks", "calibration.no-light-force"},
        ),
    ],
)
def test_columns_that_are_lost_are_warned_of(lost, kinds):
    """And nothing is said of sound ones: presses on two stacks may read one force."""
    data = held_by_contact(Held(doubled=8, noise=5e-6)).to_xarray().drop_vars(lost)
    found = ec.calibrate(ec.Dataset.from_xarray(data), contact=STATED, springs="actuated", draws=40)
    said = {each.kind for each in found.calibration.warnings}
    assert {each for each in said if "stacks" in each or "light" in each} == kinds
    assert "mistakes.repeated-readings" not in said


def test_a_contact_is_refused_where_a_tracker_measured_every_reading():
    blank = held_by_contact().to_xarray()
    blank["marker_displacement"] = 0.0 * blank["controller_displacement"]
    with pytest.raises(IdentificationError, match="an empty cell is no 0"):
        ec.calibrate(ec.Dataset.from_xarray(blank), contact=Contact(5e6, 3e6), springs="actuated")


@pytest.mark.parametrize("name", ["force", "reference_force"])
def test_a_surface_that_pulls_is_refused(name):
    turned = held_by_contact().to_xarray()
    turned[name] = -turned[name]
    with pytest.raises(IdentificationError, match=f"^{name} of pose 0, .* pulls the tool"):
        ec.calibrate(ec.Dataset.from_xarray(turned), contact=Contact(5e6, 3e6), springs="actuated")


@pytest.mark.slow
def test_a_marker_of_zeros_ends_in_a_sentence_and_not_in_a_traceback():
    blank = held_by_contact(Held(noise=5e-6, doubled=8)).to_xarray()
    blank["marker_displacement"] = 0.0 * blank["controller_displacement"]
    found = ec.calibrate(ec.Dataset.from_xarray(blank), springs="actuated")
    assert any("marker_displacement_x is dead" in each for each in found.calibration.warnings)


def of_pose_before(good: Readings) -> dict[str, np.ndarray]:
    return {"force": np.roll(good.force.reshape(15, 5, 3), 1, axis=0).reshape(-1, 3)}


def turned(good: Readings) -> dict[str, np.ndarray]:
    R = robot().forward(good.joint_position)[:, :3, :3]
    G = R @ np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]) @ np.swapaxes(R, 1, 2)
    return {
        name: np.einsum("rij,rj->ri", G, getattr(good, name))
        for name in ("force", "reference_force")
    }


def with_drift(good: Readings) -> dict[str, np.ndarray]:
    late = np.linspace(0.0, 1.0, len(good))[:, None]
    return {"force": good.force + 0.3 * PRESS * late * np.array([0.4, 0.3, 0.8])}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("wrong", "said", "grade"),
    [
        (of_pose_before, "forces are those of the pose before", Grade.REFUSAL),
        (turned, "force in the tcp frame looks turned by 90 deg about z", Grade.REFUSAL),
        (with_drift, "the zero of the force drifts by", Grade.WARNING),
    ],
)
def test_mistaken_forces_are_named_without_a_tracker_too(wrong, said, grade):
    rng, good = np.random.default_rng(0), readings(Held(noise=5e-6))
    good = replace(good, force=good.force + rng.standard_normal(good.force.shape))
    assert find_undone(arm(), good, None, STATED) == ()
    (found,) = find_undone(arm(), replace(good, **wrong(good)), None, STATED)
    assert said in str(found)
    assert found.grade is grade


def test_a_stiffness_with_a_unit_is_refused_in_python():
    with pytest.raises(IdentificationError, match=r"^contact.normal is '50 N/um': in Python"):
        Contact(normal="50 N/um")


def test_gears_on_bearing_springs_are_tried_beside_a_contact_alone():
    """A free normal compliance leaves them where it leaves no springs of links."""
    held = choose_model(arm(), readings(), "auto", FitOptions(contact=Contact()))
    assert "bearing-gears" in [each.name for each in held.ladder]
    assert {each.values["springs"] for each in held.refused} >= {"links", "gears"}
