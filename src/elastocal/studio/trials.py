"""Trials before a plan: where the robot can press, and the choice of each search."""

import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from elastocal.cell import Cell, load_cell
from elastocal.errors import ElastocalError
from elastocal.parallel import one_blas_thread
from elastocal.planning import SearchPool, cell_surface, sample_pool
from elastocal.planning.search import technique
from elastocal.studio.worker import Data, Outbox
from elastocal.wording import in_words, readable

_SURVEYED = 300
"""Candidates of a survey: enough to see where they end."""
_COMPARED = 1000
"""Candidates that the searches are compared on, at most."""
_TECHNIQUES = ("cover", "i_optimal", "ioops", "exchange-a", "exchange-e", "random")


def survey_reach(path: Path, outbox: Outbox) -> Data:
    """Return points on the tooling, each with the check that refuses it, or empty."""
    cell = _with_pool(load_cell(path), _SURVEYED)
    surface = cell_surface(cell)
    sampled = sample_pool(cell, surface, np.random.default_rng(0), 1, outbox.progress)
    pool = sampled.pool
    names = [
        in_words(pool.refusals[number]) if number >= 0 else ""
        for number in pool.refused_by.tolist()
    ]
    share = f"{len(pool.postures)} of {pool.sampled} points can be pressed on"
    return {
        "points": sampled.points.position.tolist(),
        "refused": names,
        "summary": f"{share}; {pool.advice}" if pool.bottleneck else share,
    }


@one_blas_thread()
def compare_techniques(path: Path, outbox: Outbox) -> Data:
    """Return the choice of each search technique from one pool, a row a technique."""
    cell = load_cell(path)
    cell = _with_pool(cell, min(_COMPARED, cell.file.search.pool))
    surface = cell_surface(cell)
    seed = cell.file.search.seed
    sampled = sample_pool(cell, surface, np.random.default_rng(seed), 1, outbox.progress)
    pool = SearchPool.of(cell, surface, sampled)
    everyone = pool.preferred(cell, np.arange(len(pool.candidates)))
    outbox.progress("search", 0, len(_TECHNIQUES))
    count = len(pool.choose(cell, everyone, np.random.default_rng(seed)))
    rows: list[dict[str, str]] = []
    for done, name in enumerate(_TECHNIQUES, start=1):
        start = time.perf_counter()
        try:
            found = pool.take(technique(name), everyone, count, np.random.default_rng(seed))
        except ElastocalError as error:
            rows.append({"technique": name, "refusal": str(error)})
            continue
        seconds = time.perf_counter() - start
        spread = pool.spread(found.order)
        rows.append(
            {
                "technique": name,
                "poses": str(len(found)),
                "covering_radius": readable(spread.covering_radius, "m"),
                "o1": f"{spread.o1:.3g}",
                "seconds": f"{seconds:.2f} s",
            }
        )
        outbox.progress("search", done, len(_TECHNIQUES))
    return {"rows": rows, "candidates": len(everyone), "own": cell.technique}


def _with_pool(cell: Cell, candidates: int) -> Cell:
    search = cell.file.search
    wanted = min(candidates, search.pool)
    # No more poses than candidates, whatever the file asks for.
    poses = search.poses if search.poses is None else min(search.poses, wanted)
    search = search.model_copy(update={"pool": wanted, "poses": poses})
    return replace(cell, file=cell.file.model_copy(update={"search": search}))
