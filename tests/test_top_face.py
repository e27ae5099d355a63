"""``import elastocal as ec``: every command, the nouns, the readers; nothing before it is used."""

import dataclasses
import inspect
import pydoc
import subprocess
import sys

import numpy as np
import pytest

import elastocal as ec
from elastocal.cli.commands import COMMANDS
from elastocal.elastic import Hinge
from elastocal.robot import parse_urdf
from elastocal.workflows._inputs import find_robot

OTHERWISE = {"import": "import_logs"}
"""Commands whose name is a word of Python."""


def test_every_command_is_a_function_of_the_top_face():
    missing = [
        name
        for name in COMMANDS
        if name != "robots"
        and not callable(getattr(ec, OTHERWISE.get(name, name.replace("-", "_")), None))
    ]
    assert missing == []


WITHOUT_EXAMPLE = {
    *("demo", "guess_map", "import_logs", "import_positions", "krc_config", "live"),
    *("measure_delay", "read_dataset", "read_plan", "release", "report", "simulate"),
    *("simulate_process", "studio", "study", "tool", "touch", "watch"),
}
"""They need a device, a person, or the files of a long chain. No other joins them."""


def test_functions_of_the_top_face_show_an_example_that_runs():
    # Packages that bear the name of a command have a description of their own.
    found = {name: getattr(ec.workflows, name, getattr(ec, name)) for name in ec.__all__}
    without = {
        name
        for name, each in found.items()
        if inspect.isfunction(each) and "Examples" not in (each.__doc__ or "")
    }
    assert without == WITHOUT_EXAMPLE


def test_a_package_that_bears_the_name_of_a_command_does_not_hide_it():
    from elastocal.codec import CodecOptions
    from elastocal.report import write_plan_page

    assert CodecOptions.__module__.startswith("elastocal.codec")
    assert callable(write_plan_page)
    import elastocal.codec as package

    assert package is ec.codec
    assert package.CodecOptions is CodecOptions
    assert next(iter(inspect.signature(ec.codec).parameters)) == "data"
    assert next(iter(inspect.signature(ec.report).parameters)) == "run"
    with pytest.raises(TypeError, match=r"codec\(\) needs 'data'"):
        ec.codec()


@pytest.mark.slow
def test_packages_are_completed_and_found_without_being_imported():
    code = "import elastocal as ec; print(ec.identification.calibrate.__name__, *dir(ec))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    shown = done.stdout.split()
    assert shown[0] == "calibrate"
    assert {"codec", "datasets", "elastic", "geometry", "identification", "robot"} < set(shown)
    assert not [name for name in shown if name.startswith("_") and name != "__version__"]
    assert not {"arrays", "blocks", "cli", "files", "locks", "templating", "wording"} & set(shown)


@pytest.mark.parametrize("name", ["codec", "geometry", "report", "studio"])
def test_help_on_a_command_that_is_also_a_package_is_that_of_the_command(name):
    package = getattr(ec, name)
    text = pydoc.render_doc(package, renderer=pydoc.plaintext)
    first, *_ = ec.workflows.__dict__[name].__doc__.splitlines()
    assert f"elastocal.{name} - {first}" in text
    assert "Parameters\n    ----------" in text
    assert len(text) < 6000
    star: dict[str, object] = {}
    exec(f"from elastocal.{name} import *", star)
    assert len(star) > 3


def test_signatures_name_their_types():
    functions = (ec.Robot.forward, ec.ElasticModel.deflection, ec.Dataset.from_arrays)
    for each in (*functions, ec.identification.CalibratedModel.predict):
        signature = str(inspect.signature(each))
        assert "ArrayLike" in signature
        assert "_SupportsArray" not in signature


def test_every_field_of_the_settings_stands_in_help_and_in_the_signature():
    for name in ("calibrate", "plan", "run", "codec", "report", "import_logs", "simulate_process"):
        command = getattr(ec.workflows, name)
        text, parameters = inspect.getdoc(command), inspect.signature(command).parameters
        missing = [each for each in parameters if f"\n{each} : " not in text]
        assert missing == [], name
        assert "settings :" not in text
        assert "\nReturns\n-------\n" in text
        assert "Annotated" not in str(inspect.signature(command))


def test_help_on_settings_shows_no_option_of_a_command_line():
    assert ec.new
    for name in ("CheckSettings", "PlanSettings", "CalibrateSettings", "NewSettings"):
        settings = getattr(ec.workflows, name)
        assert (
            "Option(" not in f"{inspect.signature(settings)}{inspect.signature(settings.__init__)}"
        )


def test_what_has_no_default_may_be_given_by_place():
    assert [*inspect.signature(ec.compare).parameters][:3] == ["old", "new", "progress"]
    with pytest.raises(TypeError, match=r"compare\(\) needs 'new'"):
        ec.compare("a.json")
    with pytest.raises(TypeError, match=r"multiple values for 'old'"):
        ec.compare("a.json", old="b.json", new="c.json")
    with pytest.raises(TypeError, match="takes 2 arguments without a name"):
        ec.compare("a.json", "b.json", print, "c.json")


@pytest.fixture(scope="module")
def readings():
    return ec.datasets.fanuc_r2000ic()


def test_calibrate_takes_datasets_and_springs_as_objects(readings, tmp_path):
    springs = tuple(Hinge(f"joint_{n}.axial", f"joint_{n}", axis=(0, 0, 1)) for n in range(1, 5))
    found = ec.calibrate(readings, springs=iter(springs), out=tmp_path / "model.json")
    assert found.springs == springs
    assert found.calibration.settings.springs == "given"
    again = ec.read_model(tmp_path / "model.json")
    assert again.model.springs == springs
    named = ec.calibrate([readings, readings], springs="actuated")
    assert [*named.made_from] == ["dataset 1", "dataset 2"]
    assert named.calibration.readings == 2 * len(readings.poses)


@pytest.mark.slow
def test_calibrate_takes_a_robot_and_the_path_of_springs(readings, tmp_path):
    robot = ec.Robot.from_urdf(readings.robot_urdf, readings.tcp_frame)
    sideways = dataclasses.replace(robot, gravity=(0.0, 9.80665, 0.0))
    springs = tmp_path / "springs.yaml"
    springs.write_text("schema: elastocal.springs/1\ninclude: actuated\n", encoding="utf-8")
    found = ec.calibrate(readings, robot=sideways, springs=springs, out=tmp_path / "model.json")
    again = ec.read_model(tmp_path / "model.json").model
    assert again.robot.urdf_hash == robot.urdf_hash
    assert (again.robot.tip, again.robot.gravity) == (robot.tip, sideways.gravity)
    assert found.calibration.settings.springs == str(springs)
    by_name = ec.calibrate(readings, springs="actuated")
    np.testing.assert_allclose(found.compliance, by_name.compliance)


def test_a_robot_given_keeps_its_base_and_takes_another_tool():
    robot = ec.robot.catalogue.load("UR20")
    shifted = find_robot(robot, None, "0 mm, 0 mm, 100 mm, 0 deg, 0 deg, 0 deg")
    q = np.zeros(len(robot.joint_names))
    z = robot.forward(q)[:3, 2]
    np.testing.assert_allclose(shifted.forward(q)[:3, 3], robot.forward(q)[:3, 3] + 0.1 * z)
    link = robot.chain.joints[0].name
    links = parse_urdf(robot.urdf).iterfind(f"joint[@name='{link}']/child")
    from_link = ec.Robot.from_urdf(robot.urdf, robot.tip, next(links).get("link"))
    assert find_robot(from_link, None, None).base == from_link.base


def test_models_are_taken_as_objects(readings, tmp_path):
    old = ec.calibrate(readings, springs="actuated", out=tmp_path / "old.json")
    new = ec.calibrate(readings, springs="actuated", exclude=("0", "1"), out=tmp_path / "new.json")
    by_objects = ec.compare(old, new.calibrated)
    by_files = ec.compare(tmp_path / "old.json", tmp_path / "new.json")
    assert by_objects.summary.springs == by_files.summary.springs
    with pytest.raises(ec.errors.IdentificationError, match="one and the same model"):
        ec.compare(old, old)


def test_what_the_face_names_is_there():
    assert [name for name in ec.__all__ if not hasattr(ec, name)] == []
    assert isinstance(ec.__version__, str)


def test_importing_it_imports_nothing_heavy():
    code = "import sys, elastocal; print(sorted(set(sys.modules) & {'numpy', 'pydantic', 'rich'}))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
