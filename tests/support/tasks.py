"""Tasks for processes, which find them by the name of this module."""

import os
import time

import numpy as np
import scipy.linalg  # noqa: F401 (brings a BLAS of its own)
from threadpoolctl import threadpool_info

from elastocal.errors import ProcedureError


def blas_threads():
    return [found["num_threads"] for found in threadpool_info() if found["user_api"] == "blas"]


def square(number):
    return number * number


def here(_):
    return os.getpid()


def threads(_):
    np.linalg.solve(np.eye(3), np.ones(3))
    return blas_threads()


def nothing():
    pass


def die(_):
    os._exit(3)


def tick_until_stopped(outbox):
    """Work for the studio: nothing, until it is stopped."""
    outbox.progress("ticking", 1, 2)
    while not outbox.stopped():
        time.sleep(0.01)
    outbox.tell({"heard": "stop"})
    return {"ended": "well"}


def ask_twice(outbox):
    """Work for the studio: two questions, each until it is answered."""
    for question in (1, 2):
        outbox.tell({"asked": "put it on", "question": question})
        while outbox.answered() != question:
            if outbox.stopped():
                return {"ended": "stopped", "at": question}
            time.sleep(0.01)
    return {"ended": "well"}


def fail(outbox):
    """Work for the studio that cannot be done."""
    raise ProcedureError("it cannot be done")
