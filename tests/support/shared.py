"""Where the data beside the repository are, and how to do without."""

from pathlib import Path

import pytest

SHARED = Path(__file__).parents[3] / "shared"

needs_shared = pytest.mark.skipif(
    not (SHARED / "data").is_dir(), reason=f"needs the data in {SHARED}, which is not there"
)

FANUC = SHARED / "data" / "fanuc_r2000ic"
GOLDEN = SHARED / "data" / "golden_6r"
