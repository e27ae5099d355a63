"""Bags of ROS 1 and ROS 2, written by the library that others use."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag1 import Writer as BagOne
from rosbags.rosbag2 import Writer as BagTwo
from rosbags.typesys import Stores, get_typestore

JOINTS = ["joint_a1", "joint_a2"]


def _messages(types: Any) -> Iterator[tuple[str, str, int, Any]]:
    """Yield topic, type, time in ns and message: joints, a wrench, transforms of two frames."""
    kinds = types.types
    time, header = kinds["builtin_interfaces/msg/Time"], kinds["std_msgs/msg/Header"]
    vector = kinds["geometry_msgs/msg/Vector3"]

    def stamped(at: int) -> Any:
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


def write_bag(folder: Path, form: str) -> Path:
    """Write a bag of a form (``ros1``, ``ros2``) into a folder; return its path."""
    if form == "ros1":
        types, path = get_typestore(Stores.ROS1_NOETIC), folder / "log.bag"
        writer, encode = BagOne(path), types.serialize_ros1
    else:
        types, path = get_typestore(Stores.ROS2_HUMBLE), folder / "log"
        writer, encode = BagTwo(path, version=9), types.serialize_cdr
    with writer:
        known: dict[str, Any] = {}
        for topic, kind, time, message in _messages(types):
            if topic not in known:
                known[topic] = writer.add_connection(topic, kind, typestore=types)
            writer.write(known[topic], time, encode(message, kind))
    return path
