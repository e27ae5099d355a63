"""Figure of merged logs: what each instrument felt by one clock, and where a reading was taken."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from elastocal.arrays import BoolArray, FloatArray
from elastocal.logs import ImportedLogs, Plateau
from elastocal.report.plots import style
from elastocal.units import in_unit
from elastocal.wording import counted

_MOST = 4000
"""Samples of a curve; more cannot be distinguished on the page."""
_MARGIN = 4.0
"""Time before and after the pose that is shown closely, in s."""


def write_timeline_figure(path: Path, found: ImportedLogs, title: str) -> Path:
    """Write the figure, atomically; return its path.

    Parameters
    ----------
    path : Path
        Its suffix decides the kind: SVG, PNG or PDF.
    found : ImportedLogs
        Streams by one clock, plateaus and clocks.
    title : str
        Title of the figure.

    Raises
    ------
    FileAccessError
        If the suffix is another or the file cannot be written.
    """
    return style.write_figure(path, lambda: timeline_figure(found, title))


def timeline_figure(found: ImportedLogs, title: str) -> Figure:
    """Return the figure: the whole recording above, one pose closely below.

    Starts and stops of arm, force and marker must be aligned, and every band must be where all
    three are constant.
    """
    poses = max((each.pose for each in found.plateaus), default=0) + 1
    figure = style.new_figure(9.6, 7.4)
    figure.add_title(title, 0.75)
    clocks = "\n".join(each.sentence for each in found.clocks) or "all logs share one clock"
    top = figure.add_panel(0.75, 4.95, 8.6, 1.6)
    _overview(top, found, poses)
    pose = poses // 2
    own = [each for each in found.plateaus if each.pose == pose]
    span = own[0].start - _MARGIN, own[-1].end + _MARGIN
    panels = [figure.add_panel(0.75, bottom, 8.6, 0.98) for bottom in (3.2, 2.1, 1.0)]
    _closely(panels, found, own, span)
    panels[0].set_title(f"Pose {pose} closely", fontsize=9, loc="left", color=style.INK)
    for panel in panels[:2]:
        panel.tick_params(labelbottom=False)
    panels[-1].set_xlabel("time by the clock of the joints in s")
    figure.add_caption(f"Clocks: {clocks}", 0.75)
    return figure


def _overview(axes: Axes, found: ImportedLogs, poses: int) -> None:
    """Draw the size of the force and the poses of a whole recording."""
    wrench = found.streams.wrench
    unloaded = [each for each in found.plateaus if each.load is None and each.pose >= 0]
    force = wrench.force - wrench.force[_during(wrench.time, unloaded)].mean(axis=0)
    time, size = _thinned(wrench.time, np.linalg.norm(force, axis=1)[:, None])
    axes.plot(time, size[:, 0], color=style.BLUE, linewidth=0.6)
    for pose in range(poses):
        own = [each for each in found.plateaus if each.pose == pose]
        axes.axvspan(own[0].start, own[-1].end, color=style.BAND if pose % 2 else style.GRID, lw=0)
        if poses <= 40:
            middle = 0.5 * (own[0].start + own[-1].end)
            axes.text(
                middle, 1.01, str(pose), transform=axes.get_xaxis_transform(), ha="center",
                va="bottom", fontsize=6.5, color=style.MUTED,
            )  # fmt: skip
    lost = sum(each.pose < 0 for each in found.plateaus)
    used = counted(len(found.plateaus) - lost, "plateau")
    axes.set_title(
        f"Force from unloaded. {counted(poses, 'pose')}, {used} used, {lost} not (no reference, no"
        " load)",
        fontsize=9, loc="left", pad=14, color=style.INK,
    )  # fmt: skip
    axes.set_ylabel("force, N")
    axes.set_xlim(found.streams.arm.time[0], found.streams.arm.time[-1])


def _closely(
    panels: list[Axes], found: ImportedLogs, own: list[Plateau], span: tuple[float, float]
) -> None:
    """Draw arm, force and marker about one pose, from its reference."""
    arm, wrench, points = found.streams.arm, found.streams.wrench, found.streams.points
    curves = (
        ("arm, mm", arm.time, in_unit(arm.T_base_tcp[:, :3, 3], "mm"), True),
        ("force, N", wrench.time, wrench.force, False),
        ("marker, mm", points.time, in_unit(points.position, "mm"), True),
    )
    for axes, (name, time, values, as_norm) in zip(panels, curves, strict=True):
        if not len(time):
            axes.set_xlim(*span)
            axes.set_ylabel(name)
            axes.text(0.5, 0.5, "in no log", transform=axes.transAxes, ha="center", va="center")
            continue
        inside = (time >= span[0]) & (time <= span[1])
        change = values[inside] - values[_during(time, own[:1])].mean(axis=0)
        if as_norm:
            change = np.linalg.norm(change, axis=1, keepdims=True)
            # Travel to and from the pose goes off the scale: what counts is what the loads do.
            most = change[_during(time[inside], own)].max()
            axes.set_ylim(-0.05 * most, 1.15 * most)
        drawn = _thinned(time[inside], change)
        colours = (style.INK,) if as_norm else (style.BLUE, style.VERMILLION, style.GREEN)
        for axis, colour in zip(drawn[1].T, colours, strict=True):
            axes.plot(drawn[0], axis, color=colour, linewidth=0.9)
        if not as_norm:
            axes.legend(["x", "y", "z"], loc="center right", fontsize=6.5, frameon=False)
        axes.set_ylabel(name)
        axes.set_xlim(*span)
        for each in own:
            colour = style.GREEN if each.load is None else style.ORANGE
            axes.axvspan(each.start, each.end, color=style.tint(colour), lw=0, zorder=0)
    for each in own:
        panels[1].text(
            0.5 * (each.start + each.end), 0.03, each.load or "unloaded", rotation=90,
            transform=panels[1].get_xaxis_transform(), fontsize=6, color=style.INK, ha="center",
            va="bottom", bbox={"facecolor": style.PAPER, "alpha": 0.6, "lw": 0, "pad": 0.6},
        )  # fmt: skip


def _during(time: FloatArray, plateaus: Sequence[Plateau]) -> BoolArray:
    """Return whether each time lies within one of some plateaus, shape (sample,)."""
    during = np.zeros(len(time), dtype=bool)
    for each in plateaus:
        during |= (time >= each.start) & (time <= each.end)
    return during


def _thinned(time: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return not more samples than can be seen, the extremes of each piece among them."""
    if len(time) <= _MOST:
        return time, values
    size = -(-len(time) // (_MOST // 2))
    starts = np.arange(0, len(time) - size + 1, size)
    pieces = values[starts[:, None] + np.arange(size)]
    ends = np.stack([pieces.min(axis=1), pieces.max(axis=1)], axis=1)
    return np.repeat(time[starts], 2), ends.reshape(-1, values.shape[1])
