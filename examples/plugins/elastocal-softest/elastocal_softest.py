"""``elastocal softest MODEL.json --most 3``: which springs of a model yield most."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from elastocal.blocks import Block, Paragraph, Table
from elastocal.errors import IdentificationError
from elastocal.plugins import Command
from elastocal.wording import phrase, phrases


@dataclass(frozen=True)
class Settings:
    """List the springs of a model that yield most."""

    model: Path
    """Model file from calibrate."""
    most: int = 5
    """How many springs are listed."""


@dataclass(frozen=True)
class Softest:
    """The springs that yield most."""

    robot: str
    springs: dict[str, float]
    """Compliance by the name of the spring, the softest first, in rad/(N·m)."""


def run(settings: Settings) -> Softest:
    """Return the springs that turn and yield most.

    Raises
    ------
    IdentificationError
        If none is asked for.
    """
    from elastocal.identification import read_model  # not for the help of the command

    if not settings.most >= 1:
        raise IdentificationError(f"--most {settings.most} springs: must be at least 1")
    found = read_model(settings.model)
    known = zip(found.model.parameters, found.compliance.tolist(), strict=True)
    turning = {each.name: value for each, value in known if each.unit.si == "rad/(N*m)"}
    order = sorted(turning, key=lambda name: -turning[name])[: settings.most]
    return Softest(found.model.robot.name, {name: turning[name] for name in order})


def show(result: Softest) -> Iterator[Block]:
    """Yield a sentence and a table."""
    yield Paragraph(phrase("These springs of {robot} yield most.", robot=result.robot))
    yield Table(
        phrase("The softest springs"),
        phrases("Spring", "Compliance, µrad/(N·m)"),
        tuple((name, f"{1e6 * value:.3f}") for name, value in result.springs.items()),
    )


COMMAND = Command(Settings, run, show)
GERMAN = {
    "These springs of {robot} yield most.": "Diese Federn von {robot} geben am meisten nach.",
    "The softest springs": "Die weichsten Federn",
}
