"""NetCDF4 files as labelled arrays, without xarray, whose import takes longer than a calibration.

What is written here is what ``xarray.open_dataset`` and any other reader of NetCDF expects: the
data model is theirs, the conventions are CF (https://cfconventions.org).
"""

import copy
import hashlib
import json
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache, partial
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from elastocal.errors import FileAccessError, SchemaError
from elastocal.files import Limit, readable, write_bytes
from elastocal.parallel import GuardedError, guarded
from elastocal.records._json import SEAL, require_seal
from elastocal.results import brief_repr

_SIGNATURE = b"\x89HDF\r\n\x1a\n"
"""First bytes of an HDF5 file, which every NetCDF4 file is (HDF5 file format, section II.A)."""
_CHECKED = {"fletcher32": True}
"""A checksum for each chunk: a byte that a disk has changed is an error, not another number."""
_MOST_ARRAYS = Limit("ELASTOCAL_MAX_ARRAYS_MB", 256, "MB of numbers")
_MOST_SECONDS = Limit("ELASTOCAL_MAX_SECONDS", 8, "s of reading")
_SMALL = 1_000_000
"""Files of fewer bytes are read once, however often they are asked for, in bytes."""
_MOST_REMEMBERED = 10_000_000
"""Numbers that a remembered file may hold, in bytes: a small file may be a packed large one."""
_MEMORY_PER_ARRAYS = 4
"""Memory that reading takes, in terms of the numbers that are read."""
_MEGABYTE = 1_000_000
_DAMAGE = (
    SchemaError,
    OSError,
    ValueError,
    LookupError,
    RuntimeError,
    TypeError,
    AttributeError,
    OverflowError,
    MemoryError,
)
"""Exceptions of h5py and h5netcdf for damaged files; for a user all of them mean the same."""
_PACKED = {"compression": "gzip", "compression_opts": 4, "shuffle": True}
_STORAGE = ("_FillValue", "missing_value", "scale_factor", "add_offset", "_Encoding", "coordinates")
"""Attributes that say how values are stored (CF section 2.5.1, 8.1), not what they mean."""


@brief_repr
@dataclass(frozen=True, eq=False)
class LabelledArray:
    """An array whose dimensions have names."""

    dims: tuple[str, ...]
    """Name of each dimension."""
    values: np.ndarray
    """Numbers or texts, a dimension for each name."""
    attributes: Mapping[str, Any] = field(default_factory=dict)
    """``units``, ``long_name`` and whatever else is said about the values."""
    packed: bool = False
    """Whether the file holds it compressed and without a fill value."""


@brief_repr
@dataclass(frozen=True, eq=False)
class LabelledArrays:
    """The contents of a NetCDF file: variables that share their dimensions, and attributes."""

    variables: dict[str, LabelledArray]
    """All variables by name; one that is named as its only dimension labels that dimension."""
    attributes: dict[str, Any] = field(default_factory=dict)
    """Attributes of the whole file."""
    auxiliary: tuple[str, ...] = ()
    """Variables that are coordinates although no dimension has their name (CF section 5)."""

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the variables that label others."""
        labels = [name for name, array in self.variables.items() if array.dims == (name,)]
        return (*labels, *self.auxiliary)

    @property
    def sizes(self) -> dict[str, int]:
        """Length of each dimension.

        Raises
        ------
        ValueError
            If an array has not as many dimensions as names, or another length than another array.
        """
        sizes: dict[str, int] = {}
        for name, array in self.variables.items():
            for dim, length in zip(array.dims, array.values.shape, strict=True):
                if sizes.setdefault(dim, length) != length:
                    raise ValueError(f"{name} has length {length} along {dim}, not {sizes[dim]}")
        return sizes

    def __contains__(self, name: str) -> bool:
        """Return whether there is a variable of that name."""
        return name in self.variables

    def __getitem__(self, name: str) -> LabelledArray:
        """Return a variable."""
        return self.variables[name]


def read_arrays(path: Path, schema: str = "", older: Sequence[str] = ()) -> LabelledArrays:
    """Return the contents of a NetCDF4 file.

    Parameters
    ----------
    path : Path
        The file.
    schema : str
        What the file must state; nothing by default.
    older : sequence of str
        Schemas of earlier versions that are read too.

    Raises
    ------
    SchemaError
        If the file is not NetCDF4, is damaged, states another schema, or was changed since its
        hash was put into it.
    FileAccessError
        If the file is missing, unreadable or empty.
    """
    source = _source(path)
    reader = _read_guarded if isinstance(source, Path) else _remembered
    try:
        found = reader(source, _MOST_SECONDS.most, _MOST_ARRAYS.most)
    except GuardedError as error:
        raise SchemaError(f"{path}: not a readable NetCDF4 file: {error}") from error
    if isinstance(found, str):
        raise SchemaError(f"{path}: not a readable NetCDF4 file: {found}")
    if schema:
        # Pydantic comes with it, which datasets do without.
        from elastocal.records._validation import check_schema

        check_schema(found.attributes.get("schema"), schema, str(path), older)
    if SEAL in found.attributes:
        require_seal(found.attributes[SEAL], arrays_sha256(found), str(path))
    if isinstance(source, Path):
        return found
    if sum(array.values.nbytes for array in found.variables.values()) > _MOST_REMEMBERED:
        _remembered.cache_clear()
        return found
    # What is remembered stays as it is.
    return copy.deepcopy(found)


def arrays_sha256(arrays: LabelledArrays, without: Collection[str] = (SEAL,)) -> str:
    """Return the SHA-256 of values, dimensions and texts, the same for a file and its copy.

    Parameters
    ----------
    arrays : LabelledArrays
        What to hash.
    without : collection of str
        Attributes of the whole file that do not count.
    """
    digest = hashlib.sha256()
    for name in sorted(arrays.variables):
        values = np.ascontiguousarray(arrays[name].values)
        shape = f"{name} {arrays[name].dims} {values.shape}"
        listed = json.dumps(values.tolist()) if values.dtype.kind in "OU" else ""
        digest.update(shape.encode() + (listed.encode() if listed else values.tobytes()))
    attributes = {k: str(v) for k, v in arrays.attributes.items() if k not in without}
    digest.update(json.dumps(attributes, sort_keys=True).encode())
    return digest.hexdigest()


def write_arrays(path: Path, arrays: LabelledArrays) -> None:
    """Write a NetCDF4 file, whole or not at all.

    Numbers that are not packed have NaN as their fill value, as xarray gives them.

    Raises
    ------
    FileAccessError
        If the file cannot be written.
    """
    # In memory: HDF5 crashes the process when a disk is full, at the latest when it closes.
    write_bytes(path, netcdf_image(arrays))


def netcdf_image(arrays: LabelledArrays) -> memoryview:
    """Return the bytes of a NetCDF4 file."""
    import h5netcdf

    image = BytesIO()
    with h5netcdf.File(image, "w") as file:
        file.attrs.update(arrays.attributes)
        file.dimensions = arrays.sizes
        for name, array in arrays.variables.items():
            _write(file, name, array)
            labels = [each for each in arrays.auxiliary if _labels(arrays, each, name)]
            if labels:
                file.variables[name].attrs["coordinates"] = " ".join(labels)
    return image.getbuffer()


def _source(path: Path) -> Path | bytes:
    """Return the bytes of a small file, the path of a large one."""
    with readable(path), Path(path).open("rb") as file:
        image = file.read(_SMALL)
    if not image:
        raise FileAccessError(f"cannot read {path}: the file is empty")
    if not image.startswith(_SIGNATURE):
        raise SchemaError(f"{path}: not a NetCDF4 file: it does not begin with the HDF5 signature")
    return image if len(image) < _SMALL else Path(path)


def _read_guarded(source: Path | bytes, seconds: int, megabytes: int) -> LabelledArrays | str:
    """Read in a child process with bounded time and memory."""
    # Imported here, so that no child repeats it.
    import h5netcdf  # noqa: F401

    return guarded(partial(_read, source), seconds, _MEMORY_PER_ARRAYS * megabytes)


_remembered = lru_cache(maxsize=16)(_read_guarded)
"""The same for bytes: a report needs a file's hash and its numbers, and several parts need both."""


def _read(source: Path | bytes) -> LabelledArrays | str:
    """Return the contents of a file, or why it cannot be read."""
    import h5netcdf
    import h5py

    try:
        opened = h5py.File.in_memory if isinstance(source, bytes) else h5py.File
        with opened(source) as image:
            _require_readable(image)
            # HDF5 without dimension scales gets made-up ones; the validation names what lacks.
            with h5netcdf.File(image, "r", decode_vlen_strings=True, phony_dims="sort") as file:
                return _contents(file)
    except _DAMAGE as error:
        # Their own text is the only diagnosis.
        return " ".join(str(error).split()) or type(error).__name__


def _require_readable(image: Any) -> None:
    """Refuse more numbers than fit into memory, and what lies in other files."""
    import h5py

    size = 0
    for name in image:
        if not isinstance(image.get(name, getlink=True), h5py.HardLink):
            raise SchemaError(f"{name!r:.60} is a link, maybe into another file")
        if isinstance(image[name], h5py.Dataset):
            array = image[name]
            if array.external or array.is_virtual:
                raise SchemaError(f"the values of {name!r:.60} lie in another file")
            size += (array.size or 0) * array.dtype.itemsize
            _MOST_ARRAYS.require(size / _MEGABYTE, f"what {name!r:.60} and those before it hold")


def _contents(file: Any) -> LabelledArrays:
    attributes = _attributes(file)
    listed = str(attributes.pop("coordinates", "")).split()
    variables = {}
    for name, variable in file.variables.items():
        stated = _attributes(variable)
        listed += str(stated.get("coordinates", "")).split()
        variables[name] = _decoded(variable, stated)
    auxiliary = tuple(
        name
        for name in dict.fromkeys(listed)
        if name in variables and variables[name].dims != (name,)
    )
    return LabelledArrays(variables, attributes, auxiliary)


def _attributes(holder: Any) -> dict[str, Any]:
    return {
        name: value.decode("utf-8", "replace") if isinstance(value, bytes) else value
        for name, value in holder.attrs.items()
    }


def _decoded(variable: Any, stated: dict[str, Any]) -> LabelledArray:
    """Return the values that a variable means by what it stores (CF section 2.5.1, 8.1)."""
    values, dims = np.asarray(variable[...]), tuple(variable.dimensions)
    if values.dtype.kind not in "biufSUO":
        raise SchemaError(f"{variable.name!r:.60} holds values of type {values.dtype}")
    if values.dtype == "S1" and dims:
        # Texts as rows of characters, from before NetCDF had texts.
        values, dims = _joined_characters(values), dims[:-1]
    if "_Encoding" in stated and values.dtype.kind == "S":
        values = np.char.decode(values, str(stated["_Encoding"]))
    if values.dtype.kind in "iuf":
        values = _unpacked(values, stated)
    notes = {name: value for name, value in stated.items() if name not in _STORAGE}
    return LabelledArray(dims, values, notes)


def _joined_characters(values: np.ndarray) -> np.ndarray:
    length = values.shape[-1]
    if not length:
        return np.zeros(values.shape[:-1], dtype="S1")
    return np.ascontiguousarray(values).view(f"S{length}")[..., 0]


def _unpacked(values: np.ndarray, stated: dict[str, Any]) -> np.ndarray:
    fills = [stated[name] for name in ("_FillValue", "missing_value") if name in stated]
    absent = np.isin(values, np.concatenate([np.ravel(fill) for fill in fills])) if fills else None
    if "scale_factor" in stated or "add_offset" in stated:
        values = values * stated.get("scale_factor", 1.0) + stated.get("add_offset", 0.0)
    if absent is not None and np.any(absent):
        values = np.where(absent, np.nan, values)
    return values


def _write(file: Any, name: str, array: LabelledArray) -> None:
    texts = array.values.dtype.kind in "UO"
    fill = np.nan if array.values.dtype.kind == "f" and not array.packed else None
    storage: dict[str, Any] = {}
    # HDF5 cannot cut nothing, or a single number, into chunks; a text's checksum would be that of
    # its place in the file.
    if array.values.size and array.dims and not texts:
        storage = {**_CHECKED, **(_PACKED if array.packed else {})}
    variable = file.create_variable(
        name, array.dims, _text_type() if texts else array.values.dtype, fillvalue=fill, **storage
    )
    for key, value in array.attributes.items():
        variable.attrs[key] = value
    variable[...] = array.values.astype(object) if texts else array.values


def _text_type() -> Any:
    import h5py

    return h5py.string_dtype()


def _labels(arrays: LabelledArrays, label: str, name: str) -> bool:
    """Return whether an auxiliary coordinate says something about a variable."""
    if name in arrays.coordinates:
        return False
    return set(arrays[label].dims) <= set(arrays[name].dims)
