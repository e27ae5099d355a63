"""Show the reference of Python plainly.

Types come without what a command line or a validator adds to them: ``Annotated[float,
Field(gt=0.0)]`` is read as ``float``. Examples of a docstring stand in blocks of code, where they
have no section of their own: the signs before them would be those of a quotation.
"""

import re
from typing import Any

import griffe

_EXAMPLE = re.compile(r"^>>> .*?(?=\n\n|\Z)", flags=re.MULTILINE | re.DOTALL)


class Plainly(griffe.Extension):
    """Takes ``Annotated`` from fields, parameters and results, and fences examples."""

    def on_object(self, *, obj: griffe.Object, **_: Any) -> None:
        """Set the examples of a docstring as code."""
        if obj.docstring and "\nExamples\n---" not in obj.docstring.value:
            obj.docstring.value = _EXAMPLE.sub(as_code, obj.docstring.value)

    def on_attribute(self, *, attr: griffe.Attribute, **_: Any) -> None:
        """Show the type of a field, and a type that is named, plainly."""
        attr.annotation, attr.value = plain(attr.annotation), plain(attr.value)

    def on_function(self, *, func: griffe.Function, **_: Any) -> None:
        """Show the types of parameters and of the result plainly."""
        func.returns = plain(func.returns)
        for each in func.parameters:
            each.annotation = plain(each.annotation)


def as_code(example: re.Match[str]) -> str:
    """Return an example as code; behind a section it would be read as part of that."""
    behind = "\n---" in example.string[: example.start()]
    return f"Examples\n--------\n{example[0]}" if behind else f"```pycon\n{example[0]}\n```"


def plain(annotation: Any) -> Any:
    """Return an annotation with the type of each ``Annotated`` in its place."""
    if isinstance(annotation, griffe.ExprSubscript):
        if annotation.canonical_name == "Annotated":
            return plain(annotation.slice.elements[0])
        annotation.slice = plain(annotation.slice)
    elif isinstance(annotation, griffe.ExprTuple):
        annotation.elements = [plain(each) for each in annotation.elements]
    elif isinstance(annotation, griffe.ExprBinOp):
        annotation.left, annotation.right = plain(annotation.left), plain(annotation.right)
    return annotation
