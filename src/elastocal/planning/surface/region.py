"""Which part of a surface is wanted: anything that can say whether points lie in it."""

from typing import Protocol

from elastocal.arrays import BoolArray, FloatArray


class Region(Protocol):
    """A part of space; `elastocal.cell` has boxes and polygons.

    Its border is no border of the surface: a contact disk may reach over it.
    """

    def contains(self, points_surface: FloatArray) -> BoolArray:
        """Return whether points lie in the region.

        Parameters
        ----------
        points_surface : ndarray, shape (point, 3)
            In the frame of the surface's mesh, in m.

        Returns
        -------
        ndarray of bool, shape (point,)
        """
