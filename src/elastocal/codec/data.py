"""The arrays of Algorithm 1, for every variant, and their file ``codec.nc``, without loss.

The file is NetCDF4, all in SI units; any tool that reads NetCDF opens it. Errors of all variants
lie in one array; the compliances of variant k have a dimension of their own, ``spring_k``, since
layouts differ in their numbers of springs.
"""

import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.codec.splits import CodecOptions
from elastocal.codec.variants import KEYS, Variant
from elastocal.elastic import Spring
from elastocal.errors import CodecError, SchemaError, nearest
from elastocal.findings import Finding
from elastocal.identification import Contact, RungSummary
from elastocal.records import (
    SEAL,
    LabelledArray,
    LabelledArrays,
    Variable,
    array_fields,
    arrays_of,
    arrays_sha256,
    from_data,
    parse_json,
    read_arrays,
    to_data,
    write_arrays,
)
from elastocal.results import brief_repr

AXES = ("x", "y", "z", "norm")
"""Components of an error in base, and the length of the vector."""
_ERROR_DIMS = ("variant", "cv", "n_train", "axis")
NO_POSE = -1
"""Fills `CodecData.chosen` behind the last chosen pose."""
ARRAYS_SCHEMA = "elastocal.codec/2"
"""Schema of the arrays of a codec."""
_OLDER = ("elastocal.codec/1",)
"""Its findings are sentences alone."""
ARRAYS = "codec.nc"
"""Name of the file in a codec's folder."""
_OPTIONS = ("ratio", "seed", "set_blunders_aside", "trust_conventions", "poses")
_ALL_POSES = {"poses": sys.maxsize}
"""Poses drawn of a file that does not say: elastocal 0.1.0 drew none."""


@brief_repr
@dataclass(frozen=True)
class SpringLabels:
    """Names and units of the springs of a variant."""

    names: tuple[str, ...]
    units: tuple[str, ...]
    """SI unit of each compliance."""

    @classmethod
    def of(cls, springs: Sequence[Spring]) -> "SpringLabels":
        """Return the labels of springs."""
        return cls(
            tuple(each.name for spring in springs for each in spring.parameters),
            tuple(each.unit.si for spring in springs for each in spring.parameters),
        )


@brief_repr
@dataclass(frozen=True, eq=False)
class CodecData:
    """Results of a repeated cross-validation; arrays are read-only copies.

    Sizes of training sets are 1, 2, … ``n_train``. Poses are numbered from 0; ``pose_labels`` holds
    their labels in the dataset.

    Raises
    ------
    CodecError
        If shapes contradict each other.
    """

    variants: tuple[Variant, ...]
    springs: tuple[SpringLabels, ...]
    """Labels of the springs of each variant."""
    pose_labels: tuple[tuple[int, ...], ...]
    """Labels of each physical pose; several where one was measured more than once."""
    contact: Annotated[
        FloatArray, Variable(("pose", "xyz"), "m", "tcp position of each physical pose in base")
    ]
    """Tcp position of each pose in base, shape (pose, 3), in m."""
    seed_pose: Annotated[
        IndexArray, Variable(("cv",), meaning="pose that the verification set was grown from")
    ]
    """Pose that each verification set was grown from, shape (cv,)."""
    verification: Annotated[
        IndexArray, Variable(("cv", "place"), meaning="verification poses in the order of choice")
    ]
    """Poses of each verification set in the order of choice, shape (cv, N_v)."""
    chosen: Annotated[
        IndexArray,
        Variable(
            ("variant", "cv", "n_train", "training_place"),
            meaning="training poses in the order of choice; -1 behind the last",
        ),
    ]
    """Training poses in the order of choice, `NO_POSE` behind the last, shape
    (variant, cv, n_train, n_train)."""
    compliance: tuple[FloatArray, ...]
    """Compliances of each variant, shape (cv, n_train, spring), in the units of ``springs``."""
    error_mean: Annotated[
        FloatArray, Variable(_ERROR_DIMS, "m", "mean absolute residual at the verification poses")
    ]
    """Mean absolute residual at the verification poses under all load cases, shape
    (variant, cv, n_train, 4), in m; the last axis is x, y, z in base, and the norm."""
    error_max: Annotated[
        FloatArray,
        Variable(_ERROR_DIMS, "m", "largest absolute residual at the verification poses"),
    ]
    """Largest absolute residual, of the same shape and unit."""
    load_cases: tuple[str, ...]
    """Load cases that are verified with."""
    options: CodecOptions
    robot: str = ""
    """Name of the robot."""
    provenance: str = ""
    """Origin of the readings."""
    findings: tuple[Finding, ...] = ()
    """Notes on the data for the user."""
    versions: dict[str, str] = field(default_factory=dict)
    """Version of each package that the numbers come from."""
    zero_error: FloatArray | None = None
    """Mean error norm without any model, which is the mean deflection, at the verification poses,
    shape (cv,), in m; None in files of elastocal 0.1.0."""
    layouts: tuple[str, ...] = ()
    """Springs of each variant: what `calibrate` takes on this file for the variant's word."""
    split_layouts: tuple[tuple[tuple[str, ...], ...], ...] = ()
    """Springs behind the errors, by variant, split and number of training poses; chosen from the
    training poses of that split where there is a choice."""
    ladder: tuple[RungSummary, ...] = ()
    """The ladder of `calibrate` on this file, and other compared layouts; empty in older files."""
    left_out: FloatArray | None = None
    """Errors at left-out poses by which `calibrate` judges, shape (variant, left-out pose), in m;
    NaN for variants that it cannot judge; none in older files."""
    made_from: dict[str, str] = field(default_factory=dict)
    """SHA-256 of what the dataset says (`elastocal.dataset.content_sha256`), by its file."""

    def __post_init__(self) -> None:
        for name in ("contact", "error_mean", "error_max"):
            self._own(name, np.array(getattr(self, name), dtype=float))
        for name in ("seed_pose", "verification", "chosen"):
            self._own(name, np.array(getattr(self, name), dtype=np.intp))
        if self.zero_error is not None:
            self._own("zero_error", np.array(self.zero_error, dtype=float))
        if self.left_out is not None:
            self._own("left_out", np.array(self.left_out, dtype=float))
        # Before there was a choice, every split had the springs of its variant.
        layouts = self.layouts or tuple(each.springs for each in self.variants)
        sizes, sets = self.error_mean.shape[2], len(self.seed_pose)
        splits = self.split_layouts or tuple(((name,) * sizes,) * sets for name in layouts)
        object.__setattr__(self, "layouts", layouts)
        object.__setattr__(self, "split_layouts", splits)
        compliance = tuple(np.array(each, dtype=float) for each in self.compliance)
        for each in compliance:
            each.flags.writeable = False
        object.__setattr__(self, "compliance", compliance)
        self._check()

    @property
    def n_train(self) -> IndexArray:
        """Sizes of the training sets, 1 to the largest."""
        return np.arange(1, self.error_mean.shape[2] + 1)

    @property
    def training_poses(self) -> int:
        """Poses on the training side of a split, ``N_c``."""
        return len(self.contact) - int(self.verification.shape[1])

    def index(self, variant: str) -> int:
        """Return the number of a variant.

        Raises
        ------
        CodecError
            If there is none of that name.
        """
        names = [each.name for each in self.variants]
        if variant not in names:
            raise CodecError(
                f"unknown variant {variant!r}{nearest(variant, names)} (known: {', '.join(names)})"
            )
        return names.index(variant)

    def errors(self, variant: str, which: str = "mean", axis: str = "norm") -> FloatArray:
        """Return the ``mean`` or ``max`` errors of a variant, shape (cv, n_train), in m.

        Raises
        ------
        CodecError
            If variant, error or axis are unknown.
        """
        for name, known in ((which, ("mean", "max")), (axis, AXES)):
            if name not in known:
                raise CodecError(f"unknown {name!r} of an error (allowed: {', '.join(known)})")
        array = self.error_mean if which == "mean" else self.error_max
        return array[self.index(variant), :, :, AXES.index(axis)]

    def _own(self, name: str, array: FloatArray | IndexArray) -> None:
        array.flags.writeable = False
        object.__setattr__(self, name, array)

    def _check(self) -> None:
        v, cv, n = len(self.variants), self.seed_pose.size, _length(self.error_mean, 2)
        poses = len(self.pose_labels)
        expected = {
            "contact": (poses, 3),
            "seed_pose": (cv,),
            "chosen": (v, cv, n, n),
            "error_mean": (v, cv, n, len(AXES)),
            "error_max": (v, cv, n, len(AXES)),
            "verification": (cv, _length(self.verification, 1)),
        }
        if self.zero_error is not None:
            expected["zero_error"] = (cv,)
        if self.left_out is not None:
            expected["left_out"] = (v, _length(self.left_out, 1))
        found = {name: getattr(self, name).shape for name in expected}
        found["split_layouts"] = np.shape(self.split_layouts)
        expected["split_layouts"] = (v, cv, n)
        for k, (array, springs) in enumerate(zip(self.compliance, self.springs, strict=True)):
            expected[f"compliance of variant {k}"] = (cv, n, len(springs.names))
            found[f"compliance of variant {k}"] = array.shape
        for name, shape in expected.items():
            if found[name] != shape:
                raise CodecError(f"{name} has shape {found[name]}, not {shape}")
        if not v or len(self.compliance) != v or len({each.name for each in self.variants}) != v:
            raise CodecError("variants must be at least one, each with a name of its own")
        for name in ("seed_pose", "verification", "chosen"):
            outside = getattr(self, name)
            if np.any((outside < NO_POSE) | (outside >= poses)):
                raise CodecError(f"{name} names a pose that is not one of the {poses}")


def _length(array: FloatArray | IndexArray, axis: int) -> int:
    """Return the length of an array along an axis; 0 where it has no such axis."""
    return array.shape[axis] if axis < array.ndim else 0


def known(value: float) -> float | None:
    """Return a figure as files hold it: None where it is NaN."""
    return None if np.isnan(value) else float(value)


def write_codec(folder: Path, data: CodecData) -> Path:
    """Write ``codec.nc`` into a folder, atomically; return its path.

    Raises
    ------
    FileAccessError
        If it cannot be written.
    """
    path = Path(folder) / ARRAYS
    arrays = _arrays_of(data)
    arrays.attributes[SEAL] = arrays_sha256(arrays)
    write_arrays(path, arrays)
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
    found = read_arrays(path, ARRAYS_SCHEMA, _OLDER)
    try:
        return _data_of(found)
    except (CodecError, SchemaError, KeyError, TypeError, ValueError) as error:
        # A damaged file may lack anything; what it is says the library's own text.
        raise SchemaError(f"{path}: {' '.join(str(error).split())}") from error


def _arrays_of(data: CodecData) -> LabelledArrays:
    variables = arrays_of(data)
    if data.zero_error is not None:
        notes = {"long_name": "mean deflection at the verification poses", "units": "m"}
        variables["zero_error"] = LabelledArray(("cv",), data.zero_error, notes, packed=True)
    for k, (compliance, springs) in enumerate(zip(data.compliance, data.springs, strict=True)):
        dims = ("cv", "n_train", f"spring_{k}")
        notes = {"long_name": f"compliances of variant {data.variants[k].name}"}
        variables[f"compliance_{k}"] = LabelledArray(dims, compliance, notes, packed=True)
        variables[f"spring_unit_{k}"] = _texts(f"spring_{k}", springs.units)
    if data.left_out is not None:
        notes = {"long_name": "errors by which calibrate judges", "units": "m"}
        by_pose = ("variant", "left_out_pose")
        variables["left_out"] = LabelledArray(by_pose, data.left_out, notes, packed=True)
    variables["variant_layout"] = _texts("variant", data.layouts)
    names = np.array(data.split_layouts, dtype=np.str_)
    variables["split_layout"] = LabelledArray(("variant", "cv", "n_train"), names)
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


def _read_options(stated: Mapping[str, Any]) -> CodecOptions:
    own = {name: value for name, value in stated.items() if name != "set_blunders_aside"}
    if own.get("contact") is not None:
        own["contact"] = from_data(Contact, own["contact"], "contact")
    return CodecOptions(**(_ALL_POSES | own), keep_blunders=not stated["set_blunders_aside"])


def _attributes(data: CodecData) -> dict[str, str]:
    options = {name: getattr(data.options, name) for name in _OPTIONS}
    splits, contact = data.options.splits, to_data(data.options.contact)
    return {
        "schema": ARRAYS_SCHEMA,
        "robot_name": data.robot,
        "provenance": data.provenance,
        "options": json.dumps(options | {"splits": splits, "contact": contact}),
        "load_cases": json.dumps(data.load_cases),
        "findings": json.dumps(to_data(data.findings, stored=True)),
        "versions": json.dumps(data.versions),
        "ladder": json.dumps([to_data(rung) for rung in data.ladder]),
        "made_from": json.dumps(data.made_from),
    }


def _texts(dim: str, texts: Sequence[str]) -> LabelledArray:
    return LabelledArray((dim,), np.array(texts, dtype=np.str_))


def _data_of(found: LabelledArrays) -> CodecData:
    """Return the data of a file; variables that are not ours are left alone."""
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
        load_cases=tuple(_said(found, "load_cases")),
        options=_read_options(_said(found, "options")),
        robot=str(found.attributes["robot_name"]),
        provenance=str(found.attributes["provenance"]),
        findings=tuple(map(Finding.read, _said(found, "findings"))),
        versions=_said(found, "versions"),
        zero_error=found["zero_error"].values if "zero_error" in found else None,
        layouts=_listed(found["variant_layout"]) if "variant_layout" in found else (),
        split_layouts=_split_layouts(found),
        ladder=tuple(
            from_data(RungSummary, rung, "ladder") for rung in _said(found, "ladder", "[]")
        ),
        left_out=found["left_out"].values if "left_out" in found else None,
        made_from=_said(found, "made_from", "{}"),
        **arrays,
    )


def _said(found: LabelledArrays, name: str, default: str = "") -> Any:
    """Return the JSON value of an attribute."""
    return parse_json(str(found.attributes.get(name, default)), f"attribute {name!r}")


def _split_layouts(found: LabelledArrays) -> tuple[tuple[tuple[str, ...], ...], ...]:
    if "split_layout" not in found:
        return ()
    names = found["split_layout"].values
    if names.ndim == 2:
        # Before, a split had one choice for all sizes.
        names = np.repeat(names[:, :, None], len(found["n_train"].values), axis=2)
    return tuple(tuple(tuple(map(str, sizes)) for sizes in row) for row in names.tolist())


def _listed(texts: LabelledArray) -> tuple[str, ...]:
    return tuple(map(str, texts.values.tolist()))
