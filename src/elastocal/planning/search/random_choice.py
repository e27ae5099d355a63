"""Poses drawn at random: what every other technique has to beat."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from elastocal.planning.search.protocol import Candidates, Selection, check_count


@dataclass(frozen=True)
class RandomChoice:
    """Draw without replacement, every candidate as likely as any other."""

    name: ClassVar[str] = "random"
    nested: ClassVar[bool] = True
    """Smaller choices are prefixes of larger ones if the generators are equal."""

    def search(
        self, candidates: Candidates, count: int, rng: np.random.Generator | None = None
    ) -> Selection:
        """Return candidates in the order in which they are drawn; see `SearchTechnique`."""
        check_count(candidates, count)
        rng = np.random.default_rng(0) if rng is None else rng
        return Selection(rng.permutation(len(candidates))[:count], self.name)
