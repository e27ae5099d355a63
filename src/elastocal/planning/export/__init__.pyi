from ._krl_motion import takes_krl as takes_krl
from .krl_program import check_name as check_name, write_krl as write_krl
from .table import (
    PLAN_TABLE as PLAN_TABLE,
    pose_lines as pose_lines,
    write_table as write_table,
)
