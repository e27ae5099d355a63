"""Make parts of the figures: ``python -m gallery FOLDER PART …``."""

import importlib
import json
import sys
from pathlib import Path

folder, *parts = sys.argv[1:]
for part in parts:
    own = Path(folder) / part
    own.mkdir(parents=True)
    told = importlib.import_module(f"gallery.{part}").make(own)
    (own / "told.json").write_text(json.dumps(told), encoding="utf-8")
