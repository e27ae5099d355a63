"""What a person is told of contact and faults while an arm presses."""

import threading

from elastocal.cell import ArmState
from elastocal.workflows._operator_and_devices import Operator

_CONTACT = {
    True: "says that it is in contact",
    False: "says that it is not in contact",
    None: "does not know whether it is in contact: the force is measured before it moves",
}


def contact_sentence(state: ArmState) -> str:
    """Return what an arm says of contact."""
    return f"the arm {_CONTACT[state.in_contact]}"


def tell_at_once(operator: Operator, fault: str) -> None:
    """Let a person read a fault before the arm is brought off the surface, which may take long.

    In a thread of its own: a terminal that takes nothing must not hold the arm up.
    """
    lines = [
        f"fault: {fault}",
        "the arm now lets go, retracts where it is before a surface, and stops",
    ]
    threading.Thread(target=operator.warn, args=(lines,), daemon=True).start()
