import numpy as np
import pytest

from elastocal.compensation import CompensatorSettings, read_settings
from elastocal.errors import CompensationError, SchemaError

TEXT = """
schema: elastocal.compensator/1
cycle: "4 ms"
frame: {abc: ["90 deg", "0 deg", "0 deg"]}
limits: {correction: "2 mm", rate: "20 mm/s", fade: "5 mm/s"}
filter:
  sample: "1 ms"
  notches: [{frequency: "200 Hz", width: "20 Hz"}]
"""


@pytest.fixture
def read(tmp_path):
    def read(text):
        path = tmp_path / "online.yaml"
        path.write_text(text)
        return read_settings(path)

    return read


def test_settings_are_read_in_si(read):
    settings = read(TEXT)
    assert settings.limits.correction == 0.002
    assert settings.chain.sample == 0.001
    assert len(settings.chain.sections) == 2
    assert settings.hold_cycles == 10


def test_a_turned_frame_is_a_rotation_in_base(read):
    np.testing.assert_allclose(
        read(TEXT).R_base_frame, [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-15
    )


def test_the_tcp_frame_has_no_fixed_rotation():
    assert CompensatorSettings(frame="tcp").R_base_frame is None


@pytest.mark.parametrize(
    ("old", "new", "reason"),
    [
        ('"2 mm"', '"0 mm"', "limits.correction: Input should be greater than 0"),
        ('"20 mm/s"', '"-1 mm/s"', "limits.rate: must be above 0"),
        ('"5 mm/s"', '"50 mm/s"', "fade 0.05 m/s is above rate 0.02 m/s"),
        ('"4 ms"', "0.004", "0.004 is not a time with its unit"),
        ("notches", "notchs", "did you mean 'notches'"),
        ('"2 mm"', '"51 mm"', "limits.correction: Input should be less than or equal to 50 mm"),
        ('"20 mm/s"', '"2 m/s"', "limits.rate: Input should be less than or equal to 1"),
        ("limits:", 'hold: "2 s"\nlimits:', "hold: Input should be less than or equal to 1"),
        ("limits:", 'hold: "1 ms"\nlimits:', "not longer than the time between readings"),
        ("limits:", 'deadband: "2 mm"\nlimits:', "deadband 2 mm must be below limits.correction"),
        (', "0 deg"]', "]", r"frame\.turned\.abc"),
        ('"90 deg"', '"90"', r"frame\.turned\.abc\.0: '90' is not an? angle"),
    ],
)
def test_settings_that_do_not_fit_are_refused(read, old, new, reason):
    with pytest.raises(SchemaError, match=reason):
        read(TEXT.replace(old, new))


@pytest.mark.parametrize("frame", ["world", "flange"])
def test_an_unknown_frame_is_refused_by_name(read, frame):
    text = TEXT.replace('{abc: ["90 deg", "0 deg", "0 deg"]}', frame)
    with pytest.raises(SchemaError, match=f"frame.*got '{frame}'"):
        read(text)


def test_a_filter_beyond_half_the_rate_is_refused_with_the_file(read):
    with pytest.raises(CompensationError, match=r"online.yaml: notch 200 Hz must be .* below 125"):
        read(TEXT.replace('  sample: "1 ms"\n', ""))


def test_filters_that_are_late_by_seconds_are_refused_with_the_file(read):
    slow = TEXT + '  low_pass: {cutoff: "0.1 Hz"}\n'
    with pytest.raises(CompensationError, match=r"online.yaml: the filters delay a slow wrench by"):
        read(slow)
