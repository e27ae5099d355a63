"""Readings to try things on: published ones of a real arm, and a simulated campaign.

Nothing is downloaded. The published readings are files that stand beside the documentation
(``examples/fanuc_r2000ic`` of the sources) and are not part of an installation.
"""

import os
import shutil
import sys
from dataclasses import replace
from pathlib import Path

from elastocal._version import __version__
from elastocal.dataset import Dataset, read_dataset
from elastocal.errors import FileAccessError
from elastocal.files import filling, read_text

DATA = "ELASTOCAL_DATA"
"""Environment variable with a folder that holds data sets, each in a folder of its name."""
_FANUC = "fanuc_r2000ic"
_CELL, _RUN = "cell.yaml", "run"
"""The cell file and the folder of the run in a simulated campaign."""
_EXAMPLES = Path(__file__).parents[2] / "examples"
"""In a checkout of the sources."""


def fanuc_r2000ic(folder: str | os.PathLike[str] | None = None) -> Dataset:
    """Return 43 published force-deflection readings of a FANUC R-2000iC.

    A cable pulls at the tool, one load a pose: 115 to 1166 N, 0.46 to 3.66 mm. Source: longton2001-
    pixel, breakthrough-surge-suppression-in-high-speed-robotic-drilling (2026), MIT licence.

    Parameters
    ----------
    folder : path, optional
        Folder with ``measurements.csv`` and ``fanuc_r2000ic.urdf``, as in ``examples`` of the
        sources. By default ``fanuc_r2000ic`` in the folder that the environment variable
        ``ELASTOCAL_DATA`` names, else ``examples`` of a checkout.

    Returns
    -------
    Dataset
        With the arm as published, so that `calibrate` needs no robot.

    Raises
    ------
    FileAccessError
        If the readings are in none of these places.

    Examples
    --------
    >>> import elastocal as ec
    >>> readings = ec.datasets.fanuc_r2000ic()
    >>> len(readings.poses)
    43
    """
    chosen = _folder_of(_FANUC, "measurements.csv") if folder is None else Path(folder)
    found = read_dataset(chosen / "measurements.csv")
    urdf = read_text(chosen / f"{_FANUC}.urdf")
    arm = {"robot_name": _FANUC, "robot_urdf": urdf, "tcp_frame": "tcp"}
    return replace(found, attributes={**found.attributes, **arm})


def _folder_of(name: str, file: str) -> Path:
    stated = os.environ.get(DATA)
    places = [Path(stated) / name] if stated else [_EXAMPLES / name]
    for place in places:
        if (place / file).is_file():
            return place
    raise FileAccessError(
        f"{places[0] / file} is not there: give the folder of {name}, which elastocal's sources"
        f" have in examples/{name}, or name the folder that holds it by the environment variable"
        f" {DATA}"
    )


def afp_simulated(seed: int = 0, poses: int = 31) -> Dataset:
    """Return a simulated campaign of fibre placement, with gears, noise, drift and a tracker.

    Plan and run of the example cell take a minute or more; the readings are then kept in the
    user's cache folder (``XDG_CACHE_HOME``, ``LOCALAPPDATA`` or ``~/.cache``) for this version.

    Parameters
    ----------
    seed : int, default 0
        Seed of the simulated cell.
    poses : int, default 31
        Number of poses.

    Returns
    -------
    Dataset
        As `run` leaves it, with the robot on its rail.

    Raises
    ------
    FileAccessError
        If the cache folder cannot be written.

    Examples
    --------
    >>> import elastocal as ec
    >>> readings = ec.datasets.afp_simulated(poses=5)  # doctest: +SKIP
    >>> ec.calibrate(readings, springs="actuated")  # doctest: +SKIP
    """
    return read_dataset(_campaign(seed, poses) / _RUN / "dataset.nc")


def afp_run(
    out: str | os.PathLike[str], seed: int = 0, poses: int = 31, *, force: bool = False
) -> Path:
    """Write the campaign of `afp_simulated` into a folder: cell, production path, plan and run.

    It is what `init`, `plan` and `run` leave, for all that begins with a run, and is copied from
    the cache folder where it was made before.

    Parameters
    ----------
    out : path
        Folder to write: ``cell.yaml``, ``dome.stl``, ``process.csv``, ``plan`` and ``run``.
    seed : int, default 0
        Seed of the simulated cell.
    poses : int, default 31
        Number of poses.
    force : bool, default False
        Replace files that are there.

    Returns
    -------
    Path
        Folder of the run, ``run`` in that folder.

    Raises
    ------
    FileAccessError
        If the folder holds files already, or it or the cache folder cannot be written.

    Examples
    --------
    >>> import elastocal as ec
    >>> run = ec.datasets.afp_run("afp", poses=4)
    >>> dict(ec.derive(run).facts())["readings"]
    '32 ok'
    """
    kept, out = _campaign(seed, poses), Path(out)
    with filling(out, _CELL, force) as folder:
        shutil.copytree(kept, folder, dirs_exist_ok=True)
    return out / _RUN


def _campaign(seed: int, poses: int) -> Path:
    """Return the folder of a campaign that was simulated once, now or before."""
    kept = cache_folder() / f"afp-{__version__}-seed{seed}-poses{poses}"
    if not (kept / _RUN / "dataset.nc").is_file():
        _measure(kept, seed, poses)
    return kept


def _measure(kept: Path, seed: int, poses: int) -> None:
    """Plan and run the example cell; leave all of it in a folder, whole or not at all."""
    from elastocal import workflows

    kept.parent.mkdir(parents=True, exist_ok=True)
    with filling(kept, _CELL, force=True) as folder:
        workflows.init(folder, kind="afp")
        cell, plan, run = folder / _CELL, folder / "plan", folder / _RUN
        workflows.plan(cell, out=plan, poses=poses, compare="none")
        workflows.run(cell, plan=plan, out=run, seed=seed)


def cache_folder() -> Path:
    """Return the folder in which this user's programs keep what they can make again."""
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData/Local")) / "elastocal"
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "elastocal"
