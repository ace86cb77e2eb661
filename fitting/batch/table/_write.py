"""The files of a batch's results: table and page."""

import hashlib
from collections.abc import Sequence
from pathlib import Path

from fitting.batch._record import JobRecord
from rapi_jax.io import write_atomic

from ._columns import tabulate
from ._csv import table_csv
from ._netcdf import write_netcdf
from ._parquet import write_parquet
from ._read import read_result

CSV, NETCDF, PARQUET, PAGE = "results.csv", "results.nc", "results.parquet", "report.html"


def write_table(records: Sequence[JobRecord], folder: Path, *, parquet: bool = False) -> list[Path]:
    """Write `results.csv` and `results.nc` of a batch into `folder`; return their paths.

    **Arguments:**

    - `records`: in the order of the rows; their files lie in `folder/<name>/`.
    - `parquet`: write `results.parquet` as well, which needs the extra `parquet`.

    A row whose files are missing, damaged or of another job has no figures, and says so in its
    `message`. Each file is written whole or not at all. Raises `OutputError` where one cannot be
    written, `DataError` where Parquet is asked for without pyarrow.
    """
    columns, parameters = tabulate([read_result(record, folder) for record in records])
    text = table_csv(columns).encode()
    write_atomic(folder / CSV, text)
    digest = hashlib.sha256(text).hexdigest()
    write_netcdf(columns, parameters, folder / NETCDF, csv_sha256=digest)
    written = [folder / CSV, folder / NETCDF]
    if parquet:
        write_parquet(columns, folder / PARQUET)
        written.append(folder / PARQUET)
    return written


def write_page(records: Sequence[JobRecord], folder: Path) -> Path:
    """Write `report.html` of a batch into `folder`; return its path.

    Raises `OutputError` where it cannot be written.
    """
    from fitting.report.batch._page import render_page

    from ._summary import summarise

    content = summarise([read_result(record, folder) for record in records])
    write_atomic(folder / PAGE, render_page(content))
    return folder / PAGE
