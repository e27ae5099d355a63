"""Reads RSI contexts in all their forms, and holds them against what a cell needs."""

import math
from xml.etree import ElementTree

from elastocal.drivers.kuka_rsi._site_xml import attribute, parsed
from elastocal.drivers.kuka_rsi.context import CHOICES, ContextEntry, RsiContext
from elastocal.errors import DeviceError

_Entries = dict[str, ContextEntry]


def read_context(text: str) -> _Entries:
    """Return what ``.rsi.xml``, ``.rsix`` or ``.rsi`` says, by kind and index of the KRL variable.

    Parameters
    ----------
    text : str
        Contents of the file.

    Raises
    ------
    DeviceError
        If it is none of the three, or its objects do not fit together.
    """
    root = parsed(text)
    readers = {"RSIObjects": _read_3, "RsiContext": _read_4, "rSIModel": _read_drawn}
    reader = readers.get(root.tag)
    if reader is None:
        raise DeviceError(
            f"its root is <{root.tag:.20}>: must be <ROOT> of an ETHERNET file, or of a context"
            f" {', '.join(f'<{tag}>' for tag in readers)}"
        )
    return reader(root)


def check_context(text: str, wanted: RsiContext) -> None:
    """Refuse a context that is not the one that a cell needs.

    Names of objects and parameters beyond ours may differ; objects beyond ours may not be there.

    Raises
    ------
    DeviceError
        With the first object, limit or wire that is another.
    """
    found, table = read_context(text), wanted.table()
    for name in sorted(table.keys() - found.keys()):
        raise DeviceError(f"no object {name}")
    for name in sorted(found.keys() - table.keys()):
        raise DeviceError(f"it has an object {name}, which {wanted.name} must not have")
    for name, ours in table.items():
        _check_entry(name, found[name], ours)


def _check_entry(name: str, theirs: ContextEntry, ours: ContextEntry) -> None:
    if theirs.type_id != ours.type_id:
        raise DeviceError(f"{name}: its type is {theirs.type_id}, must be {ours.type_id}")
    for key, (number, value) in ours.parameters.items():
        if key not in theirs.parameters:
            raise DeviceError(f"{name}: no parameter {key}")
        given_number, given = theirs.parameters[key]
        if given_number != number:
            raise DeviceError(f"{name}: {key} is parameter {given_number}, must be {number}")
        if not _same(given, value):
            raise DeviceError(f"{name}: {key} is {given:.40}, must be {value}")
    for number in sorted(ours.wires.keys() | theirs.wires.keys()):
        given_wire, wire = theirs.wires.get(number), ours.wires.get(number)
        if given_wire != wire:
            raise DeviceError(
                f"{name}: input {number} has {_wire(given_wire)}, must be {_wire(wire)}"
            )


def _same(given: str, wanted: str) -> bool:
    try:
        return math.isclose(float(given), float(wanted), abs_tol=1e-9)
    except ValueError:
        return given == wanted


def _wire(wire: tuple[str, int] | None) -> str:
    return "no wire" if wire is None else f"output {wire[1]} of {wire[0]}"


def _whole(element: ElementTree.Element, name: str, first: int = 1) -> int:
    """Return a number that counts from ``first`` as one that counts from 1."""
    text = attribute(element, name)
    if not (text.isascii() and text.isdigit() and len(text) < 6):
        raise DeviceError(f"{element.tag}: {name} is {text:.20}: must be a whole number")
    return int(text) + 1 - first


def _read_3(root: ElementTree.Element) -> _Entries:
    return _linked(root.findall("RSIObject"), 1, ("ObjTypeID", "ObjID", "OutObjID", "ParamID"))


def _read_4(root: ElementTree.Element) -> _Entries:
    objects = root.findall("RsiObjects/RsiObject")
    return _linked(objects, 0, ("ObjTypeId", "ObjId", "OutObjId", "ParamId"))


def _linked(objects: list[ElementTree.Element], first: int, names: tuple[str, ...]) -> _Entries:
    """Return the entries of files in which wires name numbers of ports."""
    type_id, own_id, source_id, parameter_id = names
    ids: dict[str, str] = {}
    parameters = []
    for each in objects:
        values = {
            attribute(p, "Name"): (_whole(p, parameter_id, first), attribute(p, "ParamValue"))
            for p in each.findall("Parameters/Parameter")
        }
        _name(ids, attribute(each, own_id), attribute(each, "ObjType"), values)
        parameters.append(values)
    found = {}
    for each, values in zip(objects, parameters, strict=True):
        wires = {
            _whole(wire, "InIdx", first): (
                _known(ids, attribute(wire, source_id)),
                _whole(wire, "OutIdx", first),
            )
            for wire in each.findall("Inputs/Input")
        }
        entry = ContextEntry(_whole(each, type_id), values, wires)
        found[ids[attribute(each, own_id)]] = entry
    return found


def _read_drawn(root: ElementTree.Element) -> _Entries:
    """Return the entries of ``.rsi``, in which wires and choices have names."""
    ids: dict[str, str] = {}
    objects, parameters = root.findall("rSIObjects/rSIElement"), []
    outputs: dict[str, list[str]] = {}
    for each in objects:
        values = {
            attribute(p, "name"): (_whole(p, "index"), _code(p))
            for p in each.findall("rSIParameters/rSIParameter")
        }
        own = attribute(each, "name")
        _name(ids, own, attribute(each, "objType"), values)
        parameters.append(values)
        outputs[own] = [attribute(p, "name") for p in each.findall("rSIOutPorts/rSIOutPort")]
    found = {}
    for each, values in zip(objects, parameters, strict=True):
        wires = {}
        for number, port in enumerate(each.findall("rSIInPorts/rSIInPort"), start=1):
            moniker = port.find("source/rSIOutPortMoniker")
            if moniker is not None:
                source, _, output = attribute(moniker, "name").removeprefix("//").partition("/")
                name = _known(ids, source)
                if output not in outputs[source]:
                    raise DeviceError(f"{source:.40} has no output {output:.40}")
                wires[number] = (name, outputs[source].index(output) + 1)
        found[ids[attribute(each, "name")]] = ContextEntry(_whole(each, "objTypeID"), values, wires)
    return found


def _code(parameter: ElementTree.Element) -> str:
    value = attribute(parameter, "value")
    choices = CHOICES.get(attribute(parameter, "paramType"), ())
    return str(choices.index(value)) if value in choices else value


def _name(ids: dict[str, str], own: str, kind: str, parameters: dict[str, tuple[int, str]]) -> None:
    name = f"{kind.upper()[:24]}{parameters.get('Index', (0, '1'))[1][:6]}"
    if own in ids or name in ids.values():
        raise DeviceError(f"two objects {name}")
    ids[own] = name


def _known(ids: dict[str, str], name: str) -> str:
    if name not in ids:
        raise DeviceError(f"a wire from {name:.40}, which is not there")
    return ids[name]
