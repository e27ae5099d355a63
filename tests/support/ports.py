"""Ports of loopback that are bound later, by another object or another process."""

import itertools
import os
import socket

# Below what Linux gives to sockets that ask for any port (32768 on), so that none of them takes one
# between the question and the answer; a part of it for each worker of the tests.
_FIRST, _A_WORKER = 20000, 500
_WORKER = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0").removeprefix("gw"))
_PORTS = itertools.cycle(range(_FIRST + _WORKER * _A_WORKER, _FIRST + (_WORKER + 1) * _A_WORKER))


def free(kind: socket.SocketKind) -> int:
    """Return the next port of this worker that nothing has."""
    for port in itertools.islice(_PORTS, _A_WORKER):
        with socket.socket(socket.AF_INET, kind) as line:
            try:
                line.bind(("127.0.0.1", port))
            except OSError:
                continue
            return port
    raise OSError(f"every port of worker {_WORKER} is taken")
