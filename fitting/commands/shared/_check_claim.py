"""`rapi fit --check`: a recording compared with what a result claims."""

from pathlib import Path
from typing import Any

from fitting import check_claim, check_scan
from fitting._json import json_text
from fitting._result_files import check_output
from fitting.claim_check._certificate import CERTIFICATE, read_certificate
from fitting.commands.run import DONE, UNTRUSTED
from fitting.diagnosis._data_checks import check_units
from fitting.identification.assessment._claim import Claim
from fitting.report import MODEL, render_claim_check
from rapi_jax import Identified, ModelError
from rapi_jax.io import read_recording, write_atomic

from ._model import load_model
from ._out import console, output_folder, print_json
from ._plugins import Plugins, plugin_effects, plugin_operators
from ._progress import progress
from .files._provenance import provenance


def check_result(
    recording: Path,
    result: Path,
    output: Path | None,
    nan: Any,
    plugin: Plugins,
    json: bool,
    options: dict[str, Any],
) -> int:
    """Hold a recording against a model's claim or the certificate of drives; the exit code."""
    if output is not None:
        check_output(output, "check.json")
    data = read_recording(recording, nan=nan)
    with progress("checking", json):
        found = _hold_against(result, data, plugin)
    about = provenance("rapi fit --check", options, ("recording", "check"))
    content = found.to_dict() | {"result": str(result), "data_sha256": data.sha256()}
    content |= {"provenance": about}
    if output is not None:
        write_atomic(output_folder(output) / "check.json", json_text(content))
    if json:
        print_json(content)
    else:
        out = console(json)
        out.print(render_claim_check(found))
        if output is not None:
            out.print(f"written to {output}: check.json", markup=False)
    return UNTRUSTED if found.held is False else DONE


def _hold_against(result: Path, data: Any, plugin: Plugins) -> Any:
    """The check against `result`: a certificate or a folder with one, or a model."""
    listed = result / CERTIFICATE if result.is_dir() else result
    if listed.name == CERTIFICATE and listed.exists():
        if result.is_dir() and (result / MODEL).exists():
            raise ModelError(
                f"{result} holds a model and a certificate. Name the one to check: {MODEL} or "
                f"{CERTIFICATE} in it."
            )
        drives, claim, about = read_certificate(listed)
        check_units(about, data)
        return check_scan(drives, data, claim=claim, unclaimed=about["unclaimed"])
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
    if about.get("data_sha256") == data.sha256():
        raise ModelError(
            f"{result}: this model was fitted to this very recording, of which its claim says "
            "nothing: it is of runs that the fit has not seen. Record runs like those that were "
            "fitted once more, and give these."
        )
    claim = Claim.from_dict(about["claim"])
    identified = Identified.from_dict(about["identified"])
    return check_claim(ecdl, data, claim=claim, identified=identified)
