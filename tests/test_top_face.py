"""``import elastocal as ec``: every command, the nouns, the readers; nothing before it is used."""

import subprocess
import sys

import elastocal as ec
from elastocal.cli.commands import COMMANDS

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


def test_a_package_that_bears_the_name_of_a_command_does_not_hide_it():
    from elastocal.codec import CodecOptions
    from elastocal.report import write_plan_page

    assert CodecOptions.__module__.startswith("elastocal.codec")
    assert callable(write_plan_page)
    assert ec.codec.__module__ == "elastocal.workflows.codec"
    assert ec.report.__module__ == "elastocal.workflows.report"


def test_what_the_face_names_is_there():
    assert [name for name in ec.__all__ if not hasattr(ec, name)] == []
    assert isinstance(ec.__version__, str)


def test_importing_it_imports_nothing_heavy():
    code = "import sys, elastocal; print(sorted(set(sys.modules) & {'numpy', 'pydantic', 'rich'}))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
