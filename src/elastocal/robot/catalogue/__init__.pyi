from .catalogue import (
    SCHEMA as SCHEMA,
    entry as entry,
    load as load,
    names as names,
    read_table as read_table,
    urdf as urdf,
)
from .record import (
    LINKS as LINKS,
    CatalogueEntry as CatalogueEntry,
    Dimensions as Dimensions,
    Group as Group,
    Inertias as Inertias,
    LinkInertia as LinkInertia,
    Maxima as Maxima,
    PositionLimits as PositionLimits,
    inertias_like as inertias_like,
    urdf_of as urdf_of,
)
