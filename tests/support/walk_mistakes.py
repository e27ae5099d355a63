"""Make every mistake in campaigns and keep what came of it: ``walk_mistakes.py OUT [PART …]``.

``OUT`` is a JSON file; what stands in it already is not tried again. Arguments after it are parts
of the names of mistakes that are to be made, or ``sound`` for 200 sound campaigns; by default all.
No threshold was chosen on these campaigns.
"""

import json
import math
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from support.campaigns import Sound, campaign, sounds
from support.further_mistakes import FURTHER
from support.mistake_table import alarms, outcome
from support.mistakes import MISTAKES

MADE_IN = (
    Sound("afp", "typical", 31, 101),
    Sound("afp", "kind", 20, 104, rail=False),
    Sound("ur20", "kind", 25, 103),
    Sound("machining", "harsh", 31, 102, conditioned=True),
)
SOUND = sounds(200, seed=11000)


def walk(out: Path, wanted: list[str]) -> None:
    found = json.loads(out.read_text()) if out.exists() else {"mistakes": [], "sound": []}
    done = {(row["campaign"], row["mistake"]) for row in found["mistakes"]}
    heard = {row["seed"] for row in found["sound"]}
    for sound in SOUND if not wanted or "sound" in wanted else ():
        if sound.seed not in heard:
            said = [*map(str, alarms(campaign(sound)))]
            found["sound"].append(
                {"campaign": title(sound), "poses": sound.poses, "seed": sound.seed, "said": said}
            )
            out.write_text(json.dumps(found, indent=1) + "\n")
    for sound in MADE_IN:
        for mistake in (*FURTHER, *MISTAKES):
            if (title(sound), mistake.name) in done or not (
                not wanted or any(part in mistake.name for part in wanted)
            ):
                continue
            each = outcome(campaign(sound), mistake)
            found["mistakes"].append(
                {
                    "mistake": mistake.name,
                    "campaign": title(sound),
                    "harm": round(each.harm, 4) if math.isfinite(each.harm) else None,
                    "refused": each.refused,
                    "found": each.found,
                    "named": each.named,
                }
            )
            out.write_text(json.dumps(found, indent=1) + "\n")


def title(sound: Sound) -> str:
    return f"{sound.like} {sound.preset}"


if __name__ == "__main__":
    walk(Path(sys.argv[1]), sys.argv[2:])
