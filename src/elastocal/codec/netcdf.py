"""Codec file ``codec.nc``: every array of Algorithm 1, without loss.

NetCDF4, all in SI units; any tool that reads NetCDF opens it. Errors of all variants lie in one
array; the compliances of variant k have a dimension of their own, ``spring_k``, since layouts
differ in their numbers of springs.
"""

import json
from pathlib import Path
from typing import Any

import numpy as np

from elastocal.codec.data import AXES, CodecData, SpringLabels
from elastocal.codec.splits import CodecOptions
from elastocal.codec.variants import KEYS, Variant
from elastocal.errors import CodecError, SchemaError
from elastocal.records import (
    LabelledArray,
    LabelledArrays,
    array_fields,
    arrays_of,
    read_arrays,
    write_arrays,
)

ARRAYS_SCHEMA = "elastocal.codec/1"
ARRAYS = "codec.nc"
"""Name of the file in a codec's folder."""

_OPTIONS = ("ratio", "seed", "set_blunders_aside", "trust_conventions")


def write_codec(folder: Path, data: CodecData) -> Path:
    """Write ``codec.nc`` into a folder, atomically; return its path.

    Raises
    ------
    FileAccessError
        If it cannot be written.
    """
    path = Path(folder) / ARRAYS
    write_arrays(path, _arrays_of(data))
    return path


def read_codec(folder: Path) -> CodecData:
    """Return the arrays of a folder (or of the ``codec.nc`` itself).

    Raises
    ------
    SchemaError
        If it is no codec, has another schema or contradicts itself.
    FileAccessError
        If it cannot be read.
    """
    path = Path(folder)
    path = path / ARRAYS if path.is_dir() else path
    found = read_arrays(path, ARRAYS_SCHEMA)
    try:
        return _data_of(found)
    except (CodecError, SchemaError, KeyError, TypeError, ValueError) as error:
        # A damaged file may lack anything; what it is says the library's own text.
        raise SchemaError(f"{path}: {' '.join(str(error).split())}") from error


def _arrays_of(data: CodecData) -> LabelledArrays:
    variables = arrays_of(data)
    for k, (compliance, springs) in enumerate(zip(data.compliance, data.springs, strict=True)):
        dims = ("cv", "n_train", f"spring_{k}")
        notes = {"long_name": f"compliances of variant {data.variants[k].name}"}
        variables[f"compliance_{k}"] = LabelledArray(dims, compliance, notes, packed=True)
        variables[f"spring_unit_{k}"] = _texts(f"spring_{k}", springs.units)
    for key in KEYS:
        variables[f"variant_{key}"] = _texts("variant", [getattr(v, key) for v in data.variants])
    labels = [", ".join(map(str, group)) for group in data.pose_labels]
    variables["pose_label"] = _texts("pose", labels)
    variables |= {
        "variant": _texts("variant", [each.name for each in data.variants]),
        "n_train": LabelledArray(("n_train",), data.n_train.astype(np.int32)),
        "axis": _texts("axis", AXES),
        "xyz": _texts("xyz", AXES[:3]),
    }
    for k, springs in enumerate(data.springs):
        variables[f"spring_{k}"] = _texts(f"spring_{k}", springs.names)
    return LabelledArrays(variables, _attributes(data))


def _attributes(data: CodecData) -> dict[str, Any]:
    options = {name: getattr(data.options, name) for name in _OPTIONS}
    splits = data.options.splits
    return {
        "schema": ARRAYS_SCHEMA,
        "robot_name": data.robot,
        "provenance": data.provenance,
        "options": json.dumps(options | {"splits": splits}),
        "load_cases": json.dumps(data.load_cases),
        "findings": json.dumps(data.findings),
        "versions": json.dumps(data.versions),
    }


def _texts(dim: str, texts: Any) -> LabelledArray:
    return LabelledArray((dim,), np.array(texts, dtype=np.str_))


def _data_of(found: LabelledArrays) -> CodecData:
    """Return what a file holds; variables that are not ours are left alone."""
    arrays = array_fields(CodecData, found)
    rows = zip(
        found["variant"].values, *(found[f"variant_{key}"].values for key in KEYS), strict=True
    )
    variants = tuple(Variant(*map(str, row)) for row in rows)
    labels = (
        tuple(int(label) for label in str(text).split(",")) for text in found["pose_label"].values
    )
    numbers = range(len(variants))
    return CodecData(
        variants=variants,
        springs=tuple(
            SpringLabels(_listed(found[f"spring_{k}"]), _listed(found[f"spring_unit_{k}"]))
            for k in numbers
        ),
        pose_labels=tuple(labels),
        compliance=tuple(found[f"compliance_{k}"].values for k in numbers),
        load_cases=tuple(json.loads(found.attributes["load_cases"])),
        options=CodecOptions(**json.loads(found.attributes["options"])),
        robot=str(found.attributes["robot_name"]),
        provenance=str(found.attributes["provenance"]),
        findings=tuple(json.loads(found.attributes["findings"])),
        versions=json.loads(found.attributes["versions"]),
        **arrays,
    )


def _listed(texts: LabelledArray) -> tuple[str, ...]:
    return tuple(map(str, texts.values.tolist()))
