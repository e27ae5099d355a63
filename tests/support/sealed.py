"""Edit JSON files by hand and seal them again, as somebody would who renews their hashes."""

import hashlib
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from elastocal.files import write_json
from elastocal.records import SEAL, json_sha256


def edit(path: Path, change: Callable[[Any], object]) -> None:
    """Change what a JSON file says; where it states the hash of its content, renew that."""
    data = json.loads(path.read_text(encoding="utf-8"))
    change(data)
    if SEAL in data:
        data[SEAL] = json_sha256(data)
    write_json(path, data)


def edit_text(path: Path, old: str, new: str) -> None:
    """Replace a text in a JSON file likewise."""
    path.write_text(path.read_text(encoding="utf-8").replace(old, new), encoding="utf-8")
    edit(path, lambda _: None)


def edit_journal(path: Path, change: Callable[[str], str]) -> None:
    """Change what a journal says; the checksum of every line is renewed over the line before."""
    path.write_text(chained(change(path.read_text(encoding="utf-8"))), encoding="utf-8")


def chained(journal: str) -> str:
    """Return lines with checksums over the lines before; those that have none stay as they are."""
    check, lines = "", []
    for line in journal.splitlines(keepends=True):
        body, found = re.subn(r',"line_check":"[0-9a-f]+"}\s*$', "", line)
        check = hashlib.sha256(f"{check}{body}".encode()).hexdigest()[:16] if found else check
        lines.append(f'{body},"line_check":"{check}"}}\n' if found else line)
    return "".join(lines)
