"""Make one part of the figures: ``python -m gallery PART FOLDER``."""

import importlib
import json
import sys
from pathlib import Path

part, folder = sys.argv[1], Path(sys.argv[2])
folder.mkdir(parents=True)
told = importlib.import_module(f"gallery.{part}").make(folder)
(folder / "told.json").write_text(json.dumps(told), encoding="utf-8")
