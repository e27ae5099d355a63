"""Show the reference of Python plainly.

Types come without what a command line or a validator adds to them: ``Annotated[float,
Field(gt=0.0)]`` is read as ``float``. Examples of a docstring stand in blocks of code, where they
have no section of their own: the signs before them would be those of a quotation. Tables of a
docstring are lists. A workflow is shown as it is called: with the fields of its settings, which are
then not told again. A result of which a docstring has only the type has no dash behind it.
"""

import inspect
import re
from collections.abc import Iterator, Mapping
from importlib import import_module
from itertools import groupby
from typing import Any

import griffe
from mkdocs.structure.pages import Page

from elastocal import errors

_EXAMPLE = re.compile(r"^>>> .*?(?=\n\n|\Z)", flags=re.MULTILINE | re.DOTALL)
_TABLE = re.compile(r"^(=+) +=+\n(.*?)^=+ +=+$", flags=re.MULTILINE | re.DOTALL)
_PAGE = re.compile(r"\bdocs/((?:[\w-]+/)*)([\w-]+)\.md")
_MODULE = re.compile(r"\b(?:[a-z_]\w*\.)+(?=\w)")
"""What a type or default is read from, before its name."""
_LONGEST, _SHORT = 300, 40
"""Characters of a value beyond which it is not shown, and of one that stands for its name."""
_UNDESCRIBED = re.compile(r"–\s*<div class=\"doc-md-description\">\s*</div>")
_REFUSALS = re.compile(r"<code>(?:\w+Error|, |<[^>]*>)+</code>")
_REFUSAL = re.compile(r"<(a|autoref)\b.*?</\1>|<[^>]*>|(\w+Error)", flags=re.DOTALL)
"""A link, a tag, or the name of a refusal that is no link yet."""


def on_page_content(html: str, page: Page, **_: object) -> str:
    """Return the page with links to refusals, and without the dashes that nothing follows."""
    if page.file.src_uri.startswith("reference/api/"):
        html = _REFUSALS.sub(lambda code: _REFUSAL.sub(linked, code[0]), html)
    return _UNDESCRIBED.sub("", html)


def linked(name: re.Match[str]) -> str:
    """Return a refusal as a link; a name that is none of elastocal's stays, and so does a link."""
    ours = getattr(errors, name[2] or "", None)
    return f'<a href="errors.html#{ours.__module__}.{name[0]}">{name[0]}</a>' if ours else name[0]


class Plainly(griffe.Extension):
    """Takes ``Annotated`` from fields, parameters and results, and fences examples."""

    def on_object(self, *, obj: griffe.Object, **_: Any) -> None:
        """Set the examples of a docstring as code, its tables as lists, and pages as links."""
        if not obj.docstring:
            return
        obj.docstring.value = _PAGE.sub(as_link, _TABLE.sub(as_list, obj.docstring.value))
        if "\nExamples\n---" not in obj.docstring.value:
            obj.docstring.value = _EXAMPLE.sub(as_code, obj.docstring.value)

    def on_class_instance(self, *, cls: griffe.Class, **_: Any) -> None:
        """Show a record as the dataclass that it is, with all its fields."""
        for decorator in cls.decorators:
            call = decorator.value
            if isinstance(call, griffe.ExprCall) and call.canonical_name == "record":
                call.function = griffe.ExprName("dataclass", parent="dataclasses")
                cls.labels.add("dataclass")

    def on_attribute(self, *, attr: griffe.Attribute, **_: Any) -> None:
        """Show the type of a field, and a type that is named, plainly."""
        attr.annotation, attr.value = plain(attr.annotation), plain(attr.value)
        computed = "instance-attribute" in attr.labels and "class-attribute" not in attr.labels
        if computed or len(str(attr.value)) > _LONGEST:
            attr.value = None
        owned = "class-attribute" in attr.labels and attr.docstring is None
        if owned and has_no_signature(attr.parent):
            attr.docstring = griffe.Docstring("", parent=attr)

    def on_function(self, *, func: griffe.Function, **_: Any) -> None:
        """Show the types of parameters and of the result plainly, and a workflow as called."""
        for decorator in func.decorators:
            call = decorator.value
            if isinstance(call, griffe.ExprCall) and call.canonical_name == "workflow":
                show_as_called(func, str(call.arguments[0]))
        func.returns = plain(func.returns)
        for each in func.parameters:
            each.annotation = plain(each.annotation)
            each.default = of_constant(each.default, func.module)
        if func.docstring:
            tell_apart(func)


def of_constant(default: Any, module: griffe.Module) -> Any:
    """Return the value of a private constant that is a default, if it is a short one."""
    known = module.members.get(default.name) if isinstance(default, griffe.ExprName) else None
    is_ours = isinstance(known, griffe.Attribute) and known.name.startswith("_")
    return known.value if is_ours and len(str(known.value)) < _SHORT else default


def tell_apart(func: griffe.Function) -> None:
    """Give each parameter of a group that a docstring tells together its own type and default."""
    own = {each.name: each for each in func.parameters}
    for section in func.docstring.parsed:
        if section.kind is not griffe.DocstringSectionKind.parameters:
            continue
        for each in section.value:
            known = own.get(each.name.lstrip("*"))
            if known is None:
                continue
            others = (other.annotation for other in own.values() if other is not known)
            of_another = any(each.annotation is other for other in others)
            if of_another or is_list_of_types(each.annotation):
                each.annotation = known.annotation
            each.value = None if each.name.startswith("*") else known.default
        section.value = list(together(section.value))


def together(told: list[griffe.DocstringParameter]) -> Iterator[griffe.DocstringParameter]:
    """Yield parameters, those in one that have one description and one default."""
    for (text, _), each in groupby(told, key=lambda one: (one.description, str(one.value))):
        group = list(each)
        if len(group) == 1 or not text:
            yield from group
            continue
        types = [str(one.annotation) for one in group]
        yield griffe.DocstringParameter(
            ", ".join(one.name for one in group),
            annotation=group[0].annotation if len({*types}) == 1 else ", ".join(types),
            description=text,
            value=group[0].value,
        )


def is_list_of_types(annotation: Any) -> bool:
    """Return whether an annotation is "A, B", the types of two parameters; a shape is none."""
    return isinstance(annotation, griffe.ExprTuple) and "shape" not in str(annotation)


def has_no_signature(owner: griffe.Object) -> bool:
    """Return whether a class shows its members one by one alone, so that none may be left out."""
    return owner.is_class and not any(
        each.callable_path.endswith("dataclass") for each in owner.decorators
    )


def show_as_called(func: griffe.Function, settings: str) -> None:
    """Give a workflow the parameters and the docstring that Python shows of it."""
    called = getattr(import_module(func.module.canonical_path), func.name)
    func.docstring.value = called.__doc__
    members = func.module.members[settings].members
    fields = {name: each for name, each in members.items() if isinstance(each, griffe.Attribute)}
    signature = inspect.signature(called).parameters.values()
    func.parameters = griffe.Parameters(*(parameter(each, fields) for each in signature))
    for each in fields.values():
        each.docstring = None
        if isinstance(each.value, griffe.ExprName):  # a constant
            each.value = func.parameters[each.name].default
    for section in func.docstring.parsed:
        if section.kind is griffe.DocstringSectionKind.parameters:
            for each in section.value:
                each.annotation = choices(each.annotation)


def parameter(each: inspect.Parameter, fields: Mapping[str, griffe.Attribute]) -> griffe.Parameter:
    """Return a parameter of a signature, its type as the settings write it."""
    field = fields.get(each.name)
    return griffe.Parameter(
        each.name,
        annotation=_MODULE.sub("", inspect.formatannotation(each.annotation))
        if field is None
        else field.annotation,
        kind=griffe.ParameterKind(each.kind.description),
        default=None if each.default is each.empty else shown(each.default),
    )


def shown(default: object) -> str:
    """Return a default as one would write it."""
    name = getattr(default, "__name__", repr(default))
    if name == "<lambda>":
        return "..."
    return f"{type(default).__name__}()" if name.startswith("<") else name


def choices(annotation: Any) -> Any:
    """Return the values that a docstring allows in braces, which are read as a tuple of types."""
    if isinstance(annotation, griffe.ExprTuple):
        return "{" + ", ".join(f"'{each}'" for each in annotation.elements) + "}"
    return annotation


def as_list(table: re.Match[str]) -> str:
    """Return the rows of a table of two columns as items of a list."""
    width, items = len(table[1]), []
    for line in table[2].splitlines():
        name, text = line[:width].strip(), line[width:].strip()
        if name:
            items.append(f"- {name}: {text}")
        else:
            items[-1] += f" {text}"
    return "\n".join(["", *items])


def as_link(page: re.Match[str]) -> str:
    """Return the link to a page of the documentation, from a page of the reference."""
    folder, name = page[1], page[2]
    number = name.partition("-")[0]
    text = f"decision {int(number)}" if number.isdecimal() else name.replace("-", " ")
    return f"[{text}](../../{folder}{name}.md)"


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
