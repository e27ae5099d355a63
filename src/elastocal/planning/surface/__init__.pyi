from .boundary import distance_to_boundary as distance_to_boundary
from .contact import contact_frames as contact_frames, contact_poses as contact_poses
from .errors import SurfaceError as SurfaceError
from .findings import (
    Finding as Finding,
    inverted_finding as inverted_finding,
    mesh_findings as mesh_findings,
    placement_findings as placement_findings,
)
from .flatness import DiskFit as DiskFit, fit_disk as fit_disk
from .geodesic import GeodesicDistance as GeodesicDistance, geodesic_distance as geodesic_distance
from .mesh import TriangleMesh as TriangleMesh, read_mesh as read_mesh, weld as weld
from .region import Region as Region
from .robot_side import (
    ReachableFrom as ReachableFrom,
    arm_reach as arm_reach,
    arm_stands as arm_stands,
)
from .sampling import (
    region_share as region_share,
    sample_blue_noise as sample_blue_noise,
    sample_uniform as sample_uniform,
)
from .surface import (
    CREASE_ANGLE as CREASE_ANGLE,
    Surface as Surface,
    SurfacePoints as SurfacePoints,
    build_surface as build_surface,
    flipped as flipped,
    load_surface as load_surface,
)
