"""The numbers that stand in the page for integrators."""

import numpy as np

from elastocal.compensation.online.design import Design


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
        "MASS": f"{numbers.load.mass:g}",
        "DELAYS": "\n".join(rows),
    }
