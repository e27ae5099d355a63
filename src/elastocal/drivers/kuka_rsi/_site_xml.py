"""XML that a site may have changed: bounded, without entities, attributes by name."""

from xml.etree import ElementTree

from elastocal.errors import DeviceError

_MOST_CHARACTERS = 262_144


def parsed(text: str) -> ElementTree.Element:
    """Return the root of a file, all names without their namespaces.

    Raises
    ------
    DeviceError
        If it is no XML, too long, or has a document type.
    """
    if len(text) > _MOST_CHARACTERS:
        raise DeviceError(
            f"{len(text)} characters: a file of a controller has at most {_MOST_CHARACTERS}"
        )
    if "<!" in text.replace("<!--", ""):
        raise DeviceError("a document type or entities: a file of a controller has none")
    try:
        # RSIVisual begins its files with a byte order mark.
        root = ElementTree.fromstring(text.removeprefix("\ufeff"))
    except ElementTree.ParseError as error:
        raise DeviceError(f"no XML: {error}") from error
    for each in root.iter():
        each.tag = each.tag.rpartition("}")[2]
    return root


def attribute(element: ElementTree.Element, name: str) -> str:
    """Return an attribute that must be there.

    Raises
    ------
    DeviceError
        If it is not.
    """
    found = element.get(name)
    if found is None:
        raise DeviceError(f"an {element.tag} has no {name}")
    return found
