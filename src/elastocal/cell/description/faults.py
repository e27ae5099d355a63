"""Faults that the simulated cell injects, to try out what a run makes of them."""

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from elastocal.cell.description.motion import PositiveTime
from elastocal.cell.description.quantities import Force, Mass, Point, PositiveLength
from elastocal.records import StrictModel
from elastocal.units import parse_quantity

Kind = Literal[
    "beam_break",
    "ft_dropout",
    "ft_frozen",
    "ft_saturation",
    "slip",
    "never_stable",
    "contact_missed",
    "robot_stop",
    "stale_clock",
    "station_bumped",
    "tool_weight",
]
Step = Literal["approach", "reference", "engage", "hold", "release", "retract"]

Time = Annotated[
    float, BeforeValidator(lambda text: parse_quantity(text, "time")), Field(ge=0.0, le=1e6)
]
"""In s, 0 or above."""

_ALWAYS = {"kind", "pose", "visits"}
_WHEN = {"step", "load", "after"}
_KEYS: dict[str, set[str]] = {
    "beam_break": {*_WHEN, "duration", "station"},
    "ft_dropout": {*_WHEN, "duration"},
    "ft_frozen": {*_WHEN, "duration"},
    "ft_saturation": {*_WHEN, "duration"},
    "slip": {"load", "after", "distance"},
    "never_stable": {"load", "amplitude"},
    "contact_missed": set(),
    "robot_stop": {*_WHEN, "duration"},
    "stale_clock": {*_WHEN, "duration"},
    "station_bumped": {"station", "offset"},
    "tool_weight": {"mass"},
}


class Fault(StrictModel):
    """One fault: what goes wrong, and when."""

    kind: Kind
    pose: Annotated[int, Field(ge=0)]
    """Visit at which it happens, from 0. A visit begins with the first straight approach after a
    joint move or a retract; a pose that is tried again is another visit."""
    visits: Annotated[int, Field(ge=1)] = 1
    """How many visits in a row it happens at. Not counted by `station_bumped` and `tool_weight`,
    which stay."""
    step: Step = "hold"
    """Step of the visit from whose beginning `after` counts: `approach` the first approach,
    `reference` when it has ended, `engage` the second approach, `hold` a load case."""
    load: Annotated[int, Field(ge=0)] = 0
    """Which load case of the visit, from 0, where the step is `hold`."""
    after: Time = 0.0
    """In s."""
    duration: PositiveTime | None = None
    """How long it lasts, in s; for good by default."""
    station: str | None = None
    """Tracker station; all by default."""
    distance: PositiveLength = 1e-3
    """How far the contact slips, in m."""
    amplitude: Force = 40.0
    """Of the force that never comes to rest, in N."""
    offset: Point = (0.5e-3, 0.0, 0.0)
    """How far the station is moved, in base, in m."""
    mass: Annotated[Mass, Field(le=1e3)] = 2.0
    """What is put on the tool, in kg."""

    @model_validator(mode="before")
    @classmethod
    def _only_its_keys(cls, data: Any) -> Any:
        """Refuse a key that has no meaning for this kind of fault."""
        if isinstance(data, dict) and data.get("kind") in _KEYS:
            allowed = _KEYS[data["kind"]]
            for key in data:
                if key in cls.model_fields and key not in _ALWAYS | allowed:
                    raise ValueError(
                        f"{key!r} means nothing for {data['kind']}"
                        f" (its keys: {', '.join(sorted(allowed)) or 'none'})"
                    )
        return data
