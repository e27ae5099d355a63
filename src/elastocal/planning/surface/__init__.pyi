from .contact import (
    DiskFit as DiskFit,
    contact_frames as contact_frames,
    fit_disk as fit_disk,
)
from .distances import (
    distance_to_boundary as distance_to_boundary,
    geodesic_distance as geodesic_distance,
)
from .findings import (
    INVERTED as INVERTED,
    OF_WRONG_MESHES as OF_WRONG_MESHES,
    ReachableFrom as ReachableFrom,
    arm_reach as arm_reach,
    first_joint_positions as first_joint_positions,
    mesh_findings as mesh_findings,
    placement_findings as placement_findings,
    size_findings as size_findings,
    tiny_finding as tiny_finding,
    unit_findings as unit_findings,
)
from .mesh import (
    SurfaceError as SurfaceError,
    read_mesh as read_mesh,
)
from .sampling import (
    sample_blue_noise as sample_blue_noise,
    sample_uniform as sample_uniform,
)
from .surface import (
    Surface as Surface,
    SurfacePoints as SurfacePoints,
    flipped as flipped,
    load_surface as load_surface,
)
