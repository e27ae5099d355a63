"""No arm that can hurt moves unarmed: one place arms, drivers ask, whatever is edited meanwhile."""

import contextlib
import re
from pathlib import Path

import numpy as np
import pytest

from elastocal import workflows
from elastocal.cell import Arming, load_cell
from elastocal.drivers.kuka_rsi import DRIVER as KUKA, RsiSettings
from elastocal.errors import DeviceError, ElastocalError, ProcedureError
from elastocal.studio import Session
from elastocal.studio.worker import WorkNews
from elastocal.workflows._operator_and_devices import arm_devices, rig_of
from elastocal.workflows.studio import _Commands
from support import drivers
from support.kuka_bench import Bench
from support.run_cells import PlannedCell, planned_cell

SOURCES = Path(workflows.__file__).parents[1]
REAL = "devices: {arm: fake, sensor: fake, metrology: fake}"


class Outbox:
    """Hears what a worker says."""

    def progress(self, *_) -> None: ...

    def sample(self, _) -> None: ...

    def tell(self, _) -> None: ...

    def stopped(self) -> bool:
        return False


class LateWorker:
    """A worker whose process starts when a test says so."""

    def __init__(self) -> None:
        self.news, self.waiting = WorkNews(), []

    def begin(self, _kind, work) -> None:
        if self.waiting:
            raise ProcedureError("still going on: stop it first")
        self.waiting.append(work)

    def stop(self) -> None:
        self.waiting.clear()

    def go(self) -> None:
        while self.waiting:
            self.waiting.pop()(Outbox())


@pytest.fixture(scope="module")
def planned(tmp_path_factory):
    return planned_cell(tmp_path_factory.mktemp("armed"), 3)


@pytest.fixture
def fake(tmp_path, monkeypatch):
    """A driver that could hurt; its list `enabled` has the cell files whose arm was enabled."""
    drivers.install(tmp_path / "site", monkeypatch, "fake", drivers.REAL)
    import fake

    return fake


class Page:
    """A page of a studio, which shows what the cell file was when it looked."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.look()

    def look(self) -> None:
        self.shown = self.session.actions["scene"]({})["sha256"]

    def run(self, folder: str, confirmed: bool) -> None:
        message = {"plan": "../plan", "folder": folder, "confirmed": confirmed, "cell": self.shown}
        self.session.actions["run"](message)


@pytest.fixture
def studio(planned, monkeypatch):
    """Return a function that opens a studio on a cell file, with a worker that waits."""

    def opened(cell: Path, armed: bool) -> Session:
        session = Session(cell, _Commands(None), armed)
        session.worker = LateWorker()
        monkeypatch.setattr(session, "_require_folder", lambda name: cell.parent / name)
        return session

    return opened


def test_a_file_that_becomes_real_behind_the_studio_moves_nothing(planned, fake, studio):
    """The page shows a simulated cell; the worker, which reads the file anew, finds a real one."""
    cell = planned.with_text("edited.yaml", "").cell
    session = studio(cell, armed=False)
    Page(session).run("run1", confirmed=True)
    planned.with_text("edited.yaml", REAL)
    with pytest.raises(DeviceError, match=r"edited.yaml has changed since it was agreed to"):
        session.worker.go()
    assert fake.enabled == []
    assert not (cell.parent / "run1").exists()


def test_a_page_that_shows_an_older_file_starts_nothing_real(planned, fake, studio):
    fake.moves = False
    cell = planned.with_text("older.yaml", REAL).cell
    session = studio(cell, armed=True)
    one, other = Page(session), Page(session)
    cell.write_text(cell.read_text() + "# another\n")
    session.actions["reload"]({})
    with pytest.raises(ProcedureError, match="shows another state of the cell file"):
        one.run("run2", confirmed=True)
    other.look()
    other.run("run2", confirmed=True)
    with contextlib.suppress(ElastocalError):
        session.worker.go()
    assert set(fake.enabled) == {other.shown}


def interleaved(planned: PlannedCell, session: Session, seed: int, steps: int) -> set[str]:
    """Let two pages, an editor and a worker do something, in any order; return what was agreed."""
    rng, cell, plain = np.random.default_rng(seed), session._path, planned.cell.read_text()
    texts = [plain, f"{plain}\n{REAL}\n", f"{plain}\n# another\n{REAL}\n"]
    pages, agreed = [Page(session), Page(session)], set()
    for step in range(steps):
        page = pages[rng.integers(2)]
        with contextlib.suppress(ElastocalError):
            match rng.choice(["edit", "reload", "look", "run", "start", "stop"], p=P):
                case "edit":
                    cell.write_text(texts[rng.integers(3)])
                case "reload":
                    session.actions["reload"]({})
                case "look":
                    page.look()
                case "run":
                    confirmed = bool(rng.random() < 0.7)
                    agreed |= {page.shown} if confirmed else set()
                    page.run(f"run_{seed}_{step}", confirmed)
                case "start":
                    session.worker.go()
                case "stop":
                    session.actions["stop"]({})
    return agreed


P = [0.08, 0.12, 0.25, 0.25, 0.27, 0.03]


@pytest.mark.parametrize("steps", [40, pytest.param(600, marks=pytest.mark.slow)])
@pytest.mark.parametrize("armed", [False, True])
def test_whatever_the_order_no_file_moves_an_arm_that_nobody_agreed_to(
    planned, fake, studio, armed, steps
):
    fake.moves = False
    cell = planned.with_text(f"shuffled_{armed}_{steps}.yaml", REAL).cell
    agreed = interleaved(planned, studio(cell, armed), 3, steps)
    assert bool(fake.enabled) is armed
    assert set(fake.enabled) <= agreed


def test_without_agreement_no_arm_is_armed_whoever_asks(planned, fake):
    rig = rig_of(load_cell(planned.with_text("asked.yaml", REAL).cell))
    with rig.reserved("test") as reserved, contextlib.closing(reserved.connect(0, 0.0)) as devices:
        with pytest.raises(ProcedureError, match="a person must confirm"):
            arm_devices(rig, devices.arm, workflows.Unattended(), confirmed=False)
        for arming in (Arming(), Arming(rig.cell.sha256), Arming("0" * 64, real=True)):
            with pytest.raises(DeviceError, match=r"is not armed|has changed"):
                arm_devices(rig, devices.arm, workflows.Unattended(), True, arming)
            with pytest.raises(DeviceError, match="the arm is not armed: nothing moves"):
                devices.arm.enable()
        arm_devices(rig, devices.arm, workflows.Unattended(), confirmed=True)
        devices.arm.enable()
    assert fake.enabled == [rig.cell.sha256]


def test_an_arm_that_takes_no_arming_is_refused(planned, fake, monkeypatch):
    rig = rig_of(load_cell(planned.with_text("takes_none.yaml", REAL).cell))
    with rig.reserved("test") as reserved, contextlib.closing(reserved.connect(0, 0.0)) as devices:
        del devices.arm.arming
        with pytest.raises(
            DeviceError, match=r"driver 'fake' can hurt, and its arm takes no arming"
        ):
            arm_devices(rig, devices.arm, workflows.Unattended(), confirmed=True)


def test_a_kuka_is_not_enabled_by_the_arming_of_another_file():
    bench = Bench.of()
    for arming in (Arming(), Arming("0" * 64, real=True)):
        bench.arm.arming = arming
        with pytest.raises(DeviceError, match=r"is not armed|has changed"):
            bench.arm.enable()
    assert KUKA.real
    assert RsiSettings().mode == "measure"


def test_real_arms_are_armed_in_one_place():
    """Every command that moves an arm goes through `arm_devices`, or hands an `Arming` to live."""
    texts = {
        str(file.relative_to(SOURCES)): file.read_text(encoding="utf-8")
        for file in SOURCES.rglob("*.py")
    }
    hands = {
        name for name, text in texts.items() if re.search(r"arm\.arming = (?!Arming\(\))", text)
    }
    assert hands == {"workflows/_operator_and_devices.py"}
    made = {name for name, text in texts.items() if re.search(r"Arming\.of\(|Arming\(\w", text)}
    assert made == {
        "studio/session.py",
        "workflows/_operator_and_devices.py",
        "workflows/live.py",
        "workflows/run.py",
    }
    enabling = {name for name, text in texts.items() if "arm.enable()" in text}
    for name in enabling & {name for name in texts if name.startswith("workflows/")}:
        assert "arm_devices(" in texts[name], name
