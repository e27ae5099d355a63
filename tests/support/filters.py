"""An example of every filter of the wrench, for contracts and for the exported C."""

from typing import get_origin

from elastocal.compensation.conditioning import FilterSettings
from elastocal.compensation.conditioning.filters import LowPass, Notch, Section, lead_section


class Lead(float):
    """A lead in s, which the settings hold as a bare time."""

    def sections(self, sample: float) -> tuple[Section, ...]:
        """Return its section for a sampling time in s."""
        return (lead_section(self, sample),)


EXAMPLES = {
    "lead": Lead(0.02),
    "low_pass": LowPass(cutoff="15 Hz"),
    "notches": Notch(frequency="50 Hz", width="5 Hz"),
}
"""By their key in `FilterSettings`."""


def filter_settings(*names: str, median: int = 1) -> FilterSettings:
    """Return settings with the examples of some filters and no other filter."""
    fields = FilterSettings.model_fields
    several = {name: get_origin(fields[name].annotation) is tuple for name in names}
    chosen = {name: (EXAMPLES[name],) if many else EXAMPLES[name] for name, many in several.items()}
    if "lead" in chosen:
        chosen["lead"] = f"{chosen['lead']} s"
    return FilterSettings(median=median, **{"low_pass": None, **chosen})
