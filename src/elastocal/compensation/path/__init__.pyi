from .angles import beyond_a_turn as beyond_a_turn
from .columns import (
    PathColumns as PathColumns,
    Wrench as Wrench,
    find_columns as find_columns,
    find_wrenches as find_wrenches,
)
from .errors import PathError as PathError, in_file as in_file
from .text import (
    Piece as Piece,
    TextLayout as TextLayout,
    count_lines as count_lines,
    pieces as pieces,
    read_layout as read_layout,
)
from .values import (
    PathValues as PathValues,
    read_values as read_values,
    turned_to_base as turned_to_base,
)
