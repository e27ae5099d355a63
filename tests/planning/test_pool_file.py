"""The pool's file: lossless, small, readable by others, refused when it is not the plan's."""

from dataclasses import fields, replace

import numpy as np
import pytest
import xarray as xr

from elastocal.errors import FileAccessError, PlanningError, SchemaError
from elastocal.planning import POOL, PoolData, check_pool_of, read_pool, write_pool
from elastocal.planning.pool_file import _SCHEMA as SCHEMA
from support import plans


def assert_same(found, wanted):
    for field in fields(PoolData):
        a, b = getattr(found, field.name), getattr(wanted, field.name)
        assert type(a) is type(b), field.name
        if isinstance(b, np.ndarray):
            assert (a.dtype, a.shape, a.tobytes()) == (b.dtype, b.shape, b.tobytes()), field.name
        else:
            assert a == b


def random_pool(rng, candidates, points, joints=7, checks=10) -> PoolData:
    names = tuple(f"check_{i}" for i in range(checks))
    point = np.sort(rng.permutation(points)[:candidates])
    refused_by = rng.integers(0, checks + 1, points)
    refused_by[point] = -1
    return PoolData(
        contact=rng.normal(size=(candidates, 3)),
        normal=rng.normal(size=(candidates, 3)),
        T_base_tcp=rng.normal(size=(candidates, 4, 4)),
        q=rng.normal(size=(candidates, joints)),
        q_approach=rng.normal(size=(candidates, joints)),
        joint_names=tuple(f"joint_a{i}" for i in range(joints)),
        branch=rng.integers(0, 8, candidates),
        margin=rng.normal(size=(checks, candidates)),
        check_names=names,
        check_units=("rad",) * checks,
        boundary_distance=rng.uniform(size=candidates),
        pose_id=np.full(candidates, -1),
        point=point,
        sampled=rng.normal(size=(points, 3)),
        refused_by=refused_by,
        refusal_names=("reach", *names),
    )


def damaged(tmp_path, change):
    """Write the pool, change the dataset of the file, return the refusal."""
    path = write_pool(tmp_path, plans.pool())
    data = change(xr.load_dataset(path, engine="h5netcdf"))
    data.to_netcdf(path, engine="h5netcdf")
    with pytest.raises(SchemaError) as caught:
        read_pool(tmp_path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_a_pool_comes_back_bit_for_bit(tmp_path):
    path = write_pool(tmp_path, plans.pool())
    assert path == tmp_path / POOL
    assert_same(read_pool(tmp_path), plans.pool())
    assert_same(read_pool(path), plans.pool())


def test_distances_without_edge_and_margins_without_number_survive(tmp_path):
    data = plans.pool()
    margin = data.margin.copy()
    margin[0, :3] = np.nan, np.inf, -np.inf
    odd = replace(data, boundary_distance=np.full(len(data), np.inf), margin=margin)
    write_pool(tmp_path, odd)
    assert_same(read_pool(tmp_path), odd)


@pytest.mark.parametrize(("candidates", "checks"), [(0, 2), (3, 0), (0, 0)])
def test_an_empty_pool_survives(tmp_path, candidates, checks):
    data = random_pool(np.random.default_rng(0), candidates, 5, checks=checks)
    write_pool(tmp_path, data)
    assert_same(read_pool(tmp_path), data)


def test_three_thousand_candidates_stay_below_two_megabytes(tmp_path):
    """Random digits do not compress: no real pool is larger."""
    path = write_pool(tmp_path, random_pool(np.random.default_rng(0), 3000, 6000))
    assert path.stat().st_size < 2e6


def test_others_open_it_and_find_units_and_flags(tmp_path):
    with xr.open_dataset(write_pool(tmp_path, plans.pool())) as data:
        assert data.attrs["schema"] == SCHEMA == "elastocal.pool/1"
        assert data["contact"].attrs["units"] == "m"
        assert data["pose_id"].dtype == np.int32
        assert data["check_names"].values.tolist() == ["joint_limits", "wrist"]
        flags = data["refused_by"].attrs
        meaning = dict(zip(flags["flag_values"].tolist(), flags["flag_meanings"].split(), strict=1))
        assert meaning == {-1: "none", 0: "reach", 1: "joint_limits", 2: "wrist"}
        assert np.count_nonzero(data["refused_by"] == 0) == 7


def test_arrays_are_copied_and_read_only():
    contact = plans.pool().contact.copy()
    data = replace(plans.pool(), contact=contact)
    contact[:] = 0.0
    assert np.any(data.contact)
    with pytest.raises(ValueError, match="read-only"):
        data.contact[0, 0] = 1.0


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"normal": np.zeros((3, 3))}, r"normal of the pool has shape \(3, 3\), not \(50, 3\)"),
        ({"T_base_tcp": np.zeros((50, 7))}, r"T_base_tcp of the pool has shape"),
        ({"joint_names": ("a",)}, r"q of the pool has shape \(50, 7\), not \(50, 1\)"),
        ({"check_units": ("rad",)}, "2 checks and 1 units"),
        ({"refusal_names": ("reach", "two words", "wrist")}, "'two words' of the pool must be"),
        ({"refusal_names": ("reach", "wrist", "wrist")}, "'wrist' of the pool must be one word"),
        ({"refusal_names": ("reach",)}, "refused_by of the pool holds 2, allowed: -1 to 0"),
        ({"point": np.full(50, 64)}, "point of the pool holds 64, allowed: 0 to 63"),
        ({"pose_id": np.full(50, -2)}, "pose_id of the pool holds -2"),
    ],
)
def test_contradictions_are_refused_by_name(changes, said):
    with pytest.raises(PlanningError, match=said):
        replace(plans.pool(), **changes)


@pytest.mark.slow
def test_an_unknown_schema_is_refused_by_name(tmp_path):
    said = damaged(tmp_path, lambda data: data.assign_attrs(schema="elastocal.pool/2"))
    assert "'elastocal.pool/2'; this version reads 'elastocal.pool/1'" in said
    assert "None" in damaged(tmp_path, lambda data: data.drop_attrs(deep=False))


@pytest.mark.slow
def test_a_missing_variable_and_a_wrong_dimension_are_named(tmp_path):
    assert "'margin' is missing" in damaged(tmp_path, lambda data: data.drop_vars("margin"))
    assert "q has dimensions" in damaged(tmp_path, lambda data: data.assign(q=data["q"].T))
    assert "refused_by" in damaged(
        tmp_path, lambda data: data.assign(refused_by=data["refused_by"].drop_attrs())
    )


def test_a_variable_of_somebody_else_is_left_alone(tmp_path):
    path = write_pool(tmp_path, plans.pool())
    data = xr.load_dataset(path, engine="h5netcdf").assign(note=("candidate", np.zeros(50)))
    data.to_netcdf(path, engine="h5netcdf")
    assert_same(read_pool(tmp_path), plans.pool())


def test_a_folder_without_pool_and_a_file_that_is_none_are_named(tmp_path):
    with pytest.raises(FileAccessError, match=r"cannot read .*pool\.nc: No such file"):
        read_pool(tmp_path)
    (tmp_path / POOL).write_text("candidate,x\n")
    with pytest.raises(SchemaError, match=r"pool\.nc: not a NetCDF4 file"):
        read_pool(tmp_path)


def test_a_failed_write_leaves_the_old_file(tmp_path, monkeypatch):
    path = write_pool(tmp_path, plans.pool())
    before = path.read_bytes()

    def fail(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr("h5netcdf.File.create_variable", fail)
    with pytest.raises(KeyboardInterrupt):
        write_pool(tmp_path, plans.pool())
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("rail", [True, False])
def test_a_pool_and_the_plan_chosen_from_it_belong_together(rail):
    check_pool_of(plans.plan(rail), plans.pool(rail))


def test_a_pool_of_another_plan_is_refused():
    plan, data = plans.plan(), plans.pool()
    others = {
        "belongs to another plan: joints": plans.pool(rail=False),
        "candidates 30, in the plan 50": random_pool(np.random.default_rng(0), 30, 64),
        "sampled points 65, in the plan 64": replace(
            data, sampled=np.zeros((65, 3)), refused_by=np.zeros(65)
        ),
        "chosen candidates 0, in the plan 6": replace(data, pose_id=np.full(50, -1)),
        "its candidate 43 is not pose 0": replace(data, q=data.q + 1e-9),
        "candidate 43 is not pose 0": replace(data, pose_id=data.pose_id[::-1]),
    }
    others["candidates 30, in the plan 50"] = replace(
        others["candidates 30, in the plan 50"], joint_names=data.joint_names
    )
    for said, other in others.items():
        with pytest.raises(SchemaError, match=said):
            check_pool_of(plan, other, "runs/pool.nc")
