"""What a study is a study of: two stretches belong together only when this is the same."""

from collections.abc import Sequence

from elastocal.codec.study.factors import FACTORS, Condition, Value
from elastocal.errors import CodecError
from elastocal.records import StrictModel

SETTINGS_SCHEMA = "elastocal.study_settings/1"
_LONGEST = 60
"""Letters of a setting that a refusal still quotes whole; fingerprints are longer."""


class ConditionRecord(StrictModel):
    """`Condition` as it stands in files."""

    poses: int
    search: str
    load_cases: str
    springs: str
    tracker_noise: float
    force_noise: float
    truth: float

    @classmethod
    def of(cls, condition: Condition) -> "ConditionRecord":
        """Return the record of a condition."""
        return cls.model_validate({key: condition.value(key) for key in FACTORS})

    @property
    def condition(self) -> Condition:
        """The condition."""
        return Condition(**self.model_dump())


class SpringRecord(StrictModel):
    """A spring of a layout."""

    name: str
    unit: str
    """Of its compliance."""


class StudySettings(StrictModel):
    """All that the numbers of a study depend on, but for the number of samples."""

    cell: str
    """Name of the cell."""
    cell_fingerprint: str
    """Over the cell file and the files that it names (`elastocal.cell.fingerprint`)."""
    simulation_fingerprint: str
    """Over what is simulated in the cell."""
    seed: int
    pool: int
    """Candidates that calibration poses are chosen from."""
    verification: int
    """Verification poses."""
    load_cases: tuple[str, ...]
    """Those of the cell; verification takes all of them."""
    conditions: tuple[ConditionRecord, ...]
    springs: dict[str, tuple[SpringRecord, ...]]
    """By layout, in the order of the compliances."""
    versions: dict[str, str]
    """Of the packages that make the numbers."""

    @property
    def varied(self) -> tuple[str, ...]:
        """Factors with more than one value."""
        return tuple(
            key for key in FACTORS if len({getattr(each, key) for each in self.conditions}) > 1
        )

    def name(self, condition: Condition) -> str:
        """Return what a condition is called: the values of the factors that are varied."""
        return name_of(self.varied, condition)


def name_of(factors: Sequence[str], condition: Condition) -> str:
    """Return a name of some factors' values, e.g. ``"poses 10, springs bearing"``."""
    values = (f"{key.replace('_', ' ')} {written(condition.value(key))}" for key in factors)
    return ", ".join(values) or f"poses {condition.poses}"


def written(value: Value) -> str:
    """Return a factor's value as text."""
    return f"{value:g}" if isinstance(value, float) else str(value)


def check_same(found: StudySettings, wanted: StudySettings, where: str) -> None:
    """Refuse to go on with another study.

    Raises
    ------
    CodecError
        With the first setting that differs.
    """
    before, now = found.model_dump(mode="json"), wanted.model_dump(mode="json")
    for key in before:
        if before[key] != now[key]:
            raise CodecError(
                f"{where} holds another study ({key.replace('_', ' ')}: {_short(before[key])}, not"
                f" {_short(now[key])}): name another folder"
            )


def _short(value: object) -> str:
    """Return a setting in so few letters that the difference is in sight."""
    if isinstance(value, list):
        return "; ".join(_short(each) for each in value)
    if isinstance(value, dict):
        return " ".join(str(each) for each in value.values())
    text = str(value)
    return text if len(text) < _LONGEST else f"{text[:12]}…"
