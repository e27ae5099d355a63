"""Commands of other packages: listed without being imported, made from their settings."""

import dataclasses
import inspect
import typing
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer.core import TyperCommand

from elastocal import plugins
from elastocal.cli import output

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint


def listed_command(name: str, entry: "EntryPoint") -> TyperCommand:
    """Return what help lists of a command; nothing of its package is imported."""
    source = plugins.source_of(entry)
    return TyperCommand(name, help=f"Of {source}.", rich_help_panel="Of other packages")


def loaded_command(name: str, cls: type[TyperCommand]) -> Any:
    """Return a command of another package, its arguments and options made from its settings.

    Raises
    ------
    PluginError
        If it cannot be used.
    """
    found: plugins.Command[Any] = plugins.load("command", name)
    hints = typing.get_type_hints(found.settings, include_extras=True)

    def call(as_json: bool, **values: Any) -> None:
        result = found.run(found.settings(**values))
        if as_json:
            output.print_json(result)
        else:
            output.print_blocks(output.console(), found.show(result))

    parameters = [
        inspect.Parameter(
            each.name,
            inspect.Parameter.KEYWORD_ONLY,
            default=_default(each),
            annotation=_annotation(hints[each.name], each),
        )
        for each in dataclasses.fields(found.settings)
    ]
    as_json = inspect.Parameter(
        "as_json", inspect.Parameter.KEYWORD_ONLY, default=False, annotation=_JSON
    )
    call.__signature__ = inspect.Signature([*parameters, as_json])  # type: ignore[attr-defined]
    call.__annotations__ = {each.name: each.annotation for each in (*parameters, as_json)}
    call.__doc__ = inspect.getdoc(found.settings)
    alone = typer.Typer(add_completion=False)
    alone.command(name, cls=cls)(call)
    return typer.main.get_command(alone)


_JSON = Annotated[bool, typer.Option("--json", help="Print the result as one JSON object.")]


def _default(field: "dataclasses.Field[Any]") -> Any:
    missing = field.default is dataclasses.MISSING
    return inspect.Parameter.empty if missing else field.default


def _annotation(hint: Any, field: "dataclasses.Field[Any]") -> Any:
    kind, *notes = typing.get_args(hint) if typing.get_origin(hint) is Annotated else (hint,)
    help = next((note for note in notes if isinstance(note, str)), None)
    required = field.default is dataclasses.MISSING
    return Annotated[kind, typer.Argument(help=help) if required else typer.Option(help=help)]
