from ._layout import (
    DOUBTS as DOUBTS,
    MADE_FROM as MADE_FROM,
    SCHEMA as SCHEMA,
    STATUSES as STATUSES,
    read_made_from as read_made_from,
    require_joint_names as require_joint_names,
    require_labels as require_labels,
    write_doubts as write_doubts,
    write_vector as write_vector,
)
from ._store import (
    content_sha256 as content_sha256,
    read as read,
    read_dataset as read_dataset,
    write as write,
)
from .dataset import Dataset as Dataset
from .merging import (
    merge as merge,
    merge_files as merge_files,
)
from .path_columns import (
    LARGEST_FORCE as LARGEST_FORCE,
    LARGEST_MOMENT as LARGEST_MOMENT,
    PathColumns as PathColumns,
    find_columns as find_columns,
    find_posture_columns as find_posture_columns,
    find_wrench_columns as find_wrench_columns,
    guess_columns as guess_columns,
    joint_dimensions as joint_dimensions,
)
from .path_table import (
    Columns as Columns,
    PathRows as PathRows,
    PathTable as PathTable,
    in_file as in_file,
    new_rows as new_rows,
)
from .readings import (
    Readings as Readings,
    excluded_rows as excluded_rows,
    without as without,
)
