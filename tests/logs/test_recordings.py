"""MCAP and ROS bags, written by the programs that others use, are tables of their topics."""

import numpy as np
import pytest
from rosbags.rosbag1 import Writer as BagOne
from rosbags.rosbag2 import Writer as BagTwo
from rosbags.typesys import Stores, get_typestore

from elastocal.errors import LogError
from elastocal.logs import guess_logs, read_recording, read_topics
from support import reported

JOINTS = ["joint_a1", "joint_a2"]


def _messages(types):
    """Yield topic, type, time in ns and message: joints, a wrench, transforms of two frames."""
    kinds = types.types
    time, header = kinds["builtin_interfaces/msg/Time"], kinds["std_msgs/msg/Header"]
    vector = kinds["geometry_msgs/msg/Vector3"]

    def stamped(at):
        extra = {"seq": 0} if "seq" in header.__dataclass_fields__ else {}
        return header(stamp=time(sec=at, nanosec=500_000_000), frame_id="base", **extra)

    for at in (1, 2):
        yield (
            "/joint_states",
            "sensor_msgs/msg/JointState",
            at * 10**9,
            kinds["sensor_msgs/msg/JointState"](
                header=stamped(at),
                name=JOINTS,
                position=np.array([0.1 * at, -0.2]),
                velocity=np.zeros(0),
                effort=np.zeros(0),
            ),
        )
        yield (
            "/wrench",
            "geometry_msgs/msg/WrenchStamped",
            at * 10**9,
            kinds["geometry_msgs/msg/WrenchStamped"](
                header=stamped(at),
                wrench=kinds["geometry_msgs/msg/Wrench"](
                    force=vector(x=1.0 * at, y=2.0, z=3.0), torque=vector(x=0.0, y=0.0, z=0.5)
                ),
            ),
        )
        if "tf2_msgs/msg/TFMessage" not in kinds:
            continue
        yield (
            "/tf",
            "tf2_msgs/msg/TFMessage",
            at * 10**9,
            kinds["tf2_msgs/msg/TFMessage"](
                transforms=[
                    kinds["geometry_msgs/msg/TransformStamped"](
                        header=stamped(at),
                        child_frame_id=frame,
                        transform=kinds["geometry_msgs/msg/Transform"](
                            translation=vector(x=x * at, y=0.0, z=0.0),
                            rotation=kinds["geometry_msgs/msg/Quaternion"](
                                x=0.0, y=0.0, z=0.0, w=1.0
                            ),
                        ),
                    )
                    for frame, x in (("tool", 1.0), ("marker", 7.0))
                ]
            ),
        )


@pytest.fixture(scope="module", params=["ros1", "ros2"])
def bag(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp("bags")
    if request.param == "ros1":
        types, path = get_typestore(Stores.ROS1_NOETIC), folder / "log.bag"
        writer, encode = BagOne(path), types.serialize_ros1
    else:
        types, path = get_typestore(Stores.ROS2_HUMBLE), folder / "log"
        writer, encode = BagTwo(path, version=9), types.serialize_cdr
    with writer:
        known = {}
        for topic, kind, time, message in _messages(types):
            if topic not in known:
                known[topic] = writer.add_connection(topic, kind, typestore=types)
            writer.write(known[topic], time, encode(message, kind))
    return path


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
