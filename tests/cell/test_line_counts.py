"""What was counted on a line, in words and over several sessions."""

from elastocal.cell import LineCounts


def test_what_did_not_happen_is_left_out():
    counts = LineCounts(device="box", received=10, lost=2, breaks=1, status=("saturated",))
    assert counts.sentence() == "box: 10 received, 2 lost, 1 broken off, saturated"
    assert LineCounts(device="box", received=10).sentence() == "box: 10 received, none lost"


def test_times_of_answers_are_in_ms():
    counts = LineCounts(device="arm", received=1, answer=(2e-4, 1e-3, 0.012))
    assert counts.sentence().endswith("answered in 0.20 / 1.00 / 12.00 ms (median, 99 %, longest)")


def test_sessions_add_up_and_the_longer_answer_counts():
    first = LineCounts(device="a", received=3, late=1, status=("x",), answer=(1e-3, 2e-3, 3e-3))
    other = LineCounts(device="a", received=4, late=2, status=("x", "y"), answer=(2e-3, 1e-3, 9e-3))
    both = first.plus(other)
    assert (both.received, both.late, both.status) == (7, 3, ("x", "y"))
    assert both.answer == (2e-3, 2e-3, 9e-3)
    assert first.plus(LineCounts(device="a", received=1)).answer == first.answer
