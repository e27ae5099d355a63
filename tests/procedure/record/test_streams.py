import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.records import Metadata

from elastocal.cell import (
    ArmState,
    BeamState,
    Motion,
    PointBlock,
    SensorStatus,
    WrenchBlock,
)
from elastocal.errors import ProcedureError, SchemaError
from elastocal.procedure import STREAMS_SCHEMA, PoseRecorder, read_streams
from elastocal.procedure.record.streams import Mark, Topic, schemas, write_mcap
from support.stations import station

JOINTS = ("rail", "joint 100%s")


def state(time: float) -> ArmState:
    return ArmState(
        time, np.array([time, -1.0 / 3.0]), station(1), Motion.HOLDING, True, None, "arm"
    )


def wrenches(time: np.ndarray, status: SensorStatus = SensorStatus.OK, sigma: float = 0.5):
    force = np.outer(np.sin(time + 1.0), [1.0, -200.0, 1e-3])
    return WrenchBlock(time, force, 0.1 * force, sigma, np.nan, status, 'a "sensor"')


def points(time: np.ndarray, beam: BeamState = BeamState.LOCKED) -> PointBlock:
    position = np.outer(np.cos(time), [1.0, 2.0, 3.0])
    return PointBlock(time, position, np.full((len(time), 3), 2e-5), beam, "A", "tracker")


@pytest.fixture
def recorder() -> PoseRecorder:
    recorder = PoseRecorder(JOINTS)
    for cycle in range(5):
        start = 10.0 + 0.04 * cycle
        recorder.arm(state(start))
        recorder.wrenches(wrenches(start + 0.01 * np.arange(4)))
        recorder.points(points(start + 0.01 * np.arange(4)))
    recorder.mark(10.2, "approach")
    return recorder


@pytest.fixture
def path(tmp_path, recorder):
    recorder.save(tmp_path / "pose_0000_1.mcap")
    return tmp_path / "pose_0000_1.mcap"


def test_streams_come_back_to_twelve_digits(path):
    found = read_streams(path)
    time = 10.0 + 0.01 * np.arange(20)
    assert found.joint_names == JOINTS
    np.testing.assert_allclose(found.wrench.time, time, atol=1e-9)
    np.testing.assert_allclose(found.wrench.force, wrenches(time).force, rtol=1e-11)
    np.testing.assert_allclose(found.wrench.moment, wrenches(time).moment, rtol=1e-11)
    np.testing.assert_allclose(found.points.position, points(time).position, rtol=1e-11)
    np.testing.assert_array_equal(found.points.sigma, 2e-5)
    np.testing.assert_allclose(found.arm.q, [[10 + 0.04 * k, -1 / 3] for k in range(5)], rtol=1e-11)
    np.testing.assert_allclose(found.arm.T_base_tcp[3], station(1), atol=1e-11)
    assert found.points.station.tolist() == ["A"] * 20
    assert np.all(found.wrench.ok)


def test_links_of_an_arm_with_secondary_encoders_come_back(tmp_path):
    recorder = PoseRecorder(JOINTS)
    recorder.arm(replace(state(1.0), link=np.array([np.nan, -1.0 / 3.0 + 1e-6])))
    recorder.arm(state(1.1))  # not read
    recorder.save(tmp_path / "linked.mcap")
    found = read_streams(tmp_path / "linked.mcap").arm
    np.testing.assert_allclose(found.link, [[np.nan, -1 / 3 + 1e-6], [np.nan] * 2], rtol=1e-11)
    assert read_streams(tmp_path / "linked.mcap").arm.q.shape == (2, 2)


def test_an_arm_without_them_has_none(path):
    assert read_streams(path).arm.link is None


def test_a_file_from_before_the_mcap_package_wrote_it_is_read(path):
    found, now = read_streams(Path(__file__).parent / "packed_by_hand.mcap"), read_streams(path)
    assert (found.joint_names, found.marks) == (now.joint_names, now.marks)
    np.testing.assert_array_equal(found.arm.T_base_tcp, now.arm.T_base_tcp)
    np.testing.assert_array_equal(found.wrench.force, now.wrench.force)
    np.testing.assert_array_equal(found.points.time, now.points.time)
    np.testing.assert_array_equal(found.points.position, now.points.position)


def test_only_the_spans_that_are_asked_for_are_read(path):
    found, whole = read_streams(path, [(10.02, 10.03), (10.1, 10.1)]), read_streams(path)
    assert found.wrench.time.tolist() == [10.02, 10.03, 10.1]
    np.testing.assert_array_equal(found.wrench.force, whole.wrench.force[[2, 3, 10]])
    np.testing.assert_array_equal(found.points.position, whole.points.position[[2, 3, 10]])
    assert found.arm.time.tolist() == []
    assert read_streams(path, []).wrench.time.tolist() == []


def test_arrays_are_read_only(path):
    found = read_streams(path)
    with pytest.raises(ValueError, match="read-only"):
        found.wrench.force[0] = 0.0


def test_marks_and_changes_of_state_are_kept_in_order(tmp_path, recorder):
    recorder.points(points(np.empty(0), BeamState.BROKEN))
    recorder.arm(state(10.4))
    recorder.wrenches(wrenches(10.4 + 0.01 * np.arange(4), SensorStatus.SATURATED))
    recorder.points(points(10.4 + 0.01 * np.arange(4)))
    recorder.save(tmp_path / "a.mcap")
    found = read_streams(tmp_path / "a.mcap")
    assert found.marks == (
        Mark(10.0, "sensor: ok"),
        Mark(10.0, "beam of station A: locked"),
        Mark(10.16, "beam of station A: broken"),
        Mark(10.2, "approach"),
        Mark(10.4, "sensor: saturated"),
        Mark(10.4, "beam of station A: locked"),
    )
    assert found.wrench.ok.tolist() == [True] * 20 + [False] * 4


def test_a_state_that_is_asked_for_twice_is_kept_once(tmp_path):
    recorder = PoseRecorder(JOINTS)
    recorder.arm(state(1.0))
    recorder.arm(state(1.0))
    recorder.save(tmp_path / "a.mcap")
    assert read_streams(tmp_path / "a.mcap").arm.time.tolist() == [1.0]


def test_an_attempt_without_a_sample_can_be_saved(tmp_path):
    PoseRecorder(JOINTS).save(tmp_path / "a.mcap")
    found = read_streams(tmp_path / "a.mcap")
    assert found.arm.q.shape == (0, 2)
    assert found.arm.T_base_tcp.shape == (0, 4, 4)
    assert found.wrench.force.shape == found.points.position.shape == (0, 3)
    assert found.marks == ()


def test_numbers_that_are_not_finite_become_nan_and_spare_the_others(tmp_path):
    block = wrenches(np.array([1.0, 1.01]), sigma=np.nan)
    block.force[0, 1], block.moment[1, 2] = np.nan, np.inf
    recorder = PoseRecorder(JOINTS)
    recorder.wrenches(block)
    recorder.save(tmp_path / "a.mcap")
    found = read_streams(tmp_path / "a.mcap").wrench
    assert np.isnan(found.force).tolist() == [[False, True, False], [False] * 3]
    assert np.isnan(found.moment[1, 2])
    assert np.all(np.isnan(found.force_sigma))
    np.testing.assert_allclose(found.force[1], block.force[1], rtol=1e-11)


def test_times_of_microseconds_come_back_exactly(tmp_path):
    ticks = np.array([0, 1, 999_999, 1_234_567, 36_000_000_001])
    recorder = PoseRecorder(JOINTS)
    recorder.wrenches(wrenches(ticks / 1e6))
    recorder.save(tmp_path / "a.mcap")
    assert read_streams(tmp_path / "a.mcap").wrench.time.tolist() == (ticks / 1e6).tolist()


def test_a_time_before_zero_is_refused(tmp_path):
    recorder = PoseRecorder(JOINTS)
    recorder.mark(-1.0, "too early")
    with pytest.raises(ProcedureError, match=r"/marks: time -1.0 s cannot be recorded"):
        recorder.save(tmp_path / "a.mcap")


def test_viewers_find_json_channels_with_the_schema_of_every_field(path):
    """Foxglove needs encoding json with a jsonschema of type object; PlotJuggler the encoding."""
    with path.open("rb") as file:
        messages = list(make_reader(file, validate_crcs=True).iter_messages())
    assert {channel.topic for _, channel, _ in messages} == {"/arm", "/wrench", "/marker", "/marks"}
    for schema, channel, message in messages:
        assert (channel.message_encoding, schema.encoding) == ("json", "jsonschema")
        check(json.loads(schema.data), json.loads(message.data))


def check(schema: dict, value: object) -> None:
    """Check a value against the few words of JSON schema that are used here."""
    kinds = {"object": dict, "string": str, "boolean": bool, "number": (float, int, type(None))}
    assert isinstance(value, kinds[schema["type"]])
    if schema["type"] == "object":
        assert set(value) == set(schema["properties"]) == set(schema["required"])
        for key, inner in schema["properties"].items():
            check(inner, value[key])


def test_units_stand_in_the_schemas():
    text = schemas(JOINTS)
    for topic, words in {
        "/arm": ["rad", "in m"],
        "/wrench": ["in N", "N m"],
        "/marker": ["in m"],
    }.items():
        for word in words:
            assert word in text[topic][1]


def other_schema(path) -> None:
    note = Metadata(name="elastocal", metadata={"schema": "elastocal.streams/9", "joints": "[]"})
    write_mcap(path, [], "test", note)


def foreign(path) -> None:
    write_mcap(path, [], "test", Metadata(name="someone", metadata={}))


def no_joints(path) -> None:
    write_mcap(path, [], "test", Metadata(name="elastocal", metadata={"schema": STREAMS_SCHEMA}))


def odd_message(path) -> None:
    note = Metadata(name="elastocal", metadata={"schema": STREAMS_SCHEMA, "joints": "[]"})
    topic = Topic("/wrench", "x", "{}", np.array([5]), [b'{"force": 3}'])
    write_mcap(path, [topic], "test", note)


def no_json(path) -> None:
    note = Metadata(name="elastocal", metadata={"schema": STREAMS_SCHEMA, "joints": "[]"})
    write_mcap(path, [Topic("/marks", "x", "{}", np.array([5]), [b"hello"])], "test", note)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            other_schema,
            "has schema 'elastocal.streams/9'; this version reads 'elastocal.streams/1'",
        ),
        (foreign, "has schema None"),
        (no_joints, "its metadata do not name the joints of the arm"),
        (odd_message, "/wrench holds a message that is not ours: KeyError 'status'"),
        (no_json, "/marks holds a message that is not ours: its text is not valid JSON"),
    ],
)
def test_files_of_others_are_refused_in_one_line(tmp_path, make, message):
    make(tmp_path / "a.mcap")
    with pytest.raises(SchemaError) as caught:
        read_streams(tmp_path / "a.mcap")
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)
