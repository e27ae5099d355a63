"""The installed version, and those of the packages that make the numbers."""

from importlib.metadata import version

__version__ = version("elastocal")
NUMERICAL = ("elastocal", "numpy", "scipy", "pin")
"""Distributions on which the last digits of a result depend."""


def package_versions() -> dict[str, str]:
    """Return the versions of the packages that make the numbers, by their names."""
    return {name: version(name) for name in NUMERICAL}
