"""Whether the parts of a report come from one run.

A dataset of another run with the model made from it agrees with itself in every figure; only
what the files say of their origin tells that it is not the run whose journal is shown.
"""

from collections.abc import Iterator

from elastocal.procedure import commits
from elastocal.report.document.parts import Parts


def origin_doubts(parts: Parts) -> Iterator[str]:
    """Yield what says that a part is of another run than the others.

    Parameters
    ----------
    parts : Parts
        Whatever is there.
    """
    yield from _dataset(parts)
    yield from _summary(parts)
    yield from _codecs(parts)
    yield from _process(parts)


def _dataset(parts: Parts) -> Iterator[str]:
    if parts.dataset is None or not parts.journal:
        return
    record = parts.journal[0].run
    if record is not None and record.origin not in parts.dataset.provenance:
        yield "the dataset does not say that it is of the run that the journal tells of"
    unknown = sorted(set(parts.dataset.poses) - {log.pose for log in commits(parts.journal)})
    if unknown:
        yield f"the dataset has pose {unknown[0]}, of which the journal tells no measurement"


def _summary(parts: Parts) -> Iterator[str]:
    if parts.summary is None:
        return
    record = parts.journal[0].run if parts.journal else None
    if record is not None and parts.summary["times"]["started"] not in (None, record.started):
        yield "the summary is of a run that began at another time than the one of the journal"
    if parts.dataset is None:
        return
    usable = len(parts.dataset.readings(parts.dataset.joint_names))
    stated = parts.summary["readings"]["counts"].get("ok", 0)
    if usable != stated:
        yield (
            f"the dataset has {usable} usable readings, the summary of the run tells of {stated}:"
            " one of them was changed after the run"
        )


def _codecs(parts: Parts) -> Iterator[str]:
    origin = "" if parts.dataset is None else parts.dataset.provenance
    if not all(origin in codec.data.provenance for codec in parts.codecs):
        yield "a codec does not say that it is of the readings of this report"


def _process(parts: Parts) -> Iterator[str]:
    if parts.process is None or parts.calibrated is None:
        return
    runs = parts.process.table.runs
    own = [run for run in runs if run.model_sha256 == parts.calibrated.sha256]
    if not own:
        yield "the process was run with another model than the one of this report"
    elif parts.tool_sha256 and parts.tool_sha256 not in {run.tool_sha256 for run in own}:
        yield "the process was run with another tool file than the one of this report"
    record = parts.journal[0].run if parts.journal else None
    if own and parts.simulated and record and record.seed not in {run.seed for run in own}:
        yield (
            f"the process was run on the simulated cell of seed {own[0].seed}, the run on that of"
            f" seed {record.seed}"
        )
