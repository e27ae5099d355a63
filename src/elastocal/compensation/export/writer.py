"""A compensator as a folder of C: model, header, self-test, CMake file and page for integrators."""

from importlib import resources
from pathlib import Path

import numpy as np

from elastocal import __version__
from elastocal.compensation.export.comments import remark
from elastocal.compensation.export.constants import checksum, constants_of
from elastocal.compensation.export.readme import readme_values
from elastocal.compensation.export.routines import c_routines
from elastocal.compensation.export.vectors import episodes, load_cases
from elastocal.compensation.online import Design
from elastocal.files import filling

PARTS = ("head.c", "sin_cos.c", "condition.c", "correct.c", "selftest.c")


def write_c(folder: Path, numbers: Design, force: bool = False) -> tuple[str, ...]:
    """Write the C files of a compensator and return their names.

    Parameters
    ----------
    folder : Path
        Made if it is not there.
    numbers : Design
        The compensator.
    force : bool
        Whether files in the folder may be replaced.

    Raises
    ------
    FileAccessError
        If the folder holds files and ``force`` is not given, or cannot be written.
    """
    files = c_files(numbers)
    with filling(folder, "elastocal_model.c", force) as temporary:
        for name, text in files.items():
            (temporary / name).write_text(text, encoding="utf-8", newline="\n")
    return tuple(files)


def c_files(numbers: Design) -> dict[str, str]:
    """Return the C files of a compensator, by name; the same design gives the same text."""
    values = _values(numbers)
    constants = constants_of(numbers)
    data = _test_data(numbers)
    mixing = "\n".join(line for constant in constants for line in constant.mixing())
    values |= data | {"MIXING": mixing, "CHECKSUM": str(checksum(constants))}
    head, sin_cos, condition, correct, selftest = (_filled(part, values) for part in PARTS)
    definitions = "".join(f"{each.definition()}\n" for each in constants if not each.in_header)
    model = "".join([head, definitions, sin_cos, c_routines(numbers), condition, correct, selftest])
    return {
        "elastocal_model.c": model,
        "elastocal_model.h": _filled("elastocal_model.h", values),
        "selftest_main.c": _filled("selftest_main.c", values),
        "CMakeLists.txt": _filled("CMakeLists.txt", values),
        "README.md": _filled("README.md", values | readme_values(numbers)),
    }


def _values(numbers: Design) -> dict[str, str]:
    calibrated = numbers.calibrated
    robot = calibrated.model.robot
    about = [
        f"Robot {robot.name}, base {robot.base}, tool centre point {robot.tip}.",
        f"Data: {calibrated.provenance or 'not named'}.",
    ]
    names = [
        f"{k}  {name}, {'rad' if turns else 'm'}"
        for k, (name, turns) in enumerate(zip(robot.joint_names, robot.revolute, strict=True))
    ]
    frame = numbers.settings.frame
    median = numbers.filters.median
    return {
        "VERSION": __version__,
        "ABOUT": "\n".join(f" * {remark(line)}" for line in about),
        "JOINT_NAMES": "\n".join(f" *   {remark(name)}" for name in names),
        "JOINTS": str(numbers.joints),
        "SPRINGS": str(len(calibrated.model.parameters)),
        "SECTIONS": str(len(numbers.filters.sections)),
        "MEDIAN": str(median),
        "MEDIAN_CODE": _template(f"median_{median}.c").rstrip("\n"),
        "CYCLE": repr(numbers.settings.cycle),
        "SAMPLE": repr(numbers.filters.sample),
        "DELAY": repr(float(numbers.filters.delay())),
        "FRAME": frame if isinstance(frame, str) else "a frame turned in base (FRAME)",
    }


def _test_data(numbers: Design) -> dict[str, str]:
    loads, course = load_cases(numbers), episodes(numbers)
    load_rows = [
        _struct(_array(x.q), _array(x.force), _array(x.moment), _array(x.deflection), x.half_width)
        for x in loads
    ]
    episode_rows = [
        _struct(
            str(x.times),
            _struct(
                x.reading.time,
                _array(x.reading.q),
                _array(x.reading.force),
                _array(x.reading.moment),
                "1" if x.reading.ok else "0",
            ),
            _array(x.correction),
            f"{x.status}U",
        )
        for x in course
    ]
    return {
        "LOADS": str(len(loads)),
        "LOAD_DATA": ",\n".join(f"    {row}" for row in load_rows),
        "EPISODES": str(len(course)),
        "EPISODE_DATA": ",\n".join(f"    {row}" for row in episode_rows),
    }


def _struct(*parts: str | float) -> str:
    texts = (part if isinstance(part, str) else repr(float(part)) for part in parts)
    return "{" + ",\n     ".join(texts) + "}"


def _array(numbers: object) -> str:
    return "{" + ", ".join(repr(x) for x in np.asarray(numbers, dtype=float).tolist()) + "}"


def _template(name: str) -> str:
    return (resources.files(__package__) / "templates" / name).read_text(encoding="utf-8")


def _filled(name: str, values: dict[str, str]) -> str:
    text = _template(name)
    for key, value in values.items():
        text = text.replace(f"@{key}@", value)
    return text
