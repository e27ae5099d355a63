"""Where output goes: people read standard error, programs read standard output."""

import json
import sys
from typing import Any

from rich.console import Console


def console() -> Console:
    """Return the console that people read; standard output stays free for data."""
    return Console(stderr=True, highlight=False, soft_wrap=False)


def print_json(data: Any) -> None:
    """Print one JSON object on standard output, and nothing else there."""
    sys.stdout.write(json.dumps(data, allow_nan=False) + "\n")
