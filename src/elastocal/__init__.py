"""elastocal: in-situ elastic calibration of industrial robots.

The method is that of Monsarrat et al., "In-situ elastic calibration of robots", Robotics and
Computer-Integrated Manufacturing (2024), doi:10.1016/j.rcim.2024.102743, called *the paper*
throughout. Typical use:

    import elastocal as ec

    result = ec.calibrate("dataset.nc")
    result.plot()

Every command is a function here; the subpackages hold the equations and components. Subpackages are
imported when they are first used.
"""

import ast
import importlib
import os
import sys
import types
from collections.abc import Callable

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
_attribute, _, __all__ = lazy_loader.attach(__name__, submod_attrs=_exports)
_PACKAGES = {
    entry.name.removesuffix(".py"): entry.is_dir()
    for entry in os.scandir(__path__[0])
    if not entry.name.startswith(("_", "options", "outputs"))
    and (entry.is_dir() or entry.name.endswith(".py"))
}
"""Subpackages and modules, and which are packages; ``codec``, ``geometry``, ``report`` and
``studio`` are commands too."""
_FOR_PEOPLE = ("datasets", "errors")
"""Modules that are completed beside the packages; the others serve these."""
_SHELLS = ("cli", "templating", "viewer")
"""Packages that show results, and have nothing to call."""


def __getattr__(name: str) -> object:
    if name in _PACKAGES:
        return importlib.import_module(f"{__name__}.{name}")
    return _attribute(name)


def __dir__() -> list[str]:
    packages = {name for name, is_package in _PACKAGES.items() if is_package}
    return sorted({*__all__, *_FOR_PEOPLE, *(packages - {*_SHELLS})})


class _Command(types.ModuleType):
    """A package that bears the name of a command, is called as it, and has its help."""

    @property
    def __doc__(self) -> str:  # type: ignore[override]
        """The help of the command, then what the package is."""
        return f"{self.__wrapped__.__doc__}\n\nThe package of this name: {vars(self)['__doc__']}"

    @property
    def __wrapped__(self) -> Callable[..., object]:
        """The command; `inspect.signature` asks for it."""
        workflows = importlib.import_module(f"{__package__}.workflows")
        return getattr(workflows, self.__name__.rpartition(".")[2])

    def __call__(self, *given: object, **options: object) -> object:
        """Carry out the command."""
        return self.__wrapped__(*given, **options)


class _Face(types.ModuleType):
    """Makes packages with the name of a command callable: ``ec.codec(...)`` is the command.

    Python sets a package's attribute when a subpackage is imported; ``import elastocal.codec`` and
    ``from elastocal.codec import ...`` find the package as ever.
    """

    def __setattr__(self, name: str, value: object) -> None:
        """Set an attribute; a subpackage that bears the name of a command is called as it."""
        if name in __all__ and isinstance(value, types.ModuleType):
            value.__class__ = _Command
            # With it `help` would print every class of the package after the command.
            vars(value).pop("__all__", None)
        super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Face
