from ._version import __version__ as __version__
from .dataset import Dataset as Dataset
from .elastic import ElasticModel as ElasticModel
from .identification import CalibratedModel as CalibratedModel, read_model as read_model
from .robot import Robot as Robot
from .workflows import (
    CalibrateResult as CalibrateResult,
    CalibrateSettings as CalibrateSettings,
    PredictResult as PredictResult,
    PredictSettings as PredictSettings,
    calibrate as calibrate,
    predict as predict,
)
