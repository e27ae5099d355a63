from .arm import (
    TURN as TURN,
    AxisLines as AxisLines,
    arm_axes as arm_axes,
    arm_base as arm_base,
    arm_joints as arm_joints,
    nearest_zero as nearest_zero,
    turns as turns,
)
from .numerical import NumericalInverse as NumericalInverse, inverse_for as inverse_for
from .opw import (
    NotOrthoParallelError as NotOrthoParallelError,
    OpwGeometry as OpwGeometry,
    OpwInverse as OpwInverse,
    OpwParameters as OpwParameters,
    derive_opw as derive_opw,
    opw_branches as opw_branches,
)
from .parallel import (
    NotParallelError as NotParallelError,
    ParallelGeometry as ParallelGeometry,
    ParallelInverse as ParallelInverse,
    derive_parallel as derive_parallel,
)
from .path_joints import (
    RowName as RowName,
    check_limits as check_limits,
    joints_along_path as joints_along_path,
    largest_move as largest_move,
    nearest_zero_posture as nearest_zero_posture,
    posture_jumps as posture_jumps,
    turned_inside as turned_inside,
)
from .solver import (
    InverseKinematics as InverseKinematics,
    InverseSolutions as InverseSolutions,
    distinct as distinct,
    pose_error as pose_error,
    reaches as reaches,
)
