"""Thirty poses out of a thousand: by distance, and by what they tell about the springs.

You learn how to get the valid poses of a cell (every check passed), and how two search techniques
choose from them: COVER spreads poses over the surface (paper Pseudocode 2), IOOPS maximises the
observability index O1 (Pseudocode 1). The printed numbers are those behind the paper's Fig. 3.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np

import elastocal as ec
from elastocal.elastic import layout
from elastocal.planning import sample_pool
from elastocal.planning.search import (
    Candidates,
    Cover,
    build_information,
    covering_radius,
    nearest_neighbour,
    o1,
    technique,
)
from elastocal.planning.surface import distance_to_boundary, load_surface

folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(tempfile.mkdtemp(prefix="elastocal-"))
folder.mkdir(parents=True, exist_ok=True)
cell_file = ec.init(folder / "cell", kind="afp").cell
text = cell_file.read_text(encoding="utf-8").replace("pool: 3000", "pool: 1000")
cell_file.write_text(text, encoding="utf-8")

cell = ec.load_cell(cell_file)
entry = cell.file.surface
surface = load_surface(cell.surface_path, entry.metres, cell.T_base_surface, entry.region)
gathered = sample_pool(cell, surface, np.random.default_rng(1), jobs=1)
postures = gathered.pool.postures
print(f"{len(postures)} valid poses of {gathered.pool.sampled} points on the surface")
for check, count in gathered.pool.refused.items():
    if count:
        print(f"  {count} points refused by the check {check!r}")

# What each pose would show of the springs under every load case (paper Eq. 15, 17).
model = ec.ElasticModel(cell.robot, layout(cell.robot, "bearing"))
R_base_tcp = postures.T_base_tcp[:, :3, :3]
force = np.einsum("pij,lj->pli", R_base_tcp, cell.file.load_cases.force_tcp)
rows = model.observation_blocks(postures.q[:, None], force)
candidates = Candidates(postures.contact, rows.reshape(len(postures), -1, len(model.springs)))

cover = Cover(d_max=0.175).search(candidates, len(candidates))
ioops = technique("ioops").search(candidates, len(cover), np.random.default_rng(1))
print(f"\nCOVER needs {len(cover)} poses until every candidate has one within 175 mm")

information = build_information(candidates)
edge = distance_to_boundary(surface, gathered.points.take(postures.point))
print(f"{'':6s} {'covering':>9s} {'neighbour':>10s} {'edge':>8s} {'O1':>7s}")
for name, chosen in (("COVER", cover.order), ("IOOPS", ioops.order)):
    radius = covering_radius(candidates, chosen)
    neighbour = nearest_neighbour(candidates, chosen).mean()
    print(
        f"{name:6s} {1e3 * radius:6.0f} mm {1e3 * neighbour:7.0f} mm"
        f" {1e3 * edge[chosen].mean():5.0f} mm {o1(information, chosen):7.3f}"
    )
