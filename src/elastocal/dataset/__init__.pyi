from .dataset import Dataset as Dataset
from .layout import SCHEMA as SCHEMA, STATUSES as STATUSES
from .load_rows import (
    LoadRows as LoadRows,
    joint_dimensions as joint_dimensions,
    read_load_rows as read_load_rows,
    write_load_rows as write_load_rows,
)
from .merging import merge as merge
from .netcdf import read_stated as read_stated, write_netcdf as write_netcdf
from .readings import Readings as Readings, without as without
from .store import read as read, write as write
