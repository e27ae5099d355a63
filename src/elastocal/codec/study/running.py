"""Simulate the samples that are missing, in batches that may be done anywhere."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial

from elastocal.codec.study.samples import Sample, SampleResult, Simulate
from elastocal.codec.study.settings import StudySettings
from elastocal.codec.study.store import StudyStore
from elastocal.errors import CodecError

Report = Callable[[str, int, int], None]
"""Told a stage, how much of it is done and how much there is."""
STAGE = "samples"
BATCH = 2
"""Samples that are done and kept together: some seconds of work are lost when a study is killed."""

Work = Callable[[], list[SampleResult]]
"""One batch."""
Spread = Callable[[Iterable[Work]], Iterator[list[SampleResult]]]
"""Has the batches done, somewhere and in any order, and yields each result when it is there."""


def run_study(
    store: StudyStore,
    settings: StudySettings,
    samples: int,
    simulate: Simulate,
    spread: Spread,
    report: Report = lambda *_: None,
) -> tuple[SampleResult, ...]:
    """Return the results of samples 0 to ``samples - 1``; those in the folder are not done again.

    Parameters
    ----------
    store : StudyStore
        Folder of the study.
    settings : StudySettings
        What it is a study of.
    samples : int
        Number of samples; a finished study goes on with a larger one.
    simulate : callable
        See `Simulate`.
    spread : callable
        Has batches done: see `one_after_the_other`.
    report : callable
        Told of finished samples.

    Raises
    ------
    CodecError
        If less than one sample is wanted, or the folder holds another study.
    ElastocalError
        If a sample cannot be simulated, or a file not be written.
    """
    check_samples(samples)
    store.open(settings)
    found = store.finished(settings)
    missing = [number for number in range(samples) if number not in found]
    report(STAGE, samples - len(missing), samples)
    if missing:
        parts = [missing[start : start + BATCH] for start in range(0, len(missing), BATCH)]
        work = [partial(_simulated, simulate, settings.seed, part) for part in parts]
        done = samples - len(missing)
        for results in spread(work):
            store.keep(settings, results)
            done += len(results)
            report(STAGE, done, samples)
            found |= {result.number: result for result in results}
    return tuple(found[number] for number in range(samples))


def check_samples(samples: int) -> None:
    """Refuse less than one sample.

    Raises
    ------
    CodecError
        If there is less than one.
    """
    if not samples >= 1:
        raise CodecError(f"{samples} samples: must be at least 1")


def one_after_the_other(batches: Iterable[Work]) -> Iterator[list[SampleResult]]:
    """Do the batches here and now."""
    return (work() for work in batches)


def _simulated(simulate: Simulate, seed: int, numbers: Sequence[int]) -> list[SampleResult]:
    return [simulate(Sample(seed, number)) for number in numbers]
