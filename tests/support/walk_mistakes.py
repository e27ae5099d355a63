"""Make every mistake and keep what came of it: ``walk_mistakes.py OUT COMMAND [PART …]``.

``OUT`` is a JSON file; what stands in it already is not tried again. ``COMMAND`` is one of
`WALKS`; arguments after it are parts of the names of mistakes that are to be made, or ``sound``
for what is sound; by default all. No threshold was chosen on the campaigns of `calibrate`.
"""

import json
import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))

from support.campaigns import Sound, campaign, sounds
from support.further_mistakes import FURTHER
from support.log_mistakes import LOG_MISTAKES, Recording, log_alarms, log_outcome
from support.mistake_table import HARMFUL, Outcome, alarms, outcome
from support.mistakes import MISTAKES
from support.outside_mistakes import OUTSIDE
from support.tool_mistakes import TOOL_MISTAKES, Table, tool_alarms, tool_outcome

MADE_IN = (
    Sound("afp", "typical", 31, 101),
    Sound("afp", "kind", 20, 104, rail=False),
    Sound("ur20", "kind", 25, 103),
    Sound("machining", "harsh", 31, 102, conditioned=True),
)
MADE_OUTSIDE = (
    Sound("ur20", "kind", 25, 403),
    Sound("afp", "typical", 31, 401),
    Sound("machining", "harsh", 31, 405, conditioned=True),
)
"""Sound campaigns that are none of those on which a threshold was chosen."""


@dataclass(frozen=True)
class Walk:
    """The mistakes of one command, and the sound inputs in which they are made."""

    made_in: Sequence[Any]
    """Each has a ``title``."""
    mistakes: Sequence[Any]
    """Each has a ``name``."""
    outcome: Callable[[Any, Any], Outcome]
    sound: Sequence[Any]
    """Each has a ``title`` and a ``seed``."""
    alarms: Callable[[Any], tuple[str, ...]]


WALKS = {
    "calibrate": Walk(
        MADE_IN,
        (*FURTHER, *MISTAKES),
        lambda sound, mistake: outcome(campaign(sound), mistake),
        sounds(200, seed=11000),
        lambda sound: alarms(campaign(sound)),
    ),
    "outside": Walk(
        MADE_OUTSIDE,
        OUTSIDE,
        lambda sound, mistake: outcome(campaign(sound), mistake),
        (),
        lambda sound: alarms(campaign(sound)),
    ),
    "tool": Walk(
        (Table(), Table(8, 4.0, 0.7, 3)),
        TOOL_MISTAKES,
        tool_outcome,
        [Table(6 + n % 10, 3.0 + n, 0.5 + 0.02 * n, 1000 + n, 0.01 * (n % 2)) for n in range(100)],
        tool_alarms,
    ),
    "import": Walk(
        (Recording(), Recording(1), Recording(2, other=True)),
        LOG_MISTAKES,
        log_outcome,
        [Recording(100 + n, other=n % 2 == 1) for n in range(100)],
        log_alarms,
    ),
}


def walk(out: Path, command: str, wanted: Sequence[str]) -> None:
    """Make what is wanted and not made yet."""
    every = json.loads(out.read_text()) if out.exists() else {}
    found, own = every.setdefault(command, {"mistakes": [], "sound": []}), WALKS[command]
    done = {(row["campaign"], row["mistake"]) for row in found["mistakes"]}
    heard = {row["seed"] for row in found["sound"]}
    for sound in own.sound if not wanted or "sound" in wanted else ():
        if sound.seed not in heard:
            said = [*map(str, own.alarms(sound))]
            found["sound"].append({"campaign": sound.title, "seed": sound.seed, "said": said})
            out.write_text(json.dumps(every, indent=1) + "\n")
    for sound in own.made_in:
        for mistake in own.mistakes:
            if (sound.title, mistake.name) in done or not (
                not wanted or any(part in mistake.name for part in wanted)
            ):
                continue
            found["mistakes"].append(row_of(own.outcome(sound, mistake), sound.title))
            out.write_text(json.dumps(every, indent=1) + "\n")


def row_of(each: Outcome, campaign: str) -> dict[str, object]:
    """Return an outcome as the table keeps it."""
    return {
        "mistake": each.mistake,
        "campaign": campaign,
        "harm": round(each.harm, 4) if math.isfinite(each.harm) else None,
        "refused": each.refused,
        "found": each.found,
        "named": each.named,
    }


TRIED = Path(__file__).parents[2] / "docs" / "hooks" / "gallery" / "mistakes.json"
"""What the documentation shows."""


def tried(command: str) -> dict[str, Any]:
    """Return what the documentation shows of a command."""
    found: dict[str, Any] = json.loads(TRIED.read_text(encoding="utf-8"))[command]
    return found


def require_whole(command: str, found: float, named: float, most_alarms: float) -> None:
    """Require that the documentation shows every mistake of a command, and rates at least so good.

    ``found`` is a part of the harmful mistakes, ``named`` one of those, ``most_alarms`` a part of
    what is sound.
    """
    own, kept = WALKS[command], tried(command)
    made = {(each.title, mistake.name) for each in own.made_in for mistake in own.mistakes}
    assert {(row["campaign"], row["mistake"]) for row in kept["mistakes"]} == made
    assert {row["seed"] for row in kept["sound"]} == {each.seed for each in own.sound}
    harmful = [row for row in kept["mistakes"] if row["harm"] is None or row["harm"] > HARMFUL]
    seen = [row for row in harmful if row["found"]]
    assert len(seen) >= found * len(harmful)
    assert sum(row["named"] for row in seen) >= named * len(seen)
    assert sum(bool(row["said"]) for row in kept["sound"]) <= most_alarms * len(kept["sound"])


def require_same(command: str, campaign: int, name: str) -> Outcome:
    """Make a mistake again, require that the documentation shows the same, and return it."""
    own = WALKS[command]
    sound = own.made_in[campaign]
    mistake = next(each for each in own.mistakes if each.name == name)
    found = own.outcome(sound, mistake)
    row = row_of(found, sound.title)
    kept = next(
        each
        for each in tried(command)["mistakes"]
        if (each["campaign"], each["mistake"]) == (sound.title, name)
    )
    harm, was = row.pop("harm"), kept.pop("harm")
    assert row == kept, found.said
    assert (harm is None) == (was is None)
    assert harm is None or abs(harm - was) < 0.01 + 0.05 * was
    return found


if __name__ == "__main__":
    walk(Path(sys.argv[1]), sys.argv[2], sys.argv[3:])
