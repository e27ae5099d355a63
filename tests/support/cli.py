"""Run the command line in this process, as a user would see it."""

import signal

from elastocal.testing import CommandOutput as Result, run_command as elastocal

__all__ = ["ENTRY", "PATIENCE", "Result", "default_signals", "elastocal"]

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


def default_signals() -> None:
    """Let a child take signals as on a terminal, whoever started the tests (``preexec_fn``).

    What ``nohup`` or a job in the background ignores is inherited, and rightly stays ignored.
    """
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)
