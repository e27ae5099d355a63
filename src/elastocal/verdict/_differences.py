"""How a dataset or a summary that was made again differs from the one that is stated."""

import re

import numpy as np

from elastocal.dataset import Dataset, content_sha256

_SAME = 1e-4
"""Difference, by the largest number of its kind, below which two derivations are one: versions and
machines round differently, and what is smaller changes no verdict."""
_SAME_PLACE = 1e-6
"""The same of the place of the marker, which stands as a text."""
_FRACTION = re.compile(r"[-+]?\d+\.\d+(?:e[-+]?\d+)?")


def changed_text(stated: Dataset, found: Dataset) -> str:
    """Return which text of a dataset is not that of the one made again; empty where none is."""
    told = ("robot_name", "robot_urdf", "tcp_frame", "marker", "gravity", "history", "check")
    for name in told:
        mine, again = stated.attributes.get(name), found.attributes.get(name)
        # The marker's place alone is fitted; what is copied comes back to the letter.
        if mine != again and not (name == "marker" and _is_same_text(mine, again)):
            return f"its attribute {name} is another"
    return ""


def _is_same_text(stated: object, found: object) -> bool:
    """Return whether two texts are the same but for the rounding of the fractions in them."""
    if not (isinstance(stated, str) and isinstance(found, str)):
        return False
    a, b = (np.array(_FRACTION.findall(text), dtype=float) for text in (stated, found))
    return (
        _FRACTION.sub("", stated) == _FRACTION.sub("", found)
        and a.shape == b.shape
        and bool(np.all(np.abs(a - b) <= _SAME_PLACE * np.max(np.abs(b), initial=0.0)))
    )


def changed_reading(stated: Dataset, found: Dataset, old: bool, source: str) -> str:
    """Return how readings differ from those made again; empty where they do not.

    Parameters
    ----------
    stated, found : Dataset
        As it stands, and made again.
    old : bool
        What a dataset of before does not have at all is no difference.
    source : str
        What it was made again from: streams, logs.
    """
    if content_sha256(stated) == content_sha256(found):
        return ""
    for name in ("poses", "load_cases", "joint_names", "joint_units", "campaigns"):
        if getattr(stated, name) != getattr(found, name):
            return f"its {name.replace('_', ' ')} are others"
    mine, again = stated.to_labelled(), found.to_labelled()
    for name, array in again.variables.items():
        if array.values.dtype.kind not in "iuf" or (name not in mine and old):
            continue
        if name not in mine:
            return f"it has no {name}"
        unit = str(array.attributes.get("units", ""))
        if text := _largest_difference(stated, mine[name].values, array.values, unit, source):
            return f"{name} {text}"
    added = sorted(mine.variables.keys() - again.variables.keys())
    return f"it has {added[0]}, which the {source} do not give" if added else ""


def _largest_difference(
    dataset: Dataset, stated: np.ndarray, found: np.ndarray, unit: str, source: str
) -> str:
    """Return the place where two arrays differ most, with both numbers; empty where they agree."""
    a, b = np.asarray(stated, dtype=float), np.asarray(found, dtype=float)
    size = float(np.nanmax(np.abs(b), initial=0.0))
    gap = np.where(np.isnan(a) & np.isnan(b), 0.0, np.abs(a - b))
    gap = np.where(np.isnan(gap), np.inf, gap)
    if not np.any(gap > _SAME * size):
        return ""
    place = np.unravel_index(int(np.argmax(gap)), gap.shape)
    pose = f"of pose {dataset.poses[place[0]]}" if place else ""
    case = f" {dataset.load_cases[place[1]]}" if dataset.status.shape == gap.shape[:2] else ""
    return f"{pose}{case} is {a[place]:.6g} {unit}, the {source} give {b[place]:.6g} {unit}"


def changed_place(stated: object, found: object, place: str = "") -> str:
    """Return the path of the first entry in which two JSON-ready records differ."""
    if isinstance(stated, dict) and isinstance(found, dict) and stated.keys() == found.keys():
        inner = [(f"{place}.{key}".lstrip("."), stated[key], found[key]) for key in stated]
        # Which version derived it is no finding.
        pairs = [each for each in inner if each[0] != "elastocal"]
    elif isinstance(stated, list) and isinstance(found, list) and len(stated) == len(found):
        pairs = [(f"{place}.{n}", a, b) for n, (a, b) in enumerate(zip(stated, found, strict=True))]
    else:
        return "" if stated == found or _is_close(stated, found) else place
    return next((text for key, a, b in pairs if (text := changed_place(a, b, key))), "")


def _is_close(a: object, b: object) -> bool:
    if not (isinstance(a, int | float) and isinstance(b, int | float)):
        return False
    # A thousandth: standard deviations of what is hardly determined round most.
    return abs(a - b) <= max(10.0 * _SAME * abs(b), 1e-12)
