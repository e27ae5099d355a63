import numpy as np
import pytest

from elastocal.dataset import Dataset
from elastocal.errors import DatasetError
from support.datasets import labelled


def with_values(data, name, values):
    return data.assign({name: (data[name].dims, values, data[name].attrs)})


def test_the_canonical_form_is_a_fixed_point():
    data = labelled()
    assert Dataset.from_xarray(data).to_xarray().identical(data)


def test_the_order_of_dimensions_and_of_axes_does_not_matter():
    data = labelled()
    shuffled = data.transpose("axis", "joint", "load_case", "pose").isel(axis=[2, 0, 1])
    assert Dataset.from_xarray(shuffled).to_xarray().identical(data)


@pytest.mark.parametrize(
    ("name", "unit", "scale"),
    [
        ("marker_displacement", "mm", 1e3),
        ("force", "kN", 1e-3),
        ("moment", "kN*m", 1e-3),
        ("joint_position", "deg", 180 / np.pi),
    ],
)
def test_a_stated_unit_is_converted(name, unit, scale):
    data = labelled()
    other = with_values(data, name, data[name].values * scale)
    other[name].attrs["units"] = unit
    read = Dataset.from_xarray(other).to_xarray()[name]
    np.testing.assert_allclose(read.values, data[name].values, rtol=1e-15)
    assert read.attrs == data[name].attrs


def test_whole_numbers_and_single_precision_become_float64():
    data = labelled()
    data["tcp_position"] = data["tcp_position"].astype(np.int32)
    data["force"] = data["force"].astype(np.float32)
    read = Dataset.from_xarray(data).to_xarray()
    assert {read["tcp_position"].dtype, read["force"].dtype} == {np.dtype(np.float64)}


def test_a_missing_status_means_ok():
    data = labelled().isel(pose=[0, 2]).drop_vars("status")
    assert not Dataset.from_xarray(data).to_xarray()["status"].any()


def test_a_sigma_with_fewer_dimensions_is_filled():
    data = labelled()
    data["marker_sigma"] = ("axis", [1e-5, 1e-5, 3e-5], {"units": "m"})
    assert np.all(
        Dataset.from_xarray(data).to_xarray()["marker_sigma"].values == [1e-5, 1e-5, 3e-5]
    )


def test_a_prismatic_joint_has_its_own_unit():
    data = labelled(joint_units=("m", "rad"))
    assert data["joint_position"].attrs["units"] == "rad or m"
    assert Dataset.from_xarray(data).joint_units == ("m", "rad")
    data["joint_unit"] = ("joint", ["mm", "deg"])
    data["joint_position"].attrs["units"] = "mm or deg"
    positions = Dataset.from_xarray(data).to_xarray()["joint_position"].values[0, 0]
    factors = [1e-3, np.pi / 180]
    np.testing.assert_allclose(positions, data["joint_position"].values[0, 0] * factors)


def drop_units(data):
    del data["force"].attrs["units"]


def wrong_units(data):
    data["force"].attrs["units"] = "Nm"


def wrong_joint_units(data):
    data["joint_position"].attrs["units"] = "degrees"


def contradictory_joint_units(data):
    data["joint_position"].attrs["units"] = "rad"
    return data.assign_coords(joint_unit=("joint", ["m", "rad"]))


def other_flags(data):
    data["status"].attrs["flag_meanings"] = "missing ok"


def status_out_of_range(data):
    data["status"][2, 1] = 7


def unknown_status_number(data):
    data["status"] = data["status"].astype(float)
    data["status"][0, 1] = np.nan


def relabel(**labels):
    return lambda data: data.assign_coords(labels)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda data: data.drop_vars("force"),
            "variable 'force' (pose, load_case, axis) is missing",
        ),
        (
            lambda data: data.rename(force_sigma="force_sigmas"),
            "variable 'force_sigmas' is not known; did you mean 'force_sigma'? (allowed: joint",
        ),
        (
            lambda data: data.assign_coords(station=1),
            "coordinate 'station' is not known (allowed: pose, load_case, axis, joint, joint_unit,"
            " campaign)",
        ),
        (lambda data: data.drop_vars("joint"), "coordinate 'joint' (one label each) is missing"),
        (lambda data: data.drop_vars("axis"), "coordinate 'axis' (one label each) is missing"),
        (
            lambda data: data.assign(tcp_position=data["tcp_position"].isel(axis=0, drop=True)),
            "variable 'tcp_position' has dimensions (pose): they must be (pose, axis)",
        ),
        (
            lambda data: with_values(data, "force", data["force"].values.astype(str)),
            "variable 'force' is <U32: it must hold numbers",
        ),
        (drop_units, "variable 'force' has no attribute 'units': it must say 'N' or another unit"),
        (
            wrong_units,
            "variable 'force': unit 'Nm' is not a force: allowed are N, kN",
        ),
        (
            wrong_joint_units,
            "variable 'joint_position': unit 'degrees' is not one of rad, deg, m, mm",
        ),
        (
            contradictory_joint_units,
            "variable 'joint_position' has units 'rad' but its coordinate 'joint_unit' is"
            " ['m', 'rad']: it must give each of the 2 joints one of the units",
        ),
        (
            other_flags,
            "variable 'status' has flag_meanings 'missing ok': they must be 'ok slipped unstable",
        ),
        (
            status_out_of_range,
            "status of pose 11, load case 'north' is 7: allowed are 0 ok, 1 slipped, 2 unstable,"
            " 3 aborted, 4 missing",
        ),
        (unknown_status_number, "status of pose 4, load case 'north' is nan: allowed are 0 ok"),
        (
            relabel(pose=[4, 2, 4]),
            "pose 4 stands twice, at positions 0 and 2: every pose needs its own label",
        ),
        (
            relabel(pose=[0.5, 1.0, 2.0]),
            "coordinate 'pose' has float64 labels: they must be integers",
        ),
        (
            relabel(load_case=["north", "north"]),
            "load case 'north' stands twice, at positions 0 and 1",
        ),
        (
            relabel(load_case=["north ", "east"]),
            "load case 'north ' must be a printable name without spaces around it",
        ),
        (relabel(load_case=[1, 2]), "coordinate 'load_case' is [1, 2]: its labels must be texts"),
        (relabel(axis=["x", "y", "u"]), "coordinate 'axis' is ['x', 'y', 'u']: it must be ['x',"),
        (relabel(joint=["a", "a"]), "joint 'a' stands twice, at positions 0 and 1"),
        (
            relabel(joint=["a", "forse_x"]),
            "joint 'forse_x': it is not a joint; did you mean 'force_x'?",
        ),
        (
            lambda data: data.isel(joint=[]),
            "coordinate 'joint' is empty: a robot has at least one joint",
        ),
    ],
)
def test_what_breaks_the_form_is_refused_by_name(change, message):
    data = labelled()
    changed = change(data)
    with pytest.raises(DatasetError) as caught:
        Dataset.from_xarray(data if changed is None else changed)
    assert str(caught.value).startswith(message)
