"""Messages of the raw streams: their JSON schemas, and samples as JSON text.

One message a sample, because that is what both viewers draw: Foxglove plots ``/wrench.force.z``
and PlotJuggler lists ``/wrench/force/z``. A block of samples as arrays would be three times as
quick to write, but PlotJuggler makes a series of each array place, a hundred a block.
Numbers have 12 digits: finer than any instrument, and nearly three times as quick to write as all
17. What is not a finite number is null, whatever the schema says.
"""

import json
import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from elastocal.arrays import FloatArray
from elastocal.cell import ArmState, PointBlock, WrenchBlock

ARM, WRENCH, MARKER, MARKS = "/arm", "/wrench", "/marker", "/marks"
"""Topics, in the order of their channels."""

_NUMBER = {"type": "number"}
"""Not ``["number", "null"]``: one type a field is what every viewer's schema reader knows."""
_HERE = "\0"
"""Place of a number; no JSON text holds this letter."""
_XYZ = f'{{"x":{_HERE},"y":{_HERE},"z":{_HERE}}}'
_XYZW = f'{_XYZ[:-1]},"w":{_HERE}}}'


def schemas(joint_names: Sequence[str]) -> dict[str, tuple[str, str]]:
    """Return name and text of the JSON schema of each topic.

    Parameters
    ----------
    joint_names : sequence of str
        Joints, which are the keys of ``q``.
    """
    joints = dict.fromkeys(joint_names, _NUMBER)
    fields: dict[str, tuple[str, dict[str, Any]]] = {
        ARM: (
            "elastocal.ArmState",
            {
                "q": _object("joint positions of the controller, in rad (m if prismatic)", joints),
                "position": _object("tcp of the controller in base, in m", _axes("xyz")),
                "orientation": _object("tcp of the controller in base, quaternion", _axes("xyzw")),
                "motion": _text("what the arm is doing"),
                "in_contact": {"type": "boolean", "description": "touched, not yet retracted"},
                "fault": _text("why it stopped; empty when nothing is wrong"),
                "source": _text("device"),
            },
        ),
        WRENCH: (
            "elastocal.RawWrench",
            {
                "force": _object("on the tool side, sensor frame, raw, in N", _axes("xyz")),
                "moment": _object("about the sensor's origin, raw, in N m", _axes("xyz")),
                "force_sigma": {**_NUMBER, "description": "of one sample and axis, in N"},
                "moment_sigma": {**_NUMBER, "description": "of one sample and axis, in N m"},
                "status": _text("state of the sensor"),
                "source": _text("device"),
            },
        ),
        MARKER: (
            "elastocal.MarkerPoint",
            {
                "position": _object("of the marker, tracker frame, in m", _axes("xyz")),
                "sigma": _object("standard deviation, tracker frame, in m", _axes("xyz")),
                "station": _text("tracker station"),
                "beam": _text("state of the beam"),
                "source": _text("device"),
            },
        ),
        MARKS: ("elastocal.Mark", {"text": _text("what happened")}),
    }
    return {topic: (name, json.dumps(_schema(keys))) for topic, (name, keys) in fields.items()}


def arm_messages(states: Sequence[ArmState], joint_names: Sequence[str]) -> list[bytes]:
    """Return a message for each state of the arm."""
    if not states:
        return []
    poses = np.array([state.T_base_tcp for state in states])
    quaternions = Rotation.from_matrix(poses[:, :3, :3]).as_quat()
    numbers = np.hstack([np.array([state.q for state in states]), poses[:, :3, 3], quaternions])
    keys = ",".join(json.dumps(name) + ":" + _HERE for name in joint_names)
    head = f'{{"q":{{{keys}}},"position":{_XYZ},"orientation":{_XYZW}'
    return _joined(head, numbers, [_arm_tail(state) for state in states])


def wrench_messages(blocks: Sequence[WrenchBlock]) -> list[bytes]:
    """Return a message for each wrench of some blocks."""
    numbers = [np.hstack([block.force, block.moment]) for block in blocks if len(block)]
    tails = [tail for block in blocks for tail in [_wrench_tail(block)] * len(block)]
    return _joined(f'{{"force":{_XYZ},"moment":{_XYZ}', _stacked(numbers), tails)


def point_messages(blocks: Sequence[PointBlock]) -> list[bytes]:
    """Return a message for each point of some blocks."""
    numbers = [np.hstack([block.position, block.sigma]) for block in blocks if len(block)]
    tails = [tail for block in blocks for tail in [_point_tail(block)] * len(block)]
    return _joined(f'{{"position":{_XYZ},"sigma":{_XYZ}', _stacked(numbers), tails)


def mark_message(text: str) -> bytes:
    """Return the message of a mark."""
    return json.dumps({"text": text}).encode()


def _arm_tail(state: ArmState) -> str:
    return _arm_text(state.motion.value, bool(state.in_contact), state.fault or "", state.source)


def _wrench_tail(block: WrenchBlock) -> str:
    sigmas = _finite(block.force_sigma), _finite(block.moment_sigma)
    return _wrench_text(*sigmas, block.status.value, block.source)


def _point_tail(block: PointBlock) -> str:
    return _point_text(block.station, block.beam.value, block.source)


# These texts hardly ever change from one look at a device to the next.
@lru_cache(maxsize=64)
def _arm_text(motion: str, in_contact: bool, fault: str, source: str) -> str:
    return _tail(motion=motion, in_contact=in_contact, fault=fault, source=source)


@lru_cache(maxsize=64)
def _wrench_text(force: float | None, moment: float | None, status: str, source: str) -> str:
    return _tail(force_sigma=force, moment_sigma=moment, status=status, source=source)


@lru_cache(maxsize=64)
def _point_text(station: str, beam: str, source: str) -> str:
    return _tail(station=station, beam=beam, source=source)


def _tail(**keys: object) -> str:
    """Return the end of a JSON object, from the comma on."""
    return "," + json.dumps(keys)[1:]


def _joined(head: str, numbers: FloatArray, tails: Sequence[str]) -> list[bytes]:
    """Return JSON objects: the numbers of a row in their places of ``head``, then the tail."""
    head, rows = head.replace("%", "%%"), numbers.tolist()
    if np.all(np.isfinite(numbers)):
        template = head.replace(_HERE, "%.12g")
    else:
        template = head.replace(_HERE, "%s")
        rows = [[_number(value) for value in row] for row in rows]
    return [(template % tuple(row) + tail).encode() for row, tail in zip(rows, tails, strict=True)]


def _number(value: float) -> str:
    return f"{value:.12g}" if math.isfinite(value) else "null"


def _stacked(arrays: Sequence[FloatArray]) -> FloatArray:
    return np.vstack(arrays) if arrays else np.empty((0, 0))


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _schema(keys: dict[str, Any]) -> dict[str, Any]:
    return {"type": "object", "properties": keys, "required": list(keys)}


def _object(description: str, keys: dict[str, Any]) -> dict[str, Any]:
    return {"description": description, **_schema(keys)}


def _axes(letters: str) -> dict[str, Any]:
    return dict.fromkeys(letters, _NUMBER)


def _text(description: str) -> dict[str, Any]:
    return {"type": "string", "description": description}
