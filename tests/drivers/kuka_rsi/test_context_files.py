"""RSI contexts: held against facts of public files, read back, and compared with the sheet."""

import os
import random
import re
import subprocess
from collections import Counter
from pathlib import Path
from xml.etree import ElementTree

import pytest

from elastocal import workflows
from elastocal.drivers.kuka_rsi import (
    SHEET,
    RsiSettings,
    bounds_of,
    check_controller_file,
    controller_files,
)
from elastocal.drivers.kuka_rsi.context import CHOICES, read_context
from elastocal.drivers.kuka_rsi.controller_files import FORMS, PROGRAMS
from elastocal.drivers.kuka_rsi.ethernet_file import MODES
from elastocal.errors import DeviceError
from support.kuka_bench import write_cell
from support.simulated import example_cell

READ = {"rsi": ("rsi", "rsi.xml"), "rsix": ("rsix",)}
"""Forms that say what is wired to what; the third of RSI 3 is a drawing."""
NUMBER = "-2147483648", "2147483647"
KINDS = {
    # kind: type id, name in .rsix, inputs, outputs (64: as many as channels)
    "ETHERNET": (64, "Ethernet", None, None),
    "STOP": (18, "Stop", ["In1"], []),
    "POSCORR": (27, "PosCorr", [f"Corr{a}" for a in "XYZABC"], ["Stat", *"XYZABC"]),
    "POSCORRMON": (81, "PosCorrMon", [], [*"XYZABC"]),
    "MAP2SEN_PINT": (16, "Map2Sen_PInt", ["In1"], []),
    "MAP2SEN_PREA": (17, "Map2Sen_PRea", ["In1"], []),
    "SEN_PINT": (57, "Sen_PInt", [], ["Out1"]),
}
"""kroshu/kuka-external-control-sdk: catalogue in kss/.../rsi_joint_pos.rsix (RSI 4.1 B567)."""
PARAMETERS = {
    # kind: name: paramType, minVal, maxVal, isEnum, isRuntime or None, index
    "ETHERNET": {
        "ConfigFile": ("System.FileName", *NUMBER, "false", "false", "1"),
        "Timeout": ("System.Int32", "0", "2147483647", "false", None, "1"),
        "Flag": ("System.Int32", "-1", "999", "false", None, "4"),
        "Precision": ("System.Int32", "1", "32", "false", None, "8"),
    },
    "STOP": {"Mode": ("KUKA.RSIVisual.RSI_StopType", *NUMBER, "true", None, "1")},
    "POSCORR": {
        **{
            name: ("System.Double", *NUMBER, "false", None, str(k))
            for k, name in enumerate(
                [*(f"{s}Lim{a}" for s in ("Lower", "Upper") for a in "XYZ"), "MaxRotAngle"], start=1
            )
        },
        "RefCorrSys": ("KUKA.RSIVisual.RSI_TrafoCosys", *NUMBER, "true", "false", "1"),
    },
    "POSCORRMON": {
        "MaxTrans": ("System.Double", "0", "2147483647", "false", None, "1"),
        "MaxRotAngle": ("System.Double", "0", "2147483647", "false", None, "2"),
    },
    **{
        kind: {"Index": ("System.Int32", "1", "20", "false", None, "1")}
        for kind in ("MAP2SEN_PINT", "MAP2SEN_PREA", "SEN_PINT")
    },
}
"""otherworld-dev/rsi-pi: RSIPI_Stop.rsi (ETHERNET, STOP, POSCORR, POSCORRMON, MAP2SEN_PREA), which
ran on KSS 8.3; ETHERNET also ros-industrial/kuka_experimental: KR_C4/ros_rsi.rsi. The two PINT
objects are taken to be as MAP2SEN_PREA: no public file of RSI 3 has them from RSIVisual."""
SHAPES = {
    "rsi": {
        "rSIModel": "dslVersion name",
        "rSIElement": "name objType objTypeID maxInputs maxOutputs",
        "rSIInPort": "name signalType? mandatory?",
        "rSIOutPort": "name signalType?",
        "rSIOutPortMoniker": "name",
        "rSIParameter": "name value paramType minVal maxVal isEnum isRuntime? index",
    },
    "rsi.xml": {
        "RSIObjects": "noNamespaceSchemaLocation",
        "RSIObject": "ObjType ObjTypeID ObjID",
        "Input": "InIdx OutObjID OutIdx",
        "Parameter": "Name ParamID ParamValue IsRuntime?",
    },
    "rsix": {
        "RsiContext": "schemaLocation SchemaVersion",
        "RsiObject": "ObjTypeId ObjType ObjId",
        "Input": "InIdx OutObjId OutIdx",
        "Parameter": "IsRuntime? Name ParamId ParamValue",
    },
    "rsi.diagram": {
        "rSIObjectDiagram": "dslVersion absoluteBounds name",
        "rSIModelMoniker": "name",
        "rSIElementShape": "Id absoluteBounds fillColor",
        "rSIElementMoniker": "name",
        "rSIInPortShape": "Id absoluteBounds fillColor",
        "rSIInPortMoniker": "name",
        "rSIOutPortShape": "Id absoluteBounds fillColor",
        "rSIOutPortMoniker": "name",
        "elementListCompartment": "Id isExpanded? absoluteBounds name titleTextColor itemTextColor",
        "rSISignalConnector": "edgePoints fixedFrom fixedTo TargetRelationshipDomainClassId",
        "rSIInPortShapeMoniker": "Id",
        "rSIOutPortShapeMoniker": "Id",
    },
}
"""Attributes in their order by element; elements that are not named have none. The same files."""
CHILDREN = {
    "rsi": {
        "rSIModel": "rSIObjects",
        "rSIObjects": "rSIElement*",
        "rSIElement": "rSIInPorts? rSIOutPorts? rSIParameters?",
        "rSIInPorts": "rSIInPort*",
        "rSIInPort": "source?",
        "source": "rSIOutPortMoniker",
        "rSIOutPorts": "rSIOutPort*",
        "rSIParameters": "rSIParameter*",
    },
    "rsi.xml": {
        "RSIObjects": "RSIObject*",
        "RSIObject": "Inputs? Parameters?",
        "Inputs": "Input*",
        "Parameters": "Parameter*",
    },
    "rsix": {
        "RsiContext": "RsiObjects BlueprintCollections? Constructs?",
        "RsiObjects": "RsiObject*",
        "RsiObject": "Inputs? Parameters?",
        "Inputs": "Input*",
        "Parameters": "Parameter*",
    },
    "rsi.diagram": {
        "rSIObjectDiagram": "rSIModelMoniker nestedChildShapes",
        "rSIElementShape": "rSIElementMoniker relativeChildShapes nestedChildShapes",
        "rSIInPortShape": "rSIInPortMoniker relativeChildShapes",
        "rSIOutPortShape": "rSIOutPortMoniker relativeChildShapes",
        "rSISignalConnector": "nodes",
        "nodes": "rSIInPortShapeMoniker rSIOutPortShapeMoniker",
    },
}
"""What stands below an element, in its order. The same files; shapes hold others of any order."""
KUKA, SDK = "ros-industrial+kuka_experimental", "kroshu+kuka-external-control-sdk"
_SETUP = "kuka_external_control_sdk/krc_setup"
PUBLIC = {
    KUKA: ("kuka_rsi_hw_interface/krl/KR_C4/ros_rsi.{form}", ("rsi", "rsi.xml", "rsi.diagram")),
    SDK: (
        f"{_SETUP}/kss_under_8.5/Config/User/Common/SensorInterface/rsi_joint_pos.{{form}}",
        ("rsi", "rsi.xml", "rsi.diagram"),
    ),
}
RSIX = f"{_SETUP}/kss/Config/User/Common/SensorInterface/rsi_joint_pos.rsix"


def settings(form: str, mode: str = "contact") -> RsiSettings:
    return RsiSettings(mode=mode, delay="20 ms", rsi_context=form)


@pytest.fixture(scope="module")
def files() -> dict[str, dict[str, str]]:
    cell = example_cell("afp")
    return {
        form: {n: c.decode() for n, c in controller_files(cell, settings(form)).items()}
        for form in FORMS
    }


def tree(text: str) -> ElementTree.Element:
    root = ElementTree.fromstring(text.removeprefix("\ufeff"))
    for each in root.iter():
        each.tag = each.tag.rpartition("}")[2]
        for key in [*each.attrib]:
            # Popped and set again, so that the order stays.
            each.attrib[key.rpartition("}")[2]] = each.attrib.pop(key)
    return root


def contexts(files: dict[str, dict[str, str]]) -> list[tuple[str, str, str, str]]:
    return [
        (form, mode, suffix, files[form][f"{PROGRAMS[mode]}.{suffix}"])
        for form, suffixes in FORMS.items()
        for mode in MODES
        for suffix in suffixes
    ]


def fits(given: list[str], pattern: str) -> bool:
    words = pattern.split()
    whole = "".join(f"({w[:-1]} ){w[-1]}" if w[-1] in "?*" else f"{w} " for w in words)
    return re.fullmatch(whole, "".join(f"{name} " for name in given)) is not None


def assert_shape(suffix: str, each: ElementTree.Element) -> None:
    # The SDK lets KRL set limits (IsPublic), we do not.
    given = [name for name in each.attrib if name.lower() != "ispublic"]
    assert fits(given, SHAPES[suffix].get(each.tag, "")), (suffix, each.tag, given)
    if each.tag.endswith("ChildShapes"):
        return
    below = [child.tag for child in each]
    assert fits(below, CHILDREN[suffix].get(each.tag, "")), (suffix, each.tag, below)


def test_every_element_has_attributes_and_children_of_public_files_in_their_order(files):
    seen = set()
    for _, _, suffix, text in contexts(files):
        for each in tree(text).iter():
            assert_shape(suffix, each)
            seen.add((suffix, each.tag))
    assert seen >= {(suffix, tag) for suffix, shapes in SHAPES.items() for tag in shapes}


def test_objects_have_the_types_ports_and_parameters_of_public_files(files):
    for mode in MODES:
        name = PROGRAMS[mode]
        drawn = tree(files["rsi"][f"{name}.rsi"]).findall("rSIObjects/rSIElement")
        read = tree(files["rsi"][f"{name}.rsi.xml"]).findall("RSIObject")
        newer = tree(files["rsix"][f"{name}.rsix"]).findall("RsiObjects/RsiObject")
        assert len(drawn) == len(read) == len(newer)
        for shown, old, new in zip(drawn, read, newer, strict=True):
            kind = shown.get("objType")
            type_id, camel, inputs, outputs = KINDS[kind]
            assert {shown.get("objTypeID"), old.get("ObjTypeID"), new.get("ObjTypeId")} == {
                str(type_id)
            }
            assert (old.get("ObjType"), new.get("ObjType")) == (kind, camel)
            if inputs is not None:
                assert [p.get("name") for p in shown.iter("rSIInPort")] == inputs
                assert [p.get("name") for p in shown.iter("rSIOutPort")] == outputs
            assert_parameters(kind, shown, old, new)


def assert_parameters(kind, shown, old, new) -> None:
    keys = ("paramType", "minVal", "maxVal", "isEnum", "isRuntime", "index")
    given = {p.get("name"): tuple(p.get(k) for k in keys) for p in shown.iter("rSIParameter")}
    assert given == PARAMETERS[kind]
    for parameter, other in zip(old.iter("Parameter"), new.iter("Parameter"), strict=False):
        name = parameter.get("Name")
        assert other.get("Name") == name
        number, runtime = PARAMETERS[kind][name][5], PARAMETERS[kind][name][4]
        assert parameter.get("ParamID") == number
        assert other.get("ParamId") == str(int(number) - 1)
        assert parameter.get("IsRuntime") == other.get("IsRuntime") == runtime
        assert parameter.get("ParamValue") == other.get("ParamValue")
    only_new = [p.get("Name") for p in new.iter("Parameter")][len(given) :]
    # RSI 3 was seen to take no corrections with a Channel; files of RSI 4 have it.
    assert only_new == (["Channel"] if kind == "STOP" else [])


@pytest.mark.parametrize("mode", MODES)
def test_every_channel_of_the_ethernet_file_is_wired_exactly_once(files, mode):
    name = PROGRAMS[mode]
    ethernet = ElementTree.fromstring(files["rsi"][f"{name}.xml"])
    received = {int(e.get("INDX")) for e in ethernet.findall("RECEIVE/ELEMENTS/ELEMENT")}
    numbers = [e.get("INDX") for e in ethernet.findall("SEND/ELEMENTS/ELEMENT")]
    sent = {int(number) for number in numbers if number != "INTERNAL"}
    assert (len(received), len(sent)) == {
        "measure": (0, 0),
        "contact": (22, 2),
        "compensation": (7, 0),
    }[mode]
    for form, suffixes in READ.items():
        for suffix in suffixes:
            table = read_context(files[form][f"{name}.{suffix}"])
            used = Counter(
                output
                for each in table.values()
                for source, output in each.wires.values()
                if source == "ETHERNET1"
            )
            assert used == Counter(received)
            assert set(table["ETHERNET1"].wires) == sent


@pytest.mark.parametrize("mode", MODES)
def test_all_forms_read_back_as_one_table(files, mode):
    tables = [
        read_context(files[form][f"{PROGRAMS[mode]}.{suffix}"])
        for form, suffixes in READ.items()
        for suffix in suffixes
    ]
    for table in tables:
        table.get("STOP1") and table["STOP1"].parameters.pop("Channel", None)
    assert tables[0] == tables[1] == tables[2]
    objects = {"measure": 1, "compensation": 4, "contact": 4 + 2 + 13 + 2}
    assert len(tables[0]) == objects[mode]


@pytest.mark.parametrize(("mode", "column"), [("contact", 2), ("compensation", 3)])
def test_limits_are_those_that_the_sheet_shows(files, mode, column):
    bounds = bounds_of(example_cell("afp"), settings("rsi", mode))
    for form, made in files.items():
        table = read_context(made[f"{PROGRAMS[mode]}.{READ[form][-1]}"])
        limits_table = made[SHEET].partition("## Limits")[2].partition("##")[0]
        rows = [line.split("|") for line in limits_table.splitlines() if line.startswith("| ")]
        shown = {row[1].strip(): [*row[column].split(), ""][0] for row in rows}
        limits = {k: float(v) for k, (_, v) in table["POSCORR1"].parameters.items()}
        assert (
            limits["LowerLimX"] == float(shown["POSCORR LowerLimX, Y, Z"]) == -limits["UpperLimZ"]
        )
        assert limits["UpperLimY"] == pytest.approx(1e3 * bounds.poscorr)
        assert limits["MaxRotAngle"] == float(shown["POSCORR MaxRotAngle"])
        monitor = table["POSCORRMON1"].parameters
        assert float(monitor["MaxTrans"][1]) == float(shown["POSCORRMON MaxTrans"])
        assert float(monitor["MaxRotAngle"][1]) == float(shown["POSCORRMON MaxRotAngle"])
        line = table["ETHERNET1"].parameters
        assert line["Timeout"][1] == shown["ETHERNET Timeout"]
        assert (line["ConfigFile"][1], line["Precision"][1]) == (f"{PROGRAMS[mode]}.xml", "6")


@pytest.mark.parametrize(
    ("form", "called", "other"), [("rsi", '"{}.rsi"', "rsix"), ("rsix", '"{}"', "rsi")]
)
def test_programs_load_the_context_by_the_name_that_its_form_has(files, form, called, other):
    for name in PROGRAMS.values():
        want = f"ret = RSI_CREATE({called.format(name)},cont_id,TRUE)"
        assert want in files[form][f"{name}.src"].splitlines()
        assert {f"{name}.{each}" for each in FORMS[form]} <= files[form].keys()
        assert not {f"{name}.{each}" for each in FORMS[other]} & files[form].keys()
        assert f"`RSI_CREATE({called.format(name)},...)`" in files[form][SHEET]
    assert f"`rsi_context: {form}`)" in files[form][SHEET]
    assert "Tried on no controller" in files[form][SHEET]


def test_the_drawing_shows_every_object_port_and_wire_once_and_apart(files):
    for mode in MODES:
        drawn = tree(files["rsi"][f"{PROGRAMS[mode]}.rsi"])
        page = tree(files["rsi"][f"{PROGRAMS[mode]}.rsi.diagram"])
        ids = [e.get("Id") for e in page.iter() if e.tag.endswith(("Shape", "Compartment"))]
        assert len(ids) == len(set(ids))
        ends = [e.get("Id") for e in page.iter() if e.tag.endswith("PortShapeMoniker")]
        assert set(ends) <= set(ids)
        assert len(ends) == 2 * len(drawn.findall(".//source"))
        names = {
            f"//{e.get('name')}/{p.get('name')}"
            for e in drawn.iter("rSIElement")
            for p in [*e.iter("rSIInPort"), *e.iter("rSIOutPort")]
        }
        assert names == {e.get("name") for e in page.iter() if e.tag.endswith("PortMoniker")}
        boxes = [
            [float(v) for v in e.get("absoluteBounds").split(",")]
            for e in page.iter("rSIElementShape")
        ]
        width, height = (float(v) for v in page.get("absoluteBounds").split(",")[2:])
        for k, (x, y, w, h) in enumerate(boxes):
            assert x + w < width
            assert y + h < height
            for left, top, wide, high in boxes[:k]:
                assert x >= left + wide or left >= x + w or y >= top + high or top >= y + h


@pytest.mark.parametrize(
    ("suffix", "old", "new", "reason"),
    [
        (
            "rsi.xml",
            'ParamValue="126.4"',
            'ParamValue="226.4"',
            "UpperLimX is 226.4, must be 126.4",
        ),
        ("rsi", 'value="126.4"', 'value="226.4"', "UpperLimX is 226.4, must be 126.4"),
        ("rsix", 'ParamValue="126.4"', 'ParamValue="226.4"', "UpperLimX is 226.4, must be 126.4"),
        ("rsi", 'value="Base"', 'value="Tool"', "RefCorrSys is 3, must be 1"),
        ("rsi", 'value="ExitMoveCorr"', 'value="PathFast"', "Mode is 3, must be 4"),
        ("rsi.xml", '"8" ParamValue="6"', '"8" ParamValue="1"', "Precision is 1, must be 6"),
        ("rsi.xml", 'UpperLimZ" ParamID="6"', 'UpperLimZ" ParamID="5"', "parameter 5, must be 6"),
        (
            "rsi.xml",
            '"2" OutObjID="ETHERNET1" OutIdx="3"',
            '"2" OutObjID="ETHERNET1" OutIdx="4"',
            "input 2 has output 4 of ETHERNET1, must be output 3 of ETHERNET1",
        ),
        ("rsi", "//ETHERNET1/Out3", "//ETHERNET1/Out4", "input 2 has output 4 of ETHERNET1"),
        ("rsi", "//ETHERNET1/Out3", "//ETHERNET1/Out99", "ETHERNET1 has no output Out99"),
        ("rsi", "//ETHERNET1/Out3", "//ELSEWHERE/Out3", "a wire from ELSEWHERE"),
        ("rsix", 'Type="PosCorrMon"', 'Type="AxisCorr"', "no object POSCORRMON1"),
        ("rsix", '"81" ObjType="PosCorrMon"', '"82" ObjType="PosCorrMon"', "its type is 82"),
        ("rsi.xml", 'ParamValue="12" />', 'ParamValue="11" />', "two objects SEN_PINT11"),
        ("rsi.xml", "InIdx=", "Input=", "an Input has no InIdx"),
        ("rsi.xml", 'InIdx="1"', 'InIdx="one"', "InIdx is one: must be a whole number"),
        ("rsi.xml", "RSIObjects", "RSIThings", "its root is <RSIThings>"),
    ],
)
def test_a_context_that_a_site_has_changed_is_refused_by_what_is_wrong(
    files, suffix, old, new, reason
):
    form = "rsix" if suffix == "rsix" else "rsi"
    text = files[form][f"elcal_run.{suffix}"]
    assert old in text
    with pytest.raises(DeviceError, match=re.escape(reason)):
        check_controller_file(text.replace(old, new), example_cell("afp"), settings(form))


def test_an_object_that_moves_the_arm_otherwise_is_refused(files):
    more = '<RSIObject ObjType="AXISCORR" ObjTypeID="33" ObjID="A"></RSIObject></RSIObjects>'
    text = files["rsi"]["elcal_run.rsi.xml"].replace("</RSIObjects>", more)
    with pytest.raises(DeviceError, match="AXISCORR1, which elcal_run must not have"):
        check_controller_file(text, example_cell("afp"), settings("rsi"))


@pytest.mark.parametrize("suffix", ["rsi", "rsi.xml", "rsix"])
def test_whatever_comes_is_read_or_refused_in_one_line(files, suffix):
    rng = random.Random(3)
    text = files["rsix" if suffix == "rsix" else "rsi"][f"elcal_comp.{suffix}"]
    words = re.findall(r'[\w./]+="[^"]*"|<[^>]*>', text)
    reasons = []
    for _ in range(150):
        other = text
        for _ in range(rng.randint(1, 4)):
            other = other.replace(rng.choice(words), rng.choice(words), rng.randint(1, 3))
        try:
            read_context(other)
        except DeviceError as error:
            reasons.append(str(error))
    assert len(reasons) > 30
    assert not any("\n" in reason for reason in reasons)


def test_a_context_under_other_names_of_objects_is_the_same_one(files):
    text = files["rsi"]["elcal_run.rsi.xml"].replace("POSCORR1", "Corr_7")
    check_controller_file(text, example_cell("afp"), settings("rsi"))


def test_the_command_checks_a_context_with_the_cell(tmp_path):
    cell = write_cell(tmp_path, mode="contact")
    workflows.krc_config(cell, out=tmp_path / "krc")
    checked = workflows.krc_config(cell, check=tmp_path / "krc" / "elcal_run.rsi.xml")
    assert checked.files == ("elcal_run.rsi.xml",)
    with pytest.raises(DeviceError, match=r"elcal_comp\.rsi: no object"):
        workflows.krc_config(cell, check=tmp_path / "krc" / "elcal_comp.rsi")


# -- the public files themselves, where they are at hand --------------------------------------


def public(mirror: str, path: str) -> str:
    folder = Path(os.environ.get("ELASTOCAL_MIRRORS", "/work/.mirror")) / mirror / "repo"
    if not folder.is_dir():
        pytest.skip(f"no copy of {mirror} (ELASTOCAL_MIRRORS names a folder of copies)")
    done = subprocess.run(
        ["git", "-C", str(folder), "-c", "safe.directory=*", "show", f"HEAD:{path}"],
        capture_output=True,
        check=True,
    )
    return done.stdout.decode("utf-8-sig")


@pytest.mark.parametrize("mirror", PUBLIC)
def test_public_contexts_of_rsi_3_have_the_shapes_that_ours_are_held_against(mirror):
    path, forms = PUBLIC[mirror]
    for form in forms:
        for each in tree(public(mirror, path.format(form=form))).iter():
            assert_shape(form, each)


@pytest.mark.parametrize("mirror", PUBLIC)
def test_public_contexts_of_rsi_3_have_the_parameters_that_ours_are_held_against(mirror):
    path, _ = PUBLIC[mirror]
    keys = ("paramType", "minVal", "maxVal", "isEnum", "isRuntime", "index")
    for each in tree(public(mirror, path.format(form="rsi"))).iter("rSIElement"):
        wanted = PARAMETERS.get(each.get("objType"))
        if wanted is not None:
            given = {
                p.get("name"): tuple(p.get(k) for k in keys) for p in each.iter("rSIParameter")
            }
            assert given.items() >= wanted.items()


def test_the_catalogue_of_rsi_4_has_the_objects_that_ours_are_held_against():
    root = tree(public(SDK, RSIX))
    for part in (root, *root.find("RsiObjects").iter()):
        assert_shape("rsix", part)
    known = {e.get("Name"): e for e in root.iter("Element")}
    for kind, (type_id, camel, inputs, outputs) in KINDS.items():
        entry = known[camel]
        assert entry.get("Id") == str(type_id)
        if inputs is not None:
            assert [p.get("Name") for p in entry.findall("Inputs/Input")] == inputs
            assert [p.get("Name") for p in entry.findall("Outputs/Output")] == outputs
        theirs = {p.get("Name"): p for p in entry.find("Parameters")}
        for name, (param_type, *_, runtime, number) in PARAMETERS[kind].items():
            assert theirs[name].get("Index") == str(int(number) - 1)
            assert theirs[name].get("CanBeSetAtRuntime") == runtime
            values = tuple(v.text for v in theirs[name].findall("EnumValues/Value"))
            assert values == CHOICES.get(param_type, ())
