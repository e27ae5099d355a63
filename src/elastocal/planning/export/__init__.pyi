from .table import (
    PLAN_TABLE as PLAN_TABLE,
    pose_lines as pose_lines,
    write_table as write_table,
)
