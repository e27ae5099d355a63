"""Where the data beside the repository are, and how to do without."""

from pathlib import Path

import pytest

# Beside the repository; mutation testing runs a copy of the tests one folder farther in.
PLACES = [folder / "shared" for folder in Path(__file__).parents[3:5]]
SHARED = next((place for place in PLACES if (place / "data").is_dir()), PLACES[0])

needs_shared = pytest.mark.skipif(
    not (SHARED / "data").is_dir(), reason=f"needs the data in {SHARED}, which is not there"
)

FANUC = SHARED / "data" / "fanuc_r2000ic"
GOLDEN = SHARED / "data" / "golden_6r"
