"""What a codec says in words, on planted errors."""

import numpy as np

from elastocal.codec import CodecData, CodecOptions, Variant, judge
from elastocal.codec.data import SpringLabels

SETS, POSES = 8, 8
VERIFICATION = np.array([[n, (n + 1) % POSES] for n in range(SETS)])


def codec(*curves):
    """Return a codec whose mean errors are curves in um, nearly the same in every set."""
    sizes = len(curves[0])
    factor = 1.0 + 1e-3 * np.linspace(-1.0, 1.0, SETS)[:, None]
    mean = np.array([1e-6 * np.array(curve) * factor for curve in curves])
    largest = 2.0 * mean
    largest[:, 0] *= 5.0
    chosen = np.full((len(curves), SETS, sizes, sizes), -1)
    return CodecData(
        variants=tuple(Variant(f"v{k}") for k in range(len(curves))),
        springs=(SpringLabels(("s",), ("rad/(N*m)",)),) * len(curves),
        pose_labels=tuple((n,) for n in range(POSES)),
        contact=np.zeros((POSES, 3)),
        seed_pose=np.arange(SETS),
        verification=VERIFICATION,
        chosen=chosen,
        compliance=(np.ones((SETS, sizes, 1)),) * len(curves),
        error_mean=np.repeat(mean[..., None], 4, axis=-1),
        error_max=np.repeat(largest[..., None], 4, axis=-1),
        load_cases=("normal",),
        options=CodecOptions(),
    )


def sentence(*curves, number=0):
    return judge(codec(*curves)).sentences[number]


def test_saturation_is_told_with_the_largest_error_of_the_median_and_of_the_worst_set():
    said = sentence([900, 300, 102, 100, 100])
    assert "saturated from 3 training poses on (95 % interval 3 to 3)" in said
    assert "largest error with 3: 204.1 µm, 1019.0" in said
    assert "µm in the worst set; medians over 8 verification sets of 2 poses" in said


def test_an_error_that_leaves_its_tolerance_again_is_not_called_saturated_before():
    said = sentence([900, 102, 150, 101, 100, 100])
    assert "saturated" not in said
    assert "as good as the last from 2 training poses" in said
    assert "steadily only from 4 on" in said


def test_an_error_that_rises_again_is_told():
    assert "the error rises again: 50.0 µm with 3" in sentence([900, 200, 50, 90, 100, 100])


def test_an_error_that_falls_to_the_end_promises_nothing():
    said = sentence([900, 700, 500, 300])
    assert "still falls at 4 training poses: mean 300.0 µm; more poses may help" in said


def test_one_training_pose_says_nothing_of_saturation():
    assert "nothing can be said of saturation" in sentence([900])


def test_a_pair_is_called_saturated_only_where_it_is():
    assert "where both have saturated, with 3" in sentence(
        [900, 300, 102, 100, 100], [800, 90, 81, 80, 80], number=2
    )
    assert "saturated" not in sentence([900, 700, 500, 300], [900, 600, 400, 200], number=2)


def test_a_difference_that_cannot_be_told_says_which_is_taken_from_which():
    said = sentence([900, 100, 100], [900, 100, 100], number=2)
    assert "v0 against v1: no difference can be told" in said
    assert "first minus second, mean over the sets: 0.0 µm" in said
