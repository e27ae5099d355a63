"""The line of a worker to its studio."""

import multiprocessing
import threading

from elastocal.studio import Outbox


def test_a_studio_that_reads_nothing_does_not_hold_the_work_up():
    ours, theirs = multiprocessing.Pipe()
    outbox = Outbox(theirs)

    def work():
        for number in range(2000):
            outbox.tell({"number": number, "text": "x" * 1000})
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
