from ._layout import (
    MADE_FROM as MADE_FROM,
    SCHEMA as SCHEMA,
    SCHEMAS as SCHEMAS,
    STATUSES as STATUSES,
    read_made_from as read_made_from,
    require_joint_names as require_joint_names,
    require_labels as require_labels,
)
from ._store import (
    content_sha256 as content_sha256,
    read as read,
    read_dataset as read_dataset,
    write as write,
)
from .dataset import Dataset as Dataset
from .merging import merge as merge, selected as selected, usable_readings as usable_readings
from .path_columns import (
    LARGEST_FORCE as LARGEST_FORCE,
    LARGEST_MOMENT as LARGEST_MOMENT,
    PathColumns as PathColumns,
    WrenchColumns as WrenchColumns,
    find_columns as find_columns,
    find_names as find_names,
    find_posture_columns as find_posture_columns,
    find_time as find_time,
    find_wrench_columns as find_wrench_columns,
    guess_columns as guess_columns,
    joint_dimensions as joint_dimensions,
    plausible_range as plausible_range,
)
from .path_table import (
    PathRows as PathRows,
    PathTable as PathTable,
    in_file as in_file,
    new_rows as new_rows,
    require_within_a_turn as require_within_a_turn,
)
from .readings import (
    Presses as Presses,
    Readings as Readings,
    without as without,
)
