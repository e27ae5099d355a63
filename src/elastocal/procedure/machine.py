"""Runs the state machine of one attempt: every state has one action."""

from collections.abc import Callable

from elastocal.procedure.attempt import Attempt
from elastocal.procedure.faults import CAUGHT, Ends, FaultError, as_fault
from elastocal.procedure.leaving import back_off, lift, release, retract
from elastocal.procedure.off_surface import aim, move, near, released, unloaded
from elastocal.procedure.on_surface import average, engage, load, settle
from elastocal.procedure.stand import Left, Stand
from elastocal.procedure.steps import Outcome, Step, following

Action = Callable[[Attempt], Outcome]

ACTIONS: dict[Step, Action] = {
    Step.MOVE: move,
    Step.AIM: aim,
    Step.NEAR: near,
    Step.UNLOADED: unloaded,
    Step.ENGAGE: engage,
    Step.LOAD: load,
    Step.SETTLE: settle,
    Step.AVERAGE: average,
    Step.RELEASE: release,
    Step.LIFT: lift,
    Step.RELEASED: released,
    Step.RETRACT: retract,
}


class AttemptFailedError(FaultError):
    """An attempt that ended with a fault; the arm has been made safe."""

    def __init__(self, cause: FaultError, place: str, left: Left) -> None:
        super().__init__(cause.fault)
        more = left.why if left.stand is Stand.SURFACE and left.why != str(cause) else ""
        self.args = (f"{place}: {cause}" + (f"; no retract: {more}" if more else ""),)
        self.stand = left.stand


def run_attempt(a: Attempt, enter: Callable[[Attempt], None], commit: Action) -> None:
    """Run one attempt to its end.

    Parameters
    ----------
    a : Attempt
        In its first state.
    enter : callable
        Called with the attempt at the beginning of each state.
    commit : callable
        The action of COMMIT.

    Raises
    ------
    AttemptFailedError
        If it failed; force, contact and motion have been taken care of.
    """
    actions = {**ACTIONS, Step.COMMIT: commit}
    try:
        while a.step is not Step.DONE:
            enter(a)
            outcome = actions[a.step](a)
            a.step = following(a.step, outcome, a.loads_left)
    except CAUGHT as error:
        fault = as_fault(error)
        place = _place(a)
        raise AttemptFailedError(fault, place, back_off(a, fault.fault.ends)) from error
    except BaseException:
        # A mistake in the program, while a tonne of robot may press on the tooling.
        a.stand = back_off(a, Ends.RUN).stand
        raise


def _place(a: Attempt) -> str:
    load_case = f" {a.load_case}" if a.load_case else ""
    return f"pose {a.pose.id}, attempt {a.number}, {a.step.value}{load_case}"
