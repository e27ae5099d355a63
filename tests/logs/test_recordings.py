"""MCAP and ROS bags, written by the programs that others use, are tables of their topics."""

import os

import pytest

from elastocal.errors import FileAccessError, LogError
from elastocal.logs import guess_logs
from elastocal.logs.recordings import read_recording, read_topics
from support import reported
from support.foreign_bags import write_bag


@pytest.fixture(scope="module", params=["ros1", "ros2"])
def bag(request, tmp_path_factory):
    return write_bag(tmp_path_factory.mktemp("bags"), request.param)


def test_the_topics_of_a_bag_are_listed(bag):
    assert {"/joint_states": 2, "/wrench": 2}.items() <= read_topics(bag).items()


def test_joints_stand_under_their_names_and_the_stamp_is_the_time(bag):
    table = read_recording(bag, "/joint_states")
    assert table.numbers("time").tolist() == [1.5, 2.5]
    assert table.numbers("position.joint_a1").tolist() == [0.1, 0.2]


def test_a_wrench_stands_under_its_path(bag):
    assert read_recording(bag, "/wrench").numbers("wrench.force.x").tolist() == [1.0, 2.0]


def test_one_frame_of_many_transforms_is_chosen(bag):
    if "/tf" not in read_topics(bag):
        pytest.skip("the types of this distribution have no transforms")
    table = read_recording(bag, "/tf:marker")
    assert table.numbers("transform.translation.x").tolist() == [7.0, 14.0]
    with pytest.raises(LogError, match="holds no message of tolo"):
        read_recording(bag, "/tf:tolo")


def test_an_unknown_topic_is_refused_with_those_that_are_there(bag):
    with pytest.raises(LogError, match=r"not '/wrenc'; did you mean '/wrench'\?"):
        read_recording(bag, "/wrenc")


def test_the_raw_stream_of_a_run_is_a_recording():
    path = sorted((reported.finished() / "run" / "streams").iterdir())[0]
    assert set(read_topics(path)) >= {"/arm", "/wrench", "/marker"}
    assert "q.joint_a1" in read_recording(path, "/arm").header
    keys = {(log.topic, each.key) for log in guess_logs([path]) for each in log.columns}
    assert keys >= {("/arm", "joints"), ("/wrench", "force"), ("/marker", "markers")}


@pytest.mark.parametrize("name", ["log.mcap", "log.bag", "log.db3"])
def test_a_damaged_recording_is_one_refusal(tmp_path, name):
    path = tmp_path / name
    path.write_bytes(b"\x89MCAP0\r\n" + b"damage" * 40)
    with pytest.raises(LogError, match=r"is no recording, or damaged|has no summary"):
        read_topics(path)


def test_a_pipe_in_the_folder_of_a_bag_is_not_waited_for(tmp_path):
    write_bag(tmp_path, "ros2")
    (database,) = (tmp_path / "log").glob("*.db3")
    database.unlink()
    os.mkfifo(database)
    with pytest.raises(FileAccessError, match="it is a pipe or a device"):
        read_topics(tmp_path / "log")


def test_gigabytes_without_the_end_of_a_line_are_no_bag(tmp_path):
    with (tmp_path / "a.bag").open("wb") as file:
        file.truncate(3 << 30)
    with pytest.raises(LogError, match="does not begin like one"):
        read_topics(tmp_path / "a.bag")
