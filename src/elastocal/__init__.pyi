from ._version import __version__ as __version__
from .cell import load_cell as load_cell
from .dataset import Dataset as Dataset, read_dataset as read_dataset
from .elastic import ElasticModel as ElasticModel
from .identification import (
    read_model as read_model,
)
from .planning import read_plan as read_plan
from .robot import Robot as Robot
from .workflows import *  # noqa: F403 - the commands, by the list `__all__`
