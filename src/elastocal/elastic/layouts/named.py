"""Spring layouts: named ones, and lists from a file.

A new named layout is one file here with a function ``(robot) -> springs``, an entry in
`LAYOUTS`, a line in the changelog and an entry in ``tests/contracts/test_layouts.py``.
"""

from collections.abc import Callable
from pathlib import Path

from elastocal.elastic.layouts.actuated import actuated
from elastocal.elastic.layouts.bearing import bearing
from elastocal.elastic.layouts.custom import custom, read_springs
from elastocal.elastic.springs import Spring
from elastocal.errors import SpringError, nearest
from elastocal.robot import Robot

LAYOUTS: dict[str, Callable[[Robot], tuple[Spring, ...]]] = {
    "actuated": actuated,
    "bearing": bearing,
}


def layout(robot: Robot, name: str) -> tuple[Spring, ...]:
    """Return the springs of a layout by name, or of a YAML file by its path.

    Raises
    ------
    SpringError
        If the name is neither a layout nor a file.
    """
    if name in LAYOUTS:
        return LAYOUTS[name](robot)
    path = Path(name)
    if path.suffix not in (".yaml", ".yml"):
        raise SpringError(
            f"unknown spring layout {name!r}{nearest(name, LAYOUTS)}"
            f" (allowed: {', '.join(LAYOUTS)}, or a .yaml file)"
        )
    file = read_springs(path)
    included = LAYOUTS[file.include](robot) if file.include else ()
    return (*included, *custom(robot, file.springs))
