import numpy as np

from elastocal.codec.study import Purpose, Sample


def drawn(sample, purpose=Purpose.TRUTH):
    return sample.generator(purpose).standard_normal(4).tolist()


def test_a_sample_draws_the_same_again():
    assert drawn(Sample(1, 5)) == drawn(Sample(1, 5))


def test_seed_number_and_purpose_each_make_other_draws():
    found = [
        drawn(Sample(seed, number), purpose)
        for seed in (0, 1) for number in (0, 1, 300) for purpose in Purpose
    ]  # fmt: skip
    assert len(np.unique(found, axis=0)) == len(found)
