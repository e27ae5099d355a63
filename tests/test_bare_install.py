"""The declared dependencies are enough: nothing is found by luck."""

import subprocess
import sys

import pytest

from support import bare

TRY_ALL = """
import importlib, pkgutil
from support import bare
bare.forbid()
import elastocal
for module in pkgutil.walk_packages(elastocal.__path__, "elastocal."):
    # Suites for other packages run under pytest alone.
    if not module.name.startswith("elastocal.testing"):
        importlib.import_module(module.name)
"""


@pytest.mark.slow
def test_every_module_is_imported_with_the_declared_dependencies_alone():
    paths = {"PYTHONPATH": ":".join(path for path in sys.path if path)}
    command = [sys.executable, "-W", "error", "-c", TRY_ALL]
    done = subprocess.run(command, env=paths, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.slow
def test_what_only_the_documentation_needs_is_not_found_by_the_core():
    pytest.importorskip("charset_normalizer")
    assert "charset-normalizer" not in bare.closure(["numpy", "trimesh", "matplotlib"])
    program = (
        "from support import bare; bare.forbid();"
        "from trimesh.util import decode_text; decode_text(b'\\xfc')"
    )
    paths = {"PYTHONPATH": ":".join(path for path in sys.path if path)}
    command = [sys.executable, "-c", program]
    done = subprocess.run(command, env=paths, capture_output=True, text=True, check=False)
    assert "No module named 'charset_normalizer' (bare install)" in done.stderr


def test_the_suite_runs_as_in_a_bare_install():
    assert any(isinstance(finder, bare.BareFinder) for finder in sys.meta_path)


def test_a_closure_follows_what_packages_need():
    assert {"rich", "markdown-it-py", "mdurl"} <= bare.closure(["rich"])
    assert "dask" not in bare.closure(["xarray>=2024.1"])
