"""The runs of a cell before and after a run, which reveal repetition until the light is green.

Earlier runs are in its journal, under its signature. Later ones are known only where the history
file is available.
"""

import contextlib
from collections.abc import Iterator

from elastocal.errors import ElastocalError
from elastocal.findings import Finding, Grade, Kind
from elastocal.procedure import RunFolder, RunRecord
from elastocal.procedure.record import HISTORY, EarlierRun, copies_sha256, note_run, read_history
from elastocal.verdict.chain import Link, LinkState
from elastocal.verdict.evidence import Evidence
from elastocal.verdict.manifest import read_manifest
from elastocal.wording import Phrase, phrase

_SHOWN = 16
"""Number of digits of a run's hash that people compare."""
_NO_REPORT = phrase("no report")
_LIGHTS = {
    "green": phrase("green light"),
    "yellow": phrase("yellow light"),
    "red": phrase("red light"),
}


def begin_record(record: RunRecord, run: RunFolder, cell: str) -> RunRecord:
    """Return the record of a run that begins, with its files and the runs before it.

    The run is added to the history; it counts there although it should fail to begin.

    Parameters
    ----------
    record : RunRecord
        What else it states.
    run : RunFolder
        Its folder, with cell and plan in it.
    cell : str
        Name of the cell.
    """
    place = run.path.absolute().parent
    lights = {}
    for page in sorted(place.glob("*.html")):
        with contextlib.suppress(ElastocalError):
            shown = read_manifest(page).manifest
            lights[shown.run] = shown.light
    earlier = tuple(
        EarlierRun(
            run=each.run,
            started=each.started,
            same_plan=each.plan == record.plan,
            light=lights.get(each.run),
        )
        for each in read_history(place, cell)
    )
    found = {"run_number": len(earlier) + 1, "earlier_runs": earlier}
    began = record.model_copy(update={"files_sha256": copies_sha256(run)} | found)
    note_run(place, cell, began)
    return began


def history_link(record: RunRecord, run: RunFolder, cell: str) -> Link | None:
    """Return the number of a run among those of its cell, checked against the history beside it.

    Parameters
    ----------
    record : RunRecord
        What it stated when it began.
    run : RunFolder
        Its folder.
    cell : str
        Name of the cell.
    """
    if record.run_number is None:
        return None
    known = [each.run for each in read_history(run.path.absolute().parent, cell)]
    own, number = record.identity[:_SHOWN], record.run_number
    if record.identity not in known:
        text = phrase(
            "run {run}, number {number} of its cell; no {history} that names it lies beside it, so"
            " later runs would not be seen",
            run=own,
            number=number,
            history=HISTORY,
        )
        return Link("history", LinkState.WHOLE, text)
    lost = [each.run for each in record.earlier_runs if each.run not in known]
    if lost:
        text = phrase(
            "{history} was cut: it does not name run {run}, which was before this",
            history=HISTORY,
            run=lost[0][:_SHOWN],
        )
        return Link("history", LinkState.BROKEN, text)
    later = known[known.index(record.identity) + 1 :]
    text = phrase(
        "run {run}, number {number} of its cell; {history} names {later} after it, the last of"
        " them {last}"
        if later
        else "run {run}, number {number} of its cell; {history} names none after it",
        run=own,
        number=number,
        history=HISTORY,
        later=len(later),
        last=later[-1][:_SHOWN] if later else "",
    )
    return Link("history", LinkState.WHOLE, text)


EARLIER_RUNS = Kind(
    "verdict.earlier-runs",
    "this is run {number} of its cell; before it: {earlier}",
    grade=Grade.NOTE,
)


def history_findings(evidence: Evidence) -> Iterator[Finding]:
    """Yield that a cell was measured before, and what came of it."""
    record = evidence.run_record
    if record is not None and record.earlier_runs:
        yield EARLIER_RUNS(number=record.run_number, earlier=_listed(record.earlier_runs))


def _listed(earlier: tuple[EarlierRun, ...]) -> Phrase:
    """Return dates and lights as one phrase."""
    said = _said(earlier[0])
    for each in earlier[1:]:
        said = phrase("{one}, {other}", one=said, other=_said(each))
    return said


def _said(run: EarlierRun) -> Phrase:
    light = _LIGHTS.get(run.light or "", _NO_REPORT)
    if run.same_plan:
        return phrase("{date} ({light})", date=run.started[:10], light=light)
    return phrase("{date} by another plan ({light})", date=run.started[:10], light=light)
