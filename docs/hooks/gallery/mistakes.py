"""What mistakes in readings do, and whether they are found: the table of `mistakes.json`.

``python tests/support/walk_mistakes.py docs/hooks/gallery/mistakes.json COMMAND`` makes every one.
"""

import json
from pathlib import Path
from typing import Any

TRIED = Path(__file__).with_name("mistakes.json")
HARMFUL = 0.05
"""Change of predictions from which a mistake is harmful."""
_INPUTS = {
    "calibrate": ("predictions", "campaigns"),
    "outside": ("predictions", "campaigns"),
    "tool": ("what is taken off", "tables"),
    "import": ("predictions", "recordings"),
}
"""What mistakes change, and what they are made in."""


def make(_: Path) -> dict[str, str]:
    """Return what is told of the mistakes; there is no figure."""
    found = {}
    for command, tried in json.loads(TRIED.read_text(encoding="utf-8")).items():
        found[f"mistakes-{command}"] = told(tried, *_INPUTS[command])
        found[f"mistakes-{command}-table"] = table(tried["mistakes"])
    return found


def harmful(row: dict[str, Any]) -> bool:
    """Return whether a mistake changes predictions, or leaves none."""
    return row["harm"] is None or row["harm"] > HARMFUL


def told(tried: dict[str, Any], changed: str, inputs: str) -> str:
    """Return the rates as a sentence."""
    rows, sound = tried["mistakes"], tried["sound"]
    bad = [row for row in rows if harmful(row)]
    found = [row for row in bad if row["found"]]
    named = sum(row["named"] for row in found)
    alarms = sum(bool(row["said"]) for row in sound)
    kinds = len({row["mistake"] for row in rows})
    heard = f". Of {len(sound)} sound {inputs} {alarms} are warned of" if sound else ""
    return (
        f"{len(rows)} trials of {kinds} mistakes: {len(bad)} change {changed} by more than"
        f" {HARMFUL:.0%}; {len(found)} of these ({len(found) / len(bad):.0%}) are refused or warned"
        f" of, {named} ({named / len(found):.0%}) by the right name{heard}"
    )


def table(rows: list[dict[str, Any]]) -> str:
    """Return a row a mistake: its harm in each campaign, with what became of it."""
    campaigns = list(dict.fromkeys(row["campaign"] for row in rows))
    lines = [f"| mistake | {' | '.join(campaigns)} |", "|---" * (1 + len(campaigns)) + "|"]
    for name in dict.fromkeys(row["mistake"] for row in rows):
        own = {row["campaign"]: row for row in rows if row["mistake"] == name}
        cells = (_cell(own[each]) if each in own else "" for each in campaigns)
        lines.append(f"| {name} | {' | '.join(cells)} |")
    return "\n".join(lines)


def _cell(row: dict[str, Any]) -> str:
    """Return the harm, and how it was met."""
    harm = "no fit" if row["harm"] is None else f"{row['harm']:.0%}"
    if not row["found"]:
        return f"{harm}, **silent**" if harmful(row) else f"{harm}, silent"
    met = "refused" if row["refused"] else "warned"
    return f"{harm}, {met}{'' if row['named'] else ', other name'}"
