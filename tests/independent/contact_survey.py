"""What campaigns without a tracker leave, seed by seed: the figures of decisions 137 and 146.

``cd tests && python -m independent.contact_survey free|known|tip|exact ARM,… SEED,…``: a free steel
contact; one that is known to 30 %; the same with a tip that is 8.8 mm off, with ``tip`` in the
contact file; and without it. Needs the extra ``[nightly]``; some ten seconds a campaign.
"""

import sys

import numpy as np

import elastocal as ec
from elastocal.identification import Contact
from independent.contact_truth import STEEL
from independent.test_contact import KNOWN, OFF, TIP_OPEN, dataset, judged_model, with_tip_off

CONTACTS = {"free": Contact(), "known": KNOWN, "tip": TIP_OPEN, "exact": KNOWN}


def main(what: str, arms: list[str], seeds: list[int]) -> None:
    """Print error and share inside of each campaign, and where a tip was found."""
    for arm in arms:
        for seed in seeds:
            data = dataset(arm, STEEL, seed)
            data = with_tip_off(data) if what in ("tip", "exact") else data
            found = ec.calibrate(data, contact=CONTACTS[what])
            print(what, "seed", seed, end=" ")
            judged_model(arm, found.calibrated)
            tip = found.calibration.contact.tip
            if tip is not None:
                true = -np.array(OFF)
                held = (np.array(tip.low) <= true) & (true <= np.array(tip.high))
                print(f"  place {np.count_nonzero(held)} of 3 inside, told: {tip.told()}")


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2].split(","), [int(each) for each in sys.argv[3].split(",")])
