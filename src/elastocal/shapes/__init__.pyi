from .convex import (
    Box as Box,
    Capsule as Capsule,
    Convex as Convex,
    Cylinder as Cylinder,
    Span as Span,
    Sphere as Sphere,
)
from .mesh import Mesh as Mesh, solid_of as solid_of
from .solid import (
    Beams as Beams,
    Body as Body,
    OtherSolid as OtherSolid,
    SightSolid as SightSolid,
    Solid as Solid,
    box_corners as box_corners,
)
