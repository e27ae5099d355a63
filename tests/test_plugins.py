"""Plug-ins of other packages: found by their entry points, in every process."""

import importlib
import json
import multiprocessing
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from elastocal.cell import fingerprint, load_cell, write_example
from elastocal.compensation import read_settings
from elastocal.compensation.conditioning import FILTERS, FilterChain
from elastocal.elastic import KINDS, ElasticModel, bearing, layout
from elastocal.errors import ElastocalError, PlanningError, PluginError, SchemaError
from elastocal.identification import LOSSES, CalibratedModel, Observability, read_model, write_model
from elastocal.planning import CHECKS, Postures, cell_surface
from elastocal.planning.checks import check_margins
from elastocal.planning.pool import robot_checks
from elastocal.planning.search import CRITERIA, TECHNIQUES
from elastocal.plugins import KINDS as KINDS_OF_PLUGINS, Registry
from elastocal.report.document import write_report
from elastocal.report.language import language_of
from elastocal.testing import CheckSuite, FilterSuite
from elastocal.verdict import Evidence
from support import plugged, shown
from support.cells import robot
from support.cli import elastocal
from support.pools import choice

ROOT = Path(__file__).parents[1]


@pytest.fixture
def examples(tmp_path, monkeypatch):
    """The examples as if they were installed; forgotten afterwards."""
    before = set(sys.modules)
    for name in plugged.NAMES:
        for folder in plugged.example(tmp_path / name, name):
            monkeypatch.syspath_prepend(folder)
    yield os.pathsep.join(sys.path)
    for name in set(sys.modules) - before:
        if name.startswith("elastocal_"):
            del sys.modules[name]


def offered(tmp_path, monkeypatch, source, group="elastocal.losses", name="odd"):
    """Install a module with an entry point ``odd_module:THING``."""
    folder = plugged.describe(tmp_path / "site", "odd-things", {group: {name: "odd_module:THING"}})
    (folder / "odd_module.py").write_text(source)
    monkeypatch.syspath_prepend(str(folder))
    monkeypatch.delitem(sys.modules, "odd_module", raising=False)


def command_of(tmp_path, monkeypatch, source, doc='"""Show odd things."""'):
    """Install a command ``odd``, whose ``run`` and ``show`` are in a source, from its line 9 on."""
    head = (
        "from dataclasses import dataclass\nfrom elastocal.plugins import Command\n"
        "from elastocal.wording import phrase\n@dataclass(frozen=True)\nclass Settings:\n"
        f"    {doc}\n"
        "    force: float = 1.0\n    most: int = 1\n"
    )
    made = f"{head}{source}THING = Command(Settings, run, show)\n"
    offered(tmp_path, monkeypatch, made, "elastocal.commands")


@pytest.mark.parametrize("kind", KINDS_OF_PLUGINS)
def test_every_kind_has_a_registry_of_its_own_and_a_class_that_is_expected(kind):
    form = KINDS_OF_PLUGINS[kind]
    for place in (form.home, form.expected):
        module, _, name = place.partition(":")
        assert hasattr(importlib.import_module(module), name), place
    module, _, name = form.home.partition(":")
    registry = getattr(importlib.import_module(module), name)
    if kind in ("command", "words"):  # of its own form: typer's, and catalogues
        return
    assert isinstance(registry, Registry)
    assert registry.kind == kind
    assert len(registry) >= len(registry.own)
    assert registry.own or kind == "filter"  # those of elastocal have keys of their own


def model_with_a_spring_of_another_package(path: Path) -> CalibratedModel:
    spring = KINDS["softening"]("joint_2.soft", "joint_2", (1.0, 0.0, 0.0))
    model = ElasticModel(robot(), (*bearing(robot()), spring))
    n = len(model.parameters)
    c = np.linspace(1e-7, 2e-7, n)
    made = CalibratedModel(model, c, np.tile(c, (40, 1)), Observability(n, 1.0, (True,) * n, ()))
    write_model(path, made)
    return made


@pytest.mark.slow
def test_a_model_file_with_a_spring_of_a_plug_in_is_read_by_a_fresh_process(examples, tmp_path):
    made = model_with_a_spring_of_another_package(tmp_path / "model.json")
    code = (
        "from elastocal.identification import read_model; from pathlib import Path; import sys\n"
        "assert 'elastocal_softening' not in sys.modules\n"
        f"print(read_model(Path({str(tmp_path / 'model.json')!r})).model.springs[-1])"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "PYTHONPATH": examples},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip() == repr(made.model.springs[-1])


def test_a_model_file_names_the_distribution_that_it_needs(examples, tmp_path, monkeypatch):
    file = tmp_path / "model.json"
    made = model_with_a_spring_of_another_package(file)
    assert read_model(file).model.springs == made.model.springs
    with monkeypatch.context() as without:
        without.setattr(sys, "path", [each for each in sys.path if "elastocal-" not in each])
        with pytest.raises(PluginError, match=r"needs elastocal-softening \(made with 1\.0\), wh"):
            read_model(file)


def test_a_key_that_a_spring_of_a_plug_in_does_not_have_is_refused_by_its_place(examples, tmp_path):
    file = tmp_path / "model.json"
    model_with_a_spring_of_another_package(file)
    text = file.read_text()
    assert text.count('"opening": 1000.0') == 1
    file.write_text(text.replace('"opening": 1000.0', '"opening": "wide"'))
    with pytest.raises(SchemaError, match=r"springs\.18\.opening: Input should be a valid number"):
        read_model(file)


def test_a_spring_file_gives_settings_of_a_spring_of_a_plug_in(examples, tmp_path):
    file = tmp_path / "springs.yaml"
    entry = "{joint: joint_2, axis: x, kind: softening, settings: {opening: 250.0}}"
    file.write_text(f"schema: elastocal.springs/1\nsprings: [{entry}]")
    (spring,) = layout(robot(), str(file))
    assert spring == KINDS["softening"]("joint_2.softening-x", "joint_2", (1.0, 0, 0), opening=250)


@pytest.mark.slow
def test_a_technique_of_a_plug_in_works_in_other_processes(examples):
    """They know it by its name, as those of a study do."""
    assert "exchange-t" in TECHNIQUES
    assert CRITERIA.sources(["d", "t"]) == {"elastocal-trace": "1.0"}
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        assert pool.apply(choice, ["exchange-t"]) == choice("exchange-t")


def test_names_are_known_without_importing_a_package(examples):
    assert {"softening", "gear"} < set(KINDS)
    assert "softening" in KINDS
    assert "elastocal_softening" not in sys.modules


class TestAPlugInThatCannotBeUsed:
    def refused(self, name="odd"):
        with pytest.raises(PluginError) as caught:
            LOSSES.named(name)
        assert "\n" not in str(caught.value)
        assert isinstance(caught.value, ElastocalError)
        return str(caught.value)

    @pytest.mark.parametrize(
        ("source", "reason"),
        [
            ("import no_such_package", "ModuleNotFoundError: No module named 'no_such_package'"),
            ("THING = ", "SyntaxError: invalid syntax"),
            ("OTHER = 1", "AttributeError: module 'odd_module' has no attribute 'THING'"),
            ("1 / 0", "ZeroDivisionError: division by zero"),
        ],
    )
    def test_one_that_cannot_be_imported_names_its_distribution_and_why(
        self, tmp_path, monkeypatch, source, reason
    ):
        offered(tmp_path, monkeypatch, source)
        start = f"loss 'odd' of odd-things 1.0 cannot be loaded: {reason}"
        assert self.refused().startswith(start)

    def test_one_of_another_kind_names_what_it_is_not(self, tmp_path, monkeypatch):
        offered(tmp_path, monkeypatch, "THING = 3")
        assert self.refused() == (
            "loss 'odd' of odd-things 1.0: odd_module:THING is not a Callable"
        )
        offered(tmp_path / "b", monkeypatch, "THING = len", "elastocal.springs")
        with pytest.raises(PluginError, match="odd_module:THING is not a subclass of Spring"):
            KINDS["odd"]

    def test_a_class_that_is_not_finished_names_what_is_missing(self, tmp_path, monkeypatch):
        source = "from elastocal.elastic import OneAxisSpring as THING"
        offered(tmp_path, monkeypatch, source, "elastocal.springs")
        with pytest.raises(
            PluginError, match=r"does not define angles, kind, parameters, tangents$"
        ):
            KINDS["odd"]

    @pytest.mark.parametrize(
        ("at", "reason"),
        [
            (
                "at = classmethod(lambda cls: cls)",
                "kind of spring 'odd' of odd-things 1.0 cannot be used: TypeError: .*argument",
            ),
            (
                "def at(place): pass",
                "spring 'joint_2.odd-axial': kind of spring 'odd' makes a NoneType of it",
            ),
        ],
    )
    def test_a_spring_that_cannot_be_made_is_named(self, tmp_path, monkeypatch, at, reason):
        source = f"import elastocal.elastic as e\nclass THING(e.Gear):\n    {at}"
        offered(tmp_path, monkeypatch, source, "elastocal.springs")
        file = tmp_path / "springs.yaml"
        file.write_text("schema: elastocal.springs/1\nsprings: [{joint: joint_2, kind: odd}]")
        with pytest.raises(ElastocalError, match=reason):
            layout(robot(), str(file))

    @pytest.mark.parametrize(
        ("law", "reason"),
        [
            ("((math.sqrt(load.torque[0]),),)", "cannot be used: TypeError: must be real number"),
            ("((load.torque[0],) * 3,)", r"law of spring 'joint_2.odd-axial' has \[3\] entries by"),
        ],
    )
    def test_a_law_that_takes_no_names_is_named_before_the_work(
        self, tmp_path, monkeypatch, law, reason
    ):
        source = (
            "import math\nfrom typing import Literal\nimport elastocal.elastic as e\n"
            "from elastocal.records import record\n@record()\nclass THING(e.Hinge):\n"
            "    kind: Literal['odd'] = 'odd'\n"
            f"    def angles(self, load):\n        return {law}"
        )
        offered(tmp_path, monkeypatch, source, "elastocal.springs")
        file = tmp_path / "springs.yaml"
        file.write_text("schema: elastocal.springs/1\nsprings: [{joint: joint_2, kind: odd}]")
        with pytest.raises(ElastocalError, match=reason):
            ElasticModel(robot(), layout(robot(), str(file)))

    def test_two_of_one_name_are_refused_with_both_distributions(self, tmp_path, monkeypatch):
        for name in ("first", "second"):
            losses = {"elastocal.losses": {"odd": "math:e"}}
            monkeypatch.syspath_prepend(str(plugged.describe(tmp_path / name, name, losses)))
        assert self.refused() == (
            "loss 'odd' is in first 1.0 and second 1.0: one of them has to be removed"
        )

    def test_it_harms_nothing_that_does_not_ask_for_it(self, tmp_path, monkeypatch):
        offered(tmp_path, monkeypatch, "1 / 0")
        assert LOSSES.named("huber") is LOSSES["huber"]
        with pytest.raises(ElastocalError, match=r"'huber'\? .*linear, huber, cauchy, odd"):
            LOSSES.named("hubr")

    def test_a_name_of_elastocal_stays_its_own(self, tmp_path, monkeypatch):
        own = LOSSES["huber"]
        offered(tmp_path, monkeypatch, "THING = len", name="huber")
        assert LOSSES["huber"] is own
        assert list(LOSSES) == ["linear", "huber", "cauchy"]


@pytest.mark.usefixtures("examples")
class TestACommandOfAPlugIn:
    def test_help_lists_it_without_importing_it(self):
        shown = elastocal("--help").out
        assert "softest" in shown
        assert "elastocal-softest 1.0" in shown
        assert "elastocal_softest" not in sys.modules

    def test_its_arguments_and_options_are_those_of_its_settings(self):
        shown = elastocal("softest", "--help").out
        for text in ("Model file", "--most", "How many springs", "--json", "List the springs of a"):
            assert text in shown
        assert elastocal("softest", "--moist", 3).code == 2

    def test_it_shows_blocks_and_prints_json(self, tmp_path):
        made = model_with_a_spring_of_another_package(tmp_path / "model.json")
        shown = elastocal("softest", tmp_path / "model.json", "--most", 2)
        assert shown.code == 0
        assert "yield most" in shown.err
        last = made.model.parameter_names[-1]
        assert f"{last} 0.200" in " ".join(shown.err.replace("│", " ").split())
        printed = json.loads(elastocal("softest", tmp_path / "model.json", "--json").out)
        assert next(iter(printed["springs"])) == last

    @pytest.mark.slow
    def test_its_result_is_a_page_in_another_language(self, examples, tmp_path):
        model_with_a_spring_of_another_package(tmp_path / "model.json")
        page = tmp_path / "softest.html"
        asked = ("softest", "model.json", "--most", "2", "--page", page, "--page-language", "de")

        def done():
            return subprocess.run(
                [sys.executable, "-m", "elastocal", *asked],
                cwd=tmp_path,
                env={**os.environ, "PYTHONPATH": examples},
                capture_output=True,
                text=True,
                check=False,
            )

        for _ in range(2):  # a page of this command may be replaced by one
            found = done()
            assert found.returncode == 0, found.stderr
        text = page.read_text("utf-8")
        assert 'lang="de"' in text
        assert "geben am meisten nach" in text
        assert shown.Cells(text).rows[1][0].startswith("joint_")
        page.write_text("somebody's", "utf-8")
        assert done().stderr.endswith("no former output of this command; name another file\n")
        assert page.read_text("utf-8") == "somebody's"

    def test_what_it_refuses_is_one_line(self, tmp_path):
        refused = elastocal("softest", tmp_path / "model.json", "--most", 0)
        assert refused.code == 1
        assert refused.reason.endswith("--most 0 springs: must be at least 1")

    def test_one_that_cannot_be_imported_names_its_distribution(self, tmp_path, monkeypatch):
        offered(tmp_path, monkeypatch, "1 / 0", "elastocal.commands")
        assert "odd" in elastocal("--help").out
        reason = elastocal("odd").reason
        assert "command 'odd' of odd-things 1.0 cannot be loaded: ZeroDivisionError" in reason

    @pytest.mark.parametrize(
        ("work", "show"), [("return 1 / 0", "return ()"), ("return 3", "yield 1 / 0")]
    )
    def test_one_that_fails_names_its_distribution_and_the_line(
        self, tmp_path, monkeypatch, work, show
    ):
        command_of(tmp_path, monkeypatch, f"def run(_):\n    {work}\ndef show(_):\n    {show}\n")
        line = 10 if "1 / 0" in work else 12
        assert elastocal("odd").reason.endswith(
            "command 'odd' of odd-things 1.0 cannot be used: ZeroDivisionError: division by zero"
            f" (odd_module.py:{line})"
        )

    def test_settings_that_say_nothing_are_refused_in_a_line(self, tmp_path, monkeypatch):
        command_of(tmp_path, monkeypatch, "run = show = len\n", doc="")
        for words in (("odd",), ("odd", "--help")):
            assert elastocal(*words).reason.endswith(
                "command 'odd' of odd-things 1.0 cannot be used: LookupError:"
                " module odd_module has no function or class Settings with a docstring"
            )

    def test_a_force_of_it_is_an_option_like_others(self, tmp_path, monkeypatch):
        """Of elastocal's commands, --force lets files be replaced and is listed last."""
        command_of(tmp_path, monkeypatch, "run = show = len\n")
        shown = elastocal("odd", "--help").out
        assert shown.index("--force") < shown.index("--most") < shown.index("--page")

    def test_a_phrase_without_words_is_marked_as_english_on_a_german_page(
        self, tmp_path, monkeypatch
    ):
        source = (
            "from elastocal.blocks import Paragraph\ndef run(_):\n    return 3\n"
            "def show(_):\n    yield Paragraph(phrase('{n} odd ones', n=phrase('3')))\n"
        )
        command_of(tmp_path, monkeypatch, source)
        page = tmp_path / "odd.html"
        assert elastocal("odd", "--page", page, "--page-language", "de").code == 0
        assert '<span lang="en">3 odd ones</span>' in page.read_text("utf-8")

    def test_its_phrases_are_said_in_german(self):
        language_of.cache_clear()
        import elastocal_softest

        first, *_ = elastocal_softest.show(elastocal_softest.Softest("Arm", {}))
        try:
            assert (
                language_of("de").say(first.text) == "Diese Federn von Arm geben am meisten nach."
            )
        finally:
            language_of.cache_clear()


def passes(folder: str, python: Path | str, path: str) -> None:
    """Run the tests of an example as its author does."""
    done = subprocess.run(
        [python, "-m", "pytest", "-q", "-p", "no:cacheprovider", folder],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": path, "PYTEST_ADDOPTS": ""},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert " passed" in done.stdout


NIGHTLY = ("elastocal-softening", "elastocal-softest")


@pytest.mark.parametrize(
    "name",
    [
        # The command of the one and the spring of the other are tried above by day.
        pytest.param(name, marks=[pytest.mark.slow] if name in NIGHTLY else [])
        for name in plugged.NAMES
    ],
)
def test_an_example_passes_the_suites_of_elastocal(name, tmp_path):
    path = plugged.example(tmp_path, name)
    passes(path[1], sys.executable, os.pathsep.join(path))


@pytest.mark.slow
@pytest.mark.parametrize("name", plugged.NAMES)
def test_an_example_can_be_installed(name, tmp_path):
    uv = shutil.which("uv", path=os.pathsep.join((str(Path(sys.executable).parent), os.defpath)))
    if uv is None:
        pytest.skip("needs uv")
    source = shutil.copytree(plugged.EXAMPLES / name, tmp_path / name)
    site = tmp_path / "site"
    words = ("pip", "install", "--no-deps", "--target", site)
    subprocess.run([uv, *words, "--python", sys.executable, source], check=True)
    (test,) = source.glob("test_*.py")
    alone = tmp_path / "tests"
    alone.mkdir()
    shutil.copy(test, alone)
    passes(str(alone), sys.executable, str(site))


def test_a_script_adds_one_for_its_process_and_takes_the_place_of_none():
    own = {"cover": "elastocal.planning.search:Cover"}
    techniques = Registry[type]("search technique", own, PlanningError)
    techniques.add("median", list)
    assert techniques["median"] is list
    assert "median" in techniques
    assert list(techniques)[:2] == ["cover", "median"]
    for taken in ("cover", "median"):
        with pytest.raises(PlanningError, match=f"there is a search technique '{taken}' already"):
            techniques.add(taken, dict)


class TestASectionOfAPlugIn:
    def section(self, tmp_path, monkeypatch, work):
        source = (
            "from elastocal.blocks import Paragraph\n"
            "from elastocal.report.document import Section\n"
            "from elastocal.wording import phrase\n"
            f"def blocks(evidence):\n    {work}\n"
            "THING = Section('odd', phrase('Oddities'), phrase('How odd is it?'), 55, blocks)\n"
        )
        offered(tmp_path, monkeypatch, source, "elastocal.sections")

    def test_stands_at_its_place_on_the_page(self, tmp_path, monkeypatch):
        say = "yield Paragraph(phrase('{name} is odd.', name=evidence.name))"
        self.section(tmp_path, monkeypatch, say)
        path = write_report(tmp_path / "r.html", Evidence("2026-01-02T03:04:05Z", "Arm")).path
        text = path.read_text("utf-8")
        assert "Arm is odd." in text
        assert text.index('id="compliances"') < text.index('id="odd"') < text.index('id="codecs"')

    def test_one_that_fails_ends_the_report_with_a_line_and_no_file(self, tmp_path, monkeypatch):
        self.section(tmp_path, monkeypatch, "return evidence.plan.poses")
        with pytest.raises(PluginError, match=r"report section 'odd' of odd-things 1.0 cannot be"):
            write_report(tmp_path / "r.html", Evidence("2026-01-02T03:04:05Z"))
        assert not (tmp_path / "r.html").exists()


class TestACheckOfAPlugIn:
    """The one that the documentation shows."""

    @pytest.fixture(autouse=True)
    def installed(self, tmp_path, monkeypatch):
        page = (ROOT / "docs" / "how-to" / "write-a-plug-in.md").read_text("utf-8")
        shown = page.partition("## A check\n\n```python\n")[2].partition("```")[0]
        source = (
            "from dataclasses import dataclass\nfrom typing import ClassVar\n"
            "import numpy as np\nfrom elastocal.planning.checks import PostureCheck\n"
            "from elastocal.records import StrictModel\nfrom elastocal.wording import phrase\n"
            f"{shown}\nTHING = ReachCheck\n"
        )
        offered(tmp_path, monkeypatch, source, "elastocal.checks", "reach")
        write_example(tmp_path, "machining")

    def cell(self, tmp_path, checks):
        path = tmp_path / "cell.yaml"
        text = path.read_text("utf-8")
        assert "\nlimits:\n" in text
        path.write_text(text.replace("\nlimits:\n", f"\nlimits:\n  checks: {checks}\n"), "utf-8")
        return load_cell(path)

    def test_it_judges_the_cell_that_asks_for_it(self, tmp_path):
        cell = self.cell(tmp_path, "{reach: {most: 1.5}}")
        made = {each.name: each for each in robot_checks(cell, cell_surface(cell)).all}
        far, near = np.eye(4), np.eye(4)
        far[:3, 3], near[:3, 3] = (1.6, 0.0, 0.0), (0.0, 0.6, 0.8)
        places = Postures(
            np.array([far, near]), np.zeros((2, 3)), np.zeros((2, 6)), np.zeros((2, 6)), [0, 1]
        )
        margins = check_margins([made["reach"]], places)
        np.testing.assert_allclose(margins.margin, [[-0.1, 0.5]])
        assert margins.passed.tolist() == [False, True]

    def test_no_other_cell_is_judged_by_it(self, tmp_path):
        cell = load_cell(tmp_path / "cell.yaml")
        assert "reach" not in {each.name for each in robot_checks(cell, cell_surface(cell)).all}

    def test_its_settings_belong_to_the_identity_of_the_cell(self, tmp_path):
        before = fingerprint(load_cell(tmp_path / "cell.yaml"))
        found = {before}
        for k, checks in enumerate(("{reach: {most: 1.5}}", "{reach: {most: 1.6}}")):
            write_example(tmp_path / str(k), "machining")
            found.add(fingerprint(self.cell(tmp_path / str(k), checks)))
        assert len(found) == 3

    @pytest.mark.parametrize(
        ("checks", "reason"),
        [
            ("{reich: {most: 1.5}}", r"unknown check 'reich'; did you mean 'reach'\?.*: reach\)"),
            ("{reach: {moist: 1.5}}", "check reach: unknown key 'moist'"),
            ("{reach: {most: far}}", "check reach: most"),
        ],
    )
    def test_a_slip_of_the_pen_is_refused_when_the_cell_is_read(self, tmp_path, checks, reason):
        with pytest.raises(ElastocalError, match=f"limits.checks.*{reason}"):
            self.cell(tmp_path, checks)

    def test_it_keeps_what_every_check_keeps(self):
        made = CHECKS["reach"](1.5)
        suite = CheckSuite()
        suite.test_has_a_name_a_unit_and_advice(made)
        suite.test_its_class_is_found_by_its_name(made)


class TestAFilterOfAPlugIn:
    """The one that the documentation shows."""

    @pytest.fixture(autouse=True)
    def installed(self, tmp_path, monkeypatch):
        page = (ROOT / "docs" / "how-to" / "write-a-plug-in.md").read_text("utf-8")
        shown = page.partition("## A filter\n\n```python\n")[2].partition("```")[0]
        source = (
            "import math\nfrom typing import Literal\n"
            "from elastocal.compensation.conditioning import Duration, WrenchFilter\n"
            f"{shown}\nTHING = Lag\n"
        )
        offered(tmp_path, monkeypatch, source, "elastocal.filters", "lag")

    def settings(self, tmp_path, text):
        file = tmp_path / "settings.yaml"
        chosen = f"filter: {{low_pass: null, median: 1, others: [{text}]}}"
        file.write_text(f"schema: elastocal.compensator/1\n{chosen}\n", "utf-8")
        return read_settings(file)

    def test_it_is_among_the_filters_and_survives_a_file(self, tmp_path):
        found = self.settings(tmp_path, "{kind: lag, time: 20 ms}")
        chain = found.chain
        assert len(chain.sections) == 1
        # A slope is followed late by the time of the lag, less half a reading of the steps.
        assert float(chain.delay()) == pytest.approx(0.020 - 0.5 * 0.004, abs=1e-4)
        assert found.filter.model_dump()["others"] == ({"kind": "lag", "time": 0.02},)
        assert not found.filter.off().chain(0.004).sections

    @pytest.mark.parametrize(
        ("text", "reason"),
        [
            ("{kind: leg, time: 20 ms}", r"unknown kind 'leg' \(allowed: lag\)"),
            ("{time: 20 ms}", r"unknown kind None \(allowed: lag\)"),
            ("{kind: lag, time: 20}", "lag: time"),
            ("{kind: lag, time: 20 ms, order: 2}", "unknown key 'order'"),
        ],
    )
    def test_a_slip_of_the_pen_is_refused(self, tmp_path, text, reason):
        with pytest.raises(ElastocalError, match=f"filter.others.*{reason}"):
            self.settings(tmp_path, text)

    def test_it_keeps_what_every_filter_keeps(self):
        made = FILTERS["lag"](time="20 ms")
        chain, suite = FilterChain(0.004, 1, made.sections(0.004)), FilterSuite()
        suite.test_its_class_is_found_by_its_kind(made)
        suite.test_a_constant_passes_unchanged(chain)
        suite.test_it_is_stable(chain)
        suite.test_nothing_is_amplified(chain)
        suite.test_it_says_by_how_much_it_delays_a_slow_wrench(chain)
