"""What would improve the result, as far as the data of this run tell."""

from collections.abc import Iterator

from elastocal.report.document.again import Unseen
from elastocal.report.document.leading import leading
from elastocal.report.document.parts import Parts
from elastocal.wording import counted, mm, um

_LOUD = 0.3
"""Part of the mean error from which on the noise of a reading is worth less of it."""


def advised(parts: Parts) -> Iterator[str]:
    """Yield advice that no single section can give, a sentence or two each.

    Parameters
    ----------
    parts : Parts
        Whatever is there.
    """
    unseen = parts.again.unseen if parts.again is not None and parts.again.same else None
    if unseen is None:
        return
    yield from _noise(parts, unseen)
    yield from _largest(unseen)
    yield from _spare_poses(parts)


def _noise(parts: Parts, unseen: Unseen) -> Iterator[str]:
    """Tell how much of the error the tracker explains."""
    if parts.summary is None:
        return
    sigma = parts.summary["noise"]["marker_sigma_median"]
    scatter = parts.summary["registration"]["scatter"]
    known = [value for value in (sigma, scatter) if value is not None]
    if not known:
        return
    told = f"its readings scatter by {um(max(known))}, the errors are {um(unseen.mean.value)}"
    if max(known) > _LOUD * unseen.mean.value:
        yield f"Average longer or bring the tracker nearer: {told} on average."
    else:
        yield (
            f"A quieter tracker would not help much: {told} on average. Most of the error is what"
            " springs cannot express, such as play, friction in the gears and links that bend."
        )


def _largest(unseen: Unseen) -> Iterator[str]:
    """Name the pose at which the model errs most when it stands out."""
    k = int(unseen.error.argmax())
    if unseen.max > 2.0 * unseen.mean.value:
        yield (
            f"Look at pose {unseen.pose[k]} {unseen.load_case[k]} first, contact, stand and line of"
            f" sight: it has the largest error, {mm(unseen.max)}."
        )


def _spare_poses(parts: Parts) -> Iterator[str]:
    """Tell how many poses would have been enough."""
    best = leading(parts)
    if best is None:
        return
    measured = len(parts.codecs[0].data.contact)
    if best.settled and best.high is not None and best.high < measured:
        yield (
            f"{counted(best.high, 'pose')} would have done here in place of {measured}: the error"
            " no longer falls from there on. A next robot of this kind may do with about as many;"
            " its own codec tells."
        )
