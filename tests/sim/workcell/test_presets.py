"""Each effect of the presets alone changes what it should, by the size that its figure says."""

import numpy as np
import pytest

from elastocal.errors import SchemaError
from elastocal.sim import PRESET_FIGURES, PRESETS
from elastocal.sim.truth import Simulation
from elastocal.sim.workcell import CampaignSimulator, ContactPoses, ProcessCell
from elastocal.sim.workcell._contact import ContactLaw
from elastocal.sim.workcell._imperfections import SensorHysteresis, VisitChance
from elastocal.sim.workcell._quasistatics import Quasistatics
from elastocal.sim.workcell._robot import TrueRobot
from elastocal.sim.workcell._timeline import posture_key
from support.simulated import QUIET, Session, example_cell, marker_by_controller, places

ARCMIN = np.pi / 10800.0
FORCE = np.array([0.0, 0.0, -1100.0])


def statics(**simulation):
    cell = example_cell(simulation=simulation)
    return Quasistatics.of(cell, TrueRobot.of(cell))


def process(**simulation):
    return ProcessCell(example_cell(simulation=QUIET | simulation), 0)


def twists(bank, torques, joint):
    """Twist of one gear alone under torques one after the other, by Newton's method."""
    law, column, twist, found = bank, bank.gears.which[joint], 0.0, []
    row = np.zeros(len(bank.stiffness))
    for torque in torques:
        for _ in range(60):
            row[column] = twist
            _, have, rate = law.evaluate(row[None])
            missing = have[0, column] - torque
            if abs(missing) < 1e-6:
                break
            twist -= missing / rate[0, column]
        row[column] = twist
        law = law.drawn_along(row)
        found.append(twist)
    return np.array(found)


def there_and_back(most, steps=40):
    up = np.linspace(0.0, most, steps)
    return np.concatenate([up, up[::-1], -up, -up[::-1]])


@pytest.mark.parametrize("preset", ["typical", "harsh"])
@pytest.mark.parametrize("joint", range(6))
def test_the_lost_motion_of_a_load_there_and_back_is_that_of_the_file(preset, joint):
    cell = example_cell(simulation={"preset": preset, "balancer": {"fitted": False}})
    bank = TrueRobot.of(cell).springs
    bank = bank.relaxed(np.zeros(len(bank.stiffness)))
    most = 1.5e-3 * bank.stiffness[bank.gears.which[joint]]
    twist = twists(bank, there_and_back(most), joint)
    lost = twist[79] - twist[159]
    assert lost / ARCMIN == pytest.approx(
        cell.file.simulation.gears.lost_motion[joint] / ARCMIN, rel=1e-3
    )


def test_typical_lost_motion_is_a_third_to_three_fifths_of_an_arc_minute():
    lost = np.array(Simulation().gears.lost_motion) / ARCMIN
    assert np.all((lost > 0.29) & (lost < 0.61))


@pytest.mark.parametrize(("preset", "share"), [("kind", 0.8), ("typical", 0.7), ("harsh", 0.6)])
def test_k1_over_k3_is_what_the_growth_says(preset, share):
    smooth = {"backlash": "0 rad", "hysteresis": 0.0, "residual": 0.0}
    simulation = {"preset": preset, "gears": smooth, "balancer": {"fitted": False}}
    bank = TrueRobot.of(example_cell(simulation=simulation)).springs
    which = bank.gears.which
    k3 = bank.stiffness[which]
    rest = np.zeros((1, len(bank.stiffness)))
    k1 = bank.evaluate(rest)[2][0, which]
    far = bank.evaluate(rest + 0.05)[2][0, which]
    np.testing.assert_allclose(k1 / k3, share, rtol=1e-9)
    np.testing.assert_allclose(far / k3, 1.0, rtol=1e-4)


LEFT = {"preset": "typical", "gears": {"residual": 1.0}}


class TestFrictionAfterAFreeMove:
    def test_it_is_another_one_in_every_visit(self):
        still, q = statics(**LEFT), places()[0].q
        at = [
            still.visited(VisitChance.of(0, key)).free(q, np.zeros(3), None).theta
            for key in ("a", "b", "a")
        ]
        np.testing.assert_array_equal(at[0], at[2])
        which = still.robot.springs.gears.which
        assert np.abs(at[0] - at[1])[which].min() > 1e-7

    def test_the_strains_are_still_there_when_the_robot_is_at_rest(self):
        chance = VisitChance.of(0, "a")
        still = statics(**LEFT).visited(chance)
        state = still.free(places()[0].q, np.zeros(3), None)
        gears = state.springs.gears
        left = state.theta[gears.which, None] - state.springs.slider
        np.testing.assert_allclose(left, gears.strain(chance.stroke), atol=1e-15)

    def test_a_robot_with_them_stays_where_it_is_without_force(self):
        still = statics(**LEFT).visited(VisitChance.of(0, "a"))
        q = places()[0].q
        free = still.free(q, np.zeros(3), None)
        again = still.loaded(free, q, np.zeros(3), np.zeros(3))
        np.testing.assert_allclose(again.theta, free.theta, atol=1e-11)

    def test_they_change_a_deflection_by_no_more_than_the_lost_motion_can(self):
        q, moved = places()[0].q, []
        for key in "abcdef":
            still = statics(**LEFT).visited(VisitChance.of(0, key))
            free = still.free(q, np.zeros(3), None)
            force = still.robot.forward(q)[:3, :3] @ FORCE
            moved.append((still.loaded(free, q, force, np.zeros(3)).twist - free.twist)[:3])
        spread = np.ptp(moved, axis=0).max()
        # Six gears of 0.3' to 0.6' some 2 m from the tool, and they do not all add up.
        assert 10e-6 < spread < 6 * 0.6 * ARCMIN * 2.0

    def test_a_course_begins_with_them(self):
        q = places()[0].q
        with_, without = process(gears={"residual": 1.0}), process()
        for cell in (with_, without):
            cell.lift("a", q)
        gap = with_.free_shift(q) - without.free_shift(q)
        assert np.linalg.norm(gap) > 1e-7


def test_a_tilt_sits_where_turn_and_offset_put_it():
    cell = example_cell(simulation={"bearings": {"turn": "30 deg", "offset": "60 mm"}})
    plain = TrueRobot.of(example_cell()).chain
    turned = TrueRobot.of(cell).chain
    moved = [
        (a, b)
        for a, b in zip(plain.springs, turned.springs, strict=True)
        if not np.allclose(a.axis, b.axis)
    ]
    assert len(moved) == 12
    for a, b in moved:
        assert np.dot(a.axis, b.axis) == pytest.approx(np.cos(np.deg2rad(30.0)))
        assert np.linalg.norm(b.at) == pytest.approx(0.06)
        assert np.dot(b.at, b.axis) == pytest.approx(0.0, abs=1e-12)


def test_seals_rub_with_their_force_times_the_lever_of_the_posture():
    still = statics(balancer={"seal_friction": "300 N"}).robot
    angle = np.array(0.3)
    balancer = still.springs.balancer
    step = 1e-6
    stored = [balancer.evaluate(angle + s) for s in (-step, step)]
    length = [np.sqrt(2.0 * e / balancer.rate) for e, _, _ in stored]
    lever = abs(length[1] - length[0]) / (2.0 * step)
    gears = still.springs.at_joint(angle).gears
    plain = statics().robot.springs.gears
    extra = gears.friction - plain.friction
    np.testing.assert_allclose(extra, [0, 300.0 * lever, 0, 0, 0, 0], rtol=1e-6, atol=1e-9)


class TestGeometry:
    @staticmethod
    def off(**geometry):
        return statics(geometry=geometry)

    def test_a_wrong_tool_is_off_by_its_length_in_the_tools_own_frame(self):
        still = self.off(tcp="1 mm")
        assert np.linalg.norm(still.tcp_error) == pytest.approx(1e-3)
        for place in places():
            R = still.robot.forward(place.q)[:3, :3]
            shift = (still.robot.built.forward(place.q) - still.robot.forward(place.q))[:3, 3]
            np.testing.assert_allclose(R.T @ shift, still.tcp_error, atol=1e-12)

    def test_every_link_is_off_by_half_a_millimetre(self):
        robot = self.off(links="0.5 mm").robot
        shift = (robot.built.T_base_joint - robot.linkage.T_base_joint)[:, :3, 3]
        steps = np.linalg.norm(np.diff(shift, axis=0), axis=1)
        np.testing.assert_allclose(steps, [0, *5 * [0.5e-3]], atol=1e-12)

    def test_the_controller_does_not_know(self):
        plain, wrong = statics(), self.off(tcp="1 mm", links="0.5 mm")
        q = places()[0].q
        np.testing.assert_array_equal(wrong.robot.forward(q), plain.robot.forward(q))
        gap = wrong.free(q, np.zeros(3), None).twist - plain.free(q, np.zeros(3), None).twist
        assert 0.3e-3 < np.linalg.norm(gap[:3]) < 3e-3

    def test_a_deflection_hardly_depends_on_it(self):
        q, found = places()[0].q, []
        for still in (statics(), self.off(tcp="1 mm", links="0.5 mm")):
            free = still.free(q, np.zeros(3), None)
            found.append(still.loaded(free, q, FORCE, np.zeros(3)).twist[:3] - free.twist[:3])
        assert np.linalg.norm(found[1] - found[0]) < 5e-3 * np.linalg.norm(found[0])


class TestTemperature:
    def test_a_warm_arm_is_off_at_home_by_the_drift(self):
        still, home = statics(thermal={"drift": "50 um"}), example_cell().home
        cold, warm = (
            still.visited(VisitChance.of(0, "a"), np.array(w)).free(home, np.zeros(3), None)
            for w in (0.0, 1.0)
        )
        assert np.linalg.norm((warm.twist - cold.twist)[:3]) == pytest.approx(50e-6, rel=1e-9)

    def test_a_process_is_off_its_path_in_the_air_by_about_the_drift(self):
        q = places()[0].q
        cell = process(thermal={"drift": "50 um"})
        cell.lift("a", q)
        gap = cell.press(q, np.zeros(3)).shift - cell.free_shift(q)
        assert 25e-6 < np.linalg.norm(gap) < 100e-6

    def test_a_visit_of_the_calibration_measures_nothing_of_it(self):
        where = ContactPoses(places()[0].q[None], places()[0].normal[None])
        both = [
            CampaignSimulator.of(example_cell(simulation={"thermal": {"drift": drift}})).settle(
                where, FORCE[None]
            )
            for drift in ("0 um", "100 um")
        ]
        cold, warm = (each.marker_displacement - each.controller_displacement for each in both)
        np.testing.assert_allclose(warm, cold, atol=1e-6)


class TestContactMoment:
    chance = np.array([1.0, -1.0, 0.5, 2.0])

    def law(self, **contact):
        return ContactLaw.of(example_cell(simulation={"contact": contact}))

    def test_a_kind_contact_has_none(self):
        assert self.law().attack(FORCE, self.chance) is None

    def test_the_point_of_attack_wanders_by_its_standard_deviation(self):
        attack = self.law(wander="2 mm").attack(FORCE, self.chance)
        np.testing.assert_allclose(attack, [1e-3, 4e-3, 0.0], rtol=1e-12)

    def test_a_tilted_disk_makes_the_moment_of_an_elastic_bed(self):
        attack = self.law(tilt="0.1 deg").attack(FORCE, self.chance)
        moment = np.linalg.norm(np.cross(attack, FORCE))
        bed = 4e6 * 0.025**2 / 4.0
        assert moment == pytest.approx(bed * np.deg2rad(0.1) * np.sqrt(2.0), rel=1e-9)

    def test_it_never_leaves_the_inner_half_of_the_disk(self):
        attack = self.law(tilt="5 deg").attack(FORCE, self.chance)
        assert np.linalg.norm(attack) == pytest.approx(0.0125)

    def test_the_sensor_feels_it(self):
        q = places()[0].q
        felt = []
        for wander in ("0 mm", "2 mm"):
            cell = process(contact={"wander": wander})
            cell.lift("a", q)
            R = statics().robot.forward(q)[:3, :3]
            felt.append(cell.press(q, R @ FORCE).felt)
        beside = cell._chance.load(0)[2:] * 2e-3
        np.testing.assert_allclose(felt[1][:3], felt[0][:3], atol=0.05)
        moment = felt[1][3:] - felt[0][3:]
        assert np.linalg.norm(moment) == pytest.approx(1100.0 * np.linalg.norm(beside), rel=0.01)


class TestSensor:
    def test_half_a_load_reads_higher_on_the_way_down_by_the_hysteresis(self):
        ranges = np.array([2500.0, 2500.0, 6250.0, 400.0, 400.0, 400.0])
        sensor, load = SensorHysteresis(0.005, ranges), 0.2 * ranges
        way = np.concatenate([np.linspace(0, 1, 41), np.linspace(1, 0, 41)])
        lag = sensor.lag(way[:, None] * load)
        np.testing.assert_allclose((lag[61] - lag[20]) / load, 0.005, rtol=1e-9)

    def test_steps_of_the_way_do_not_matter(self):
        ranges = np.full(6, 1000.0)
        coarse, fine = SensorHysteresis(0.01, ranges), SensorHysteresis(0.01, ranges)
        one = coarse.lag(np.array([0.0, 150.0, -40.0, 80.0])[:, None] * np.ones(6))
        way = np.concatenate([np.linspace(0, 150, 9), np.linspace(150, -40, 9),
                              np.linspace(-40, 80, 9)])  # fmt: skip
        np.testing.assert_allclose(fine.lag(way[:, None] * np.ones(6))[-1], one[-1], rtol=1e-9)

    def test_typical_cross_talk_is_one_percent_of_the_ranges(self):
        cell = example_cell(simulation={"preset": "typical"})
        ranges = np.array([2500.0, 2500.0, 6250.0, 400.0, 400.0, 400.0])
        talk = [
            (Session.of(cell, seed).sim.sensor.matrix - np.eye(6)) / np.divide.outer(ranges, ranges)
            for seed in range(20)
        ]
        assert np.std(talk) == pytest.approx(0.01, rel=0.1)


class TestProcessStiffness:
    def shift(self, stiffness, aside):
        """Return force and shift of a course that is commanded some way along its normal."""
        q = places()[0].q
        cell = process(contact={"process_stiffness": stiffness})
        cell.lift("a", q)
        robot = cell._statics.robot
        T = robot.forward(q)
        path = T[:3, 3] + cell.free_shift(q)
        there = cell._statics.along(q, T[:3, :3], (T[:3, 3] + aside * T[:3, 2])[None])[0]
        pressed = cell.press(there, T[:3, :3] @ FORCE, path)
        away = robot.forward(there)[:3, 3] + pressed.shift - path
        return np.linalg.norm(pressed.felt[:3]), -T[:3, 2] @ away

    @pytest.mark.parametrize("aside", [-1e-3, 0.0, 1e-3])
    def test_the_force_is_the_programmed_one_less_stiffness_times_shift(self, aside):
        force, away = self.shift("100 N/mm", aside)
        assert force == pytest.approx(1100.0 - 1e5 * away, abs=0.05)
        assert abs(away) > 1e-5

    def test_the_force_reacts_along_the_normal_of_the_surface_and_not_along_the_tool(self):
        q = places()[0].q
        cell = process(contact={"process_stiffness": "100 N/mm"})
        cell.lift("a", q)
        T = cell._statics.robot.forward(q)
        path = T[:3, 3] + cell.free_shift(q)
        aslant = T[:3, :3] @ [0.0, np.sin(0.7), -np.cos(0.7)]
        felt = {}
        for name, step in (("along", aslant), ("square", np.cross(aslant, T[:3, 0]))):
            there = cell._statics.along(q, T[:3, :3], (T[:3, 3] + 1e-3 * step)[None])[0]
            free = cell.free_shift(there) - cell.free_shift(q)
            here, moved = (cell.press(each, T[:3, :3] @ FORCE, path, aslant) for each in (q, there))
            felt[name] = np.linalg.norm(moved.felt[:3] - here.felt[:3])
            assert np.linalg.norm(free) < 1e-4
        assert felt["along"] > 50.0
        assert felt["square"] < 0.1 * felt["along"]

    def test_without_stiffness_it_is_the_programmed_one(self):
        assert self.shift("0 N/mm", 1e-3)[0] == pytest.approx(1100.0, abs=1e-6)

    def test_a_correction_that_brings_the_tool_back_brings_the_force_back(self):
        _, away = self.shift("100 N/mm", 0.0)
        force, left = self.shift("100 N/mm", 1.13 * away)
        assert abs(left) < 0.1 * away
        assert force == pytest.approx(1100.0, rel=0.02)


@pytest.mark.slow
@pytest.mark.parametrize("preset", PRESETS)
def test_devices_and_quick_readings_agree_on_every_preset(preset):
    cell = example_cell(simulation=QUIET | {"preset": preset})
    place = places()[1]
    quick = CampaignSimulator.of(cell).settle(
        ContactPoses(place.q[None], place.normal[None]),
        cell.file.load_cases.force_tcp,
        visits=VisitChance.stack([VisitChance.of(0, posture_key(place.q_approach))]),
    )
    session = Session.of(cell)
    state = session.near(place)
    tare, marker_0 = session.average()
    by_controller_0 = marker_by_controller(state, cell)
    session.touch(place)
    for load, force in enumerate(cell.file.load_cases.force_tcp):
        state = session.hold(force)
        wrench, marker = session.average()
        deflection = marker - marker_0 - (marker_by_controller(state, cell) - by_controller_0)
        ours = quick.marker_displacement[0, load] - quick.controller_displacement[0, load]
        np.testing.assert_allclose(ours, deflection, atol=20e-9)
        np.testing.assert_allclose(quick.felt[0, load], (wrench - tare)[:3], atol=0.05)


def test_the_process_and_the_quick_readings_deflect_alike():
    cell = example_cell(
        simulation=QUIET | {"preset": "typical", "thermal": {"drift": "0 um"},
                            "contact": {"micro_slip": "0 um", "process_stiffness": "0 N/mm"}}
    )  # fmt: skip
    place, chance = places()[1], VisitChance.of(0, "process a")
    force = cell.file.load_cases.force_tcp[:1]
    where = ContactPoses(place.q[None], place.normal[None])
    quick = CampaignSimulator.of(cell).settle(where, force, visits=VisitChance.stack([chance]))
    run = ProcessCell(cell, 0)
    run.lift("a", quick.q[0, 0])
    shift = run.press(quick.q[0, 0], quick.force[0, 0]).shift - run.free_shift(quick.q[0, 0])
    np.testing.assert_allclose(shift, quick.deflection[0, 0], atol=3e-6)


def test_kind_leaves_every_effect_beyond_the_springs_out():
    kind = Simulation(preset="kind")
    cell = example_cell()
    still = statics()
    assert still.robot.built is still.robot.linkage
    assert still.growth is None
    assert still.visited(VisitChance.of(0, "a")).strain is None
    assert not np.any(still.tcp_error)
    assert kind.gears.lost_motion is None
    assert cell.file.simulation.preset == "kind"


@pytest.mark.parametrize("preset", PRESETS)
def test_every_figure_of_a_preset_arrives(preset):
    simulation = Simulation(preset=preset)
    for figure in PRESET_FIGURES:
        section, name = figure.key.split(".")
        again = Simulation.model_validate({"preset": "kind", section: {name: figure.of(preset)}})
        assert getattr(getattr(simulation, section), name) == getattr(getattr(again, section), name)


def test_a_figure_of_the_file_wins_over_the_preset():
    found = Simulation.model_validate({"preset": "harsh", "geometry": {"tcp": "0.3 mm"}})
    assert found.geometry.tcp == pytest.approx(0.3e-3)
    assert found.geometry.links == pytest.approx(1e-3)
    assert Simulation.model_validate({"gears": {"hysteresis": 0.02}}).gears.lost_motion is None


def test_typical_is_the_default():
    assert Simulation() == Simulation(preset="typical")


def test_an_unknown_preset_is_refused_in_a_line_that_names_the_three():
    with pytest.raises(SchemaError) as caught:
        example_cell(simulation={"preset": "cruel"})
    text = str(caught.value)
    assert "\n" not in text
    assert all(name in text for name in ("simulation.preset", *PRESETS))
