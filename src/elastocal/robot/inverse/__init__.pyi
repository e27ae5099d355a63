from .arm import (
    arm_axes as arm_axes,
    arm_base as arm_base,
    turns as turns,
)
from .numerical import (
    NumericalInverse as NumericalInverse,
    inverse_for as inverse_for,
)
from .path_joints import (
    RowName as RowName,
    check_limits as check_limits,
    joints_along_path as joints_along_path,
    joints_beside as joints_beside,
    largest_move as largest_move,
    nearest_zero_posture as nearest_zero_posture,
    posture_jumps as posture_jumps,
    turned_inside as turned_inside,
)
from .solver import (
    InverseKinematics as InverseKinematics,
    pose_error as pose_error,
)
