"""The README's tour runs as printed, and the pages quote the code as it is."""

import ast
import contextlib
import inspect
import io
import re
import runpy
import shlex
import shutil
import sys
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import get_args

import griffe
import pytest
from pydantic import BaseModel
from pydantic.fields import FieldInfo
from typer.main import get_command

from elastocal.cell import ProcedureSettings
from elastocal.cell.cell import cell_file_model
from elastocal.cell.identity import RUN_SECTIONS
from elastocal.cli.commands import COMMANDS
from elastocal.cli.main import app
from elastocal.plugins import KINDS
from elastocal.procedure.run.steps import Fault
from elastocal.sim.truth import FaultKind
from elastocal.workflows.codec import codec
from elastocal.workflows.demo import chapters
from support.cli import Result, elastocal
from support.demos import demo_result, finished_demo

ROOT = Path(__file__).parents[1]
FANUC = ROOT / "examples" / "fanuc_r2000ic"
OPTIONS = runpy.run_path(str(ROOT / "docs" / "hooks" / "command_options.py"))
"""What fills the reference with the options of commands."""
BREAKS = runpy.run_path(str(ROOT / "docs" / "hooks" / "line_breaks.py"))["on_page_content"]
"""What says where lines of a page may end."""
PLAIN = runpy.run_path(str(ROOT / "docs" / "hooks" / "plainly.py"))["Plainly"]
"""What shows types and examples of the reference plainly."""
FACE = re.compile(r"<!-- face: (elastocal[\w.]*) -->")
"""What docs/hooks/faces.py fills with the names that a package exports."""
FACES = runpy.run_path(str(ROOT / "docs" / "hooks" / "faces.py"))
"""How it does."""
TOUR = (ROOT / "README.md").read_text(encoding="utf-8").split("## Five-minute tour")[1]
TOUR = TOUR.split("\n## ")[0]
NUMBER = re.compile(r"[-+±]?\d+\.\d+")


@dataclass(frozen=True)
class Toured:
    """What the tour left behind."""

    folder: Path
    results: dict[str, Result]


def blocks(language: str) -> list[str]:
    return re.findall(rf"^```{language}\n(.*?)^```", TOUR, flags=re.MULTILINE | re.DOTALL)


def shell_lines() -> list[str]:
    return [line for block in blocks("sh") for line in block.splitlines() if line.strip()]


def done(arguments: list[str]) -> Result:
    """Run a command; the demo is that of all tests, told as if it stood here, and its plan too."""
    folder, told = finished_demo("afp"), demo_result("afp")
    if arguments[0] == "plan":
        # The demo's second chapter is this very command.
        assert arguments == ["plan", "afp/cell.yaml", "--out", "afp/plan"]
        assert list(chapters("afp", Path("afp"), 0)[1].words) == arguments
        assert Path("afp/cell.yaml").read_bytes() == (folder / "cell.yaml").read_bytes()
        shutil.copytree(folder / "plan", "afp/plan")
        return Result(0, "", "")
    if arguments[0] != "demo":
        return elastocal(*arguments)
    assert arguments == ["demo", "--out", "demo"]
    shutil.copytree(folder, "demo")
    return Result(told.code, told.out, told.err.replace(str(folder), "demo"))


@pytest.fixture(scope="module")
def toured(tmp_path_factory):
    folder = tmp_path_factory.mktemp("tour")
    results = {}
    with contextlib.chdir(folder):
        for line in shell_lines():
            command, *arguments = shlex.split(line)
            assert command == "elastocal", line
            results[line] = done(arguments)
    return Toured(folder, results)


def test_the_tour_has_the_lines_that_a_new_user_needs():
    commands = {shlex.split(line)[1] for line in shell_lines()}
    assert commands == {
        "demo",
        "check",
        "calibrate",
        "predict",
        "robots",
        "init",
        "plan",
        "run",
    }
    assert len(blocks("python")) == 1
    assert len(blocks("text")) == 2


def test_every_shell_line_of_the_tour_is_done(toured):
    failed = {line: result.err for line, result in toured.results.items() if result.code != 0}
    assert not failed
    for name in (
        "model.json",
        "six.json",
        "without.json",
        "predicted.csv",
        "afp/plan/plan.html",
    ):
        assert (toured.folder / name).is_file(), name


def test_the_output_in_the_readme_is_what_the_commands_print(toured):
    lines = (
        "elastocal demo --out demo",
        "elastocal calibrate demo/run/dataset.nc --out model.json",
    )
    for line, block in zip(lines, blocks("text"), strict=True):
        words = toured.results[line].err.split()
        for part in re.split(r"^…$", block, flags=re.MULTILINE):
            words = words[after(part.split(), words) :]


def test_the_page_on_the_table_quotes_what_the_tour_prints(toured):
    """The condition number is of no meaning to its last digits."""
    page = (ROOT / "docs/how-to/read-the-table.md").read_text(encoding="utf-8")
    quoted = re.findall(r"^```text\n(.*?)^```", page, flags=re.MULTILINE | re.DOTALL)
    with contextlib.chdir(toured.folder):
        bearing = elastocal(
            "calibrate", "demo/run/dataset.nc", "--out", "b.json", "--springs", "bearing"
        )
        fanuc = elastocal(
            "calibrate", FANUC / "measurements.csv", "--robot", FANUC / "fanuc_r2000ic.urdf",
            "--tcp", "link_6", "--springs", "bearing", "--out", "f.json",
        )  # fmt: skip
    auto = toured.results["elastocal calibrate demo/run/dataset.nc --out model.json"]
    for number, told in ((0, auto), (1, auto), (3, bearing), (4, auto), (6, fanuc)):
        words = re.sub(r"\d{5,}", "many", told.err).split()
        for part in re.split(r"^…$", quoted[number], flags=re.MULTILINE):
            words = words[after(re.sub(r"\d{5,}", "many", part).split(), words) :]


@pytest.mark.slow
def test_the_page_on_studies_quotes_what_its_commands_print(tmp_path):
    page = (ROOT / "docs/how-to/study-before-you-travel.md").read_text(encoding="utf-8")
    shell = "".join(re.findall(r"^```sh\n(.*?)^```", page, flags=re.MULTILINE | re.DOTALL)[:2])
    quoted = re.findall(r"^```text\n(.*?)^```", page, flags=re.MULTILINE | re.DOTALL)
    with contextlib.chdir(tmp_path):
        made, *studies = (
            elastocal(*shlex.split(line)[1:]) for line in shell.replace("\\\n", "").splitlines()
        )
    assert made.code == 0
    for told, block in zip(studies, quoted, strict=True):
        words = told.err.split()
        for part in re.split(r"^…$", block, flags=re.MULTILINE):
            words = words[after(part.split(), words) :]


def after(wanted: list[str], words: list[str]) -> int:
    """Return where the words that follow the wanted ones begin; fail when they do not stand."""
    for start in range(len(words) - len(wanted) + 1):
        if all(map(alike, wanted, words[start:])):
            return start + len(wanted)
    raise AssertionError(f"what is not printed: {' '.join(wanted)}\nbut {' '.join(words)}")


def alike(shown: str, printed: str) -> bool:
    """Return whether two words are equal, decimal numbers in them nearly so."""
    if NUMBER.sub("#", shown) != NUMBER.sub("#", printed):
        return False
    numbers = [[float(n.lstrip("±")) for n in NUMBER.findall(word)] for word in (shown, printed)]
    return numbers[0] == pytest.approx(numbers[1], rel=0.02, abs=0.002)


@pytest.mark.slow
def test_the_python_of_the_tour_runs_and_prints_its_figures(toured):
    printed = io.StringIO()
    with contextlib.chdir(toured.folder), contextlib.redirect_stdout(printed):
        exec(compile(blocks("python")[0], "README.md", "exec"), {})
    assert "split='leave-poses-out'" in printed.getvalue()


def test_the_files_that_the_readme_links_to_exist():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    links = [link for link in re.findall(r"\]\(([^)#]+)\)", text) if "://" not in link]
    assert links
    assert not [link for link in links if not (ROOT / link).exists()]


@cache
def messages() -> set[str]:
    """Return every text of the source, ``…`` in place of what is filled in."""
    found = set()
    for path in (ROOT / "src").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if not isinstance(node, ast.JoinedStr | ast.Constant):
                continue
            parts = node.values if isinstance(node, ast.JoinedStr) else [node]
            text = "".join(
                part.value
                if isinstance(part, ast.Constant) and isinstance(part.value, str)
                else "…"
                for part in parts
            )
            found |= {text, re.sub(r"\{\w+\}", "…", text)}  # of f-strings, and of phrases
    return found


def test_the_refusals_that_the_docs_quote_are_those_of_the_code():
    pages = (ROOT / "docs/how-to/when-it-refuses").glob("*.md")
    first = ROOT / "docs/how-to/when-it-refuses.md"
    text = "\n".join(page.read_text(encoding="utf-8") for page in (first, *pages))
    quoted = re.findall(r"^\| `([^`]+)`", text, flags=re.MULTILINE)
    known = [*messages(), *(f"unknown {kind} …" for kind in KINDS)]  # of every registry
    assert len(quoted) > 100
    assert not [text for text in quoted if not any(text in message for message in known)]


def test_the_faults_that_drivers_are_held_against_have_their_messages_and_their_tests():
    page = (ROOT / "docs/decisions/0080-drivers.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (?!fault|---)(.*?) \| (.*?) \| (.*?) \|$", page, flags=re.MULTILINE)
    assert len(rows) > 10
    known = messages()
    for _, told, tests in rows:
        for text in re.findall(r"`(?:… )?([^`]+)`", told):
            assert any(text in message for message in known), text
        for path, name in re.findall(r"`([^`:]+)::(\w+)`", tests):
            assert f"def {name}(" in (ROOT / path).read_text(encoding="utf-8"), name
        assert "::" in tests


def test_every_face_has_its_page_in_the_reference():
    pages = (ROOT / "docs/reference/api").glob("*.md")
    marked = [m for page in pages for m in FACE.findall(page.read_text(encoding="utf-8"))]
    stubs = (ROOT / "src/elastocal").rglob("__init__.pyi")
    faces = [".".join(stub.parent.relative_to(ROOT / "src").parts) for stub in stubs]
    # What the command line is made of is nobody's interface.
    assert sorted(marked) == sorted(face for face in faces if ".cli" not in face)


def reference_entries() -> dict[str, list[str]]:
    """Return what each page of the reference shows when its faces are filled."""
    entries = {}
    for path in sorted(FACES["PAGES"].glob("*.md")):
        page = SimpleNamespace(file=SimpleNamespace(src_uri=f"reference/api/{path.name}"))
        filled = FACES["on_page_markdown"](path.read_text(encoding="utf-8"), page)
        for heading, text in re.findall(r"^##+ (.*)\n([^#]*)", filled, flags=re.MULTILINE):
            assert text.strip(), f"{path.name}: {heading} has nothing"
        entries[path.stem] = re.findall(r"^::: (.*)", filled, flags=re.MULTILINE)
    return entries


@pytest.mark.slow
def test_each_name_stands_once_in_the_reference_on_the_page_that_names_its_module():
    entries = reference_entries()
    every = [entry for page in entries.values() for entry in page]
    assert len(every) == len(set(every))
    assert "elastocal.workflows.calibrate_pair" in entries["workflows-pair"]
    # Pages that show a module whole have the names that its package exports from it.
    assert "elastocal.compensation.online.Design" not in entries["compensation"]
    for path in FACES["PAGES"].glob("*.md"):
        for package, modules in FACES["PART"].findall(path.read_text(encoding="utf-8")):
            assert set(modules.split()) <= set(FACES["exported"](package).values()), path.name


def test_every_command_stands_on_the_page_of_its_group():
    page = (ROOT / "docs/reference/commands.md").read_text(encoding="utf-8")
    listed = {}
    for group in page.split("\n## ")[1:]:
        title, _, text = group.partition("\n")
        links = re.findall(r"\[`([\w-]+)`\]\((commands/\w+\.md)#", text)
        listed |= dict.fromkeys((name for name, _ in links), title)
        for name, path in links:
            own = (ROOT / "docs/reference" / path).read_text(encoding="utf-8")
            assert f"\n## elastocal {name}\n" in own, name
    told = {name: each.group for name, each in COMMANDS.items()}
    assert told.pop("demo") == "See all of it"
    assert listed == told


def parts_of_the_reference() -> dict[str, str]:
    """Return what the reference says of each command."""
    pages = [*(ROOT / "docs/reference/commands").glob("*.md"), ROOT / "docs/reference/commands.md"]
    text = "".join(f"\n{page.read_text(encoding='utf-8')}" for page in pages)
    parts = re.split(r"\n###? elastocal ", text)[1:]
    return {part.split("\n")[0]: part.split("\n## ")[0] for part in parts}


def test_the_reference_of_a_command_has_the_table_of_its_options():
    told = {name: OPTIONS["MARK"].findall(part) for name, part in parts_of_the_reference().items()}
    assert told == {name: [name] for name in COMMANDS}


@pytest.mark.parametrize("name", COMMANDS)
def test_the_table_of_a_command_has_its_options_and_no_others(name):
    rows = OPTIONS["options_table"](name).splitlines()[2:]
    assert {
        option for row in rows for option in re.findall(r"`(--[a-z][\w-]*)", row.split(" | ")[0])
    } == options()[name]
    assert all(re.fullmatch(r"\| `[^ ].*` \| .* \| [^|]{8,} \|", row) for row in rows)


def test_defaults_and_choices_stand_in_the_table_of_a_command():
    table = OPTIONS["options_table"]("calibrate")
    assert "| `DATA …` | required | " in table
    assert "| `--springs NAME|FILE` | `auto` | " in table
    assert "| `--budget` | off | " in table
    assert "| `--speed TEXT` | `50 mm/s` | " in OPTIONS["options_table"]("compensate")


def test_the_options_that_the_reference_names_belong_to_its_command_or_to_another():
    known = options()
    every = set().union(*known.values(), {"--help", "--version"})
    for name, part in parts_of_the_reference().items():
        # Of another command, that is named in the same breath.
        others = {each for each in known if f"`{each}" in part or f"#elastocal-{each}" in part}
        named = set(re.findall(r"`(--[a-z][\w-]*)", part))
        assert named <= every, name
        assert named <= known[name].union(*(known[each] for each in others)), name


def test_the_options_of_commands_that_pages_show_exist():
    known, wrong = options(), []
    for page in [*(ROOT / "docs").rglob("*.md"), ROOT / "README.md"]:
        for name, rest in re.findall(
            r"(?:^|`)elastocal ([a-z-]+)((?: [^\n`]|\\\n)*[^\n`#|]*)",
            page.read_text(encoding="utf-8"), flags=re.MULTILINE,
        ):  # fmt: skip
            given = set(re.findall(r"(?<!\S)--[a-z][\w-]*", rest))
            wrong += [(page.name, name, each) for each in given - known.get(name, given)]
    assert not wrong


def options() -> dict[str, set[str]]:
    """Return the options of each command, their short forms apart."""
    program = get_command(app)
    return {
        name: {
            option
            for parameter in command.params
            for option in (*parameter.opts, *parameter.secondary_opts)
            if option.startswith("--")
        }
        for name, command in ((name, program.get_command(None, name)) for name in COMMANDS)
    }


def cell_file_section(heading=None):
    """Return a part of the pages about the cell file; without heading, what comes first."""
    pages = (ROOT / f"docs/reference/files/{name}.md" for name in ("cell", "cell-simulation"))
    text = "".join(page.read_text(encoding="utf-8") for page in pages)
    if heading is None:
        return text.split("\n## Shapes\n")[0]
    return text.split(f"## {heading}\n")[1].split("\n## ")[0]


def shown_words(section):
    return {word for code in re.findall(r"`([^`]+)`", section) for word in re.findall(r"\w+", code)}


def test_every_key_of_the_cell_file_that_the_planner_reads_is_in_the_reference():
    planned = [name for name in cell_file_model().model_fields if name not in RUN_SECTIONS]
    keys = {
        *planned,
        *(key for name in planned for key in keys_in(cell_file_model().model_fields[name])),
    }
    assert len(keys) > 60
    assert keys <= shown_words(cell_file_section()) | shown_words(cell_file_section("Shapes"))


@pytest.mark.parametrize("section", RUN_SECTIONS)
def test_every_key_of_a_section_that_a_run_reads_is_in_its_table(section):
    keys = keys_in(cell_file_model().model_fields[section])
    assert keys
    assert keys <= shown_words(cell_file_section(f"Section {section}"))


def test_every_default_of_the_procedure_is_the_one_that_the_reference_tells():
    rows = re.findall(
        r"^\| `procedure\.(\w+)` \|.*\| ([^|]+) \|$",
        cell_file_section("Section procedure"),
        flags=re.MULTILINE,
    )
    told, defaults = dict(rows), ProcedureSettings()
    assert set(told) == set(ProcedureSettings.model_fields)
    assert told.pop("force_limit").startswith("1.3 times the largest load case")
    assert told.pop("force_tolerance").startswith("1 % of the largest load case")
    assert told.pop("collision_force") == "50 N and a fifth of the tool's weight"
    assert told.pop("reference") == f"`{defaults.reference}`"
    assert told.pop("conditioning") == f"`{str(defaults.conditioning).lower()}`"
    for key, text in told.items():
        number, _, unit = text.partition(" ")
        factors = {"ms": 1e-3, "mm/s": 1e-3, "mm": 1e-3, "µm": 1e-6, "µm/N": 1e-6}
        value = float(number) * factors.get(unit, 1.0)
        assert value == pytest.approx(getattr(defaults, key)), key


def test_every_kind_of_fault_has_its_row_in_the_reference():
    section = cell_file_section("Section faults")
    rows = set(re.findall(r"^\| `(\w+)` \| .* \| .* \| .* \|$", section, flags=re.MULTILINE))
    assert rows == set(get_args(FaultKind))


def test_every_fault_that_ends_an_attempt_or_a_run_is_explained():
    page = (ROOT / "docs/how-to/when-a-run-stops.md").read_text(encoding="utf-8")
    table = page.split("| message begins with |")[1].split("\n\n")[0]
    shown = set(re.findall(r"^\| `([^`]+)`", table, flags=re.MULTILINE))
    begins = {fault.message("").rstrip(": ") for fault in Fault} - {"interrupted"}
    assert begins <= shown


def keys_in(field: FieldInfo) -> set[str]:
    """Return the names of all keys below a key, without their paths."""
    found: set[str] = set()
    for model in models_in(field.annotation):
        found |= set(model.model_fields)
        found |= {key for inner in model.model_fields.values() for key in keys_in(inner)}
    return found


def models_in(annotation: object) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [model for part in get_args(annotation) for model in models_in(part)]


def test_the_output_that_the_tutorial_quotes_is_that_of_the_demo():
    folder = finished_demo("afp")
    log = (folder / "log.txt").read_text(encoding="utf-8", errors="replace")
    words = f"{log}\n{demo_result('afp').err}".replace(str(folder), "demo").split()
    page = (ROOT / "docs/tutorial.md").read_text(encoding="utf-8")
    quoted = re.findall(r"^```text\n(.*?)^```", page, flags=re.MULTILINE | re.DOTALL)
    assert len(quoted) > 5
    for block in quoted:
        after(block.split(), words)


def test_the_commands_that_the_tutorial_explains_are_those_of_the_demo():
    page = (ROOT / "docs/tutorial.md").read_text(encoding="utf-8")
    typed = set(re.findall(r"^elastocal (\w[\w-]*)", page, flags=re.MULTILINE))
    assert typed == {"demo", *(each.words[0] for each in chapters("afp", Path("demo"), 0))}


@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_code_in_a_table_of_options_is_not_within_code(name):
    for row in OPTIONS["options_table"](name).splitlines():
        assert "`" not in re.sub(r"`[^`\s](?:[^`]*[^`\s])?`(?!\w)", "", row), row


def test_a_header_of_a_table_may_be_divided_behind_its_separators():
    broken = BREAKS("<td><code>Time;S(deg);L(deg);U(deg)</code></td>")
    assert broken.count(";<wbr>") == 3


def test_lines_of_a_page_end_before_no_unit_and_code_keeps_its_characters():
    code = '<code>elastocal calibrate data.nc --free-frame none --limit "0.3 mm" 5%</code>'
    block = "<pre><code>--limit 3 mm</code></pre>"
    path = '<path d="M0 5 m 3 4"/>'
    broken = BREAKS(f"<td>0.3 mm {code}{block}{path} and 95% of <b>4\nkN</b></td>")
    assert "<td>0.3\xa0mm " in broken
    assert broken.endswith(f"{block}{path} and 95\xa0% of <b>4\xa0kN</b></td>")
    assert '<span class="whole">--free</span>-frame' in broken
    read = re.sub(r"<[^>]*>", "", broken[: broken.index("<pre>")])
    assert read == "0.3\xa0mm " + code[6:-7]
    assert BREAKS("<td>91.9 (90.0 to 93.8)</td>") == "<td>91.9 (90.0\xa0to\xa093.8)</td>"
    assert BREAKS("<td>0.4 → 0.1</td>") == "<td>0.4\xa0→\xa00.1</td>"
    assert BREAKS(r"<td><code>C:\KRC\ROBOTER\Config</code></td>").count("<wbr>") == 2


def test_the_reference_shows_workflows_as_they_are_called(monkeypatch):
    module = sys.modules[codec.__module__]
    monkeypatch.setitem(sys.modules, "plain", module)
    code = Path(module.__file__).read_text(encoding="utf-8")
    with griffe.temporary_visited_package(
        "plain", {"__init__.py": code}, extensions=griffe.load_extensions(PLAIN)
    ) as package:
        called, shown = inspect.signature(codec).parameters, package["codec"]
        assert [each.name for each in shown.parameters] == list(called)
        assert shown.parameters["saturation"].default == repr(called["saturation"].default)
        assert shown.docstring.value == codec.__doc__
        assert "<" not in shown.signature()
        # Fields of settings are told once, as parameters.
        fields = package["CodecSettings"].attributes.values()
        assert fields
        assert not [each for each in fields if each.docstring]


def test_the_reference_leaves_out_no_field_and_confuses_no_parameters():
    code = """
import enum
from elastocal.records import record
@record("doc.base/1", kw_only=True)
class Base:
    kept: int = 1
    '''Told once.'''
@record("doc.made/1")
class Made(Base):
    told: float
    silent: str = "none"
class Colour(enum.Enum):
    GREEN = "green"
_BOUND = 0.5
def both(
    x: float, y: float, n: int, force: float, limit: int = 3, share: float = _BOUND, *,
    name: str = "",
) -> None:
    '''Do it.

    Parameters
    ----------
    x, y, n
        Where, and how often.
    force, limit
        Two. See docs/explanation/observability.md.
    share, name : float, str
        Two more.
    '''
"""
    with griffe.temporary_visited_package(
        "plain",
        {"__init__.py": code},
        extensions=griffe.load_extensions(PLAIN),
        docstring_parser="numpy",
    ) as package:
        made = [each.name for each in package["Made"].parameters]
        assert {"told", "silent"} <= set(made)
        assert package["Base.kept"].docstring.value == "Told once."
        assert package["Colour.GREEN"].docstring is not None  # or it is not shown
        told = {each.name: each for each in package["both"].docstring.parsed[1].value}
        types = {name: str(each.annotation) for name, each in told.items()}
        assert types == {
            "force": "float", "limit": "int", "share": "float", "name": "str",
            "x, y, n": "float, float, int",
        }  # fmt: skip
        defaults = [str(told[name].default) for name in ("limit", "share", "name")]
        assert defaults == ["3", "0.5", "''"]
        assert "[observability](../../explanation/observability.md)" in told["force"].description


def test_a_name_that_a_page_of_the_reference_lists_is_there():
    page = "::: elastocal.codec\n    options:\n      members:\n        - judge\n        - nothing\n"
    assert FACES["absent"](page) == ["elastocal.codec.nothing"]


def test_the_reference_shows_types_and_examples_plainly():
    code = """
from typing import Annotated
Force = Annotated[float, 2]
class Settings:
    '''What it takes.

    ======= ==============
    `paths` files that are
            read
    `none`  nothing
    ======= ==============
    '''

    paths: tuple[Annotated[str, 3], ...] | None = None
def read(path: Annotated[str, 3]) -> Annotated[int, 4]:
    '''Return it.

    >>> read("a")
    1

    Raises
    ------
    TypeError
        Or not.

    >>> read("b")
    2
    '''
"""
    extensions = griffe.load_extensions(PLAIN)
    with griffe.temporary_visited_package(
        "plain", {"__init__.py": code}, extensions=extensions
    ) as package:
        read, paths = package["read"], package["Settings.paths"]
        listed = "- `paths`: files that are read\n- `none`: nothing"
        assert package["Settings"].docstring.value == f"What it takes.\n\n\n{listed}"
        assert str(package["Force"].value) == "float"
        assert str(paths.annotation) == "tuple[str, ...] | None"
        assert (str(read.parameters["path"].annotation), str(read.returns)) == ("str", "int")
        fenced = '```pycon\n>>> read("a")\n1\n```'
        assert read.docstring.value.startswith(f"Return it.\n\n{fenced}\n\nRaises")
        assert read.docstring.value.endswith('Or not.\n\nExamples\n--------\n>>> read("b")\n2')
