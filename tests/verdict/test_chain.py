"""From the streams to the verdict: whatever is edited, damaged or taken away costs the green."""

import hashlib
import json
import re
from dataclasses import replace
from types import SimpleNamespace

import pytest

from elastocal import dataset
from elastocal.codec import read_codec, write_codec
from elastocal.errors import ElastocalError
from elastocal.procedure import file_sha256
from elastocal.records import read_arrays, write_arrays
from elastocal.report import language_of
from elastocal.verdict import EvidenceOptions, Light, LinkState, find_everything, gather_evidence
from elastocal.verdict._files import read_hash
from elastocal.verdict.chain import changed_text
from elastocal.verdict.evidence import Seal
from elastocal.verdict.findings import codec_findings, missing_findings, reading_findings
from elastocal.verdict.judgement import judge
from support import sealed
from support.by_day import some_by_day
from support.cli import elastocal
from support.reported import MADE


def gathered(folder):
    return gather_evidence(EvidenceOptions(folder), MADE)


def judged(evidence):
    """Return the verdict but for the codec, which at seven poses has not saturated."""
    saturation = list(codec_findings(evidence))[-1:] if evidence.saturation else []
    return judge(evidence, [each for each in find_everything(evidence) if each not in saturation])


def edit(path, change):
    """Change a JSON file in place, as by hand: its hash stays what it was."""
    record = json.loads(path.read_text())
    change(record)
    path.write_text(json.dumps(record))


def scale_residuals(folder):
    path = folder / "run" / "dataset.nc"
    data = dataset.read(path).to_xarray().copy(deep=True)
    controller = data["controller_displacement"].values
    residual = data["marker_displacement"].values - controller
    data["marker_displacement"] = data["marker_displacement"].copy(data=controller + 0.2 * residual)
    dataset.write(dataset.Dataset.from_xarray(data), path)


def flip_a_byte_of_a_stream(folder):
    path = sorted((folder / "run" / "streams").iterdir())[2]
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)


def edit_a_line_of_the_journal(folder):
    path = folder / "run" / "journal.jsonl"
    lines = path.read_text().splitlines(keepends=True)
    record = json.loads(lines[-1])
    lines[-1] = json.dumps(record | {"time": record["time"] + 1.0}) + "\n"
    path.write_text("".join(lines))


def raise_the_tolerance(folder):
    path = folder / "run" / "cell" / "cell.yaml"
    path.write_text(path.read_text().replace('tolerance: "0.3 mm"', 'tolerance: "3 mm"'))


def drop_the_warnings(folder):
    sealed.edit(folder / "run" / "summary.json", lambda record: record.update(warnings=["none"]))


def edit_a_compliance(folder):
    edit(folder / "model.json", lambda record: record["compliance"].__setitem__(0, 1e-9))


def cut_the_table(folder):
    path = folder / "process" / "table.json"
    path.write_bytes(path.read_bytes()[:500])


def edit_the_settings_of_the_process(folder):
    edit(folder / "process" / "table.json", lambda record: record["settings"].update(gain=0.5))


def take_the_hash_out_of_the_table(folder):
    edit(folder / "process" / "table.json", lambda record: record.pop("content_sha256"))


def swap_the_codec(folder):
    data = read_codec(folder / "codec")
    write_codec(folder / "codec", replace(data, made_from={"other.nc": "0" * 64}))


def only_other_springs(folder):
    """Leave a codec that is sound, of springs that are not those of the calibration."""
    data = read_codec(folder / "codec")
    others = replace(data.variants[0], springs="tensor"), replace(data.variants[1], springs="file")
    write_codec(folder / "codec", replace(data, variants=others))


def edit_the_verdicts_of_the_codec(folder):
    edit(folder / "codec" / "codec.json", lambda record: record.update(sentences=["enough"]))


def remove(*names):
    def removing(folder):
        for name in names:
            path = folder / name
            for inner in sorted(path.rglob("*"), reverse=True) if path.is_dir() else ():
                inner.unlink()
            path.rmdir() if path.is_dir() else path.unlink()

    return removing


BROKEN = {
    "all streams are gone": (remove("run/streams"), "^cannot read .*pose_0000_1.mcap"),
    "a line of the journal": (edit_a_line_of_the_journal, "line \\d+ was changed after it was"),
    "the tolerance": (raise_the_tolerance, "cell/cell.yaml was changed after the run began"),
    "the run's warnings": (drop_the_warnings, "summary of the run is not .*: warnings differs"),
    "half a table": (cut_the_table, "the simulated process cannot be used: process/table.json"),
    "a setting in the table": (edit_the_settings_of_the_process, "process/table.json was changed"),
    "the table's hash": (take_the_hash_out_of_the_table, "table.json does not state the SHA-256"),
    "no process": (remove("process"), "the simulated process is missing"),
    "no tool": (remove("tool.json"), "run with a tool file that is not here"),
    "another codec": (swap_the_codec, "codec was made from another dataset .other.nc."),
    "a verdict of the codec": (edit_the_verdicts_of_the_codec, "codec/codec.json was changed"),
    "no verdicts of the codec": (remove("codec/codec.json"), "codec/codec.json is gone"),
    "a codec of other springs": (only_other_springs, "no codec has the springs and the loads"),
    "no codec": (remove("codec"), "whether there were enough poses was not verified"),
    "scaled residuals": (scale_residuals, "dataset is not what the streams give: marker_disp"),
    "a byte of a stream": (flip_a_byte_of_a_stream, "pose_0002_1.mcap is not what the run wrote"),
    "a stream is gone": (remove("run/streams/pose_0001_1.mcap"), "cannot read .*pose_0001_1.mcap"),
}


def test_a_whole_chain_is_green(parts):
    assert {link.state for link in parts.chain} == {LinkState.WHOLE, LinkState.UNSIGNED}
    assert [link.name for link in parts.chain] == [
        *("signature", "cell and plan", "streams", "journal", "dataset", "summary"),
        *("model", "codec", "process", "history"),
    ]
    assert judged(parts).light is Light.GREEN


@pytest.mark.parametrize("name", some_by_day(BROKEN, 6))
def test_what_is_broken_is_named_and_costs_the_green(copied, name):
    folder = copied()
    damage, told = BROKEN[name]
    damage(folder)
    verdict = judged(gathered(folder))
    assert verdict.light is Light.YELLOW
    reasons = [reason for reason in verdict.reasons if re.search(told, reason)]
    assert len(reasons) == 1, verdict.reasons
    assert str(folder) not in reasons[0]


@pytest.mark.slow
def test_an_edited_model_is_not_read_and_nothing_is_judged(copied):
    folder = copied()
    edit_a_compliance(folder)
    evidence = gathered(folder)
    verdict = judged(evidence)
    assert verdict.light is None
    assert evidence.calibrated is None
    (reason,) = (each for each in verdict.reasons if "model.json was changed after it was" in each)
    assert str(folder) not in reason


def strip(folder):
    """Make every file one of before hashes were stated."""
    edit(
        folder / "run" / "summary.json",
        lambda record: (record.pop("content_sha256"), record.pop("dataset_sha256")),
    )
    path = folder / "run" / "dataset.nc"
    data = dataset.read(path)
    attributes = {name: text for name, text in data.attributes.items() if name != "made_from"}
    dataset.write(replace(data, attributes=attributes), path)
    for name in ("model.json", "tool.json", "process/table.json", "codec/codec.json"):
        edit(
            folder / name, lambda record: (record.pop("content_sha256"), record.pop("made_from", 0))
        )
    arrays = read_arrays(folder / "codec" / "codec.nc")
    for name in ("content_sha256", "made_from"):
        del arrays.attributes[name]
    write_arrays(folder / "codec" / "codec.nc", arrays)


def test_a_run_of_before_keeps_its_light_and_is_called_not_verifiable(copied):
    folder = copied()
    strip(folder)
    table = folder / "process" / "table.json"
    sha = hashlib.sha256
    hashes = {
        f"{kind}_sha256": sha((folder / f"{kind}.json").read_bytes()).hexdigest()
        for kind in ("model", "tool")
    }
    edit(table, lambda record: record["runs"][0].update(hashes))
    evidence = gathered(folder)
    verdict = judged(evidence)
    assert verdict.light is Light.GREEN
    (note,) = (text for text in verdict.notes if "not verifiable" in text)
    assert "content, journal, model, codec" in note
    assert any("made before files stated it" in link.text for link in evidence.chain)
    # Readings are made again from the streams, however old the dataset is.
    scale_residuals(folder)
    assert judged(gathered(folder)).light is not Light.GREEN


@pytest.mark.slow
@pytest.mark.parametrize("code", ["de", "fr"])
def test_every_link_is_said_in_other_languages(finished, code):
    chain = gathered(finished).chain
    assert len(chain) > 5
    for link in chain:
        assert 'lang="en"' not in str(language_of(code).markup(link.text)), link.text


def test_a_dataset_derived_with_a_tool_file_needs_that_file(copied):
    folder = copied()
    run, data = folder / "run", folder / "run" / "dataset.nc"
    assert elastocal("derive", run, "--tool", folder / "tool.json").code == 0
    assert set(dataset.read_made_from(dataset.read(data).attributes)) == {
        *("journal.jsonl", "tool.json"),
    }
    states = {link.name: link.state for link in gathered(folder).chain}
    assert states["dataset"] is states["summary"] is LinkState.WHOLE
    assert states["model"] is LinkState.BROKEN
    edit(folder / "tool.json", lambda record: record.update(source="elsewhere"))
    (link,) = (link for link in gathered(folder).chain if link.name == "dataset")
    assert "derived with tool.json, which is not here as it was then" in link.text


def test_a_model_of_a_csv_twin_is_of_the_same_dataset(finished, tmp_path):
    data = dataset.read(finished / "run" / "dataset.nc")
    dataset.write(data, tmp_path / "twin.csv")
    assert dataset.content_sha256(dataset.read(tmp_path / "twin.csv")) == dataset.content_sha256(
        data
    )


def test_to_take_the_dataset_away_does_not_lift_a_red_light(parts):
    far = replace(parts, reproduction=None, limits=replace(parts.limits, tolerance=1e-6))
    verdict = judge(far, ())
    assert verdict.light is Light.RED
    assert "states errors of up to" in verdict.reasons[0]


def test_every_damaged_part_holds_back(parts):
    for each in parts.missing:
        damaged = replace(parts, missing=(replace(each, name="pool", damaged=True),))
        assert any(found.holds_back for found in missing_findings(damaged))
    assert not any(found.holds_back for found in reading_findings(parts))


@pytest.mark.parametrize(
    ("text", "seal"),
    [
        ("{}", Seal.NONE),
        ("[1]", Seal.NONE),
        ("{", Seal.BROKEN),
        ('{"schema": "elastocal.tool/1"}', Seal.ABSENT),
        ('{"schema": "elastocal.tool/1", "content_sha256": 1}', Seal.BROKEN),
    ],
)
def test_a_seal_is_read_of_whatever_there_is(tmp_path, text, seal):
    path = tmp_path / "a.json"
    path.write_text(text)
    assert read_hash(path)[2] is seal


def test_a_bad_statement_in_a_dataset_is_refused(finished):
    data = dataset.read(finished / "run" / "dataset.nc")
    for text in ("{", "[]", '{"a": 1}'):
        with pytest.raises(ElastocalError, match=r"made_from.*it must be SHA-256s"):
            replace(data, attributes={**data.attributes, "made_from": text})


@pytest.mark.slow
def test_a_difference_below_rounding_is_none(copied):
    folder = copied()
    path = folder / "run" / "dataset.nc"
    data = dataset.read(path).to_xarray().copy(deep=True)
    data["marker_displacement"] = data["marker_displacement"] * (1.0 + 1e-9)
    x, y, z = (float(each.removesuffix(" m")) for each in data.attrs["marker"].split(", "))
    data.attrs["marker"] = f"{x * (1.0 + 1e-12)!r} m, {y!r} m, {z!r} m"
    dataset.write(dataset.Dataset.from_xarray(data), path)
    # As a machine that rounds otherwise derives it.
    summary = folder / "run" / "summary.json"
    sealed.edit(summary, lambda record: record.update(dataset_sha256=file_sha256(path)))
    links = {link.name: link.state for link in gathered(folder).chain}
    assert links["dataset"] is LinkState.WHOLE
    data.attrs["marker"] = f"{x + 1e-4!r} m, {y!r} m, {z!r} m"
    dataset.write(dataset.Dataset.from_xarray(data), path)
    texts = [link.text for link in gathered(folder).chain]
    assert any("its attribute marker is another" in text for text in texts)
    # What is not fitted is the same to the letter.
    urdf = re.sub(r"\d\.\d+", lambda found: f"{found[0]}1", data.attrs["robot_urdf"], count=1)
    assert urdf != data.attrs["robot_urdf"]
    data.attrs |= {"marker": f"{x!r} m, {y!r} m, {z!r} m", "robot_urdf": urdf}
    dataset.write(dataset.Dataset.from_xarray(data), path)
    texts = [link.text for link in gathered(folder).chain]
    assert any("its attribute robot_urdf is another" in text for text in texts)


@pytest.mark.parametrize(
    ("name", "again", "differs"),
    [
        ("marker", f"{0.1 * (1.0 + 1e-12)!r} m, 0.2 m, 0.3 m", False),
        ("marker", "0.1001 m, 0.2 m, 0.3 m", True),
        ("marker", "0.1 m, 0.2 m", True),
        ("marker", None, True),
        # What is not fitted is the same to the letter.
        ("robot_urdf", "<robot>1.00000000000001</robot>", True),
    ],
)
def test_a_text_differs_but_for_the_rounding_of_what_is_fitted(name, again, differs):
    known = {"marker": "0.1 m, 0.2 m, 0.3 m", "robot_urdf": "<robot>1.0</robot>"}
    stated, found = (
        SimpleNamespace(attributes=each, doubts=()) for each in (known, known | {name: again})
    )
    said = changed_text(stated, found)
    assert said == (f"its attribute {name} is another" if differs else "")


def shift_readings(folder, part, kind="sound"):
    """Move each marker displacement by a part of its noise, and renew every hash."""
    path = folder / "run" / "dataset.nc"
    data = dataset.read(path).to_xarray().copy(deep=True)
    moved, sigma = data["marker_displacement"], data["marker_sigma"]
    data["marker_displacement"] = moved + part * sigma
    if kind == "louder":
        data["marker_sigma"] = 100.0 * sigma
    dataset.write(dataset.Dataset.from_xarray(data), path)
    summary = folder / "run" / "summary.json"
    sealed.edit(summary, lambda record: record.update(dataset_sha256=file_sha256(path)))


@pytest.mark.slow
def test_what_another_version_derived_is_not_called_changed(copied):
    folder = copied()
    shift_readings(folder, 0.15)
    (link,) = [each for each in gathered(folder).chain if each.name == "dataset"]
    assert link.state is LinkState.OTHERWISE
    assert "by up to 15% of the noise of a reading, 15% in the mean" in link.text
    # It is not proved, either: no light is green by it.
    held = [each for each in find_everything(gathered(folder)) if each.holds_back]
    assert any("derived by another version of elastocal: dataset" in str(each) for each in held)


@pytest.mark.slow
@pytest.mark.parametrize(("part", "kind"), [(0.3, "sound"), (0.15, "louder")])
def test_a_change_of_more_than_a_part_of_the_noise_is_broken_whoever_states_it(copied, part, kind):
    """Neither the version nor the noise that an edited file states makes room for it."""
    folder = copied()
    shift_readings(folder, part, kind)
    (link,) = [each for each in gathered(folder).chain if each.name == "dataset"]
    assert link.state is LinkState.BROKEN
    assert "the dataset is not what the streams give: marker_" in link.text
