from ._version import __version__ as __version__
from .cell import load_cell as load_cell
from .dataset import Dataset as Dataset, read_dataset as read_dataset
from .elastic import ElasticModel as ElasticModel
from .identification import CalibratedModel as CalibratedModel, read_model as read_model
from .planning import read_plan as read_plan
from .robot import Robot as Robot
from .workflows import (
    calibrate as calibrate,
    check as check,
    codec as codec,
    compare as compare,
    compensate as compensate,
    demo as demo,
    derive as derive,
    export as export,
    init as init,
    plan as plan,
    predict as predict,
    report as report,
    run as run,
    simulate_process as simulate_process,
    stiffness as stiffness,
    study as study,
    tool as tool,
)
