"""One printable figure of a plan, after the paper's Fig. 3: two search techniques side by side.

Colour gives the distance of each candidate from its nearest chosen pose; the numbers under a panel
summarise it. Clustering at the edges appears as dark areas, a large covering radius, a small
distance from the edge and a small distance between neighbours.

The surface is laid flat on paper, where every candidate can be seen. A surface that faces one way
is seen along its mean normal. A block is unfolded like a paper net: each of its faces is turned
about the edge that it shares with the face in the middle. What cannot be unfolded without overlap
is drawn twice, from two opposite sides.
"""

from dataclasses import dataclass
from itertools import combinations, pairwise
from pathlib import Path as FilePath

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection, PathCollection
from matplotlib.figure import Figure
from matplotlib.path import Path
from scipy.spatial import cKDTree

from elastocal.arrays import FloatArray, IndexArray
from elastocal.planning import PlanResult, PoolData, SpreadRecord, check_pool_of
from elastocal.planning.surface import Surface
from elastocal.report.plots import style
from elastocal.units import in_unit
from elastocal.wording import phrase, readable

ONE_WAY = np.cos(np.radians(72.0))
"""Least cosine between a normal and the viewing direction at which a surface still reads well."""
_AWAY = "upward is away from the robot's base"
_GAP = 0.1
"""Between two views, as part of their width."""
_HEIGHT = 1e-3
"""Height above the surface from which candidates are looked up on it, in m."""
_TURNED_AWAY = np.cos(np.radians(135.0))
"""Angle from the middle face beyond which a face cannot be attached to it."""
_NET_GAP = 0.05
"""Between the parts of a net, as part of the middle one's size."""
_TOUCHING = 0.02
"""Parts whose boxes share more than this part of the smaller one overlap."""


@dataclass(frozen=True, eq=False)
class Sheet:
    """A part of the surface with its own flat map ``u = A x + b``."""

    A: FloatArray
    """Shape (2, 3): unit vectors to the right and upward in the figure, in base."""
    b: FloatArray
    """Shape (2,), in m."""
    faces: IndexArray
    """Faces that are drawn, the farthest from the viewer first."""
    candidates: IndexArray
    """Candidates that lie on it."""

    def flat(self, points: FloatArray) -> FloatArray:
        """Return points in the figure, shape (..., 2), in m."""
        return points @ self.A.T + self.b

    @property
    def towards_viewer(self) -> FloatArray:
        """Unit vector out of the figure, in base, shape (3,)."""
        return np.cross(self.A[0], self.A[1])


@dataclass(frozen=True, eq=False)
class FlatMap:
    """The sheets of a surface, and how to name the picture."""

    sheets: tuple[Sheet, ...]
    kind: str

    def positions(self, contact: FloatArray) -> FloatArray:
        """Return every candidate in the figure, shape (candidate, 2), in m."""
        flat = np.full((len(contact), 2), np.nan)
        for sheet in self.sheets:
            flat[sheet.candidates] = sheet.flat(contact[sheet.candidates])
        return flat


def flat_map(surface: Surface, contact: FloatArray, normal: FloatArray) -> FlatMap:
    """Return a flat map on which every candidate is seen.

    Parameters
    ----------
    surface : Surface
        The tooling.
    contact, normal : ndarray, shape (candidate, 3)
        Contact points in base in m, and outward unit normals.
    """
    middle = normal.sum(axis=0)
    length = float(np.linalg.norm(middle))
    everything = np.arange(len(contact))
    if length > 0.0 and np.all(normal @ middle > ONE_WAY * length):
        away = surface.mesh.vertices.mean(axis=0)
        sheet = _seen_along(surface, middle / length, away, everything)
        return FlatMap((sheet,), f"seen along its mean normal; {_AWAY}")
    patch = surface.patch[_face_under(surface, contact, normal)]
    net = unfold(surface, patch, normal)
    if net is not None:
        return FlatMap(net, f"unfolded; {_AWAY}")
    return FlatMap(_two_sides(surface, normal), "from the robot's side (left) and from behind")


def _seen_along(
    surface: Surface, towards: FloatArray, upward: FloatArray, candidates: IndexArray
) -> Sheet:
    """Return the view against a unit vector; faces that point away are left out."""
    A = axes_across(towards, upward)
    depth = surface.mesh.vertices[surface.mesh.faces].mean(axis=1) @ towards
    facing = np.flatnonzero(surface.face_normals @ towards > 0.0)
    return Sheet(A, np.zeros(2), facing[np.argsort(depth[facing])], candidates)


def _two_sides(surface: Surface, normal: FloatArray) -> tuple[Sheet, Sheet]:
    """Return the views from the robot's side and from behind, side by side."""
    middle = surface.mesh.vertices.mean(axis=0)
    back = _unit(middle * (1.0, 1.0, 0.0))
    high = np.array([0.0, 0.0, 0.6])
    directions = [_unit(high - back), _unit(high + back)]
    seen = np.argmax(normal @ np.transpose(directions), axis=1)
    sheets, left = [], 0.0
    for number, towards in enumerate(directions):
        sheet = _seen_along(surface, towards, high, np.flatnonzero(seen == number))
        flat = sheet.flat(surface.mesh.vertices)
        shift = np.array([left - flat[:, 0].min(), -flat[:, 1].min()])
        sheets.append(Sheet(sheet.A, shift, sheet.faces, sheet.candidates))
        left += (1.0 + _GAP) * float(np.ptp(flat[:, 0]))
    return sheets[0], sheets[1]


def _face_under(surface: Surface, contact: FloatArray, normal: FloatArray) -> IndexArray:
    """Return the face that contains each candidate, shape (candidate,)."""
    origin = contact + _HEIGHT * normal
    face = np.array(surface.rays.ray.intersects_first(origin, -normal), dtype=np.intp)
    # A ray right along an edge may miss both faces: the nearest face is taken.
    missed = np.flatnonzero(face < 0)
    if len(missed):
        centres = surface.mesh.vertices[surface.mesh.faces].mean(axis=1)
        face[missed] = cKDTree(centres).query(contact[missed])[1]
    return face


def unfold(surface: Surface, patch: IndexArray, normal: FloatArray) -> tuple[Sheet, ...] | None:
    """Return a net of the smooth patches that hold candidates; None if none is free of overlap.

    The patch that faces in the same direction as most others stays in the middle; each other one is
    turned by the least rotation about its corner that is nearest to the middle one.

    Parameters
    ----------
    surface : Surface
        The tooling.
    patch : ndarray of int, shape (candidate,)
        The surface's smooth patch that each candidate lies on.
    normal : ndarray, shape (candidate, 3)
        Outward unit normals.
    """
    facing = {int(p): _unit(normal[patch == p].sum(axis=0)) for p in np.unique(patch)}
    if any(np.any(normal[patch == p] @ towards <= ONE_WAY) for p, towards in facing.items()):
        return None
    total = np.sum(list(facing.values()), axis=0)
    root = max(facing, key=lambda p: float(facing[p] @ total))
    if any(towards @ facing[root] < _TURNED_AWAY for towards in facing.values()):
        return None
    corners = {p: _corners(surface, p) for p in facing}
    A_root = axes_across(facing[root], corners[root].mean(axis=0))
    sheets = []
    for p, towards in facing.items():
        A, b = _hinged(A_root, facing[root], towards, corners[root], corners[p])
        sheets.append(Sheet(A, b, np.flatnonzero(surface.patch == p), np.flatnonzero(patch == p)))
    flat = [sheet.flat(points) for sheet, points in zip(sheets, corners.values(), strict=True)]
    return None if _overlap(flat) else tuple(sheets)


def axes_across(towards: FloatArray, upward: FloatArray) -> FloatArray:
    """Return right and up in the plane across a unit vector, shape (2, 3).

    Parameters
    ----------
    towards : ndarray, shape (3,)
        Unit vector to the viewer, in base.
    upward : ndarray, shape (3,)
        What is to point upward in the figure, as well as it can.
    """
    up = upward - towards * (towards @ upward)
    if not np.linalg.norm(up) > 1e-3 * np.linalg.norm(upward):
        up = np.eye(3)[np.argmin(np.abs(towards))]
        up = up - towards * (towards @ up)
    up = _unit(up)
    return np.stack([np.cross(up, towards), up])


def _hinged(
    A_root: FloatArray,
    root: FloatArray,
    towards: FloatArray,
    root_corners: FloatArray,
    corners: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Return the map of a patch turned into the plane of the middle one."""
    A = A_root @ _rotation(towards, root)
    distance, nearest = map(np.asarray, cKDTree(root_corners).query(corners))
    hinge = int(distance.argmin())
    outward = A_root @ towards
    length = float(np.linalg.norm(outward))
    gap = _NET_GAP * float(np.linalg.norm(np.ptp(root_corners, axis=0)))
    apart = gap * outward / length if length > 1e-9 else np.zeros(2)
    return A, A_root @ root_corners[int(nearest[hinge])] - A @ corners[hinge] + apart


def _rotation(start: FloatArray, end: FloatArray) -> FloatArray:
    """Return the least rotation from one unit vector to another, not its opposite (Rodrigues)."""
    x, y, z = np.cross(start, end)
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    rotation: FloatArray = np.eye(3) + K + K @ K / (1.0 + start @ end)
    return rotation


def _overlap(parts: list[FloatArray]) -> bool:
    """Return whether the boxes of flat parts, each of shape (point, 2), overlap."""
    boxes = [(part.min(axis=0), part.max(axis=0)) for part in parts]
    for (low_a, high_a), (low_b, high_b) in combinations(boxes, 2):
        shared = np.prod(np.clip(np.minimum(high_a, high_b) - np.maximum(low_a, low_b), 0.0, None))
        smaller = min(np.prod(high_a - low_a), np.prod(high_b - low_b))
        if shared > _TOUCHING * smaller:
            return True
    return False


def _corners(surface: Surface, patch: int) -> FloatArray:
    """Return the vertices of a patch, shape (vertex, 3)."""
    faces = surface.mesh.faces[surface.patch == patch]
    corners: FloatArray = surface.mesh.vertices[np.unique(faces)]
    return corners


def _unit(vector: FloatArray) -> FloatArray:
    """Return a vector with length 1, or as it is with length 0."""
    return vector / (np.linalg.norm(vector) or 1.0)


_HEAD, _FOOT, _SIDE = 0.7, 1.95, 0.25
"""Margins above, below and beside the panels, in inches."""
_FLATTEST, _TALLEST = 0.25, 1.3
"""Height of a panel as part of its width; a longer surface has space beside it."""
_ROUNDS = 200
_PULL = 0.02
"""Part of the distance to its anchor by which a label returns in each round."""
_GOLDEN = np.pi * (3.0 - np.sqrt(5.0))
"""Turn between the first steps of labels that share an anchor, in rad."""
_WIDTH = 5.1
"""Width of a panel, in inches."""
_DISC, _CROWD = 13.0, 200.0
"""Diameter of a numbered disc in points; with many it shrinks to the second over their root."""
_MANY = 20_000
"""Number of candidates above which their dots are stored as an image."""
_COLOURS = 256
"""Number of colours of the dots, as many as the colour map has."""
_SPECK = 1e-6
"""Length of the line that is drawn as a dot, in m."""
_FINE = 5_000
"""Number of faces or border lines above which the surface is stored as an image."""


@dataclass(frozen=True, eq=False)
class _Choice:
    """One panel: what a technique chose."""

    title: str
    colour: str
    marker: str
    order: list[int]
    """Candidates in search order."""
    names: list[str]
    """Id of the pose at each; empty where it is no pose of the plan."""
    distance: FloatArray
    """Distance of each candidate from the nearest chosen one, straight, in m."""
    spread: SpreadRecord
    metric: str
    """Metric of the covering radius: ``euclidean`` or ``geodesic``."""


def write_plan_figure(
    path: FilePath, surface: Surface, plan: PlanResult, pool: PoolData
) -> FilePath:
    """Write the figure of a plan, atomically; return its path.

    Parameters
    ----------
    path : Path
        Its suffix decides the kind: SVG, PNG or PDF.
    surface : Surface
        That the plan was made for.
    plan, pool : PlanResult, PoolData
        Plan and pool of one run. Without a comparison in the plan there is one panel.

    Raises
    ------
    SchemaError
        If plan and pool are not of one run.
    FileAccessError
        If the suffix is another or the file cannot be written.
    """
    check_pool_of(plan, pool)
    return style.write_figure(path, lambda: plan_figure(surface, plan, pool))


def plan_figure(surface: Surface, plan: PlanResult, pool: PoolData) -> Figure:
    """Return the figure; see `write_plan_figure`."""
    flat = flat_map(surface, pool.contact, pool.normal)
    place = flat.positions(pool.contact)
    choices = _choices(plan, pool)
    farthest = max(float(choice.distance.max()) for choice in choices)
    low, high = _extent(surface, flat)
    height = _WIDTH * float((high - low)[1] / (high - low)[0])
    figure = style.new_figure(
        len(choices) * (_WIDTH + _SIDE) + _SIDE, _HEAD + height + _FOOT
    )  # fmt: skip
    for number, choice in enumerate(choices):
        axes = figure.add_panel(_SIDE + number * (_WIDTH + _SIDE), _FOOT, _WIDTH, height)
        axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]))
        axes.set_axis_off()
        axes.set_title(choice.title, fontsize=11, fontweight="bold", color=choice.colour, pad=2)
        _draw_surface(axes, surface, flat)
        dots = _draw_candidates(axes, place, choice.distance, farthest)
        _draw_chosen(axes, place[choice.order], choice)
        _draw_scale(axes)
        _draw_numbers(axes, choice)
    _draw_frame(figure, plan, flat, dots)
    return figure


def _choices(plan: PlanResult, pool: PoolData) -> list[_Choice]:
    """Return the choice of the plan's technique, and the one that it is compared with."""
    candidate = {pose.id: pose.candidate for pose in plan.poses}
    search, other = plan.search, plan.comparison
    ids = [str(pose) for pose in search.order]
    found = [
        (search.name, phrase("this plan"), [candidate[i] for i in search.order], ids, search.spread)
    ]
    if other is not None:
        unnamed = [""] * len(other.candidates)
        found.append(
            (other.name, phrase("for comparison"), list(other.candidates), unnamed, other.spread)
        )
    choices = []
    for (name, role, order, names, spread), colour, marker in zip(
        found, style.CHOSEN, "os", strict=False
    ):
        distance = np.asarray(cKDTree(pool.contact[order]).query(pool.contact)[0])
        title = phrase("{name} ({role})", name=name.upper(), role=role)
        choices.append(
            _Choice(title, colour, marker, order, names, distance, spread, search.metric)
        )
    return choices


def _extent(surface: Surface, flat: FlatMap) -> tuple[FloatArray, FloatArray]:
    """Return the corners of the map with a margin, each of shape (2,), in m."""
    points = np.concatenate(
        [
            sheet.flat(surface.mesh.vertices[surface.mesh.faces[sheet.faces]]).reshape(-1, 2)
            for sheet in flat.sheets
        ]
    )
    low, high = points.min(axis=0), points.max(axis=0)
    size = 1.08 * (high - low)
    size = np.maximum(size, (size[1] / _TALLEST, _FLATTEST * size[0]))
    middle = 0.5 * (low + high)
    return middle - 0.5 * size, middle + 0.5 * size


def _draw_frame(figure: style.Page, plan: PlanResult, flat: FlatMap, dots: PathCollection) -> None:
    """Draw what belongs to all panels: title, colour bar, how to read it."""
    width, height = figure.get_size_inches()
    title = phrase(
        "{cell}: {poses} of {valid} candidate poses",
        cell=plan.cell.name,
        poses=len(plan.poses),
        valid=plan.pool.valid,
    )
    figure.text(0.5, 1.0 - 0.12 / height, style.literal(title), ha="center", va="top", fontsize=12)
    bar = figure.add_axes((0.5 - 1.7 / width, 0.72 / height, 3.4 / width, 0.11 / height))
    figure.colorbar(dots, cax=bar, orientation="horizontal")
    bar.set_title(
        phrase("Straight distance of each candidate from its nearest chosen pose in mm"),
        fontsize=8,
        pad=3,
    )
    bar.tick_params(labelsize=8, length=2)
    figure.text(
        0.5, 0.1 / height,
        phrase("Surface {kind}.\nPoses are numbered in visiting order.", kind=flat.kind),
        ha="center", va="bottom", fontsize=8, color=style.MUTED,
    )  # fmt: skip


def _draw_surface(axes: Axes, surface: Surface, flat: FlatMap) -> None:
    face, corner = np.divmod(surface.border_half_edges, 3)
    for sheet in flat.sheets:
        triangles = sheet.flat(surface.mesh.vertices[surface.mesh.faces[sheet.faces]])
        lit = surface.face_normals[sheet.faces] @ sheet.towards_viewer
        grey = np.round(0.86 + 0.1 * lit.clip(0.0, 1.0), 3)
        # Neighbours in the order of drawing that have one grey are one shape.
        runs = _runs(grey)
        colours = np.repeat(grey[[run.start for run in runs], None], 3, axis=1)
        corners = [Path.LINETO, Path.LINETO, Path.CLOSEPOLY]
        axes.add_collection(
            PathCollection(
                [_shapes(triangles[run][:, [0, 1, 2, 0]], corners) for run in runs],
                facecolors=colours, edgecolors=colours, lw=0.3,
                rasterized=len(triangles) > _FINE,
            )
        )  # fmt: skip
        shown = np.isin(face, sheet.faces)
        ends = [surface.mesh.faces[face[shown], (corner[shown] + step) % 3] for step in (0, 1)]
        border = sheet.flat(surface.mesh.vertices[np.stack(ends, axis=1)])
        axes.add_collection(
            PathCollection(
                [_shapes(border, [Path.LINETO])], facecolors="none", edgecolors=style.MUTED, lw=0.8,
                rasterized=len(border) > _FINE,
            )
        )  # fmt: skip


def _draw_candidates(
    axes: Axes, place: FloatArray, distance: FloatArray, farthest: float
) -> PathCollection:
    """Draw a dot a candidate, brightest at the distance ``farthest`` in m.

    Dots of one colour are one path of lines that have hardly a length, and round ends: as many
    artists as there are colours are drawn, not as many as there are candidates.
    """
    # The farthest come last, so that no gap hides under near ones.
    order = np.argsort(distance)
    largest = in_unit(farthest, "mm")
    value = in_unit(distance[order], "mm")
    runs = _runs(np.minimum(np.floor(_COLOURS * value / (largest or 1.0)), _COLOURS - 1))
    ends = np.stack([place[order], place[order] + (_SPECK, 0.0)], axis=1)
    dots = PathCollection(
        [_shapes(ends[run], [Path.LINETO]) for run in runs],
        facecolors="none", linewidths=np.sqrt(np.clip(12_000.0 / len(place), 0.5, 12.0)),
        capstyle="round", snap=False, cmap=style.SEQUENTIAL, rasterized=len(order) > _MANY,
    )  # fmt: skip
    dots.set_array([value[run].mean() for run in runs])
    dots.set_clim(0.0, largest)
    axes.add_collection(dots)
    return dots


def _runs(values: FloatArray) -> list[slice]:
    """Return the runs of equal neighbours, in order."""
    ends = [0, *(np.flatnonzero(np.diff(values)) + 1), len(values)]
    return [slice(*each) for each in pairwise(ends)]


def _shapes(points: FloatArray, steps: list[np.uint8]) -> Path:
    """Return one path of many shapes.

    Parameters
    ----------
    points : ndarray, shape (shape, point, 2)
        Points of each.
    steps : list of uint8
        How each point but the first is reached, shape (point - 1,).
    """
    return Path(points.reshape(-1, 2), np.tile([Path.MOVETO, *steps], len(points)))


def _draw_chosen(axes: Axes, anchor: FloatArray, choice: _Choice) -> None:
    """Draw numbered discs; where they crowd, they move aside and point to their place."""
    left, right = axes.get_xlim()
    points = min(_DISC, _CROWD / np.sqrt(len(anchor)))
    disc = points * (right - left) / (72.0 * _WIDTH)
    place = spread_labels(anchor, 1.08 * disc)
    moved = np.linalg.norm(place - anchor, axis=1) > 0.1 * disc
    pairs = np.stack([anchor, place], axis=1)[moved]
    axes.add_collection(LineCollection(list(pairs), colors=choice.colour, lw=0.8, zorder=3))
    axes.scatter(anchor[moved, 0], anchor[moved, 1], s=9, c=choice.colour, linewidths=0, zorder=3)
    axes.scatter(
        place[:, 0], place[:, 1], s=points**2, c=style.PAPER, edgecolors=choice.colour,
        linewidths=1.3, marker=choice.marker, zorder=4,
    )  # fmt: skip
    for name, (x, y) in zip(choice.names, place, strict=True):
        axes.text(
            x, y, name, ha="center", va="center_baseline", fontsize=0.5 * points, zorder=5,
        )  # fmt: skip


def spread_labels(anchor: FloatArray, distance: float) -> FloatArray:
    """Return places near their anchors that keep a distance from one another, shape (label, 2).

    Labels that are far enough apart stay where they are. Crowded ones push each other away and
    are pulled back, round by round; the same anchors give the same places.

    Parameters
    ----------
    anchor : ndarray, shape (label, 2)
        Where the labels belong.
    distance : float
        To keep between two labels, in the unit of the anchors.
    """
    count = len(anchor)
    angle = _GOLDEN * np.arange(count)
    nudge = 1e-3 * distance * np.column_stack([np.cos(angle), np.sin(angle)])
    gap = np.linalg.norm(anchor[:, None] - anchor[None], axis=2) + distance * np.eye(count)
    crowded = (gap < distance).any(axis=1, keepdims=True)
    place = np.where(crowded, anchor + nudge, anchor)
    for number in range(_ROUNDS):
        pull = _PULL if number < 0.8 * _ROUNDS else 0.0
        step = _pushes(place, distance) + pull * (anchor - place)
        if not np.any(step):
            break
        place = place + step
    return place


def _pushes(place: FloatArray, distance: float) -> FloatArray:
    """Return the displacement of each label by those that are too near, shape (label, 2)."""
    offset = place[:, None] - place[None]
    gap = np.linalg.norm(offset, axis=2)
    np.fill_diagonal(gap, np.inf)
    lacking = np.clip(distance - gap, 0.0, None)
    weight = np.where(lacking > 0.0, 0.5 * lacking / np.maximum(gap, 1e-12), 0.0)
    pushes: FloatArray = np.einsum("ab,abi->ai", weight, offset)
    return pushes


def _draw_scale(axes: Axes) -> None:
    """Draw a bar of a round length in the lower left corner."""
    (left, right), (low, _) = axes.get_xlim(), axes.get_ylim()
    width = right - left
    round_lengths = np.outer(10.0 ** np.arange(-3, 4), (1.0, 2.0, 5.0)).ravel()
    length = float(round_lengths[round_lengths <= max(0.25 * width, 1e-3)].max())
    start, up = left + 0.03 * width, low + 0.012 * width
    axes.plot([start, start + length], [up, up], color=style.INK, lw=1.6, solid_capstyle="butt")
    axes.text(
        start + 0.5 * length, up + 0.008 * width, readable(length, "m"), ha="center", va="bottom",
        fontsize=7.5,
    )  # fmt: skip


def _draw_numbers(axes: Axes, choice: _Choice) -> None:
    """Write the figures that show clustering under the panel."""
    numbers = choice.spread
    lines = [
        (
            phrase("Covering radius ({metric})", metric=choice.metric),
            readable(numbers.covering_radius, "m"),
        ),
        (phrase("Mean distance from the edge"), _length(numbers.boundary_distance)),
        (phrase("Mean distance to the nearest other pose"), _length(numbers.nearest_neighbour)),
        (phrase("Observability index O1 (no unit)"), f"{numbers.o1:.3g}"),
    ]
    for row, (name, value) in enumerate(lines):
        down = (0, -8 - 14 * row)
        axes.annotate(
            name, (0.08, 0.0), down, "axes fraction", "offset points", va="top", color=style.MUTED
        )
        axes.annotate(
            value, (0.92, 0.0), down, "axes fraction", "offset points", va="top", ha="right",
            weight="bold",
        )  # fmt: skip


def _length(value: float | None) -> str:
    return phrase("none") if value is None else readable(value, "m")
