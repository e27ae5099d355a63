from .branch_solver import pose_error as pose_error
from .choice import inverse_for as inverse_for
from .frames import arm_base as arm_base, inverse_transform as inverse_transform
from .limits import TURN as TURN, turns as turns
from .numerical import NumericalInverse as NumericalInverse
from .opw import OpwInverse as OpwInverse
from .opw_geometry import (
    NotOrthoParallelError as NotOrthoParallelError,
    OpwGeometry as OpwGeometry,
    OpwParameters as OpwParameters,
    derive_opw as derive_opw,
)
from .protocol import InverseKinematics as InverseKinematics, InverseSolutions as InverseSolutions
