"""Look for no garbage while the site is built: a tenth of the time, and the process ends anyway."""

import gc
from typing import Any


def on_startup(*, command: str, **_: Any) -> None:
    """Leave garbage alone, but where the site is served and built again and again."""
    if command == "build":
        gc.disable()
