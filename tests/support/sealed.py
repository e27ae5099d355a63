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
    check, lines = "", []
    for line in change(path.read_text(encoding="utf-8")).splitlines():
        body = re.sub(r',"line_check":"[0-9a-f]+"}$', "", line)
        check = hashlib.sha256(f"{check}{body}".encode()).hexdigest()[:16]
        lines.append(f'{body},"line_check":"{check}"}}\n')
    path.write_text("".join(lines), encoding="utf-8")
