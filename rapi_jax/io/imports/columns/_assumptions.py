"""What is assumed of a response's unit and of the times where a file leaves them open."""

from rapi_jax.io._safe import printable
from rapi_jax.io.imports._options import ImportOptions
from rapi_jax.io.tables._table import Table
from rapi_jax.io.tables._units import VOLTS, known_unit


def describe_assumptions(table: Table, place: int, options: ImportOptions) -> list[str]:
    """Sentences on the response in column `place` of a table; none where nothing is assumed."""
    found = []
    column = table.columns[place]
    unit = known_unit(column.unit or "")
    if options.measured == "response" and options.response_unit is None and unit in VOLTS:
        name = printable(column.name, 40)
        found.append(
            f"assumed: the response is a voltage in {unit}, the unit of its column '{name}', as no "
            "--response-unit is given. If it is that of a detector or sensor, say what a volt "
            "stands for, such as --response-scale 4.5 --response-unit GHz"
        )
    if options.sample_rate is not None:
        at = table.find_time()
        unused = None if at is None else printable(table.columns[at].name, 40)
        more = "" if unused is None else f"; the times in column '{unused}' are not used"
        found.append(
            f"assumed: samples are evenly spaced, {options.sample_rate:g} Hz as --sample-rate "
            f"says; all times are made from it, none is read{more}"
        )
    return found
