from .arm_urdf import urdf_of as urdf_of
from .catalogue import (
    SCHEMA as SCHEMA,
    entry as entry,
    load as load,
    maker_of as maker_of,
    names as names,
    read_table as read_table,
    urdf as urdf,
)
from .record import (
    LINKS as LINKS,
    ArmDimensions as ArmDimensions,
    CatalogueEntry as CatalogueEntry,
    Dimensions as Dimensions,
    Group as Group,
    Inertias as Inertias,
    LinkInertia as LinkInertia,
    Maker as Maker,
    Maxima as Maxima,
    ParallelDimensions as ParallelDimensions,
    ParallelEntry as ParallelEntry,
    PositionLimits as PositionLimits,
    WristEntry as WristEntry,
    inertias_like as inertias_like,
)
