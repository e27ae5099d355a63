"""elastocal: in-situ elastic calibration of industrial robots.

The method is that of Monsarrat et al., "In-situ elastic calibration of robots", Robotics and
Computer-Integrated Manufacturing (2024), doi:10.1016/j.rcim.2024.102743, called *the paper*
throughout. Typical use::

    import elastocal as ec

    result = ec.calibrate("dataset.nc")
    result.plot()

Every command is a function here; the subpackages hold the equations and components. Subpackages are
imported when they are first used.
"""

import ast
import sys
import types

import lazy_loader


def _statements(stub: str) -> list[ast.stmt]:
    with open(f"{__path__[0]}/{stub}", encoding="utf-8") as file:  # noqa: PTH123 - light import
        return ast.parse(file.read()).body


_exports = {
    each.module: [alias.name for alias in each.names]
    for each in _statements("__init__.pyi")
    if isinstance(each, ast.ImportFrom) and each.module
}
# The stub exports all commands by "*"; `lazy_loader` needs their names.
_commands = next(s for s in _statements("workflows/__init__.pyi") if isinstance(s, ast.Assign))
_exports["workflows"] = ast.literal_eval(_commands.value)
__getattr__, __dir__, __all__ = lazy_loader.attach(__name__, submod_attrs=_exports)


class _Face(types.ModuleType):
    """Keeps the commands `codec` and `report` in sight of the packages that bear their names.

    Python sets a package's attribute when a subpackage is imported; ``ec.codec(...)`` is to stay
    the command. ``from elastocal.codec import ...`` finds the package as ever.
    """

    def __setattr__(self, name: str, value: object) -> None:
        """Set an attribute, but no subpackage under the name of a command."""
        if not (name in __all__ and isinstance(value, types.ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Face
