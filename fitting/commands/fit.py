"""`rapi fit`: identify a model from a recording, or check the claim of one."""

import inspect
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import CycloptsError, Parameter, validators

from ._plugins import Plugins

Each = Literal["auto", "none", "lam", "lam,eta", "lam,eta,alpha"]


def fit(
    recording: Path,
    *,
    output: Annotated[Path | None, Parameter(name=["--output", "-o"])] = None,
    check: Path | None = None,
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

    With `--check` nothing is fitted: RECORDING is a new measurement, of runs like those that were
    fitted or of scans made with certified drives, and is held against what was claimed. Exit code
    0: the claim held; 4: it did not; 3: bad data, or no run that the claim is of.

    Parameters
    ----------
    recording
        A folder with a `manifest.toml`, or a netCDF-4 file.
    output
        Folder for the results; made if missing. Needed but with `--check`, where it is for
        `check.json`.
    check
        The result to hold RECORDING against: a folder that `rapi fit` wrote (the error of its model
        in each run, against its claim) or `rapi compensate` (how straight each scan is, against its
        certificate). Of the other options only `--output`, `--nan`, `--plugin` and `--json` go with
        it.
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
        Print `model.json` (`check.json` with `--check`) on standard output, and messages on
        standard error.
    """
    if check is not None:
        _refuse_unused(locals())
        return _check_claim(recording, check, output, nan, plugin, json)
    if output is None:
        raise CycloptsError(msg="--output is missing.", command_chain=("fit",))
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


_CHECKING = {"recording", "output", "check", "nan", "plugin", "json"}


def _refuse_unused(values: dict[str, Any]) -> None:
    """Refuse options of a fit where nothing is fitted."""
    defaults = inspect.signature(fit).parameters
    for name in values.keys() & defaults.keys() - _CHECKING:
        if values[name] != defaults[name].default:
            raise CycloptsError(
                msg=f"--{name} is for a fit, and with --check nothing is fitted.",
                command_chain=("fit",),
            )


def _check_claim(
    recording: Path, result: Path, output: Path | None, nan: Any, plugin: Plugins, json: bool
) -> int:
    """Hold a recording against the claim of a model, or the certificate of drives."""
    from fitting._json import json_text
    from fitting.report import render_claim_check
    from rapi_jax.io import read_recording, write_atomic

    from ._out import console, output_folder, print_json, progress
    from .run import DONE, UNTRUSTED

    data = read_recording(recording, nan=nan)
    with progress("checking", json):
        found = _hold_against(result, data, plugin)
    content = found.to_dict() | {"result": str(result), "data_sha256": data.sha256()}
    if output is not None:
        write_atomic(output_folder(output) / "check.json", json_text(content))
    if json:
        print_json(content)
    else:
        out = console(json)
        out.print(render_claim_check(found))
        if output is not None:
            out.print(f"written to {output}: check.json", markup=False)
    return DONE if found.held else UNTRUSTED


def _hold_against(result: Path, data: Any, plugin: Plugins) -> Any:
    """The check against `result`: a certificate or a folder with one, or a model."""
    from fitting import check_claim, check_scan
    from fitting.claim_check._certificate import CERTIFICATE, read_certificate
    from fitting.diagnosis._data_checks import check_units
    from fitting.identification.assessment._claim import Claim
    from fitting.report import MODEL
    from rapi_jax import Identified, ModelError

    from ._model import load_model
    from ._plugins import plugin_effects, plugin_operators

    listed = result / CERTIFICATE if result.is_dir() else result
    if listed.name == CERTIFICATE and listed.exists():
        if result.is_dir() and (result / MODEL).exists():
            raise ModelError(
                f"{result} holds a model and a certificate. Name the one to check: {MODEL} or "
                f"{CERTIFICATE} in it."
            )
        drives, claim, about = read_certificate(listed)
        check_units(about, data)
        return check_scan(drives, data, claim=claim)
    ecdl, about = load_model(result, plugin_effects(plugin), plugin_operators(plugin))
    check_units(about, data)
    if not about.get("trusted", False):
        raise ModelError(
            f"{result}: this model is not to be trusted, so it claims nothing. Mend the recording "
            "and fit again."
        )
    if about.get("claim") is None:
        raise ModelError(
            f"{result}: this model has no claim, so there is nothing to check. `rapi fit` makes "
            "one from two runs or more; a diagnosis makes none."
        )
    claim = Claim.from_dict(about["claim"])
    identified = Identified.from_dict(about["identified"])
    return check_claim(ecdl, data, claim=claim, identified=identified)
