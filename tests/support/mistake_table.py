"""The table of mistakes: how harmful each is where it goes unseen; whether it is found, named."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from elastocal.dataset import Dataset, Readings
from elastocal.elastic import ElasticModel, bearing
from elastocal.errors import DatasetError, ElastocalError, IdentificationError
from elastocal.identification import FitOptions, build, calibrate, screen, solve
from support.campaigns import Made, unseen
from support.mistakes import Mistake

HARMFUL = 0.05
"""Part of the predictions from which a mistake is harmful."""
_DRAWS = 40
_NO_ALARMS = (
    "poses and load cases determine",
    "the arm's own weight bends it",
    "of the median deflection unexplained",
)
"""What `calibrate` says of campaigns with few poses, of arms whose masses are not known, and of
springs that miss much of a small deflection, which is true."""


@dataclass(frozen=True)
class Outcome:
    """What became of one mistake in one campaign."""

    mistake: str
    harm: float
    """Mean change of predictions at poses that the campaign does not hold, over the mean true
    deflection there; NaN: no fit."""
    refused: bool
    said: tuple[str, ...]
    """What was said of the damaged campaign and not of the sound one."""
    named: bool

    @property
    def harmful(self) -> bool:
        return not self.harm <= HARMFUL

    @property
    def found(self) -> bool:
        return bool(self.said)


def outcome(made: Made, mistake: Mistake, with_harm: bool = True) -> Outcome:
    """Return what `calibrate` says of a sound campaign in which a mistake is made."""
    try:
        bad = mistake.make(made)
    except DatasetError as error:
        # Numbers that no reading can have, which the file would be refused for.
        return _outcome(mistake, float("nan"), True, (str(error),))
    refused, said = say(bad)
    before = {_kind(text) for text in say(made)[1]}
    news = tuple(text for text in said if refused or _kind(text) not in before)
    return _outcome(mistake, _harm(made, bad) if with_harm else 0.0, refused, news)


def _outcome(mistake: Mistake, harm: float, refused: bool, said: tuple[str, ...]) -> Outcome:
    words = tuple(re.escape(word) for word in mistake.named)
    return judged(mistake.name, words, harm, refused, said)


def judged(
    name: str, patterns: Iterable[str], harm: float, refused: bool, said: tuple[str, ...]
) -> Outcome:
    """Return the outcome of a mistake that a message names if one of some patterns is in it."""
    named = any(re.search(each, text, re.IGNORECASE) for text in said for each in patterns)
    return Outcome(name, harm, refused, said, named)


def _kind(text: str) -> str:
    """Return what is alike in two messages; of a mistake that is named, the whole text."""
    template = getattr(text, "template", text)
    return text if template.startswith("{mistake}") else template


@lru_cache(maxsize=16)
def say(made: Made) -> tuple[bool, tuple[str, ...]]:
    """Return whether `calibrate` refuses a campaign, and what it says."""
    try:
        readings = _through_a_dataset(made)
        model = ElasticModel(made.robot, bearing(made.robot))
        rng, options = np.random.default_rng(0), FitOptions(draws=_DRAWS)
        found = calibrate(model, readings, rng, options, marker_offset=made.marker)
    except ElastocalError as error:
        return True, (str(error),)
    aside = np.flatnonzero(found.screening.blunder)
    blunders = tuple(f"reading {number} is set aside" for number in aside.tolist())
    return False, (*found.warnings, *blunders)


def alarms(made: Made) -> tuple[str, ...]:
    """Return what `calibrate` says of a sound campaign that is none of its limits."""
    _, said = say(made)
    return tuple(text for text in said if not any(part in text for part in _NO_ALARMS))


def _through_a_dataset(made: Made) -> Readings:
    """Return the readings as a file of them is read: its checks of units come first."""
    r, robot = made.readings, made.robot
    poses, cases = np.unique(r.pose), list(dict.fromkeys(r.load_case.tolist()))
    shape = (len(poses), len(cases), -1)

    def of_pose(values: np.ndarray | None) -> np.ndarray | None:
        return None if values is None else values.reshape(shape)[:, 0]

    dataset = Dataset.from_arrays(
        joint_position=r.joint_position.reshape(shape),
        force=r.force.reshape(shape),
        controller_displacement=r.controller_displacement.reshape(shape),
        marker_displacement=r.marker_displacement.reshape(shape),
        joint_names=robot.joint_names,
        load_cases=cases,
        joint_units=["rad" if turns else "m" for turns in robot.revolute],
        tcp_position=of_pose(r.tcp_position),
        reference_joint_position=of_pose(r.reference_joint_position),
        reference_force=of_pose(r.reference_force),
        conditioned=r.conditioned,
        robot_name=robot.name,
        robot_urdf=robot.urdf,
        tcp_frame=robot.tip,
    )
    return dataset.readings(robot.joint_names)


def _harm(made: Made, bad: Made) -> float:
    """Return how far a mistake that goes unseen moves predictions, over the true deflection."""
    truth = unseen(made.sound)
    try:
        right, wrong = (_predicted(each, truth.q, truth.force) for each in (made, bad))
    except (IdentificationError, DatasetError):
        return float("nan")
    size = np.linalg.norm(truth.deflection, axis=1).mean()
    return float(np.linalg.norm(right - wrong, axis=1).mean() / size)


def _predicted(made: Made, q: np.ndarray, force: np.ndarray) -> np.ndarray:
    model = ElasticModel(made.robot, bearing(made.robot))
    problem = build(model, made.readings, None, made.marker)
    compliance = solve(problem.take(~screen(problem).blunder)).compliance
    return model.observation_blocks(q, force) @ compliance


@dataclass(frozen=True)
class Row:
    """A mistake over several campaigns."""

    mistake: str
    harm: float
    """Median over the campaigns where a fit is possible."""
    campaigns: int
    harmful: int
    found: int
    """Of the harmful ones."""
    named: int


def tabulate(outcomes: Iterable[Outcome]) -> list[Row]:
    """Return a row a mistake, in the order in which they come first."""
    by_name: dict[str, list[Outcome]] = {}
    for each in outcomes:
        by_name.setdefault(each.mistake, []).append(each)
    return [_row(name, own) for name, own in by_name.items()]


def _row(name: str, own: Sequence[Outcome]) -> Row:
    harms = [each.harm for each in own if np.isfinite(each.harm)]
    harmful = [each for each in own if each.harmful]
    return Row(
        name,
        float(np.median(harms)) if harms else float("nan"),
        len(own),
        len(harmful),
        sum(each.found for each in harmful),
        sum(each.named for each in harmful),
    )


def rates(rows: Sequence[Row]) -> tuple[float, float]:
    """Return the part of the harmful mistakes that is found, and of these that is named."""
    harmful, found = sum(row.harmful for row in rows), sum(row.found for row in rows)
    return found / harmful, sum(row.named for row in rows) / found
