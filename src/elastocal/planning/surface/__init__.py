"""The tooling surface: read it, spread points over it, tell where a contact disk can lie."""

from elastocal.planning.surface.boundary import distance_to_boundary
from elastocal.planning.surface.contact import contact_frames, contact_poses
from elastocal.planning.surface.errors import SurfaceError
from elastocal.planning.surface.findings import (
    Finding,
    inverted_finding,
    mesh_findings,
    placement_findings,
)
from elastocal.planning.surface.flatness import DiskFit, fit_disk
from elastocal.planning.surface.geodesic import GeodesicDistance, geodesic_distance
from elastocal.planning.surface.mesh import TriangleMesh, read_mesh, weld
from elastocal.planning.surface.region import Region
from elastocal.planning.surface.robot_side import ReachableFrom, arm_reach, arm_stands
from elastocal.planning.surface.sampling import region_share, sample_blue_noise, sample_uniform
from elastocal.planning.surface.surface import (
    CREASE_ANGLE,
    Surface,
    SurfacePoints,
    build_surface,
    flipped,
    load_surface,
)

__all__ = [
    "CREASE_ANGLE",
    "DiskFit",
    "Finding",
    "GeodesicDistance",
    "ReachableFrom",
    "Region",
    "Surface",
    "SurfaceError",
    "SurfacePoints",
    "TriangleMesh",
    "arm_reach",
    "arm_stands",
    "build_surface",
    "contact_frames",
    "contact_poses",
    "distance_to_boundary",
    "fit_disk",
    "flipped",
    "geodesic_distance",
    "inverted_finding",
    "load_surface",
    "mesh_findings",
    "placement_findings",
    "read_mesh",
    "region_share",
    "sample_blue_noise",
    "sample_uniform",
    "weld",
]
