import json
from pathlib import Path

import numpy as np
import pytest

from elastocal.cell import LineCounts, fingerprint, load_cell
from elastocal.dataset import read
from elastocal.errors import DatasetError, ElastocalError, ProcedureError, SchemaError
from elastocal.procedure import (
    Event,
    Journal,
    RunFolder,
    derive_run,
    read_journal,
    write_derived,
)
from elastocal.procedure.derive.derivation import DerivedRun
from elastocal.procedure.record import ReadingStatus, Window
from elastocal.records import to_data
from elastocal.robot import Robot
from support.by_day import some_by_day
from support.recorded_runs import Run, Truth, record_run
from support.sealed import edit_journal


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Run:
    return record_run(tmp_path_factory.mktemp("run") / "run")


@pytest.fixture(scope="module")
def derived(run) -> DerivedRun:
    return derive_run(run.path)


def values(derived: DerivedRun, name: str) -> np.ndarray:
    return derived.dataset.to_xarray()[name].values


@pytest.mark.slow
def test_forces_come_out_in_base_without_tool_weight_and_bias(run, derived):
    # 0.5 N of noise, 101 samples, twice: 0.07 N.
    np.testing.assert_allclose(values(derived, "force"), run.force, atol=0.4)


def test_the_controllers_displacement_is_that_of_the_marker(run, derived):
    found = values(derived, "controller_displacement")
    # The lever arm is known to a fraction of a millimetre, the tool turns by half a milliradian.
    np.testing.assert_allclose(found, run.controller, atol=0.5e-6)


def test_the_difference_of_the_displacements_is_the_deflection_of_the_marker(run, derived):
    found = values(derived, "marker_displacement") - values(derived, "controller_displacement")
    np.testing.assert_allclose(found, run.deflection, atol=6e-6)
    assert np.abs(run.deflection).max() > 1e-3


def test_the_marker_stands_in_the_datasets_attributes(run, derived):
    np.testing.assert_allclose(derived.dataset.marker, run.truth.lever, atol=0.5e-3)


def test_sigmas_are_those_of_the_means_of_the_samples(derived):
    # Two means of 101 samples each; correlation found by chance widens them by a little.
    one_mean = 1.0 / np.sqrt(101.0)
    force, marker = values(derived, "force_sigma"), values(derived, "marker_sigma")
    assert np.median(force) == pytest.approx(0.5 * np.sqrt(2.0) * one_mean, rel=0.1)
    assert np.median(marker) == pytest.approx(10e-6 * np.sqrt(2.0) * one_mean, rel=0.1)


def test_provenance_names_run_version_and_seed(derived):
    said = derived.dataset.provenance
    assert "folder run" in said
    assert "elastocal 0.1.0" in said
    assert "seed 7" in said


def test_the_summary_finds_station_and_tool(run, derived):
    station = to_data(derived.summary)["registration"]["stations"][0]
    np.testing.assert_allclose(station["T_base_tracker"], run.truth.T_base_tracker, atol=2e-3)
    tool = to_data(derived.summary)["tool"]
    assert tool["mass_kg"]["cell"] == 60.0
    assert tool["mass_kg"]["value"] == pytest.approx(60.0, abs=2 * tool["mass_kg"]["half_width_95"])
    assert to_data(derived.summary)["readings"]["counts"] == {
        "ok": 30,
        "slipped": 0,
        "unstable": 0,
        "aborted": 0,
        "missing": 0,
    }
    assert to_data(derived.summary)["poses"] == {"planned": 6, "committed": 6, "missing": []}
    assert to_data(derived.summary)["warnings"] == []


def test_the_dataset_holds_where_and_how_each_zero_was_read(run, derived):
    data = derived.dataset
    assert data.attributes["schema"] == "elastocal.dataset/2"
    robot = load_cell(RunFolder(run.path).cell / "cell.yaml").robot
    rigid = robot.forward(data.reference_joint_position)
    np.testing.assert_allclose(rigid[:, :3, 3], data.tcp_position, atol=1e-9)
    assert not data.reference_force.any()
    assert not data.conditioned


def test_the_order_in_time_is_that_of_the_windows(run, derived):
    sequence = derived.dataset.sequence
    assert sequence.shape == (6, 5)
    assert sequence.tolist() == [[0, 1, 2, 3, 4]] * 6


def test_the_urdf_of_the_dataset_weighs_the_tool(run, derived):
    cell = load_cell(RunFolder(run.path).cell / "cell.yaml")
    data = derived.dataset
    weighed = Robot.from_urdf(data.robot_urdf, data.tcp_frame)
    q = data.reference_joint_position
    J = weighed.jacobian(q)
    lever = weighed.forward(q)[:, :3, :3] @ cell.tool_centre_tcp
    at_centre = J.translation + np.cross(J.rotation, lever[..., None], axis=1)
    tool = -np.einsum("pij,i->pj", at_centre, cell.file.tool.mass * cell.gravity_base)
    more = weighed.gravity_torques(q) - cell.robot.gravity_torques(q)
    np.testing.assert_allclose(more, tool, atol=1e-8)
    assert np.abs(tool).max() > 100.0


@pytest.mark.slow
def test_deriving_again_gives_the_same_files(run, derived):
    write_derived(run.path, derived)
    folder = RunFolder(run.path)
    first = read(folder.dataset)
    again = derive_run(run.path)
    write_derived(run.path, again)
    assert first.to_xarray().identical(read(folder.dataset).to_xarray())
    assert json.loads(folder.summary.read_text())["schema"] == "elastocal.run-summary/2"


@pytest.mark.slow
def test_a_reading_that_slipped_keeps_its_numbers_and_its_status(tmp_path):
    def slip(pose: int, window: Window) -> Window:
        if (pose, window.load_case) == (2, "east"):
            return window.model_copy(update={"status": ReadingStatus.SLIPPED, "note": "slid"})
        return window

    derived = derive_run(record_run(tmp_path / "run", change=slip).path)
    cell = derived.dataset.to_xarray().sel(pose=2, load_case="east")
    assert cell["status"] == 1
    assert np.all(np.isfinite(cell["force"]))
    assert to_data(derived.summary)["readings"]["not_ok"] == [
        {"pose": 2, "load_case": "east", "status": "slipped", "note": "slid"}
    ]
    assert to_data(derived.summary)["warnings"] == [
        "1 of 30 readings are not ok; the list says why"
    ]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("station", "status"),
    some_by_day(
        [
            ("station_2", ReadingStatus.UNSTABLE),
            ("station_1", ReadingStatus.UNSTABLE),
            ("station_2", ReadingStatus.ABORTED),
            ("station_1", ReadingStatus.ABORTED),
        ],
        4,
    ),
)
def test_a_press_that_was_given_up_keeps_its_force_and_its_place_in_time(tmp_path, status, station):
    def give_up(pose: int, window: Window) -> Window:
        if (pose, window.load_case) == (2, "south"):
            lost = {"status": status, "station": station, "start": window.end}
            return window.model_copy(update=lost)
        return window

    run = record_run(tmp_path / "run", change=give_up)
    data = derive_run(run.path).dataset
    case = data.load_cases.index("south")
    assert data.sequence[2].tolist() == [0, 1, 2, 3, 4]
    np.testing.assert_allclose(data.force[2, case], run.force[2, case], atol=0.4)
    readings = data.readings(data.joint_names)
    assert not np.any((readings.pose == 2) & (readings.load_case == "south"))
    pressed = readings.also_pressed
    assert (pressed.pose.tolist(), pressed.sequence.tolist()) == ([2], [case])
    np.testing.assert_array_equal(pressed.force[0], data.force[2, case])
    np.testing.assert_array_equal(pressed.joint_position[0], data.joint_position[2, case])


@pytest.mark.slow
def test_a_press_that_was_given_up_is_not_known_by_what_was_pressed_before_it(tmp_path):
    """Its last second may reach back into the window before."""

    def give_up(pose: int, window: Window) -> Window:
        if (pose, window.load_case) == (2, "north"):
            return window.model_copy(update={"end": window.end + 1.9})
        if (pose, window.load_case) == (2, "south"):
            start = window.start - 0.05
            lost = {"status": ReadingStatus.UNSTABLE, "start": start, "end": start}
            return window.model_copy(update=lost)
        return window

    run = record_run(tmp_path / "run", change=give_up)
    data = derive_run(run.path).dataset
    case = data.load_cases.index("south")
    np.testing.assert_allclose(data.force[2, case], run.force[2, case], atol=0.8)


def test_a_window_without_samples_is_missing_and_says_how_many_there_are(tmp_path):
    def shorten(pose: int, window: Window) -> Window:
        if (pose, window.load_case) == (1, "west"):
            return window.model_copy(update={"end": window.start + 0.02})
        return window

    derived = derive_run(record_run(tmp_path / "run", change=shorten).path)
    cell = derived.dataset.to_xarray().sel(pose=1, load_case="west")
    assert cell["status"] == 4
    assert np.all(np.isnan(cell["force"]))
    assert to_data(derived.summary)["readings"]["not_ok"][0]["note"] == (
        "only 3 wrenches, not 5; only 3 points of station station_1, not 5"
    )


def test_a_pose_with_a_bad_reference_is_missing_as_a_whole(tmp_path):
    def spoil(pose: int, window: Window) -> Window:
        if pose == 4 and window.load_case is None:
            return window.model_copy(update={"status": ReadingStatus.MISSING, "note": "no beam"})
        return window

    derived = derive_run(record_run(tmp_path / "run", change=spoil).path)
    assert derived.dataset.to_xarray()["status"].sel(pose=4).values.tolist() == [4] * 5
    notes = {entry["note"] for entry in to_data(derived.summary)["readings"]["not_ok"]}
    assert notes == {"the unloaded reference is missing: no beam"}


@pytest.mark.slow
def test_a_load_case_that_was_never_had_is_left_out_with_a_warning(tmp_path):
    def without_north(_: int, window: Window) -> Window:
        if window.load_case == "north":
            return window.model_copy(update={"status": ReadingStatus.UNSTABLE, "note": "shakes"})
        return window

    derived = derive_run(record_run(tmp_path / "run", change=without_north).path)
    assert derived.dataset.load_cases == ("normal", "south", "east", "west")
    assert to_data(derived.summary)["warnings"][0] == (
        "load case 'north' has no usable reading at any pose: the dataset leaves it out"
    )


@pytest.mark.slow
def test_a_tool_that_is_heavier_than_the_cell_says_is_told(tmp_path):
    truth = Truth(mass=75.0, force_noise=0.1, drift=np.zeros(3))
    derived = derive_run(record_run(tmp_path / "run", truth).path)
    assert any(
        warning.startswith("the tool weighs 75.") and "60.0 kg by the cell file" in warning
        for warning in to_data(derived.summary)["warnings"]
    )


@pytest.mark.slow
def test_the_wrong_mass_hardly_touches_the_forces(tmp_path):
    """The tare of the same pose takes the weight away; only its turn under load is left."""
    run = record_run(tmp_path / "run", Truth(mass=75.0))
    np.testing.assert_allclose(values(derive_run(run.path), "force"), run.force, atol=0.6)


@pytest.mark.slow
def test_a_drift_after_release_is_told(tmp_path):
    def two_references(pose: int, window: Window) -> Window:
        # The last load stands for the window after release.
        return (
            window.model_copy(update={"load_case": None}) if window.load_case == "west" else window
        )

    derived = derive_run(record_run(tmp_path / "run", change=two_references).path)
    drift = to_data(derived.summary)["drift"]
    assert drift["released_windows"] == 6
    assert drift["seconds"] == pytest.approx(15.0)
    assert drift["largest_N"] == pytest.approx(np.hypot(280.0, 1100.0), abs=1.0)


def test_two_poses_do_not_register_a_station(tmp_path):
    run = record_run(tmp_path / "run", poses=2)
    message = r"no usable reading among 10: station station_1 is not registered: it saw 2 of the 3"
    with pytest.raises(DatasetError, match=message):
        derive_run(run.path)


def no_commit(run: Path) -> None:
    journal = RunFolder(run).journal
    journal.write_text(journal.read_text().splitlines(keepends=True)[0])


def cut_stream(run: Path) -> None:
    path = RunFolder(run).stream(3, 1)
    path.write_bytes(path.read_bytes()[:-100])


def no_sensor(run: Path) -> None:
    path = RunFolder(run).cell / "cell.yaml"
    text = path.read_text()
    start, end = text.index("sensor:  "), text.index("marker:  ")
    path.write_text(text[:start] + text[end:])
    # The run is to have begun with such a cell.
    journal = RunFolder(run).journal
    known = read_journal(journal)[0].run.cell
    edit_journal(journal, lambda text: text.replace(known, fingerprint(load_cell(path))))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("spoil", "error", "message"),
    [
        (no_commit, ProcedureError, "no pose is committed: there is nothing to derive"),
        (cut_stream, SchemaError, "pose_0003_1.mcap is not what the run wrote"),
        (no_sensor, ProcedureError, "cell 'afp' has no force sensor (key 'sensor')"),
    ],
)
def test_a_run_that_cannot_be_derived_is_refused_in_one_line(tmp_path, spoil, error, message):
    run = record_run(tmp_path / "run")
    spoil(run.path)
    with pytest.raises(error) as caught:
        derive_run(run.path)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_folder_that_is_no_run_is_refused(tmp_path):
    with pytest.raises(ElastocalError, match=r"journal\.jsonl"):
        derive_run(tmp_path)


@pytest.mark.slow
def test_a_tool_that_gets_heavier_is_told_with_its_pose(tmp_path):
    run = record_run(tmp_path / "run", Truth(heavier_from=3, heavier_by=20.0))
    found = to_data(derive_run(run.path).summary)
    assert found["warnings"][0].startswith("the tool weight changed near pose 3, by about +")
    assert found["tool"]["changed"]["from_pose"] == 3
    assert not any("kg by the cell file" in line for line in found["warnings"])


def change_cell(run: Run) -> Path:
    path = run.path / "cell" / "cell.yaml"
    path.write_text(path.read_text().replace('mass: "60 kg"', 'mass: "20 kg"'))
    return path.parent


def change_plan(run: Run) -> Path:
    path = run.path / "plan" / "plan.json"
    path.write_text(path.read_text() + "\n")
    return path


def change_streams(run: Run) -> Path:
    streams = run.path / "streams"
    (streams / "pose_0001_1.mcap").write_bytes((streams / "pose_0000_1.mcap").read_bytes())
    return streams / "pose_0001_1.mcap"


@pytest.mark.slow
@pytest.mark.parametrize("change", [change_cell, change_plan, change_streams])
def test_what_was_changed_in_the_folder_since_is_refused_by_name(tmp_path, change):
    run = record_run(tmp_path / "run")
    changed = change(run)
    with pytest.raises(SchemaError) as caught:
        derive_run(run.path)
    assert str(caught.value).startswith(f"{changed} is not what the run wrote: its SHA-256 is ")


def test_counts_of_the_lines_are_those_of_all_sessions(tmp_path):
    made = record_run(tmp_path / "run")
    with Journal(RunFolder(made.path).journal) as journal:
        for lost in (1, 2):
            box = LineCounts(device="box", received=10, lost=lost)
            others = (LineCounts(device="tracker", received=5, breaks=1),) * (lost == 1)
            journal.write(1e4, Event.FINISH, lines=(box, *others))
    lines = derive_run(made.path).summary.lines
    assert [(each.device, each.received, each.lost) for each in lines] == [
        ("box", 20, 3),
        ("tracker", 5, 0),
    ]


def test_a_run_without_lines_says_nothing_of_them(derived):
    assert derived.summary.lines == ()
