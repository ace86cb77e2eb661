"""`rapi fit`: identify a model from a recording."""

from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter, validators

from ._plugins import Plugins

Each = Literal["auto", "none", "lam", "lam,eta", "lam,eta,alpha"]


def fit(
    recording: Path,
    *,
    output: Annotated[Path, Parameter(name=["--output", "-o"])],
    plays: Annotated[int, Parameter(validator=validators.Number(gte=1, lte=200))] = 10,
    order: Annotated[int, Parameter(validator=validators.Number(gte=1, lte=9))] = 3,
    each: Each = "auto",
    operator: str = "RAPI",
    plugin: Plugins = (),
    choose: Annotated[bool, Parameter(negative="")] = False,
    weights: Literal["hysteresis", "uniform"] = "hysteresis",
    loss: Literal["squares", "huber", "student"] = "squares",
    starts: Annotated[int, Parameter(validator=validators.Number(gte=1, lte=100))] = 6,
    history: bool = True,
    drift: Annotated[bool | None, Parameter(negative="--no-drift")] = None,
    nan: Literal["raise", "mask"] = "raise",
    plots: bool = True,
    json: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Identify an RA-PI model from RECORDING, and say whether to trust it.

    Writes `model.json` (readable), `model.rapi` (loadable) and pictures to the output folder. Exit
    code 0: trusted; 4: not to be trusted (everything is written all the same); 3: bad data.

    Parameters
    ----------
    recording
        A folder with a `manifest.toml`, or a netCDF-4 file.
    output
        Folder for the results; made if missing.
    plays
        Number of play operators, N1.
    order
        Order of the memoryless polynomial, N2.
    each
        What has a value for each play instead of a shared one; `auto` tries `none` and `lam`, and
        keeps what predicts held-out data better.
    operator
        Class of the hysteresis operator: of this package, or of a `--plugin` file.
    plugin
        Python file with an operator of your own; the code in it runs. May be repeated.
    choose
        Also choose the number of plays and the order on held-out data (slower).
    weights
        Weights of the runs: by hysteresis percentage (Eq. 26), or equal.
    loss
        Of residuals: squares, with outliers left out and listed; or, for data that cannot be
        cleaned, huber or student (heavier tails), which leave nothing out.
    starts
        At most so many starts; two that agree on the best end are enough.
    history
        Free the plays' initial values in runs that do not repeat.
    drift
        Let the origin creep with the logarithm of session time; by default with six periods or
        more.
    nan
        What to do with readings that are not finite: refuse, or leave those samples out.
    plots
        Write pictures.
    json
        Print `model.json` on standard output, and messages on standard error.
    """
    from fitting.identification._identify import identify
    from fitting.report import write_fit
    from rapi_jax.io import read_recording

    from ._out import console, output_folder, print_json, progress, read_json
    from ._plugins import find_operator
    from .run import DONE, UNTRUSTED

    kind = find_operator(operator, plugin)
    data = read_recording(recording, nan=nan)
    folder = output_folder(output)
    structures = {"auto": None, "none": ()}.get(each, tuple(each.split(",")))
    with progress("fitting", json) as report_step:
        result = identify(
            data,
            plays=plays,
            order=order,
            each=structures,
            choose=choose,
            operator=kind,
            weights=weights,
            loss=loss,
            starts=starts,
            history=history,
            drift=drift,
            throw=False,
            progress=report_step,
        )
    written = write_fit(result, folder, plots=plots)
    if json:
        print_json(read_json(written[0]))
    else:
        from fitting.report import render_tables

        out = console(json)
        out.print(render_tables(result))
        out.print(f"written to {folder}: {', '.join(path.name for path in written)}", markup=False)
    return DONE if result.verdict.trusted else UNTRUSTED
