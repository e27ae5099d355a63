"""The arrays of Algorithm 1, for every variant."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from elastocal.arrays import FloatArray, IndexArray
from elastocal.codec.splits import CodecOptions
from elastocal.codec.variants import Variant
from elastocal.elastic import Spring
from elastocal.errors import CodecError, nearest
from elastocal.records import Variable
from elastocal.results import brief_repr

AXES = ("x", "y", "z", "norm")
"""Components of an error in base, and the length of the vector."""
_ERROR_DIMS = ("variant", "cv", "n_train", "axis")
NO_POSE = -1
"""Fills `CodecData.chosen` behind the last chosen pose."""


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
    """Everything that a repeated cross-validation found; arrays are read-only copies.

    Sizes of training sets are 1, 2, … ``n_train``. Poses are numbered from 0; what they are
    called in the dataset stands in ``pose_labels``.

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
    """Largest absolute residual, likewise."""
    load_cases: tuple[str, ...]
    """Load cases that are verified with."""
    options: CodecOptions
    robot: str = ""
    """Name of the robot."""
    provenance: str = ""
    """Origin of the readings."""
    findings: tuple[str, ...] = ()
    """Notes on the data for the user."""
    versions: dict[str, str] = field(default_factory=dict)
    """Version of each package that the numbers come from."""

    def __post_init__(self) -> None:
        for name in ("contact", "error_mean", "error_max"):
            self._own(name, np.array(getattr(self, name), dtype=float))
        for name in ("seed_pose", "verification", "chosen"):
            self._own(name, np.array(getattr(self, name), dtype=np.intp))
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
        v, cv, n = len(self.variants), len(self.seed_pose), self.error_mean.shape[2]
        poses = len(self.pose_labels)
        expected = {
            "contact": (poses, 3),
            "chosen": (v, cv, n, n),
            "error_mean": (v, cv, n, len(AXES)),
            "error_max": (v, cv, n, len(AXES)),
            "verification": (cv, self.verification.shape[-1]),
        }
        found = {name: getattr(self, name).shape for name in expected}
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
