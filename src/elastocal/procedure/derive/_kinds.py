"""What the summary of a run may warn of."""

from elastocal.findings import Kind, as_number

_MANY = 9
"""Power of ten of the runs beyond which a test on assumed distributions says no more."""


def _power_of_ten(exponent: float) -> str:
    """Return a large number as a power of ten."""
    return f"more than 10^{_MANY}" if exponent > _MANY else f"10^{exponent:.0f}"


_mm, _mrad, _kg = as_number(".2f", 1e3), as_number(".2f", 1e3), as_number(".1f")

NO_READING_OF_CASE = Kind(
    "run.no-reading-of-load-case",
    "load case {case} has no usable reading at any pose: the dataset leaves it out",
    shown={"case": repr},
)
NOT_OK = Kind("run.readings-not-ok", "{lost} of {rows} readings are not ok; the list says why")
NO_SCATTER = Kind(
    "run.no-scatter",
    "{name} is left out: some readings show no scatter and no maker's value",
)
UNREGISTERED = Kind(
    "run.station-unregistered",
    "station {station} is not registered, its readings are missing: {reason}",
)
MOVED = Kind(
    "run.station-moved",
    "station {station} moved between poses {before} and {pose}: the marker seemed to"
    " jump by {jump} ± {half} mm, the station turned by {angle} mrad; scatter and"
    " errors of the arm look like this in one run of {runs}; both stretches are"
    " registered by themselves",
    advice="Fix the tracker's stand before the next run: a station that moves splits its poses.",
    shown={"jump": _mm, "half": _mm, "angle": _mrad, "runs": _power_of_ten},
)
BLUNDER = Kind(
    "run.unloaded-blunder",
    "pose {pose}: the unloaded marker reading of station {station} is {distance} mm"
    " off: its displacements are doubtful",
    shown={"distance": _mm},
)
ROTATION = Kind(
    "run.station-rotation",
    "station {station}: its rotation is known to {angle} mrad only, an error of"
    " {angle} µm for each mm of displacement",
    shown={"angle": as_number(".1f", 1e3)},
)
LEVER_UNKNOWN = Kind(
    "run.lever-arm-not-determined",
    "the orientations of the poses are too similar to tell the lever arm of the marker"
    " along {axes} of the tcp: there it is the cell file's",
)
LEVER_AWAY = Kind(
    "run.marker-elsewhere",
    "the marker is {away} mm from where the cell file has it ({place} in the tcp frame)",
    shown={
        "away": as_number(".1f", 1e3),
        "place": lambda point: ", ".join(f"{1e3 * value:.1f} mm" for value in point),
    },
)
TOOL_CHANGED = Kind(
    "run.tool-weight-changed",
    "the tool weight changed near pose {pose}, by about {mass} kg (or the sensor's"
    " zero by as much): no one mass fits the run",
    shown={"mass": as_number("+.1f")},
)
TOOL_ZEROED = Kind(
    "run.tool-weight-zeroed",
    "the sensor shows {mass} ± {half} kg of the tool's {stated} kg: it seems to take"
    " the tool weight away itself",
    shown={"mass": _kg, "half": _kg, "stated": _kg},
)
TOOL_MASS = Kind(
    "run.tool-mass",
    "the tool weighs {mass} ± {half} kg by {count} unloaded references, {stated} kg by"
    " the cell file",
    shown={"mass": _kg, "half": _kg, "stated": _kg},
)
TOOL_CENTRE = Kind(
    "run.tool-centre",
    "the tool's centre of mass is {away} mm along {axis} of the sensor from where the"
    " cell file has it",
    shown={"away": as_number(".0f", 1e3)},
)
