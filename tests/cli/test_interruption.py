"""Signals that end or halt a program are taken note of while an arm may press."""

import os
import signal

import pytest

from elastocal.cli._operator import NAMES, interruption


@pytest.mark.parametrize("name", [name for name in NAMES if hasattr(signal, name)])
def test_a_signal_is_noted_and_does_nothing_else(name):
    number = getattr(signal, name)
    before = signal.getsignal(number)
    with interruption() as asked:
        assert not asked()
        os.kill(os.getpid(), number)
        assert asked()
    assert signal.getsignal(number) is before


def test_what_a_terminal_sends_when_it_is_closed_or_halts_a_program_is_among_them():
    assert {"SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGTSTP"} == set(NAMES)
