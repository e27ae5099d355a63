"""Run the command line in this process, as a user would see it."""

import contextlib
import io
import signal
import sys
from dataclasses import dataclass
from unittest import mock

from elastocal.cli.main import run

PATIENCE = 300.0
"""How long is waited for what must come of another process, in s: on a machine at work two seconds
of a processor may take a minute, and what hangs hangs for ever."""

ENTRY = """
import ctypes, signal, sys
if sys.platform == "linux":
    ctypes.CDLL(None).prctl(1, signal.SIGTERM)  # PR_SET_PDEATHSIG
from elastocal.cli.main import run
run()
"""
"""The command line as a program of its own, for ``python -c``, which ends with the process that
started it: a simulator that a killed test left behind would keep its port."""


@dataclass(frozen=True)
class Result:
    """What a command left behind."""

    code: int
    out: str
    err: str

    @property
    def reason(self) -> str:
        """The one line of a refusal; fails when there is more, less, or a traceback."""
        lines = self.err.strip().splitlines()
        assert self.code == 1, (self.code, self.out, self.err)
        assert len(lines) == 1, self.err
        assert "Traceback" not in self.err
        assert self.out == ""
        return lines[0]


def elastocal(*arguments: object) -> Result:
    """Run ``elastocal ARGUMENTS`` and return its exit code and output."""
    out, err, heard = io.StringIO(), io.StringIO(), signal.getsignal(signal.SIGINT)
    argv = ["elastocal", *map(str, arguments)]
    with (
        mock.patch.object(sys, "argv", argv),
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        try:
            run()
        except SystemExit as stop:
            return Result(int(stop.code or 0), out.getvalue(), err.getvalue())
        finally:
            signal.signal(signal.SIGINT, heard)  # the command line leaves it to the system
    raise AssertionError("run() returned without an exit code")


def default_signals() -> None:
    """Let a child take signals as on a terminal, whoever started the tests (``preexec_fn``).

    What ``nohup`` or a job in the background ignores is inherited, and rightly stays ignored.
    """
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)
