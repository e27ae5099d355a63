from ._layout import (
    MADE_FROM as MADE_FROM,
    SCHEMA as SCHEMA,
    SCHEMAS as SCHEMAS,
    STATUSES as STATUSES,
    read_made_from as read_made_from,
)
from ._store import (
    content_sha256 as content_sha256,
    read as read,
    read_dataset as read_dataset,
    write as write,
)
from .dataset import Dataset as Dataset
from .load_rows import (
    LARGEST_FORCE as LARGEST_FORCE,
    LARGEST_MOMENT as LARGEST_MOMENT,
    LoadRows as LoadRows,
    joint_dimensions as joint_dimensions,
    read_load_rows as read_load_rows,
    read_robot_rows as read_robot_rows,
    write_load_rows as write_load_rows,
)
from .merging import merge as merge, selected as selected
from .path_table import (
    PathColumns as PathColumns,
    PathValues as PathValues,
    WrenchColumns as WrenchColumns,
    find_columns as find_columns,
    find_wrench_columns as find_wrench_columns,
    in_file as in_file,
    read_layout as read_layout,
    read_values as read_values,
    require_within_a_turn as require_within_a_turn,
    row_blocks as row_blocks,
    turned_to_base as turned_to_base,
    wrench_in_base as wrench_in_base,
)
from .readings import (
    Presses as Presses,
    Readings as Readings,
    usable_readings as usable_readings,
    without as without,
)
