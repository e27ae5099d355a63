"""The chain from the raw streams to the verdict, each link checked against the one before it.

Streams, cell and plan are checked against the hashes of the journal. Dataset and summary are
derived again from the streams, an imported dataset from its logs, and differences are named, since
an editor of the files could renew a hash beside them. Model, codec and process state the hashes of
their inputs, and of their own content.
"""

import re
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path

import numpy as np

from elastocal.cell import SENSOR_CORRECTED, SensorLoad
from elastocal.compensation.conditioning import read_sensor_load
from elastocal.dataset import DOUBTS, Dataset, content_sha256, read_made_from
from elastocal.errors import ElastocalError, SchemaError, present
from elastocal.files import read_text, sha256
from elastocal.findings import Kind, group_alike
from elastocal.logs import import_streams, log_sha256, read_map, site
from elastocal.procedure import (
    JOURNAL,
    RunFolder,
    RunRecord,
    RunSummary,
    derive_run,
    file_sha256,
    read_copies,
)
from elastocal.procedure.record import check_stream
from elastocal.progress import silent
from elastocal.records import read_json_data, record, require_written, to_data
from elastocal.verdict.evidence import Evidence, Seal
from elastocal.verdict.signing import OF_RUN, check_signature, read_signature
from elastocal.wording import counted, phrase

_SAME = 1e-4
"""Difference, by the largest number of its kind, below which two derivations are one: versions and
machines round differently, and what is smaller changes no verdict."""
_SAME_PLACE = 1e-6
"""The same for the position of the marker, which is stored as a text."""
_PART_OF_NOISE, _MOST_OF_NOISE = 0.2, 1.0
"""Differences from readings derived again, over the noise of each, which the derivation of another
version makes: root mean square, and largest. By them no error norm changes by more than the first,
whatever the differences are made for: an editor of a dataset gains no more
(docs/explanation/threats.md)."""
_NOISE_OF = {
    "force": "force_sigma",
    "force_sigma": "force_sigma",
    "marker_displacement": "marker_sigma",
    "controller_displacement": "marker_sigma",
    "marker_sigma": "marker_sigma",
}
"""Variable with the noise of each variable that is judged by it. It is that derived again, since
what the dataset states may have been edited."""
_SAME_MARKER = 1e-4
"""Distance in m by which places of the marker in two such derivations differ at most: with a tool
that turns by 1 mrad they move a displacement by 0.1 µm."""
_LATER = ("marker_position",)
"""Attributes that only datasets with hashes have."""
_FRACTION = re.compile(r"[-+]?\d+\.\d+(?:e[-+]?\d+)?")


def changed_text(stated: Dataset, found: Dataset, marker_apart: float = 0.0) -> str:
    """Return the first text of a dataset that differs from the derived one; empty if none does.

    ``marker_apart`` is the distance in m by which the place of the marker may differ.
    """
    attributes = ("robot_name", "robot_urdf", "tcp_frame", "marker", "gravity", "history", "check")
    for name in attributes:
        mine, again = stated.attributes.get(name), found.attributes.get(name)
        # The marker's place alone is fitted; what is copied comes back to the letter.
        if mine != again and not (name == "marker" and _is_same_text(mine, again, marker_apart)):
            return phrase("its attribute {name} is another", name=name)
    # Sentences change from version to version; that nothing is suspected any more does not.
    if found.doubts and not stated.doubts:
        return phrase("its attribute {name} is another", name=DOUBTS)
    return ""


def _is_same_text(stated: object, found: object, apart: float) -> bool:
    """Return whether two texts are the same but for the rounding of the fractions in them."""
    if not (isinstance(stated, str) and isinstance(found, str)):
        return False
    a, b = (np.array(_FRACTION.findall(text), dtype=float) for text in (stated, found))
    return (
        _FRACTION.sub("", stated) == _FRACTION.sub("", found)
        and a.shape == b.shape
        and bool(np.all(np.abs(a - b) <= max(apart, _SAME_PLACE * np.max(np.abs(b), initial=0.0))))
    )


@dataclass(frozen=True)
class PartOfNoise:
    """Differences of readings from those derived again, over the noise of each."""

    typical: float
    """Largest root mean square of a variable."""
    most: float

    @property
    def is_of_a_version(self) -> bool:
        """Whether the derivation of another version may make them."""
        return self.typical <= _PART_OF_NOISE and self.most <= _MOST_OF_NOISE


def part_of_noise(stated: Dataset, found: Dataset) -> PartOfNoise:
    """Return by how much of their noise readings differ from those derived again.

    Infinite where a noise is not known, or the readings are others.

    Parameters
    ----------
    stated, found : Dataset
        As in the file, and derived again.
    """
    typical = most = 0.0
    for name, noise in _NOISE_OF.items():
        a, b, sigma = stated.arrays.get(name), found.arrays.get(name), found.arrays.get(noise)
        if a is None and b is None:
            continue
        if a is None or b is None or sigma is None or a.shape != b.shape:
            return PartOfNoise(np.inf, np.inf)
        gap = _gap(a, b)
        parts = np.divide(gap, sigma, out=np.where(gap > 0.0, np.inf, 0.0), where=sigma > 0.0)
        typical = max(typical, float(np.sqrt(np.mean(np.square(parts)))))
        most = max(most, float(parts.max()))
    return PartOfNoise(typical, most)


def changed_reading(
    stated: Dataset, found: Dataset, old: bool, source: str, apart_from: Collection[str] = ()
) -> str:
    """Return how readings differ from those derived again; empty if they do not.

    Parameters
    ----------
    stated, found : Dataset
        As in the file, and derived again.
    old : bool
        Variables that an older dataset lacks are no difference.
    source : str
        Source of the derivation: streams, logs.
    apart_from : collection of str
        Variables that are judged elsewhere (`part_of_noise`).
    """
    if content_sha256(stated) == content_sha256(found):
        return ""
    for name in ("poses", "load_cases", "joint_names", "joint_units", "campaigns"):
        if getattr(stated, name) != getattr(found, name):
            return phrase("its {what} are others", what=name.replace("_", " "))
    mine, again = stated.to_labelled(), found.to_labelled()
    for name, array in again.variables.items():
        if array.values.dtype.kind not in "iuf" or (name not in mine and (old or name in _LATER)):
            continue
        if name in apart_from:
            continue
        if name not in mine:
            return phrase("it has no {name}", name=name)
        unit = str(array.attributes.get("units", ""))
        if text := _largest_difference(stated, mine[name].values, array.values, unit, source):
            return phrase("{name} {difference}", name=name, difference=text)
    added = sorted(mine.variables.keys() - again.variables.keys())
    if not added:
        return ""
    return phrase("it has {name}, which the {source} do not give", name=added[0], source=source)


def _largest_difference(
    dataset: Dataset, stated: np.ndarray, found: np.ndarray, unit: str, source: str
) -> str:
    """Return the place where two arrays differ most, with both numbers; empty where they agree."""
    a, b = np.asarray(stated, dtype=float), np.asarray(found, dtype=float)
    size = float(np.nanmax(np.abs(b), initial=0.0))
    gap = _gap(a, b)
    if not np.any(gap > _SAME * size):
        return ""
    place = np.unravel_index(int(np.argmax(gap)), gap.shape)
    pose = dataset.poses[place[0]] if place else ""
    case = f" {dataset.load_cases[place[1]]}" if dataset.status.shape == gap.shape[:2] else ""
    return phrase(
        "of pose {pose}{case} is {stated} {unit}, the {source} give {found} {unit}"
        if place
        else "is {stated} {unit}, the {source} give {found} {unit}",
        pose=pose,
        case=case,
        stated=f"{a[place]:.6g}",
        found=f"{b[place]:.6g}",
        unit=unit,
        source=source,
    )


def _gap(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the distance of each pair of numbers: 0 between two NaN, infinite to one of them."""
    gap = np.where(np.isnan(a) & np.isnan(b), 0.0, np.abs(a - b))
    return np.where(np.isnan(gap), np.inf, gap)


def changed_place(
    stated: object, found: object, place: str = "", close: float = 10.0 * _SAME
) -> str:
    """Return the path of the first entry in which two JSON-ready records differ.

    ``close`` is the part of a number by which it may: by default a thousandth, since standard
    deviations of what is hardly determined round most.
    """
    if isinstance(stated, dict) and isinstance(found, dict) and stated.keys() == found.keys():
        inner = [(f"{place}.{key}".lstrip("."), stated[key], found[key]) for key in stated]
        # Which version derived it is no finding.
        pairs = [each for each in inner if each[0] != "elastocal"]
    elif isinstance(stated, list) and isinstance(found, list) and len(stated) == len(found):
        pairs = [(f"{place}.{n}", a, b) for n, (a, b) in enumerate(zip(stated, found, strict=True))]
    else:
        return "" if stated == found or _is_close(stated, found, close) else place
    return next((text for key, a, b in pairs if (text := changed_place(a, b, key, close))), "")


def _is_close(a: object, b: object, close: float) -> bool:
    if not (isinstance(a, int | float) and isinstance(b, int | float)):
        return False
    return abs(a - b) <= max(close * abs(b), 1e-12)


CHANGED_RECORDING = Kind("verdict.changed-recording", "{reason}")
_OLD = phrase("made before files stated it")


class LinkState(Enum):
    """Result of a link."""

    WHOLE = "whole"
    BROKEN = "broken"
    """It prevents the green light."""
    UNSTATED = "not verifiable"
    """Nothing contradicts it, and nothing proves it: files older than hashes."""
    OTHERWISE = "derived by another version"
    """It differs from what this version derives by less than the noise; it prevents the green light
    until it is derived again."""
    UNSIGNED = "not signed"
    """Nobody has signed it; an editor of a file can renew hashes."""


@record()
class Link:
    """A file, or a kind of files, checked against its inputs."""

    name: str
    state: LinkState
    text: str
    """A sentence without its full stop."""


@dataclass(frozen=True)
class ChainFiles:
    """Paths of the parts that are derived again."""

    run: RunFolder | None
    tool: Path | None
    """The tool file that a dataset may have been derived with."""
    plain: Callable[[ElastocalError], str]
    """Returns a reason without the folder that the run happens to lie in."""
    signer: str | None = None
    """Public key that must have signed the run; None: the one that its journal states."""


def verify_chain(evidence: Evidence, files: ChainFiles) -> tuple[Link, ...]:
    """Return every link that the parts at hand have, from the streams to the process.

    Parameters
    ----------
    evidence : Evidence
        All parts.
    files : ChainFiles
        Where they lie.
    """
    links = [*_seals(evidence)]
    if files.run is not None and evidence.run_record is not None:
        links += [_signed(files.run, evidence.run_record, files), *_recorded(evidence, files)]
        broken = {link.text for link in links}
        links += _derived(evidence, files, broken)
    if evidence.logs:
        logged = _logged(evidence)
        links += [logged]
        links += [] if logged.state is LinkState.BROKEN else _derived(evidence, files, ())
    if evidence.dataset is not None:
        dataset = content_sha256(evidence.dataset)
        links += [*_campaigns(evidence, files)]
        links += [*_model(evidence, dataset), *_codecs(evidence, dataset)]
    return (*links, *_process(evidence))


def _whole(name: str, text: str) -> Link:
    return Link(name, LinkState.WHOLE, text)


def _broken(name: str, text: str) -> Link:
    return Link(name, LinkState.BROKEN, text)


def _made_from(evidence: Evidence) -> Mapping[str, str]:
    """Return the origins that the dataset states; none for one of an earlier version."""
    return {} if evidence.dataset is None else read_made_from(evidence.dataset.attributes)


def _is_old(evidence: Evidence) -> bool:
    """Return whether no part states a hash: then none was taken out, all are from before them."""
    stated = (
        _made_from(evidence),
        evidence.calibrated is not None and evidence.calibrated.made_from,
        *(codec.data.made_from for codec in evidence.codecs),
        *(file.seal in (Seal.WHOLE, Seal.BROKEN) for file in evidence.files),
    )
    return not any(stated)


def _unstated(evidence: Evidence, name: str, text: str) -> Link:
    """Return a link without a statement, which only files from before hashes may lack."""
    if _is_old(evidence):
        return Link(name, LinkState.UNSTATED, phrase("{text} ({reason})", text=text, reason=_OLD))
    return _broken(
        name, phrase("{text}, although other parts state theirs: make it again", text=text)
    )


def _seals(evidence: Evidence) -> Iterator[Link]:
    """Yield the files whose content is not the one that they state."""
    for file in evidence.files:
        if file.seal is Seal.BROKEN:
            yield _broken(
                file.name,
                phrase(
                    "{name} was changed after it was written: its checksum does not match its"
                    " content",
                    name=file.name,
                ),
            )
    if silent := [file.name for file in evidence.files if file.seal is Seal.ABSENT]:
        text = phrase(
            "{name} and {more} do not state the SHA-256 of their content"
            if silent[1:]
            else "{name} does not state the SHA-256 of its content",
            name=silent[0],
            more=counted(len(silent) - 1, "other file"),
        )
        yield _unstated(evidence, "content", text)


def _signed(run: RunFolder, record: RunRecord, files: ChainFiles) -> Link:
    """Return the link of the journal's signature; the journal names all that was recorded."""
    place, trusted = run.signature, files.signer or record.signer
    if not place.exists():
        if trusted is None:
            text = phrase(
                "the run is not signed: whoever edits its record can renew the hashes"
                " (run --sign KEY signs one while it is recorded)"
            )
            return Link("signature", LinkState.UNSIGNED, text)
        return _broken(
            "signature",
            phrase("the run should be signed, and there is no {name}", name=place.name),
        )
    try:
        found = read_signature(place)
        check_signature(found, OF_RUN, file_sha256(run.journal), trusted)
    except ElastocalError as error:
        return _broken("signature", files.plain(error))
    return _whole("signature", phrase("the journal is signed by key {key}", key=found.signer))


def _recorded(evidence: Evidence, files: ChainFiles) -> Iterator[Link]:
    """Yield cell, plan, streams and the journal itself."""
    run, record, entries = files.run, evidence.run_record, evidence.journal
    run = present(run, "run")
    record = present(record, "record")
    entries = present(entries, "entries")
    try:
        cell, _ = read_copies(run, record)
        # The fingerprint leaves out the tolerance, by which the light is given.
        if record.cell_sha256 not in (None, sha256(read_text(cell.path))):
            yield _broken("cell and plan", _after_the_start(f"cell/{record.cell_file}"))
        elif changed := _changed_copy(run, record):
            yield _broken("cell and plan", _after_the_start(changed))
        else:
            yield _whole("cell and plan", phrase("cell and plan are those that the run began with"))
    except ElastocalError as error:
        yield _broken("cell and plan", files.plain(error))
    known = {e.log.streams: e.streams_sha256 for e in entries if e.log is not None}
    wrong = []
    for name, stated_hash in known.items():
        try:
            check_stream(run.streams / name, stated_hash)
        except ElastocalError as error:
            wrong.append(CHANGED_RECORDING(reason=files.plain(error)))
    if wrong:
        yield from (_broken("streams", text) for text in group_alike(wrong))
    else:
        found = counted(len(known), "recording")
        text = phrase("{found}: those that the journal names, by their SHA-256", found=found)
        yield _whole("streams", text)
    stated = _made_from(evidence).get(JOURNAL)
    if evidence.dataset is None:
        return
    if stated is None:
        text = phrase("the dataset does not state which journal it was derived from")
        yield _unstated(evidence, "journal", text)
    elif stated == file_sha256(run.journal):
        yield _whole("journal", phrase("the journal is the one that the dataset was derived from"))
    else:
        yield _broken(
            "journal",
            phrase("{name} was changed after the dataset was derived from it", name=JOURNAL),
        )


def _after_the_start(name: str) -> str:
    return phrase("{name} was changed after the run began", name=name)


def _changed_copy(run: RunFolder, record: RunRecord) -> str:
    """Return a file of cell or plan that is not, byte by byte, the one that was copied."""
    known = record.files_sha256.items()
    return next((name for name, sha in known if file_sha256(run.path / name) != sha), "")


def _logged(evidence: Evidence) -> Link:
    """Return whether map and logs are those that an imported dataset was made from."""
    for path, (name, stated) in zip(evidence.logs, _made_from(evidence).items(), strict=True):
        if not path.exists():
            return _broken(
                "logs", phrase("{name}, which the dataset was made from, is not here", name=name)
            )
        if log_sha256(path) != stated:
            return _broken(
                "logs", phrase("{name} was changed after the dataset was made from it", name=name)
            )
    found = counted(len(evidence.logs) - 1, "log")
    return _whole(
        "logs",
        phrase(
            "{found} and their map: those that the dataset names, by their SHA-256", found=found
        ),
    )


def _derived(evidence: Evidence, files: ChainFiles, reported: Collection[str]) -> Iterator[Link]:
    """Yield dataset and summary, derived again; reasons in ``reported`` are not repeated."""
    dataset, summary = evidence.dataset, evidence.summary
    if dataset is None:
        return
    old, source = _is_old(evidence), phrase("logs" if evidence.logs else "streams")
    advice = _made_again("import" if evidence.logs else "derive")
    try:
        again, again_summary = _derive(evidence, dataset, files)
    except ElastocalError as error:
        text = phrase("the dataset cannot be made again from the {source}", source=source)
        reason = files.plain(error)
        above = Link("dataset", LinkState.UNSTATED, phrase("{text}, see above", text=text))
        yield above if reason in reported else _broken("dataset", _with_reason(text, reason))
        return
    text = phrase("the dataset is not what the {source} give", source=source)
    difference = changed_reading(dataset, again, old, source)
    version = _by_another_version(dataset, again, old, source) if difference else ""
    if difference and not version:
        yield _broken("dataset", _with_advice(_with_reason(text, difference), advice))
    elif difference := changed_text(dataset, again, _SAME_MARKER if version else 0.0):
        yield _unlike(old, "dataset", _with_reason(text, difference), advice)
    elif version:
        text = phrase("the dataset {difference}", difference=version)
        yield Link("dataset", LinkState.OTHERWISE, _with_advice(text, advice))
    else:
        text = phrase("the dataset is what the {source} give, made again from them", source=source)
        yield _whole("dataset", text)
    if summary is None:
        return
    if again_summary is not None:
        again_summary = replace(again_summary, dataset_sha256=summary.dataset_sha256)
    yield _summarised(summary, again_summary, version != "", old, advice)
    if files.run is not None and summary.dataset_sha256:
        yield from _rewritten(files.run, summary)


def _summarised(
    stated: RunSummary, found: RunSummary | None, by_version: bool, old: bool, advice: str
) -> Link:
    """Return whether the summary is the one made again; of another version, by as much as it is."""
    mine, again = to_data(stated), to_data(found)
    if not (place := changed_place(mine, again)):
        return _whole("summary", phrase("the summary of the run is what the streams give"))
    text = phrase(
        "the summary of the run is not what the streams give: {place} differs", place=place
    )
    if by_version and not changed_place(mine, again, close=_PART_OF_NOISE):
        return Link("summary", LinkState.OTHERWISE, _with_advice(text, advice))
    return _unlike(old, "summary", text, advice)


def _by_another_version(stated: Dataset, found: Dataset, old: bool, source: str) -> str:
    """Return how readings differ that another version may have derived; empty: they were changed.

    What version a file states is no evidence, so that the differences alone are judged.
    """
    part = part_of_noise(stated, found)
    if not part.is_of_a_version or changed_reading(stated, found, old, source, _NOISE_OF):
        return ""
    return phrase(
        "differs from what this version of elastocal derives from the {source} by up to {most} of"
        " the noise of a reading, {typical} in the mean: another version may have derived it",
        source=source,
        most=f"{part.most:.0%}",
        typical=f"{part.typical:.0%}",
    )


def _campaigns(evidence: Evidence, files: ChainFiles) -> Iterator[Link]:
    """Yield whether each further campaign is what the streams of its own run give."""
    for each in evidence.campaigns:
        run = RunFolder(each.path.parent)
        name = phrase("campaign {name}", name=each.path.parent.name)
        if run.dataset.name != each.path.name or not run.journal.is_file():
            text = _with_reason(name, phrase("its dataset lies in no folder of a run"))
            yield Link("dataset", LinkState.UNSTATED, text)
            continue
        try:
            again = derive_run(run.path, _sensor(evidence, each.dataset, files)).dataset
        except ElastocalError as error:
            text = phrase("its dataset cannot be made again from the streams")
            reason = _with_reason(text, files.plain(error))
            yield _broken("dataset", _with_reason(name, reason))
            continue
        source = phrase("streams")
        if difference := changed_reading(each.dataset, again, False, source):
            version = _by_another_version(each.dataset, again, False, source)
            reason = _with_reason(phrase("its dataset is not what the streams give"), difference)
            state = LinkState.OTHERWISE if version else LinkState.BROKEN
            text = phrase("its dataset {difference}", difference=version) if version else reason
            yield Link("dataset", state, _with_reason(name, text))
        else:
            text = phrase("its dataset is what its streams give")
            yield _whole("dataset", _with_reason(name, text))


def _rewritten(run: RunFolder, summary: RunSummary) -> Iterator[Link]:
    """Yield what was written again, or edited too little to say something else."""
    if file_sha256(run.dataset) != summary.dataset_sha256:
        text = phrase(
            "{name} was changed after it was derived: its SHA-256 is not the one in {summary}",
            name=run.dataset.name,
            summary=run.summary.name,
        )
        yield _broken("dataset", _with_advice(text, _made_again("derive")))
    try:
        require_written(run.summary, read_json_data(run.summary))
    except SchemaError:
        yield _broken(
            "summary", phrase("{name} was changed after it was derived", name=run.summary.name)
        )


def _unlike(old: bool, name: str, text: str, advice: str) -> Link:
    """Return the link of a difference beside the readings: earlier versions wrote other remarks."""
    if old:
        reason = phrase("made before files stated it, by another version")
        text = phrase("{text} ({reason})", text=text, reason=reason)
        return Link(name, LinkState.UNSTATED, _with_advice(text, advice))
    return _broken(name, _with_advice(text, advice))


def _made_again(command: str) -> str:
    return phrase("`elastocal {command}` makes it again", command=command)


def _with_reason(text: str, reason: str) -> str:
    return phrase("{text}: {reason}", text=text, reason=reason)


def _with_advice(text: str, advice: str) -> str:
    return phrase("{text}; {advice}", text=text, advice=advice)


def _derive(
    evidence: Evidence, dataset: Dataset, files: ChainFiles
) -> tuple[Dataset, RunSummary | None]:
    """Return dataset and summary, made again from the streams of a run or from logs."""
    if evidence.logs:
        path, *logs = evidence.logs
        log_map = read_map(path)
        return import_streams(log_map, site(path, log_map), logs, silent).dataset, None
    again = derive_run(present(files.run, "run").path, _sensor(evidence, dataset, files))
    return again.dataset, again.summary


def _sensor(evidence: Evidence, dataset: Dataset, files: ChainFiles) -> SensorLoad | None:
    """Return the tool that a dataset was derived with; None where it was derived without."""
    if SENSOR_CORRECTED not in dataset.provenance:
        return None
    stated = {name: sha for name, sha in _made_from(evidence).items() if name != JOURNAL}
    at_hand = None if files.tool is None else file_sha256(files.tool)
    if at_hand is None or (stated and at_hand not in stated.values()):
        name = next(iter(stated), "a tool file")
        raise SchemaError(f"it was derived with {name}, which is not here as it was then")
    return read_sensor_load(files.tool, present(evidence.cell, "cell").robot)


def _model(evidence: Evidence, dataset: str) -> Iterator[Link]:
    if evidence.calibrated is None:
        return
    stated = evidence.calibrated.made_from
    if evidence.merged is not None:
        yield _whole(
            "model", phrase("the model was made from these {number} datasets", number=len(stated))
        )
    elif len(stated) > 1 and dataset in stated.values():
        others = phrase(
            "the model was made from {number} datasets, of which only one is here",
            number=len(stated),
        )
        yield Link("model", LinkState.UNSTATED, others)
    else:
        yield _made_of(evidence, dataset, "model", _MODEL, stated)


_MODEL = phrase("the model")


def _codecs(evidence: Evidence, dataset: str) -> Iterator[Link]:
    for codec in evidence.codecs:
        yield _made_of(evidence, dataset, "codec", codec.name or "codec", codec.data.made_from)


def _made_of(
    evidence: Evidence, dataset: str, name: str, what: str, stated: Mapping[str, str]
) -> Link:
    """Return whether a part was made from the dataset of this hash."""
    if not stated:
        text = phrase("{what} does not state which dataset it is made from", what=what)
        return _unstated(evidence, name, text)
    if dataset not in stated.values():
        text = phrase(
            "{what} was made from another dataset ({others}) than this one",
            what=what,
            others=", ".join(stated),
        )
        return _broken(name, text)
    if _is_broken(evidence, what):
        text = phrase(
            "{what} names this dataset; its content is not confirmed, see above", what=what
        )
        return Link(name, LinkState.UNSTATED, text)
    return _whole(name, phrase("{what} was made from this dataset", what=what))


def _is_broken(evidence: Evidence, what: str) -> bool:
    """Return whether a file of a codec does not say what it said; a model is then not read."""
    return any(each.name.startswith(what) for each in evidence.files if each.seal is Seal.BROKEN)


def _process(evidence: Evidence) -> Iterator[Link]:
    if evidence.process is None or evidence.calibrated is None:
        return
    runs = evidence.process.table.runs
    own = [run for run in runs if run.model_sha256 == evidence.calibrated.sha256]
    tools = {run.tool_sha256 for run in own}
    if not own:
        text = phrase("the process was run with another model than the one of this report")
        yield _broken("process", text)
    elif tools - {None} and evidence.tool_sha256 is None:
        yield _broken("process", phrase("the process was run with a tool file that is not here"))
    elif evidence.tool_sha256 not in tools:
        text = phrase("the process was run with another tool file than the one of this report")
        yield _broken("process", text)
    else:
        yield _whole("process", phrase("the process was run with this model and this tool file"))
    record = evidence.run_record
    if own and evidence.simulated and record and record.seed not in {run.seed for run in own}:
        yield _broken(
            "process",
            phrase(
                "the process was run on the simulated cell of seed {process}, the run on that of"
                " seed {run}",
                process=own[0].seed,
                run=record.seed,
            ),
        )
