"""What the files hold that are made from measurements, as ``check`` says."""

from pathlib import Path

from elastocal.codec import (
    ARRAYS,
    ARRAYS_SCHEMA,
    VERDICTS,
    VERDICTS_SCHEMA,
    CodecData,
    read_codec,
    read_codec_folder,
    read_codec_summary,
)
from elastocal.codec.study import (
    DESIGN,
    DESIGN_SCHEMA,
    PART_SCHEMA,
    PARTS,
    STUDY_SCHEMA,
    StudyDesign,
    StudyStore,
    read_design,
    read_part,
    read_study,
)
from elastocal.compensation import read_settings
from elastocal.compensation.conditioning import read_tool
from elastocal.compensation.process import TABLE, read_process, read_table
from elastocal.elastic import read_springs
from elastocal.errors import SchemaError
from elastocal.files import read_text
from elastocal.identification import read_model
from elastocal.identification.recertification import CompareSummary
from elastocal.records import read_json
from elastocal.tables import opened_table
from elastocal.workflows._kinds_of_measurement import FileDescription

_TABLES: dict[tuple[str, ...], str] = {
    ("variant", "seed_pose", "n_train"): "table of the indices of a codec",
    ("sample", "poses", "search"): "table of a study",
}
"""What a table is, by its first columns."""


def springs_file(path: Path) -> FileDescription:
    """Describe a file of springs."""
    file = read_springs(path)
    return FileDescription.of(
        "spring file", schema="elastocal.springs/1", include=file.include, springs=len(file.springs)
    )


def model_file(path: Path) -> FileDescription:
    """Describe a calibrated model."""
    calibrated = read_model(path)
    seen = calibrated.observability
    return FileDescription.of(
        "calibrated model",
        robot=calibrated.model.robot.name,
        tcp=calibrated.model.robot.tip,
        springs=seen.springs,
        rank=seen.rank,
        draws=len(calibrated.draws),
        provenance=calibrated.provenance,
    )


def tool_file(path: Path) -> FileDescription:
    """Describe a tool file."""
    record = read_tool(path)
    return FileDescription.of(
        "tool file",
        schema="elastocal.tool/1",
        flange=record.flange,
        mass=record.mass,
        postures=record.postures,
        undetermined=list(record.undetermined),
    )


def compensator_file(path: Path) -> FileDescription:
    """Describe a settings of a compensator."""
    settings = read_settings(path)
    return FileDescription.of(
        "settings of a compensator",
        schema="elastocal.compensator/1",
        cycle=settings.cycle,
        filter_delay=float(settings.chain.delay()),
        correction=settings.limits.correction,
        rate=settings.limits.rate,
    )


def process_table(path: Path) -> FileDescription:
    """Describe a table of a simulated process."""
    table = read_table(path)
    last = table.lines[-1]
    return FileDescription.of(
        "simulated process",
        schema="elastocal.process/1",
        cell=table.cell,
        process=table.process,
        seeds=[run.seed for run in table.runs],
        points=last.points,
        mean_after=last.after.mean,
        max_after=last.after.max,
    )


def comparison_file(path: Path) -> FileDescription:
    """Describe a comparison of two calibrations."""
    record = read_json(path, CompareSummary)
    return FileDescription.of(
        "comparison of two calibrations",
        schema="elastocal.comparison/1",
        robot=record.robot,
        compared=len(record.springs),
        moved=list(record.moved),
        rows=0 if record.deflection is None else record.deflection.rows,
        limit=record.limit,
        verdict=record.verdict,
    )


def process_folder(path: Path) -> FileDescription:
    """Describe the folder of a simulated process; its deviations are validated, too."""
    record = read_process(path)
    kind, facts = process_table(path / TABLE)
    return FileDescription.of(kind, **facts, courses=len(record.courses))


def is_codec(folder: Path) -> bool:
    """Return whether a folder is that of a codec."""
    return (folder / ARRAYS).is_file() and (folder / VERDICTS).is_file()


def codec_folder(path: Path) -> FileDescription:
    """Describe the folder of a codec; arrays and verdicts are validated and belong together.

    Raises
    ------
    ElastocalError
        If a file is damaged, or the two are not of one codec.
    """
    data, result = read_codec_folder(path)
    return FileDescription.of("folder of a codec", **_facts(data), saturation=result.saturation)


def arrays(path: Path) -> FileDescription:
    """Describe the arrays of a codec."""
    return FileDescription("codec", _facts(read_codec(path)))


def verdicts(path: Path) -> FileDescription:
    """Describe the verdicts of a codec."""
    result = read_codec_summary(path)
    return FileDescription.of(
        "verdict file of a codec",
        schema=VERDICTS_SCHEMA,
        robot=result.robot,
        variants=list(result.variants),
        saturation=result.saturation,
    )


def is_table(path: Path) -> bool:
    """Return whether a CSV file begins as a table that a codec or a study writes."""
    return tuple(read_text(path).partition("\n")[0].strip().split(",")[:3]) in _TABLES


def table(path: Path) -> FileDescription:
    """Describe a table of results.

    Raises
    ------
    SchemaError
        If a row has more or fewer cells than the header.
    """
    with opened_table(path) as table:
        header, rows = list(table.layout.header), table.rows()
    uneven = rows.uneven(len(header))
    if uneven:
        line, cells = uneven
        raise SchemaError(f"{path}, line {line}: {cells} cells, not {len(header)}")
    kind = _TABLES[tuple(header[:3])]
    return FileDescription.of(kind, rows=len(rows), columns=header)


def _facts(data: CodecData) -> dict[str, object]:
    return {
        "schema": ARRAYS_SCHEMA,
        "robot": data.robot,
        "variants": [each.name for each in data.variants],
        "poses": len(data.contact),
        "splits": len(data.seed_pose),
        "training": len(data.n_train),
    }


def is_study(folder: Path) -> bool:
    """Return whether a folder is that of a study."""
    return (folder / DESIGN).is_file() and (folder / PARTS).is_dir()


def study_folder(path: Path) -> FileDescription:
    """Describe the folder of a study; every finished sample is validated.

    Raises
    ------
    ElastocalError
        If settings or a sample are damaged.
    """
    settings = read_design(path / DESIGN)
    done = StudyStore(path).finished(settings)
    return FileDescription.of(
        "study", schema=DESIGN_SCHEMA, **_design_facts(settings), samples=len(done)
    )


def study_settings(path: Path) -> FileDescription:
    """Describe what a study is a study of."""
    return FileDescription.of(
        "settings file of a study", schema=DESIGN_SCHEMA, **_design_facts(read_design(path))
    )


def study_samples(path: Path) -> FileDescription:
    """Describe some finished samples, by the settings in the folder above theirs."""
    results = read_part(path, read_design(path.resolve().parent.parent / DESIGN))
    return FileDescription.of(
        "part of a study",
        schema=PART_SCHEMA,
        samples=[result.number for result in results],
        conditions=len(results[0].outcomes) if results else 0,
    )


def study_record(path: Path) -> FileDescription:
    """Describe the results of a study."""
    record = read_study(path)
    return FileDescription.of(
        "record of a study",
        schema=STUDY_SCHEMA,
        cell=record.cell,
        samples=record.samples,
        verification=record.verification,
        median_error_m={each.name: each.error_mean.median for each in record.conditions},
        advice=record.advice or None,
    )


def _design_facts(settings: StudyDesign) -> dict[str, object]:
    return {
        "cell": settings.cell,
        "seed": settings.seed,
        "conditions": list(settings.names),
        "verification": settings.verification,
    }
