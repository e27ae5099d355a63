"""Read parts one by one, noting what was used and what could not be."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

from elastocal.codec import ARRAYS, VERDICTS
from elastocal.compensation.process import DEVIATIONS, TABLE
from elastocal.errors import ElastocalError
from elastocal.report.document.content import hash_of
from elastocal.report.document.parts import Absence, UsedFile
from elastocal.report.document.places import Places

Part = TypeVar("Part")


@dataclass
class Search:
    """What has been found so far; grows while the parts are read."""

    places: Places
    files: list[UsedFile] = field(default_factory=list)
    absent: list[Absence] = field(default_factory=list)

    def read(self, name: str, path: Path, read: Callable[[], Part], named: bool) -> Part | None:
        """Return a part, or None and a note of why there is none."""
        try:
            part = read()
        except ElastocalError as error:
            if named:
                raise
            self.absent.append(Absence(name, self._said(error), damaged=True))
            return None
        self.use(path)
        return part

    def find(
        self, name: str, given: Path | None, default: str, read: Callable[[Path], Part], hint: str
    ) -> Part | None:
        """Return a part that may be named or lie under a default name."""
        path = given or self.places.default(default)
        if path is None:
            self.absent.append(Absence(name, f"there is no {default}; {hint}"))
            return None
        return self.read(name, path, lambda: read(path), named=given is not None)

    def use(self, path: Path) -> None:
        """Note the hash of a file, or of every file in a folder that belongs to a part."""
        for file in sorted(_files_of(path)):
            shown = self.places.shown(file)
            if shown not in {each.name for each in self.files}:
                self.files.append(UsedFile(shown, *hash_of(file)))

    def _said(self, error: ElastocalError) -> str:
        """Return a reason without the folder that the run happens to lie in."""
        text = " ".join(str(error).split())
        for root in self.places.roots:
            for form in {str(root), str(root.resolve())} - {"."}:
                text = text.replace(f"{form}/", "")
        return text


def _files_of(path: Path) -> list[Path]:
    """Return a file, or the files of a folder that a report reads; pictures are none of them."""
    if path.is_file():
        return [path]
    read = (ARRAYS, VERDICTS, TABLE, DEVIATIONS)
    return [path / name for name in read if (path / name).is_file()]
