"""The error of surfaces."""

from elastocal.errors import ElastocalError


class SurfaceError(ElastocalError, ValueError):
    """A tooling surface that cannot be used: unreadable mesh, no faces, empty region."""
