"""Mutations of files: on bytes whatever they are, and on the structure of each form.

A mutation is a function of the bytes of a valid file and a seeded generator. `FORMS` lists those
of each form by name, so that a case can be written down as names and seeds.
"""

import copy
import csv
import io
import json
import random
import re
import zipfile
from collections.abc import Callable
from functools import cache
from typing import Any
from xml.etree import ElementTree

import h5py
import numpy as np
import yaml
import zstandard
from mcap.exceptions import McapError
from mcap.reader import make_reader
from mcap.records import Metadata
from mcap.writer import CompressionType, Writer

from elastocal.records import SEAL, json_sha256
from support.sealed import chained

Mutation = Callable[[bytes, random.Random], bytes]
Tree = Any
"""Whatever JSON or YAML holds."""

UNREADABLE = (
    ValueError,
    LookupError,
    TypeError,
    AttributeError,
    RecursionError,
    EOFError,
    yaml.YAMLError,
    csv.Error,
    McapError,
    zstandard.ZstdError,
    zipfile.BadZipFile,
    NotImplementedError,
    OverflowError,
    MemoryError,
)
"""What a mutation raises that does not know what an earlier one has left."""

TEXTS = (
    "",
    " ",
    "a[/b]",
    "[bold]",
    "[/]",
    "\x1b[31mred\x1b[0m",
    "é漢\u202e",
    "\ud800",
    "\0",
    "nan",
    "=1+1",
    "<b>x</b>",
    "../../etc/passwd",
    "/dev/zero",
    "x" * 300,
    "y" * 200_000,
    "1_100",
    "1e400",
    "1e308 m",
    "5e-324 s",
    "0.001 deg/s",
    "-5 mm",
    "1e9 kg",
    "nan N",
    "inf m",
    "12 parsec",
    "%s{0}",
    "rad",
    "a,b;c#d",
    "elastocal.cell/1",
    "elastocal.model/99",
)
NUMBERS = (
    0,
    -1,
    1,
    2,
    3,
    1000,
    100_000_000,
    2**31,
    2**63,
    2**64,
    -(2**63) - 1,
    10**400,
    0.5,
    -0.0,
    1e-9,
    5e-324,
    1e12,
    1e160,
    1e308,
    -1e308,
    float("nan"),
    float("inf"),
    float("-inf"),
    True,
)


def deep(depth: int, inner: Tree = 0) -> Tree:
    """Return lists in lists."""
    for _ in range(depth):
        inner = [inner]
    return inner


def hostile(rng: random.Random) -> Tree:
    """Return a value that no file of ours should hold, or hardly ever."""
    kind = rng.randrange(8)
    if kind < 3:
        return rng.choice(TEXTS)
    if kind < 6:
        return rng.choice(NUMBERS)
    return rng.choice(
        (
            None,
            [],
            {},
            [[]],
            [{}],
            {"a": 1},
            {"": None},
            [1, 2, 3],
            ["slip"],
            {"kind": ["slip"]},
            [None] * 1000,
            deep(60),
            deep(900),
            {"a[/b]": "a[/b]"},
            [float("nan")] * 3,
            "x",
            7,
        )
    )


# Bytes


def _flip(data: bytes, rng: random.Random) -> bytes:
    changed = bytearray(data)
    for _ in range(rng.choice((1, 1, 1, 4, 32))):
        if changed:
            changed[rng.randrange(len(changed))] ^= 1 << rng.randrange(8)
    return bytes(changed)


def _put(data: bytes, rng: random.Random) -> bytes:
    at = rng.randrange(len(data) + 1)
    new = rng.choice(
        (
            b"\0",
            b"\xff",
            b"\xff" * 8,
            b"\x1b[31m",
            b"[/b]",
            b"\n",
            b'"',
            b"[",
            b"{",
            b"\r",
            b"\x7f\xff\xff\xff",
            b"9" * 400,
            b"\xef\xbb\xbf",
            b",",
            b"\t",
        )
    )
    over = rng.random() < 0.5
    return data[:at] + new + data[at + len(new) * over :]


def _cut(data: bytes, rng: random.Random) -> bytes:
    a, b = sorted(rng.randrange(len(data) + 1) for _ in range(2))
    return rng.choice((data[:a], data[a:], data[:a] + data[b:], data[: len(data) - 1], b""))


def _repeat(data: bytes, rng: random.Random) -> bytes:
    a, b = sorted(rng.randrange(len(data) + 1) for _ in range(2))
    return data[:b] + data[a:b] * rng.choice((1, 2, 5)) + data[b:]


def _splice(data: bytes, rng: random.Random) -> bytes:
    a, b, c = (rng.randrange(len(data) + 1) for _ in range(3))
    return data[:a] + data[b : b + rng.choice((1, 8, 64, 1024))] + data[c:]


BYTES: dict[str, Mutation] = {
    "flip": _flip,
    "put": _put,
    "cut": _cut,
    "repeat": _repeat,
    "splice": _splice,
}


# Trees: JSON, YAML, lines of JSON

_Holder = dict[str, Any] | list[Any]


def _places(tree: Tree) -> list[tuple[_Holder, Any]]:
    """Return every place of a tree: what holds it, and its key or index."""
    found: list[tuple[_Holder, Any]] = []
    open_nodes = [tree]
    while open_nodes:
        node = open_nodes.pop()
        keys = (
            node if isinstance(node, dict) else range(len(node)) if isinstance(node, list) else ()
        )
        for key in keys:
            found.append((node, key))
            open_nodes.append(node[key])
    return found


def _replace(tree: Tree, rng: random.Random) -> Tree:
    places = _places(tree)
    if not places or rng.random() < 0.01:
        return hostile(rng)
    holder, key = rng.choice(places)
    holder[key] = hostile(rng)
    return tree


def _scale(tree: Tree, rng: random.Random) -> Tree:
    """Change a number, or the number at the start of a quantity."""
    places = [(h, k) for h, k in _places(tree) if isinstance(h[k], int | float | str)]
    for holder, key in rng.sample(places, min(len(places), 20)):
        value, new = holder[key], rng.choice(NUMBERS)
        if isinstance(value, str):
            changed, count = re.subn(r"^-?[\d.]+(e[+-]?\d+)?(?= )", f"{new}", value, count=1)
            if not count:
                continue
            new = changed
        holder[key] = new
        break
    return tree


def _drop(tree: Tree, rng: random.Random) -> Tree:
    places = _places(tree)
    if places:
        holder, key = rng.choice(places)
        del holder[key]
    return tree


def _rename(tree: Tree, rng: random.Random) -> Tree:
    places = [(h, k) for h, k in _places(tree) if isinstance(h, dict)]
    if places:
        holder, key = rng.choice(places)
        holder[rng.choice((*TEXTS, key.upper(), f"{key}s"))] = holder.pop(key)
    return tree


def _swap(tree: Tree, rng: random.Random) -> Tree:
    places = _places(tree)
    if len(places) > 1:
        (a, i), (b, k) = rng.sample(places, 2)
        a[i], b[k] = json.loads(json.dumps([b[k], a[i]]))
    return tree


def _lengthen(tree: Tree, rng: random.Random) -> Tree:
    places = [(h, k) for h, k in _places(tree) if isinstance(h[k], list)]
    if places:
        holder, key = rng.choice(places)
        items = holder[key]
        holder[key] = rng.choice(
            (items * 2, items[:-1], [items], items * (2000 // (len(items) + 1)))
        )
    return tree


def _nest(tree: Tree, rng: random.Random) -> Tree:
    places = _places(tree)
    if places:
        holder, key = rng.choice(places)
        holder[key] = deep(rng.choice((1, 2, 50, 900)), holder[key])
    return tree


TREES: dict[str, Callable[[Tree, random.Random], Tree]] = {
    "replace": _replace,
    "scale": _scale,
    "drop": _drop,
    "rename": _rename,
    "swap": _swap,
    "lengthen": _lengthen,
    "nest": _nest,
}


_UNSEALED = 0.1
"""How often a hash is left as it was; it is then all that a reader finds."""


def _json(change: Callable[[Tree, random.Random], Tree]) -> Mutation:
    def mutate(data: bytes, rng: random.Random) -> bytes:
        tree = change(json.loads(data), rng)
        if isinstance(tree, dict) and SEAL in tree and rng.random() > _UNSEALED:
            tree[SEAL] = json_sha256(tree)
        return json.dumps(tree).encode()

    return mutate


_SLOW_YAML = 300_000
"""In bytes: to parse more takes longer than a case may."""


def _yaml(change: Callable[[Tree, random.Random], Tree]) -> Mutation:
    def mutate(data: bytes, rng: random.Random) -> bytes:
        if len(data) > _SLOW_YAML:
            raise ValueError("refused by its size alone, and slow to change")
        text = json.dumps(change(_parsed(data), rng))  # a flow of YAML but for these:
        return text.replace("NaN", ".nan").replace("Infinity", ".inf").encode()

    return mutate


def _parsed(data: bytes) -> Tree:
    return json.loads(_as_json(data))


@cache
def _as_json(data: bytes) -> str:
    return json.dumps(yaml.safe_load(data))


def _line(change: Callable[[Tree, random.Random], Tree]) -> Mutation:
    def mutate(data: bytes, rng: random.Random) -> bytes:
        lines = data.splitlines()
        at = rng.choice((0, rng.randrange(len(lines))))
        lines[at] = json.dumps(change(json.loads(lines[at]), rng), separators=(",", ":")).encode()
        changed = b"\n".join(lines) + b"\n"
        return changed if rng.random() < _UNSEALED else chained(changed.decode()).encode()

    return mutate


def _lines(data: bytes, rng: random.Random) -> bytes:
    """Drop, double, swap or lengthen lines."""
    lines = data.splitlines(keepends=True) or [b""]
    a, b = rng.randrange(len(lines)), rng.randrange(len(lines))
    kind = rng.randrange(4)
    if kind == 0:
        del lines[a]
    elif kind == 1:
        lines.insert(b, lines[a])
    elif kind == 2:
        lines[a], lines[b] = lines[b], lines[a]
    else:
        lines[a] = (
            lines[a].rstrip(b"\n") + rng.choice((b" # [/b]", b"," * 500, b"x" * 150_000)) + b"\n"
        )
    return b"".join(lines)


def _yaml_bomb(data: bytes, rng: random.Random) -> bytes:
    """Add a section that grows when it is read: aliases, merge keys, many keys, itself, a tag."""
    steps = rng.choice((9, 25))
    alias = "a0: &a0 [x,x]\n" + "".join(
        f"a{n}: &a{n} [*a{n - 1},*a{n - 1},*a{n - 1},*a{n - 1}]\n" for n in range(1, steps)
    )
    merge = "m0: &m0 {k: 1}\n" + "".join(
        f"m{n}: &m{n} {{<<: [*m{n - 1},*m{n - 1},*m{n - 1}]}}\n" for n in range(1, steps)
    )
    keys = "".join(f"key_{n}: {n}\n" for n in range(rng.choice((1000, 60_000))))
    more = rng.choice(
        (
            alias,
            merge,
            keys,
            "self: &s {me: *s}\n",
            "l: &l [*l]\n",
            "t: !!python/object:os.system 1\n",
            "? {a: 1}\n: 2\n",
            "? [1]\n: 2\n",
            "x: 2020-13-45\n",
            "x: 190:20:30.15\n",
            "x: 0b" + "1" * 99 + "\n",
            "x: !!set {a, b}\n",
            "x: !!binary aaa\n",
            "x: " + "[" * 5000 + "\n",
            "x: " + "9" * 5000 + "\n",
            "name: a\nname: b\n",
            "- x\n",
            "--- 1\n--- 2\n",
            "<<: 1\n",
            "x: !!timestamp 1\n",
            "x: =\n",
        )
    )
    return rng.choice((data + b"\n" + more.encode(), more.encode(), more.encode() + data))


# Tables


def _cells(data: bytes, rng: random.Random) -> bytes:
    """Change cells, a column or the header of a table."""
    text = data.decode("utf-8", "replace")
    rows = list(csv.reader(io.StringIO(text))) or [[""]]
    first = next((n for n, row in enumerate(rows) if row and not row[0].startswith("#")), 0)
    row = rng.choice((first, rng.randrange(len(rows))))
    if rows[row]:
        column = rng.randrange(len(rows[row]))
        value = rng.choice((*TEXTS, *(str(number)[:500] for number in NUMBERS), "1,5", "'", '"'))
        kind = rng.randrange(5)
        if kind < 2:
            rows[row][column] = value
        elif kind == 2:
            rows = [[*r[:column], *r[column + 1 :]] for r in rows]
        elif kind == 3:
            rows = [
                r if n <= first else [*r[:column], value, *r[column + 1 :]]
                for n, r in enumerate(rows)
            ]
        else:
            rows = [[*r, r[column]] if column < len(r) else r for r in rows]
    out = io.StringIO()
    csv.writer(
        out, delimiter=rng.choice(",,,,,;\t|"), lineterminator=rng.choice(("\n", "\r\n", "\r"))
    ).writerows(rows)
    return out.getvalue().encode("utf-8", "replace")


# NetCDF


def _attribute(rng: random.Random) -> Any:
    return rng.choice(
        (
            1,
            2.5,
            np.nan,
            np.array([1, 2, 3]),
            np.array([], dtype=float),
            np.float32(3),
            b"\xff\xfe",
            "a[/b]",
            np.array(["a", "b"], dtype=h5py.string_dtype()),
            "\x1b[31m",
            "x" * 5000,
            np.bool_(True),
            "[1, 2",
            '{"a": 1}',
            "[[1]]",
            "null",
            '["x"]',
            h5py.Empty("f8"),
            np.array([[1.0]]),
            "1e999",
            deep_text(3000),
            np.array([(1, 2.0)], dtype=[("a", "i4"), ("b", "f8")]),
            np.array([1 + 2j]),
            2**63,
        )
    )


def deep_text(depth: int) -> str:
    """Return JSON that is nested deeply."""
    return "[" * depth + "]" * depth


def _hdf5_attributes(file: h5py.File, rng: random.Random) -> None:
    holder = rng.choice((file, *file.values()))
    names = [
        *holder.attrs,
        "_FillValue",
        "missing_value",
        "scale_factor",
        "add_offset",
        "coordinates",
        "units",
        "_Encoding",
        "flag_meanings",
        "schema",
        "a[/b]",
        "extra",
    ]
    name = rng.choice(names)
    if name in holder.attrs and rng.random() < 0.3:
        del holder.attrs[name]
    else:
        holder.attrs[name] = _attribute(rng)


def _hdf5_variable(file: h5py.File, rng: random.Random) -> None:
    """Replace a variable by one of another type or shape, or take it away."""
    name = rng.choice([*file, "a[/b]"])
    old = file.get(name)
    shape = old.shape if isinstance(old, h5py.Dataset) else (2,)
    if old is not None:
        del file[name]
    kind = rng.randrange(9)
    if kind == 0:
        return
    if kind == 1:
        file.create_group(name)
    elif kind == 2:
        file[name] = h5py.SoftLink(rng.choice(("/nowhere", f"/{name}", "/")))
    elif kind == 3:
        file[name] = h5py.ExternalLink(rng.choice(("/dev/zero", "other.nc", "/etc/passwd")), "/x")
    elif kind == 4:
        huge = rng.choice(((10**6, 10**6), (3 * 10**12,), (2**40, 6), (10**9,)))
        file.create_dataset(name, huge, "f8", chunks=rng.choice((True, (1,) * len(huge))))
    else:
        dtype = rng.choice(
            ("i1", "u8", "f4", "f2", "S4", "c16", "bool", h5py.string_dtype(), "f8", "i8")
        )
        dims = rng.choice(
            (shape, shape[:-1], (*shape, 2), (0, *shape[1:]), tuple(n + 1 for n in shape), ())
        )
        file.create_dataset(name, dims, dtype)


def _hdf5_values(file: h5py.File, rng: random.Random) -> None:
    """Change one number of a variable, or all."""
    arrays = [each for each in file.values() if isinstance(each, h5py.Dataset) and each.size]
    if not arrays:
        return
    chosen = rng.choice(arrays)
    if chosen.dtype.kind in "fiu" and chosen.ndim:
        values = np.array(chosen)
        info = np.iinfo(values.dtype) if values.dtype.kind in "iu" else np.finfo(values.dtype)
        new = (
            rng.choice((0, 1, info.max, info.min, info.max / 2))
            if values.dtype.kind != "f"
            else rng.choice(
                (np.nan, np.inf, -np.inf, info.max, info.min, info.tiny, 0.0, 1e9, -1.0)
            )
        )
        if rng.random() < 0.3:
            values[...] = new
        else:
            values.flat[rng.randrange(values.size)] = new
        chosen[...] = values
    elif chosen.dtype.kind == "O" and chosen.ndim:
        chosen[rng.randrange(len(chosen))] = (
            rng.choice(TEXTS[:14]).encode("utf-8", "replace").replace(b"\0", b"")
        )


def _hdf5_more(file: h5py.File, rng: random.Random) -> None:
    name = rng.choice(("more", "a[/b]", "\x1b[31m", "schema", "pose"))
    if name not in file:
        file.create_dataset(
            name, data=rng.choice((np.arange(3.0), np.array([[1, 2]]), 5, np.array([b"x"])))
        )


def _hdf5(change: Callable[[h5py.File, random.Random], None]) -> Mutation:
    def mutate(data: bytes, rng: random.Random) -> bytes:
        image = io.BytesIO(data)
        try:
            with h5py.File(image, "r+") as file:
                change(file, rng)
        except (OSError, ValueError, TypeError, RuntimeError, KeyError, OverflowError):
            return data  # what h5py itself does not let pass is no case
        return image.getvalue()

    return mutate


# MCAP


@cache
def _zeros(megabytes: int) -> bytes:
    packer = zstandard.ZstdCompressor().compressobj()
    return b"".join(packer.compress(bytes(1 << 20)) for _ in range(megabytes)) + packer.flush()


def _bomb_in_mcap(data: bytes, rng: random.Random) -> bytes:
    """Put a chunk into the file that is thousands of times as large when unpacked."""
    megabytes = rng.choice((100, 700, 2200))
    packed = _zeros(megabytes)
    stated = rng.choice((megabytes << 20, 1000, 2**62))
    body = (0).to_bytes(8, "little") * 2 + stated.to_bytes(8, "little") + bytes(4)
    body += (4).to_bytes(4, "little") + b"zstd" + len(packed).to_bytes(8, "little") + packed
    at = 8 + 9 + int.from_bytes(data[9:17], "little")
    return data[:at] + b"\x06" + len(body).to_bytes(8, "little") + body + data[at:]


def _messages(change: Callable[[Tree, random.Random], Tree]) -> Mutation:
    """Write the file anew with one message, the metadata, or a topic changed."""

    def mutate(data: bytes, rng: random.Random) -> bytes:
        reader = make_reader(io.BytesIO(data))
        found = [(c.topic, m.log_time, m.data) for _, c, m in reader.iter_messages()]
        notes = [dict(note.metadata) for note in reader.iter_metadata()]
        at, kind = rng.randrange(len(found)), rng.randrange(6)
        if kind < 4:
            changed = json.dumps(change(json.loads(found[at][2]), rng)).encode()
            raw = rng.choice(
                (changed,) * 8
                + (b"{", b'{"a":' * 3000, b"1e999999", deep_text(99_999).encode(), b"9" * 5000)
            )
            found[at] = (found[at][0], found[at][1], raw)
        elif kind == 4 and notes:
            notes[0][rng.choice((*notes[0], "a[/b]"))] = rng.choice(
                (*TEXTS[:10], "[1,2]", "{}", deep_text(99_999), "[" * 9)
            )
        else:
            found[at] = (
                rng.choice(("/arm", "/wrench", "a[/b]")),
                rng.choice((0, 2**63, 2**64 - 1)),
                found[at][2],
            )
        return _mcap(found, notes, rng)

    return mutate


def _mcap(
    found: list[tuple[str, int, bytes]], notes: list[dict[str, str]], rng: random.Random
) -> bytes:
    out = io.BytesIO()
    writer = Writer(
        out,
        compression=rng.choice((CompressionType.NONE, CompressionType.ZSTD)),
        enable_data_crcs=True,
    )
    writer.start()
    for note in notes:
        meta = Metadata(
            name="elastocal",
            metadata={k: v.encode("utf-8", "replace").decode() for k, v in note.items()},
        )
        writer.add_metadata(meta.name, meta.metadata)
    channels: dict[str, int] = {}
    for topic, time, data in found:
        if topic not in channels:
            channels[topic] = writer.register_channel(topic, "json", 0)
        writer.add_message(channels[topic], time, data, publish_time=time)
    writer.finish()
    return out.getvalue()


# XML


def _element(data: bytes, rng: random.Random) -> bytes:
    """Change an attribute of a URDF, or drop, double, rename or move an element."""
    try:
        root = ElementTree.fromstring(data)
    except ElementTree.ParseError:
        return data
    inner = [(parent, child) for parent in root.iter() for child in parent]
    parent, child = rng.choice(inner)
    kind = rng.randrange(8)
    if kind < 4 and child.attrib:
        child.set(rng.choice(list(child.attrib)), _xml_text(rng))
    elif kind == 4:
        parent.remove(child)
    elif kind == 5:
        parent.append(copy.deepcopy(child))
    elif kind == 6:
        child.tag = rng.choice(
            ("link", "joint", "mimic", "axis", "inertial", "transmission", "x", "limit")
        )
    else:
        rng.choice(inner)[0].append(copy.deepcopy(child))
    try:
        return ElementTree.tostring(root)
    except (RecursionError, TypeError, ValueError):
        return data


def _xml_text(rng: random.Random) -> str:
    numbers = " ".join(str(rng.choice(NUMBERS))[:400] for _ in range(rng.choice((1, 3, 3, 6))))
    word = rng.choice(
        ("fixed", "revolute", "planar", "floating", "continuous", "prismatic", "-1 0 0", "0 0 0")
    )
    text = rng.choice((numbers, numbers, word, rng.choice(TEXTS)))
    return "".join(
        letter for letter in text if letter.isprintable() and not "\ud800" <= letter <= "\udfff"
    )


def _leaves(data: bytes, rng: random.Random) -> bytes:
    """Hang many links on a robot, or nest, or entities that grow."""
    count = rng.choice((40, 3000))
    links = "".join(
        f'<link name="l{n}"/><joint name="m{n}" type="fixed">'
        f'<parent link="base"/><child link="l{n}"/></joint>'
        for n in range(count)
    ).encode()
    bomb = (
        b'<!DOCTYPE r [<!ENTITY a "'
        + b"x" * 1000
        + b'">'
        + b"".join(b'<!ENTITY %c "' % (98 + n) + b"&%c;" % (97 + n) * 50 + b'">' for n in range(8))
        + b']>\n<robot name="&i;"/>'
    )
    nested = data.replace(b"</robot>", b"<x>" * 20_000 + b"</x>" * 20_000 + b"</robot>")
    return rng.choice((data.replace(b"</robot>", links + b"</robot>"), bomb, nested))


# Containers of text


def _in_manifest(change: Callable[[Tree, random.Random], Tree]) -> Mutation:
    """Change the JSON that stands in a page."""

    def mutate(data: bytes, rng: random.Random) -> bytes:
        before, opened, rest = data.partition(b'id="manifest">')
        text, closed, after = rest.partition(b"</script>")
        new = json.dumps(change(json.loads(text), rng)).encode()
        return before + opened + new.replace(b"<", b"\\u003c") + closed + after

    return mutate


def _in_zip(change: Mutation) -> Mutation:
    """Change one member of an archive, or put a huge one in its place."""

    def mutate(data: bytes, rng: random.Random) -> bytes:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            members = {name: archive.read(name) for name in archive.namelist()}
        name = rng.choice(list(members))
        members[name] = change(members[name], rng)
        out = io.BytesIO()
        with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
            for each, content in members.items():
                archive.writestr(each, content)
        return out.getvalue()

    return mutate


def _long_row(data: bytes, rng: random.Random) -> bytes:
    """Add a row that stands, or ends, far away, or very many of them."""
    far = b'<row r="1048576"><c r="XFD1048576" t="n"><v>1</v></c></row></sheetData>'
    many = b'<row><c t="n"><v>1</v></c></row>' * rng.choice((1000, 300_000)) + b"</sheetData>"
    return data.replace(b"</sheetData>", rng.choice((far, many)))


def _bomb_in_zip(data: bytes, rng: random.Random) -> bytes:
    return data.replace(b"<sheetData>", b"<sheetData>" + b" " * (rng.choice((1, 300)) << 20))


def _number_in_text(data: bytes, rng: random.Random) -> bytes:
    """Change a number of a text file: a mesh, a program."""
    found = list(re.finditer(rb"-?\d+(\.\d*)?([eE][+-]?\d+)?", data))
    if not found:
        return data
    hit = rng.choice(found)
    new = rng.choice((*(str(number)[:400] for number in NUMBERS), "", "x", "1e999", "-1")).encode()
    return data[: hit.start()] + new + data[hit.end() :]


_TEXT = {**BYTES, "lines": _lines, "number": _number_in_text}
_XML = {"element": _element, "elements": _element, "leaves": _leaves}
FORMS: dict[str, dict[str, Mutation]] = {
    "json": {**BYTES, **{name: _json(change) for name, change in TREES.items()}},
    "yaml": {
        **BYTES,
        "lines": _lines,
        "bomb": _yaml_bomb,
        **{name: _yaml(change) for name, change in TREES.items()},
    },
    "jsonl": {**BYTES, "lines": _lines, **{name: _line(change) for name, change in TREES.items()}},
    "csv": {**_TEXT, "cells": _cells, "more cells": _cells, "other cells": _cells},
    "netcdf": {
        **BYTES,
        "attributes": _hdf5(_hdf5_attributes),
        "variable": _hdf5(_hdf5_variable),
        "values": _hdf5(_hdf5_values),
        "more": _hdf5(_hdf5_more),
    },
    "mcap": {
        **BYTES,
        "zip bomb": _bomb_in_mcap,
        **{name: _messages(change) for name, change in TREES.items()},
    },
    "xml": {**_TEXT, **_XML},
    "text": _TEXT,
    "page": {**_TEXT, **{name: _in_manifest(change) for name, change in TREES.items()}},
    "workbook": {
        **BYTES,
        **{f"{name} inside": _in_zip(change) for name, change in (*_TEXT.items(), *_XML.items())},
        "long row": _in_zip(_long_row),
        "zip bomb": _in_zip(_bomb_in_zip),
    },
    "bytes": BYTES,
}
"""Mutations by name, for each form of file."""
