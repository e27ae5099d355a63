"""The way to a Dask scheduler, and the refusal of what is none.

Dask's own client goes on trying and closing long after its timeout, and prints what it tries.
So the scheduler is asked who it is first, by one message with one deadline.
"""

import asyncio
import logging
from collections.abc import Callable
from typing import Any

from elastocal.errors import CodecError

PATIENCE = 10.0
"""Longest time that a scheduler or its first worker may take to answer, in s."""
_SCHEDULER = "Scheduler"
_LOGGERS = ("distributed", "distributed.client")
"""They print tracebacks of what is refused here in one line."""


def check_scheduler(address: str) -> None:
    """Refuse an address where no Dask scheduler answers in time.

    Parameters
    ----------
    address : str
        E.g. ``tcp://10.0.0.5:8786``.

    Raises
    ------
    CodecError
        If Dask is not installed, nothing answers, or what answers is no scheduler.
    """
    try:
        import distributed  # noqa: F401 - sets the levels of its loggers
    except ImportError as error:
        raise CodecError(
            "--dask needs Dask, which is not installed: pip install 'elastocal[dask]'"
        ) from error
    from tornado.websocket import WebSocketError

    for name in _LOGGERS:
        logging.getLogger(name).setLevel(logging.CRITICAL)
    try:
        found = asyncio.run(asyncio.wait_for(_identity(address), PATIENCE))
    except (OSError, ValueError, TypeError, EOFError, MemoryError, WebSocketError) as error:
        # Memory: other services' first letters are read as the length of a message.
        raise CodecError(
            f"--dask {address}: no Dask scheduler answers there within {PATIENCE:g} s (an address"
            " looks like tcp://10.0.0.5:8786)"
        ) from error
    if found != _SCHEDULER:
        raise CodecError(
            f"--dask {address}: a Dask {found.lower()} answers there, not a scheduler: give the"
            " address that `dask scheduler` printed"
        )


def connected(address: str) -> Any:
    """Return a client of a Dask scheduler.

    Raises
    ------
    CodecError
        As `check_scheduler`.
    """
    check_scheduler(address)
    from distributed import Client

    make: Callable[..., Any] = Client
    try:
        return make(address, timeout=PATIENCE, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        raise CodecError(f"--dask {address}: the Dask scheduler has stopped answering") from error


async def _identity(address: str) -> str:
    """Return what kind of Dask process answers."""
    from distributed.comm.core import connect

    reach: Callable[..., Any] = connect
    comm = await reach(address, timeout=PATIENCE)
    try:
        await comm.write({"op": "identity"})
        answer = await comm.read()
    finally:
        comm.abort()
    return str(answer.get("type", "process") if isinstance(answer, dict) else "process")
