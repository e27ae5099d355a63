"""What would improve the result, as far as the data of this run tell."""

from collections.abc import Iterator

from elastocal.report.document.again import Unseen
from elastocal.report.document.leading import leading
from elastocal.report.document.parts import Parts
from elastocal.report.document.section import Finding
from elastocal.report.document.words import counted, mm, um

_LOUD = 0.3
"""Part of the mean error from which on the noise of a reading is worth less of it."""


def advised(parts: Parts) -> Iterator[Finding]:
    """Yield advice that no single section can give; none of it holds a green light back.

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


def _noise(parts: Parts, unseen: Unseen) -> Iterator[Finding]:
    """Tell how much of the error the instruments explain."""
    if parts.summary is None:
        return
    sigma = parts.summary["noise"]["marker_sigma_median"]
    scatter = parts.summary["registration"]["scatter"]
    known = [value for value in (sigma, scatter) if value is not None]
    if not known:
        return
    worst, mean = max(known), unseen.mean.value
    if worst > _LOUD * mean:
        yield Finding(
            f"the tracker's readings scatter by {um(worst)}, the errors are {um(mean)} on average",
            holds_back=False,
            advice="Average longer or bring the tracker nearer: its scatter is a good part of the"
            " error.",
        )
    else:
        yield Finding(
            f"the tracker's readings scatter by {um(worst)}, little beside errors of {um(mean)} on"
            " average: most of the error is what springs cannot express, such as play, friction in"
            " the gears and links that bend",
            holds_back=False,
            advice="A quieter tracker would not help much: the rest of the error is what springs"
            " cannot express.",
        )


def _largest(unseen: Unseen) -> Iterator[Finding]:
    """Name the pose at which the model errs most when it stands out."""
    k = int(unseen.error.argmax())
    if unseen.max > 2.0 * unseen.mean.value:
        yield Finding(
            f"the largest error is at pose {unseen.pose[k]} {unseen.load_case[k]},"
            f" {mm(unseen.max)}",
            holds_back=False,
            advice=f"Look at pose {unseen.pose[k]} first: contact, stand and line of sight there.",
        )


def _spare_poses(parts: Parts) -> Iterator[Finding]:
    """Tell how many poses the next such robot needs."""
    best = leading(parts)
    if best is None:
        return
    measured = len(parts.codecs[0].data.contact)
    if best.settled and best.high is not None and best.high < measured:
        yield Finding(
            f"{counted(best.high, 'training pose')} would have been enough for this accuracy",
            holds_back=False,
            advice=f"The next robot of this kind needs {best.high} poses rather than {measured}:"
            " the codec has saturated by then.",
        )
