from .catalogue import entry as entry, load as load, names as names, urdf as urdf
from .record import CatalogueEntry as CatalogueEntry
from .writer import urdf_of as urdf_of
