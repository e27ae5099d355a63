"""How readings and summaries of a run differ from those made again from its streams, in words."""

import numpy as np

from elastocal.dataset import Dataset, content_sha256
from elastocal.wording import phrase

_SAME = 1e-4
"""Difference, by the largest number of its kind, below which two derivations are one: versions and
machines round differently, and what is smaller changes no verdict."""


def other_texts(stated: Dataset, found: Dataset) -> str:
    """Return which text of a dataset is not that of the one made again; empty where none is."""
    told = ("robot_name", "robot_urdf", "tcp_frame", "marker", "gravity", "history", "check")
    for name in told:
        if stated.attributes.get(name) != found.attributes.get(name):
            return phrase("its attribute {name} is another", name=name)
    return ""


def difference_of(stated: Dataset, found: Dataset, old: bool) -> str:
    """Return how readings differ from those made again; empty where they do not.

    What a dataset of before does not have at all is no difference.
    """
    if content_sha256(stated) == content_sha256(found):
        return ""
    for name in ("poses", "load_cases", "joint_names", "joint_units", "campaigns"):
        if getattr(stated, name) != getattr(found, name):
            return phrase("its {names} are others", names=name.replace("_", " "))
    mine, again = stated.to_labelled(), found.to_labelled()
    for name, array in again.variables.items():
        if array.values.dtype.kind not in "iuf" or (name not in mine and old):
            continue
        if name not in mine:
            return f"it has no {name}"
        unit = str(array.attributes.get("units", ""))
        if text := _largest_difference(stated, mine[name].values, array.values, unit):
            return phrase("{name} {difference}", name=name, difference=text)
    added = sorted(mine.variables.keys() - again.variables.keys())
    return phrase("it has {name}, which the streams do not give", name=added[0]) if added else ""


def _largest_difference(dataset: Dataset, stated: np.ndarray, found: np.ndarray, unit: str) -> str:
    """Return the place where two arrays differ most, with both numbers; empty where they agree."""
    a, b = np.asarray(stated, dtype=float), np.asarray(found, dtype=float)
    size = float(np.nanmax(np.abs(b), initial=0.0))
    gap = np.where(np.isnan(a) & np.isnan(b), 0.0, np.abs(a - b))
    gap = np.where(np.isnan(gap), np.inf, gap)
    if not np.any(gap > _SAME * size):
        return ""
    place = np.unravel_index(int(np.argmax(gap)), gap.shape)
    case = f" {dataset.load_cases[place[1]]}" if dataset.status.shape == gap.shape[:2] else ""
    return phrase(
        "of pose {pose} is {stated} {unit}, the streams give {found} {unit}",
        pose=f"{dataset.poses[place[0]]}{case}",
        stated=f"{a[place]:.6g}",
        unit=unit,
        found=f"{b[place]:.6g}",
    )


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
