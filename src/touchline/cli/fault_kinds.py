"""The kinds of faults that are registered, as `touchline fault --list` prints them."""

from rich import box
from rich.table import Column, Table

from touchline.cli.display import print_json, print_table
from touchline.schemas.faults import Fault, fault_models
from touchline.schemas.plugins import FAULTS

_OF_EVERY_KIND = ("kind", *Fault.model_fields)


def print_fault_kinds(*, as_json: bool) -> None:
    """Print every kind with what it is and its parameters; as JSON, with its JSON schema."""
    models = fault_models()
    if as_json:
        print_json(
            [
                {"kind": kind, "summary": FAULTS.summary(kind), "schema": model.model_json_schema()}
                for kind, model in models.items()
            ]
        )
        return
    columns = (Column("kind", no_wrap=True), "parameters (defaults)", "what happens")
    table = Table(*columns, box=box.SIMPLE, pad_edge=False)
    for kind, model in models.items():
        table.add_row(kind, _parameters(model), FAULTS.summary(kind))
    print_table(table)


def _parameters(model: type[Fault]) -> str:
    """Parameters of a kind: ``sensor, share (1.0)``."""
    fields = {name: field for name, field in model.model_fields.items() if name not in _OF_EVERY_KIND}
    return ", ".join(
        name if field.is_required() or field.default is None else f"{name} ({field.default})"
        for name, field in fields.items()
    )
