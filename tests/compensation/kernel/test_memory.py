"""Weight and friction as statements, against the elastic model and against first principles."""

import re

import numpy as np
import pytest

from elastocal.compensation.kernel import (
    Assignment,
    Call,
    Turn,
    compiled,
    deflection,
    observation_block,
    rest,
)
from elastocal.compensation.kernel.functions import python_text
from elastocal.compensation.kernel.program import statement_uses
from elastocal.elastic import ElasticModel, Gear, bearing
from elastocal.robot import Robot
from support.geared import SLIPS, geared, heavy_robot
from support.virtual_chain import ARMS

TILTED = (3.0, -5.0, -7.0)
RNG = np.random.default_rng(8)
STEPS = 60
Q = np.array([0.2, -0.7, 1.1, 0.5, -0.6, 0.3]) + 0.02 * RNG.normal(size=(STEPS, 6)).cumsum(axis=0)
FORCE = (120.0 * RNG.normal(size=(STEPS, 3))).cumsum(axis=0)
MOMENT = (15.0 * RNG.normal(size=(STEPS, 3))).cumsum(axis=0)


def loaded(text: str) -> str:
    """Return a URDF whose every link but the base has a mass aside of its joint."""
    masses = iter(range(5, 1000, 7))

    def inertial(found: re.Match[str]) -> str:
        if found[1] == "base":
            return found[0]
        return (
            f'<link name="{found[1]}"><inertial><origin xyz="0.1 -0.2 0.3"/><mass value='
            f'"{next(masses)}"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
            "</inertial></link>"
        )

    return re.sub(r'<link name="(\w+)"/>', inertial, text)


def routines(calibrated):
    model, c = calibrated.model, calibrated.compliance.tolist()
    return (
        compiled(rest(model), 6, loaded=False),
        compiled(deflection(model, c), 6),
        compiled(observation_block(model, c), 6),
    )


def energy(robot: Robot, q: np.ndarray) -> float:
    """Return the potential energy of the links, by the product of their transforms."""
    T, total = np.eye(4), 0.0
    for joint, position in zip(robot.chain.joints, q, strict=True):
        x, y, z = joint.axis
        K, moved = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]), np.eye(4)
        if joint.revolute:
            moved[:3, :3] += np.sin(position) * K + (1.0 - np.cos(position)) * K @ K
        else:
            moved[:3, 3] = position * joint.axis
        T = T @ joint.placement @ moved
        centre = T[:3, :3] @ joint.centre_of_mass + T[:3, 3]
        total -= joint.mass * float(np.dot(robot.gravity, centre))
    return total


@pytest.mark.parametrize("gravity", [None, TILTED])
def test_the_weight_about_a_joint_is_minus_the_slope_of_the_potential_energy(gravity):
    model, q, step = geared(gravity).model, Q[0], 1e-4
    slope = [
        (energy(model.robot, q + by) - energy(model.robot, q - by)) / (2.0 * step)
        for by in step * np.eye(6)
    ]
    free = routines(geared(gravity))[0](q.tolist())
    first_axis = len(model.friction)
    np.testing.assert_allclose(free[first_axis : first_axis + 6], -np.array(slope), atol=1e-4)


@pytest.mark.parametrize("arm", ARMS)
def test_the_weight_of_every_arm_is_that_of_the_model(arm):
    """Rails, sliding joints, axes askew; springs behind the motion and off the axis."""
    robot = Robot.from_urdf(loaded(ARMS[arm]), "tcp")
    joints = robot.chain.joints
    springs = [
        Gear(
            f"{joint.name}.{k}",
            joint.name,
            (0.6, 0.0, 0.8),
            revolute=revolute,
            distal=distal,
            offset=(0.1, -0.2, 0.3),
            slips=(10.0,),
        )
        for joint in joints
        for k, (revolute, distal) in enumerate([(True, False), (True, True), (False, True)])
    ]
    model = ElasticModel(robot, springs)
    free = compiled(rest(model), len(joints), loaded=False)
    for q in np.random.default_rng(1).uniform(-1.0, 1.0, (3, len(joints))):
        expected = model.weight_torques(q)
        found = -np.array(free(q.tolist())[: len(springs)])
        np.testing.assert_allclose(found, expected, atol=1e-11 * np.abs(expected).max())


@pytest.mark.parametrize("gravity", [None, TILTED])
def test_a_sequence_is_that_of_friction_elements_along_their_path(gravity):
    calibrated = geared(gravity)
    model, c = calibrated.model, calibrated.compliance
    free, deflected, blocked = routines(calibrated)
    weight = model.weight_torques(Q)
    total = weight + model.load_torques(Q, FORCE, MOMENT)
    states = model.friction.path(np.concatenate([weight[:1], total]))[1:]
    assert np.mean(np.abs(states) == model.friction.limit) > 0.2
    memory = free(Q[0].tolist())
    size = 3 * len(c)
    for q, f, m, s in zip(Q, FORCE, MOMENT, states, strict=True):
        given = q.tolist(), f.tolist(), m.tolist()
        found, block = deflected(*given, memory), blocked(*given, memory)
        expected = model.deflection(c, q, f, m, friction=s)
        np.testing.assert_allclose(found[:3], expected, atol=1e-12 * np.abs(expected).max())
        rows = model.observation_blocks(q, f, m, friction=s)
        np.testing.assert_allclose(
            np.reshape(block[:size], rows.shape), rows, atol=1e-12 * np.abs(rows).max()
        )
        np.testing.assert_allclose(block[size + 3 :], found[3:], atol=1e-9)
        # Asked again of the memory after the load, nothing has changed.
        np.testing.assert_allclose(deflected(*given, found[3:])[:3], found[:3], atol=1e-15)
        memory = found[3:]


@pytest.mark.slow
def test_an_unknown_start_moves_the_deflection_by_at_most_what_is_said_and_is_forgotten():
    calibrated = geared()
    model, c = calibrated.model, calibrated.compliance
    free, _, blocked = routines(calibrated)
    force, moment = 2.0 * FORCE, 2.0 * MOMENT
    weight = model.weight_torques(Q)
    total = weight + model.load_torques(Q, force, moment)
    way = np.concatenate([weight[:1], total])
    known = model.friction.path(way)[1:]
    corners = np.sign(np.random.default_rng(0).normal(size=(40, len(model.friction))))
    others = [model.friction.path(way, corner * model.friction.limit)[1:] for corner in corners]
    memory, said, off = free(Q[0].tolist()), [], []
    size = 3 * len(c)
    for k, (q, f, m) in enumerate(zip(Q, force, moment, strict=True)):
        out = blocked(q.tolist(), f.tolist(), m.tolist(), memory)
        memory = out[size + 3 :]
        said.append(out[size : size + 3])
        expected = model.deflection(c, q, f, m, friction=known[k])
        off.append(
            max(
                (np.abs(model.deflection(c, q, f, m, friction=o[k]) - expected) for o in others),
                key=np.max,
            )
        )
    bound, error = np.array(said), np.array(off)
    assert np.all(error <= bound + 1e-12)
    # At the start nothing is known; a torque that has changed by twice the limits wipes it out.
    assert bound[0].max() > 5e-6
    span = np.ptp(total, axis=0)[:6]
    assert np.all(span > 2.0 * max(SLIPS)), span
    assert bound[-1].max() == pytest.approx(0.0, abs=1e-15)


def test_an_unknown_start_may_move_each_component_by_what_the_elements_can_still_differ():
    """``sum |J_i| f_j min(r_j, 2 r_j - R)``, none beyond ``R = 2 r_j``."""
    calibrated = geared()
    model, c = calibrated.model, calibrated.compliance
    free, _, blocked = routines(calibrated)
    J = model.spring_jacobian(Q[0]).translation[:, model.friction.axis]
    limit = model.friction.limit
    weakness = c[["friction" in name for name in model.parameter_names]]
    for part in (0.0, 0.1, 0.5, 1.0):
        given = part * FORCE[0], part * MOMENT[0]
        span = np.abs(model.load_torques(Q[0], *given))[model.friction.axis]
        out = blocked(Q[0].tolist(), *(each.tolist() for each in given), free(Q[0].tolist()))
        expected = np.abs(J) @ (weakness * np.clip(2.0 * limit - span, 0.0, limit))
        np.testing.assert_allclose(out[3 * len(c) : 3 * len(c) + 3], expected, rtol=1e-9)


def test_no_name_is_written_twice_and_none_is_read_before():
    """Programs are straight lines: a name that two statements wrote would change what was meant."""
    model, c = geared().model, geared().compliance.tolist()
    for routine in (rest(model), deflection(model, c), observation_block(model, c)):
        assert all(name.isidentifier() for name in routine.constants)
        known = {*routine.constants, *routine.memory, *(f"q{k}" for k in range(1, 7))}
        known |= {"fx", "fy", "fz", "mx", "my", "mz"}
        for statement in routine.statements:
            match statement:
                case Turn(sine, cosine, _):
                    names = {sine, cosine}
                case Assignment(name) | Call(name):
                    names = {name}
                case _:
                    continue
            assert statement_uses(statement) <= {*known, ""}
            assert not names & known
            assert all(name.isidentifier() for name in names)
            known |= names
        assert {value.name for value in routine.outputs} <= {*known, ""}


def test_without_gravity_nothing_weighs():
    model = geared((0.0, 0.0, 0.0)).model
    np.testing.assert_array_equal(compiled(rest(model), 6, loaded=False)(Q[0].tolist()), 0.0)


def test_hinges_of_a_heavy_arm_ask_for_neither_weight_nor_memory():
    model = ElasticModel(heavy_robot(), bearing(heavy_robot()))
    for routine in (deflection(model, [1e-7] * 18), observation_block(model, [1e-7] * 18)):
        assert routine.memory == ()
        assert not any(isinstance(statement, Call) for statement in routine.statements)
        assert not any(name.startswith(("weight", "link")) for name in routine.constants)
    assert rest(model).outputs == ()


def test_variables_are_used_again_once_nothing_reads_them():
    """A frame of hundreds of variables would take twice the time."""
    model, c = geared().model, geared().compliance.tolist()
    text = python_text(observation_block(model, c), 6, loaded=True)
    assert len(set(re.findall(r"\bv\d+\b", text))) < 0.5 * text.count("\n")
