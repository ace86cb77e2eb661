"""Drives of `rapi compensate`, made and written; imported late, as it imports all they need."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from fitting import fit
from fitting._result_files import check_output
from fitting.commands.shared._limits import check_limits_unit
from fitting.commands.shared._model import check_trusted, is_diagnosis, load_model
from fitting.commands.shared._nonlinearity_band import scan_bands
from fitting.commands.shared._out import output_kept_if_written
from fitting.commands.shared._plugins import Plugins, plugin_effects, plugin_operators
from fitting.commands.shared.files._certificate_report import certificate_report
from fitting.commands.shared.files._drive_files import (
    CERTIFICATE,
    check_no_other_drives,
    check_rates,
    drive_files,
    earlier_files,
    generator_waveforms,
    write_drives,
)
from fitting.diagnosis._data_checks import check_units
from fitting.identification.inverse._identify_inverse import (
    fit_inverse,
    identify_inverse,
    swapped_model,
)
from rapi_jax import Compensation, Identified, LimitError, ModelError, Target, linear_scan
from rapi_jax import compensate as compensated
from rapi_jax.internal import join_refusals, refuse_beyond
from rapi_jax.io import read_limits, read_recording

_CORNERS = (0.03, 0.05, 0.1, 0.2)  # of a period: what is tried where corners are too sharp


def compensate_into(
    model: Path,
    output: Path,
    *,
    span: float,
    frequency: list[float],
    bias: float | None,
    limits: Path | None,
    inverse: str,
    extrapolate: bool,
    untrusted: bool,
    without: Sequence[str] = (),
    rise: float,
    corner: float,
    samples: int,
    recording: Path | None,
    plugin: Plugins,
    plots: bool,
    report_step: Callable[[str], None] = lambda line: None,
    more: Mapping[str, Any] | None = None,
) -> tuple[list[Any], dict[str, Any], str, list[str], list[Path]]:
    """Drives by the options of the command: each, the certificate, their unit, and the files.

    These are the names of what was removed of earlier drives in `output`, and what was written.
    `without`: names of effects that are not inverted. `more`: further keys of `certificate.json`.
    Raises `UntrustedModel` where the model makes no drive, `ModelError` where it has no such
    effect.
    """
    whole, about = load_model(model, plugin_effects(plugin), plugin_operators(plugin))
    check_trusted(about, allowed=untrusted)
    ecdl = whole.without(*without)
    if without and recording is not None:
        raise ModelError(
            "`--without` and `--recording` do not go together: the inverse would be identified on "
            f"readings that still have {' and '.join(without)}. Use `--inverse exact`, or leave "
            "`--recording` out, so that the inverse is identified on the model's own response."
        )
    seen = identified = Identified.from_dict(about["identified"])
    if not about.get("trusted", False):  # without a claim there are no swings that it holds for
        identified = dataclasses.replace(seen, amplitudes=())
    allowed = None if limits is None else read_limits(limits)
    if not frequency or not all(np.isfinite(f) and f > 0 for f in frequency):
        raise ModelError(f"`--frequency` must be positive rates in Hz, but is {frequency}.")
    check_limits_unit(allowed, limits, about["drive_unit"])
    check_rates(frequency)
    if not extrapolate:
        refuse_beyond(identified.other_rate(*frequency))

    def targets_at(rates: list[float], rounded: float) -> tuple[Target, ...]:
        unit = about["response_unit"]
        return linear_scan(rates, span=span, rise=rise, corner=rounded, samples=samples, unit=unit)

    try:
        targets = targets_at(frequency, corner)
    except ValueError as error:
        raise ModelError(str(error)) from error
    names = drive_files(frequency, about["drive_unit"], inverse == "paper", plots)
    check_output(output, CERTIFICATE, names)
    check_no_other_drives(output)
    earlier_files(output, names)  # refused now, where one was changed
    measured = None if recording is None else read_recording(recording)
    if measured is not None:
        check_units(about, measured)
    with output_kept_if_written(output) as folder:
        used = ecdl
        fitted = None
        if inverse == "paper":
            report_step("identifying the inverse")
            used, fitted = _identify_inverse(ecdl, about, identified, measured, report_step)
        drive_for = partial(
            compensated,
            used,
            identified=identified,
            limits=allowed,
            bias=bias,
            extrapolate=extrapolate,
        )
        made, refused = [], {}
        for target in targets:
            report_step(f"{target.excitation_hz:g} Hz")
            try:
                made.append(drive_for(target))
            except LimitError as error:
                refused[target.excitation_hz] = error
        if refused:
            at_corner = partial(targets_at, list(refused))
            text = _say_which(refused, allowed is None)
            raise LimitError(text + _least_corner(drive_for, at_corner, corner))
        report_step("band on the nonlinearity")
        bands, note = scan_bands(model, ecdl, made)
        report = certificate_report(
            made, about, seen, allowed, fitted, ecdl,
            whole=whole, diagnosed=is_diagnosis(model), folder=output,
        )  # fmt: skip
        for drive, band in zip(report["drives"], bands, strict=True):
            drive["nonlinearity_band"] = band and band | {"unit": about["response_unit"]}
        report["notes"] += [] if note is None else [note]
        report |= dict(more or {})
        bounds = identified.limits() if allowed is None else allowed
        waves = generator_waveforms([one.drive for one in made], about["drive_unit"], bounds)
        if not waves:
            report["notes"].append(
                f"no generator file: the drive is in {about['drive_unit']}, not V."
            )
        written, removed = write_drives(
            folder, made, about, report, used if inverse == "paper" else None, plots, waves
        )
    return made, report, about["drive_unit"], removed, written


def _identify_inverse(
    ecdl: Any, about: dict[str, Any], identified: Any, data: Any, report_step: Any
) -> Any:
    """The paper's inverse operator, identified on a recording or on the model's own response."""
    if data is None:
        swapped = swapped_model(ecdl, identified, about["response_unit"], about["drive_unit"])
        result = fit_inverse(swapped, ecdl.operator, throw=False, progress=report_step)
    else:
        forward = fit(
            ecdl, data, starts=1, guess=False, hold_out=False, throw=False, progress=report_step
        )
        result = identify_inverse(data, forward, throw=False, progress=report_step)
    return result.ecdl, result


def _least_corner(
    drive_for: Callable[[Target], Compensation],
    at_corner: Callable[[float], tuple[Target, ...]],
    corner: float,
) -> str:
    """Which of a few rounder corners passes at all rates, in words; nothing where none does."""
    for rounded in (c for c in _CORNERS if c > corner):
        try:
            for target in at_corner(rounded):
                drive_for(target)
        except (LimitError, ModelError, ValueError):
            continue
        return f" `--corner {rounded:g}` would pass."
    return ""


def _say_which(refused: Mapping[float, LimitError], of_recording: bool) -> str:
    """Which scans a limit refuses, by rate in Hz, and whose limit it is."""
    named = [(f"the scan at {hertz:g} Hz", error) for hertz, error in refused.items()]
    text = str(join_refusals(named))
    if of_recording:
        text += (
            " These limits are the recording's own range and a twentieth more, with three times "
            "its steepest slope: give the device's with `--limits`."
        )
    return text
