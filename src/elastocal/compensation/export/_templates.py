"""The templates of the exported C: texts with places between two @."""

from importlib import resources


def template(name: str) -> str:
    """Return the text of a template."""
    return (resources.files(__package__) / "templates" / name).read_text(encoding="utf-8")


def filled(name: str, values: dict[str, str], remembers: bool = False) -> str:
    """Return a template with its places filled.

    Lines that begin with ``@FRICTION@`` are for models that remember friction only, those with
    ``@PLAIN@`` for the others.
    """
    kept, dropped = ("@FRICTION@", "@PLAIN@") if remembers else ("@PLAIN@", "@FRICTION@")
    lines = template(name).splitlines(keepends=True)
    text = "".join(line.removeprefix(kept) for line in lines if not line.startswith(dropped))
    for key, value in values.items():
        text = text.replace(f"@{key}@", value)
    return text
