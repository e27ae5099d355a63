"""Solid shapes: parts of the tool and fixtures of the cell."""

from typing import Self

from pydantic import model_validator

from elastocal.arrays import FloatArray
from elastocal.cell.description.pose import IDENTITY, Pose, vector
from elastocal.cell.description.quantities import PositiveLength, check_exactly_one
from elastocal.records import StrictModel
from elastocal.units import factor


class Box(StrictModel):
    """A box about its centre."""

    size: tuple[PositiveLength, PositiveLength, PositiveLength]
    """Edge lengths along x, y, z in m."""

    @property
    def extent(self) -> FloatArray:
        """The edge lengths, shape (3,), in m."""
        return vector(self.size)


class Cylinder(StrictModel):
    """A cylinder about its centre, along z."""

    radius: PositiveLength
    length: PositiveLength


class Sphere(StrictModel):
    """A sphere about its centre."""

    radius: PositiveLength


class MeshFile(StrictModel):
    """Triangles of a file."""

    file: str
    """STL, OBJ or PLY; relative to the cell file."""
    unit: str
    """Unit of the file's numbers: ``mm`` or ``m``; mesh files do not say."""

    @model_validator(mode="after")
    def _known_unit(self) -> Self:
        factor(self.unit, "length")
        return self

    @property
    def metres(self) -> float:
        """Length of one unit of the file, in m."""
        return factor(self.unit, "length")


class Shape(StrictModel):
    """One solid with its place: a box, a cylinder, a sphere or a mesh."""

    name: str = ""
    pose: Pose = IDENTITY
    """Of the shape in its frame: the flange for parts of the tool, the base for fixtures."""
    box: Box | None = None
    cylinder: Cylinder | None = None
    sphere: Sphere | None = None
    mesh: MeshFile | None = None

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        check_exactly_one(box=self.box, cylinder=self.cylinder, sphere=self.sphere, mesh=self.mesh)
        return self

    @property
    def solid(self) -> Box | Cylinder | Sphere | MeshFile:
        """The one that is given."""
        found = self.box or self.cylinder or self.sphere or self.mesh
        assert found is not None
        return found
