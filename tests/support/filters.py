"""An example of every filter of the wrench, for contracts and for the exported C."""

from typing import get_origin

from elastocal.compensation.conditioning import FilterSettings, LowPass, Notch

EXAMPLES = {
    "low_pass": LowPass(cutoff="15 Hz"),
    "notches": Notch(frequency="50 Hz", width="5 Hz"),
}
"""By their key in `FilterSettings`."""


def filter_settings(*names: str, median: int = 1) -> FilterSettings:
    """Return settings with the examples of some filters and no other filter."""
    fields = FilterSettings.model_fields
    several = {name: get_origin(fields[name].annotation) is tuple for name in names}
    chosen = {name: (EXAMPLES[name],) if many else EXAMPLES[name] for name, many in several.items()}
    return FilterSettings(median=median, **{"low_pass": None, **chosen})
