"""Walk the fault matrix and keep what came of it: ``python tests/support/walk_faults.py OUT``.

``OUT`` is a JSON file; what stands in it already is not tried again. Arguments after it are parts
of the names of faults that are to be tried; by default all.
"""

import json
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from support.fault_matrix import FAULTS, PHASES, as_rows, broken, quick_cell


def walk(out: Path, wanted: list[str]) -> None:
    rows = json.loads(out.read_text()) if out.exists() else []
    done = {(row["fault"], row["phase"]) for row in rows}
    with tempfile.TemporaryDirectory() as folder:
        planned = quick_cell(Path(folder))
        for fault in [name for name in FAULTS if not wanted or any(w in name for w in wanted)]:
            for phase in [each for each in PHASES if (fault, each) not in done]:
                place = Path(folder) / f"run_{len(rows)}"
                rows += as_rows([broken(planned, place, fault, phase)])
                out.write_text(json.dumps(rows, indent=1) + "\n")


if __name__ == "__main__":
    walk(Path(sys.argv[1]), sys.argv[2:])
