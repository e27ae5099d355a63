"""The line of a worker to its studio."""

import multiprocessing
import threading

from elastocal.studio import Outbox


def test_a_studio_that_reads_nothing_does_not_hold_the_work_up():
    ours, theirs = multiprocessing.Pipe()
    outbox = Outbox(theirs)

    def work():
        for number in range(2000):
            outbox.sample({"number": number, "text": "x" * 1000})
            outbox.progress("poses measured", number, 2000)

    worker = threading.Thread(target=work, daemon=True)
    worker.start()
    worker.join(20.0)
    assert not worker.is_alive()
    assert not outbox.stopped()
    # Who reads again hears the end of it, in order.
    told = []

    def read():
        while True:
            told.append(ours.recv())
            if told[-1][0] == "done":
                return

    reader = threading.Thread(target=read, daemon=True)
    reader.start()
    outbox.close(("done", {}))
    reader.join(20.0)
    numbers = [each[1]["number"] for each in told if each[0] == "live"]
    assert numbers == sorted(numbers)
    assert numbers[-1] == 1999
    assert told[-1] == ("done", {})
    ours.close()
    assert outbox.stopped()


def test_a_question_and_a_warning_wait_for_a_studio_that_hangs():
    """Samples of a run take each other's place meanwhile; what must be known does not."""
    ours, theirs = multiprocessing.Pipe()
    outbox = Outbox(theirs)
    wanted = [{"warnings": ["a fault"]}, {"asked": "put it on", "question": 1}]
    for must_be_known in wanted:
        for number in range(1000):
            outbox.sample({"number": number, "text": "x" * 1000})
            outbox.progress("poses measured", number, 1000)
        outbox.tell(must_be_known)
    told = []

    def read():
        while not told or told[-1][0] != "done":
            told.append(ours.recv())

    reader = threading.Thread(target=read, daemon=True)
    reader.start()
    outbox.close(("done", {}))
    reader.join(20.0)
    lives = [live for kind, *(live, *_) in told[:-1] if kind == "live"]
    assert [live for live in lives if "number" not in live] == wanted
    assert [live["number"] for live in lives if "number" in live][-1] == 999


def test_progress_that_is_none_is_not_told_again():
    ours, theirs = multiprocessing.Pipe()
    outbox = Outbox(theirs)
    outbox.progress("poses measured", 1, 3)
    assert ours.recv() == ("progress", "poses measured", 1, 3)
    outbox.progress("poses measured", 1, 3)
    outbox.close(("done", {}))
    assert ours.recv() == ("done", {})
