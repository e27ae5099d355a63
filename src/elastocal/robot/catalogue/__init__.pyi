from .catalogue import (
    SCHEMA as SCHEMA,
    CatalogueEntry as CatalogueEntry,
    entry as entry,
    load as load,
    maker_of as maker_of,
    names as names,
    read_table as read_table,
    urdf as urdf,
    urdf_of as urdf_of,
)
from .show import (
    robot_figures as robot_figures,
    show_robot as show_robot,
    show_robots as show_robots,
)
