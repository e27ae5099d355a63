from .description import Cell as Cell, CellFile as CellFile, load_cell as load_cell
from .fingerprint import (
    RUN_SECTIONS as RUN_SECTIONS,
    fingerprint as fingerprint,
    named_files as named_files,
)
