"""Measure the house: how many files, how long, how connected, and what goes round a face.

Usage: ``python tools/house.py [SRC]``; ``make house`` runs it on ``src``. The figures follow the
table "Measures of the good houses" that the project holds itself to:

* code lines: neither blank, nor comment, nor docstring;
* an importer is another module that imports a name of this one, directly or through the face of a
  package;
* a face is the ``__init__`` of a package: a module goes round it when it imports from a module of
  a package that it does not live in.
"""

import ast
import re
import statistics
import sys
import tokenize
from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TypeGuard

SHORT = 60
"""A file with fewer lines than this needs a reason."""
LONG = 400
"""A file with more lines than this, too."""
LONG_FUNCTION = 50
"""Most lines of code of a function."""


@dataclass(frozen=True)
class Module:
    """A file of Python."""

    name: str
    path: Path
    is_face: bool

    @cached_property
    def text(self) -> str:
        """The file's text."""
        return self.path.read_text("utf-8")

    @cached_property
    def tree(self) -> ast.Module:
        """The file's syntax."""
        return ast.parse(self.text)

    @cached_property
    def nodes(self) -> tuple[ast.AST, ...]:
        """All of the tree: walking it takes longer than any search in it."""
        return tuple(ast.walk(self.tree))

    @property
    def package(self) -> str:
        """The package that the module lives in; a face lives in its own."""
        return self.name if self.is_face else self.name.rpartition(".")[0]

    @cached_property
    def lines(self) -> int:
        """Lines in the file."""
        return self.text.count("\n")

    @cached_property
    def code(self) -> frozenset[int]:
        """Numbers of the lines of code."""
        return code_lines(self.path, self.nodes)

    def imports(self, faces: dict[str, dict[str, str]]) -> Iterator[tuple[str, str]]:
        """Yield what is imported: the name as written, in full, and the module it comes from."""
        for node in self.nodes:
            if isinstance(node, ast.Import):
                for alias in node.names:
                    yield alias.name, alias.name
            elif isinstance(node, ast.ImportFrom):
                named = _absolute(node, self.package)
                for alias in node.names:
                    written = f"{named}.{alias.name}"
                    yield written, faces.get(named, {}).get(alias.name, written)


@dataclass
class House:
    """What was measured."""

    modules: dict[str, Module]
    importers: dict[str, set[str]] = field(default_factory=lambda: defaultdict(set))
    bypasses: list[str] = field(default_factory=list)


def code_lines(path: Path, nodes: Iterable[ast.AST]) -> frozenset[int]:
    """Return the numbers of the lines that hold code: no blank, no comment, no docstring."""
    held: set[int] = set()
    with path.open("rb") as file:
        for token in tokenize.tokenize(file.readline):
            if token.type not in _NO_CODE:
                held.update(range(token.start[0], token.end[0] + 1))
    for node in nodes:
        body = getattr(node, "body", ())
        for inner in body if isinstance(body, list) else ():
            value = getattr(inner, "value", None)
            if isinstance(inner, ast.Expr) and isinstance(value, ast.Constant):
                held.difference_update(range(inner.lineno, (inner.end_lineno or 0) + 1))
    return frozenset(held)


_NO_CODE = {
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENCODING,
    tokenize.ENDMARKER,
}


def _absolute(node: ast.ImportFrom, package: str) -> str:
    """Return the module that a statement imports from, also where it is written relatively."""
    if not node.level:
        return node.module or ""
    parts = package.split(".")
    parts = parts[: len(parts) - node.level + 1]
    return ".".join([*parts, node.module] if node.module else parts)


def find_modules(source: Path) -> dict[str, Module]:
    """Return the modules below a folder by their full names."""
    found = {}
    for path in sorted(source.rglob("*.py")):
        parts = path.relative_to(source).with_suffix("").parts
        is_face = parts[-1] == "__init__"
        name = ".".join(parts[:-1] if is_face else parts)
        found[name] = Module(name, path, is_face)
    return found


def find_faces(modules: dict[str, Module]) -> dict[str, dict[str, str]]:
    """Return, for each package, the module that each name of its face comes from."""
    faces: dict[str, dict[str, str]] = {}
    for module in modules.values():
        if not module.is_face:
            continue
        stub = module.path.with_suffix(".pyi")
        tree = ast.parse(stub.read_text("utf-8")) if stub.is_file() else module.tree
        names = faces.setdefault(module.name, {})
        for node in tree.body:
            if isinstance(node, ast.ImportFrom):
                named = _absolute(node, module.name)
                for alias in node.names:
                    full = f"{named}.{alias.name}"
                    names[alias.asname or alias.name] = full if full in modules else named
    for names in faces.values():
        # The top face takes with "*" what the list ``__all__`` of another one names.
        if source := names.pop("*", None):
            names |= dict.fromkeys(_listed(modules[source].path.with_suffix(".pyi")), source)
    return _followed(faces)


def _listed(stub: Path) -> list[str]:
    """Return the list ``__all__`` of a stub."""
    statements = ast.parse(stub.read_text("utf-8")).body
    return ast.literal_eval(next(s.value for s in statements if isinstance(s, ast.Assign)))


def _followed(faces: dict[str, dict[str, str]]) -> dict[str, dict[str, str]]:
    """Return faces in which a name that comes from another face leads on to its module."""
    for names in faces.values():
        for name, source in names.items():
            seen = set()
            while name in faces.get(source, {}) and source not in seen:
                seen.add(source)
                source = faces[source][name]
            names[name] = source
    return faces


def measure(source: Path) -> House:
    """Return the modules below a folder, who imports each, and what goes round a face."""
    house = House(find_modules(source))
    faces = find_faces(house.modules)
    for module in house.modules.values():
        for written, source in module.imports(faces):
            target = source if source in house.modules else source.rpartition(".")[0]
            if target not in house.modules:
                continue
            if not module.is_face and target != module.name:
                house.importers[target].add(module.name)
            package, _, name = written.rpartition(".")
            if name not in faces.get(package, {}) and _goes_round(module, house.modules[target]):
                house.bypasses.append(f"{module.name}: {written}")
    return house


def _goes_round(module: Module, target: Module) -> bool:
    """Return whether a module names another one inside a package that it is not in itself."""
    home = target.package
    top_level = "." not in home
    return not target.is_face and not top_level and not f"{module.name}.".startswith(f"{home}.")


def used_exports(house: House, faces: dict[str, dict[str, str]]) -> set[tuple[str, str]]:
    """Return the names of faces that a module outside the face's package uses, with the face.

    A name that one face takes from another is used there when it is used here.
    """
    used = {
        (package, name)
        for module in house.modules.values()
        for package, name in names_used(module, faces)
        if not f"{module.name}.".startswith(f"{package}.")
    }
    return with_sources(used, house)


def with_sources(used: set[tuple[str, str]], house: House) -> set[tuple[str, str]]:
    """Return names of faces with those that they are taken from."""
    taken = {
        (module.name, alias.asname or alias.name): (_absolute(node, module.name), alias.name)
        for module in house.modules.values()
        if module.is_face and module.path.with_suffix(".pyi").is_file()
        for node in ast.parse(module.path.with_suffix(".pyi").read_text("utf-8")).body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    found, new = set(used), set(used)
    while new:
        new = {taken[each] for each in new if each in taken} - found
        found |= new
    return found


def names_used(module: Module, faces: dict[str, dict[str, str]]) -> Iterator[tuple[str, str]]:
    """Yield the names of faces that a module uses, by import or behind the name of a package."""
    yield from (
        (named, alias.name)
        for named, alias in _taken(module)
        if named in faces and f"{named}.{alias.name}" not in faces
    )
    local = {
        alias.asname or alias.name: f"{named}.{alias.name}".removeprefix(".")
        for named, alias in _taken(module)
        if f"{named}.{alias.name}".removeprefix(".") in faces
    }
    for node in module.nodes:
        # An annotation in quotes names what it needs, too.
        written = node.value if isinstance(node, ast.Constant) else None
        if isinstance(node, ast.Attribute):
            written = ast.unparse(node)
        if isinstance(written, str) and _DOTTED.fullmatch(written):
            first, *rest = written.split(".")
            yield from _behind(local.get(first, first), rest, faces)


def _taken(module: Module) -> Iterator[tuple[str, ast.alias]]:
    """Yield each name that a module imports, with what it is imported from, if anything."""
    for node in module.nodes:
        if isinstance(node, ast.Import | ast.ImportFrom):
            named = _absolute(node, module.package) if isinstance(node, ast.ImportFrom) else ""
            yield from ((named, alias) for alias in node.names)


_DOTTED = re.compile(r"\w+(\.\w+)+")


def _behind(
    package: str, rest: list[str], faces: dict[str, dict[str, str]]
) -> Iterator[tuple[str, str]]:
    """Yield the name that follows a package, or a package in it."""
    for part in rest:
        if part in faces.get(package, {}):
            yield package, part
            return
        package = f"{package}.{part}"


def documented(folders: list[Path], faces: dict[str, dict[str, str]]) -> set[tuple[str, str]]:
    """Return the names of faces that pages, notebooks and examples show to users."""
    shown: set[tuple[str, str]] = set()
    for path in (path for folder in folders for path in sorted(folder.rglob("*"))):
        if path.suffix not in (".md", ".py"):
            continue
        text = path.read_text("utf-8")
        for dotted in _PLACE.findall(text):
            package, _, name = dotted.rpartition(".")
            if name in faces.get(package, {}):
                shown.add((package, name))
        codes = [text] if path.suffix == ".py" else _CODE.findall(text)
        for tree in map(_parsed, codes):
            for node in ast.walk(tree):
                if isinstance(node, ast.ImportFrom) and node.module in faces:
                    shown.update((node.module, alias.name) for alias in node.names)
    return shown


_PLACE = re.compile(r"elastocal(?:\.\w+)+")
_CODE = re.compile(r"```(?:python|py|\{code-cell\})[^\n]*\n(.*?)```", re.DOTALL)


def _parsed(code: str) -> ast.Module:
    try:
        return ast.parse(code)
    except SyntaxError:  # a few lines of something longer
        return ast.Module([], [])


def idle_exports(house: House, folders: list[Path]) -> list[str]:
    """Return the names that a face exports though nobody outside its package uses them.

    What pages show to users is used; so is what is looked up by name: drivers, and faces that are
    read as a whole (`READ_WHOLE`).
    """
    faces = find_faces(house.modules)
    top = {(package, name) for package in faces if "." not in package for name in faces[package]}
    used = used_exports(house, faces) | with_sources(documented(folders, faces) | top, house)
    return sorted(
        f"{package}.{name}"
        for package, names in faces.items()
        for name in names
        if (package, name) not in used and name not in BY_NAME
        if package not in READ_WHOLE and "." in package
    )


BY_NAME = {"DRIVER", "plot_result"}
"""Names that are looked up in a face when they are wanted."""
READ_WHOLE = {
    "elastocal.planning.checks",
    "elastocal.report.document.sections",
    "elastocal.workflows",
}
"""Faces that are tables: who reads them takes all that they export."""


def own_names(module: Module, modules: dict[str, Module]) -> int:
    """Return how many names of this project a module imports."""
    return len(
        {
            (_absolute(node, module.package), alias.name)
            for node in module.nodes
            if isinstance(node, ast.ImportFrom)
            and _absolute(node, module.package).partition(".")[0] in modules
            for alias in node.names
        }
    )


SCALES = re.compile(r"\b1e[36] ?\*|\* ?1e[36]\b|np\.(rad2deg|degrees)\b|math\.degrees\b")
"""How units are scaled by hand."""
SHELLS = ("cli", "workflows", "report", "verdict", "studio")
"""Packages above the domain, where quantities come with their unit."""


def twins(modules: Iterable[Module]) -> list[str]:
    """Return the pairs of classes that share most of their fields, of those with four or more."""
    fields = [
        (f"{module.name}.{node.name}", {b.id for b in node.bases if isinstance(b, ast.Name)}, names)
        for module in modules
        for node in module.nodes
        if isinstance(node, ast.ClassDef) and len(names := _fields(node)) >= _FEW
    ]
    return [
        f"{a} = {b}"
        for number, (a, bases, first) in enumerate(fields)
        for b, others, second in fields[number + 1 :]
        if len(first & second) >= ALIKE * max(len(first), len(second))
        and a.rpartition(".")[2] not in others
        and b.rpartition(".")[2] not in bases
    ]


ALIKE = 0.7
"""Share of the fields that makes two classes twins."""
_FEW = 4


def _fields(node: ast.ClassDef) -> set[str]:
    return {
        each.target.id
        for each in node.body
        if isinstance(each, ast.AnnAssign)
        and isinstance(each.target, ast.Name)
        # What a class says of all its objects is no field of a record.
        and not ast.unparse(each.annotation).startswith("ClassVar")
    }


def functions(module: Module, beyond: int = 0) -> Iterator[tuple[str, int]]:
    """Yield each function with its lines of code, signature and docstring not among them.

    Those whose bodies have ``beyond`` lines at most, of whatever kind, are left out uncounted.
    """
    for node in module.nodes:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            first = node.body[0].lineno
            lines = range(first, (node.end_lineno or first) + 1)
            if len(lines) > beyond:
                yield f"{module.name}.{node.name}", sum(line in module.code for line in lines)


def defined_names(module: Module) -> set[str]:
    """Return the names that a module defines at its top level."""
    names: set[str] = set()
    for node in module.tree.body:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            names.add(node.name)
        elif isinstance(node, ast.Assign):
            names.update(n.id for each in node.targets for n in ast.walk(each) if _is_name(n))
        elif isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            names.add(node.target.id)
    return names


def _is_name(node: ast.AST) -> TypeGuard[ast.Name]:
    return isinstance(node, ast.Name)


def public_names(module: Module) -> set[str]:
    """Return the public names that a module defines at its top level."""
    if any(part.startswith("_") for part in module.name.split(".")):
        return set()
    return {name for name in defined_names(module) if not name.startswith("_")}


def _is_dict_of_any(node: ast.AST) -> bool:
    return isinstance(node, ast.Subscript) and ast.unparse(node) == "dict[str, Any]"


def main() -> None:
    """Print the figures, and by name what stands out."""
    words = [word for word in sys.argv[1:] if not word.startswith("-")]
    house = measure(Path(words[0] if words else "src"))
    modules = list(house.modules.values())
    rooms = [module for module in modules if not module.is_face]
    sizes = [module.lines for module in rooms]
    every = [found for module in modules for found in functions(module)]
    lengths = [length for _, length in every]
    faces = find_faces(house.modules)
    shown = {source for names in faces.values() for source in names.values()}
    single = sorted(
        f"{module.name} <- {next(iter(house.importers[module.name]))}"
        for module in rooms
        if len(house.importers[module.name]) == 1
    )
    hidden = [name for name in single if name.partition(" ")[0] not in shown]
    # What users import, and faces that are looked through as a whole, have no importers here.
    inside = {package for package in faces if "." in package} - READ_WHOLE
    exported = {(package, name) for package in inside for name in faces[package]}
    used = used_exports(house, faces)
    imported = [own_names(module, house.modules) for module in rooms]
    scaled = [
        f"{module.path}:{number}"
        for module in rooms
        if set(module.name.split(".")[1:2]) & set(SHELLS)
        for number, line in enumerate(module.text.splitlines(), 1)
        if SCALES.search(line)
    ]
    alike = twins(modules)
    public = [(module.name, name) for module in rooms for name in public_names(module)]
    loose = [
        f"{module.path}:{node.lineno}"
        for module in modules
        for node in module.nodes
        if _is_dict_of_any(node)
    ]
    long_functions = [f"{name} ({length})" for name, length in every if length > LONG_FUNCTION]
    long_files = [f"{module.path} ({module.lines})" for module in rooms if module.lines > LONG]
    comments = sum(
        line.lstrip().startswith("#") for module in modules for line in module.text.splitlines()
    )
    classes = sum(isinstance(n, ast.ClassDef) for m in modules for n in m.nodes)
    rows: list[tuple[str, object]] = [
        ("files", len(modules)),
        ("of them faces", len(modules) - len(rooms)),
        ("lines of code", sum(len(module.code) for module in modules)),
        ("lines of a file, median (faces aside)", statistics.median(sizes)),
        (f"files under {SHORT} lines (faces aside)", sum(size < SHORT for size in sizes)),
        (f"files over {LONG} lines", len(long_files)),
        ("classes", classes),
        ("public names at top level", len(public)),
        ("names that faces export to other packages", len(exported)),
        ("of them used by another package, %", round(100 * len(exported & used) / len(exported))),
        ("own names that a file imports, median", statistics.median(imported)),
        ("the same, 90 % of files", statistics.quantiles(imported, n=10)[-1]),
        ("modules with exactly one importer", len(single)),
        ("of them not exported by a face", len(hidden)),
        ("places above the domain that scale units", len(scaled)),
        ("pairs of classes that share most fields", len(alike)),
        ("imports that go round a face", len(house.bypasses)),
        ("dict[str, Any]", len(loose)),
        ("lines of code of a function, median", statistics.median(lengths)),
        (f"functions over {LONG_FUNCTION} lines of code", len(long_functions)),
        ("comment lines", comments),
    ]
    for name, figure in rows:
        print(f"{name:45} {figure}")
    if "--names" in sys.argv:
        for title, names in (
            ("one importer", single),
            ("round a face", sorted(set(house.bypasses))),
            ("scale units", scaled),
            ("share most fields", alike),
            ("own names", sorted(f"{own_names(m, house.modules):3} {m.name}" for m in rooms)[-60:]),
            ("dict[str, Any]", loose),
            ("long functions", long_functions),
            ("long files", long_files),
            (
                f"under {SHORT} lines",
                [f"{m.path} ({m.lines})" for m in rooms if m.lines < SHORT],
            ),
        ):
            print(f"\n{title}:", *names, sep="\n  ")


if __name__ == "__main__":
    main()
