"""The numbers that stand in the page for integrators."""

import numpy as np

from elastocal.compensation.online import Design

_RAW = "N, N m; raw, as the sensor gives them | sensor"
_AT_TCP = (
    "N, N m; **on** the robot, bias and tool weight removed, about the tool centre point | tcp"
)
_REMOVED_HERE = (
    "The sensor's bias, a tool of {mass:g} kg, and the way from sensor to tool centre point are"
    " taken care of by `elastocal_condition`. Do not zero the sensor after the export: its bias is"
    " among the constants. With another tool, or after a crash, identify and export again."
)
_REMOVED = (
    "**No tool file was given to this export.** Readings must come with the sensor's bias and the"
    " tool's weight removed, moved to the tool centre point and turned into its axes. A raw wrench"
    " that goes in is corrected as if the tool's weight were a process force."
)


def readme_values(numbers: Design) -> dict[str, str]:
    """Return the values of the README's places."""
    settings, limits = numbers.settings, numbers.settings.limits
    robot = numbers.calibrated.model.robot
    frequencies = np.array([0.0, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0])
    frequencies = frequencies[frequencies < 0.5 / numbers.filters.sample]
    delays, gains = numbers.filters.delay(frequencies), numbers.filters.gain(frequencies)
    rows = [
        f"| {f:g} | {'none passes' if np.isnan(d) else f'{1e3 * d:.2f}'} | {g:.3f} |"
        for f, d, g in zip(frequencies, delays, gains, strict=True)
    ]
    return {
        "ROBOT": robot.name,
        "BASE": robot.base,
        "TIP": robot.tip,
        "CYCLE_MS": f"{1e3 * settings.cycle:g}",
        "SAMPLE_MS": f"{1e3 * numbers.filters.sample:g}",
        "LARGEST_MM": f"{1e3 * limits.correction:g}",
        "RATE_MM": f"{1e3 * limits.rate:g}",
        "FADE_MM": f"{1e3 * limits.fade:g}",
        "HOLD_MS": f"{1e3 * settings.hold:g}",
        "SENSOR": _REMOVED_HERE.format(mass=numbers.load.mass) if numbers.weighs else _REMOVED,
        "RAW": _RAW if numbers.weighs else _AT_TCP,
        "DELAYS": "\n".join(rows),
    }
