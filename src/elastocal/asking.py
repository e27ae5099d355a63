"""Questions to a person, one after another: what is refused is asked again, and `BACK` undoes.

Whoever has the terminal, or a test, gives the function that puts a question.
"""

from collections.abc import Callable, Sequence
from typing import TypeVar

from elastocal.errors import ElastocalError

BACK, SKIP = "back", "skip"
"""Answers that ask the question before again, and leave out all that follow."""
HELP = f"Enter leaves one out; {BACK} returns to the one before; {SKIP}, or Ctrl-D, leaves the rest"

Question = TypeVar("Question")


def ask_in_turn(
    questions: Sequence[Question],
    put: Callable[[Question], str | None],
    take: Callable[[Question, str], None],
    refuse: Callable[[ElastocalError], None],
) -> None:
    """Put questions in their order until all are answered, or the rest is skipped.

    Parameters
    ----------
    questions : sequence
        The questions, of any type.
    put : callable
        Puts a question and returns the answer; None where earlier answers made it needless.
    take : callable
        Takes a question and its answer without spaces at the ends, which may be empty; an answer
        may be taken again, after `BACK`.
    refuse : callable
        Says why `take` refused an answer.
    """
    at, asked = 0, list[int]()
    while at < len(questions):
        text = put(questions[at])
        if text is None:
            at += 1
            continue
        answer = text.strip()
        if answer.lower() == SKIP:
            return
        if answer.lower() == BACK:
            at = asked.pop() if asked else at
            continue
        try:
            take(questions[at], answer)
        except ElastocalError as error:
            refuse(error)
        else:
            asked.append(at)
            at += 1
