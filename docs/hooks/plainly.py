"""Show plain types in the API pages: without what a command line or a validator adds to them.

``Annotated[float, Field(gt=0.0)]`` is read as ``float``.
"""

from typing import Any

import griffe


class PlainTypes(griffe.Extension):
    """Takes ``Annotated`` from fields, parameters and results."""

    def on_attribute(self, *, attr: griffe.Attribute, **_: Any) -> None:
        """Show the type of a field, and a type that is named, plainly."""
        attr.annotation, attr.value = plain(attr.annotation), plain(attr.value)

    def on_function(self, *, func: griffe.Function, **_: Any) -> None:
        """Show the types of parameters and of the result plainly."""
        func.returns = plain(func.returns)
        for each in func.parameters:
            each.annotation = plain(each.annotation)


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
