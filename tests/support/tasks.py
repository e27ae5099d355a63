"""Tasks for processes, which find them by the name of this module."""

import os

import numpy as np
import scipy.linalg  # noqa: F401 (brings a BLAS of its own)
from threadpoolctl import threadpool_info


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
