"""What a reader of the verdict has to know."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Finding:
    """Something that a reader of the verdict has to know."""

    text: str
    holds_back: bool = True
    """Whether it keeps the light from being green."""
    advice: str = ""
    """Advice that follows; empty where the text says it."""
    breaks_trust: bool = False
    """Whether files were changed or contradict one another; such findings are told first."""
