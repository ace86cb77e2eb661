"""`rapi drive`: plain triangles and sines to record a laser with, before there is any model."""

from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import CycloptsError, Parameter, validators

LIST = "drives.json"


def drive(
    *,
    frequency: Annotated[
        list[float], Parameter(name=["--frequency", "--rate"], consume_multiple=True, negative="")
    ],
    low: float,
    high: float,
    output: Annotated[Path, Parameter(name=["--output", "-o"])],
    waveform: Literal["triangle", "sine"] = "triangle",
    samples: Annotated[int, Parameter(validator=validators.Number(gte=8))] = 4000,
    limits: Path | None = None,
    json: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Write triangles or sines to send to a laser that has no model yet.

    For each rate: `drive_<HZ>Hz.csv` (`time_s,drive`, one period, from its minimum) and the same as
    generator codes (`.afg`), as `rapi compensate` writes them, and `drives.json`. Give levels at
    the output of the generator: with an amplifier behind it, the piezo's voltage over its gain. A
    drive beyond the limits is refused and never clipped; then nothing is written. Earlier drives in
    the folder are replaced: those that are not written again are removed.

    Parameters
    ----------
    frequency
        Scan rates, Hz. For a model: three or more that span yours, the highest at least twice the
        lowest, and all of them again at half the peak-to-peak voltage.
    low
        Lowest voltage, V.
    high
        Highest voltage, V.
    output
        Folder for the drives; made if missing.
    waveform
        Waveform of the drives.
    samples
        Samples in a period.
    limits
        TOML file with `low_v`, `high_v`, `slew_v_per_s` and, if wanted, `step_v`,
        `max_frequency_hz`: what the device allows, in the voltages of the drives themselves (with
        an amplifier behind them, the piezo's limits divided by its gain). Without it nothing is
        checked, and a line says so.
    json
        Print `drives.json` on standard output.
    """
    options = dict(locals())
    if not float("-inf") < low < high < float("inf"):
        raise CycloptsError(
            msg=f"--low must lie below --high, but they are {low:g} V and {high:g} V.",
            command_chain=("drive",),
        )
    from fitting.commands.shared._out import console, print_json
    from fitting.commands.shared.files._drive_files import print_removed
    from fitting.commands.shared.files._provenance import provenance

    made, allowed = _make(frequency, low, high, waveform, samples, limits)
    report: dict[str, Any] = {
        "schema": "rapi.drives/1",
        "drive_unit": "V",
        "limits": None if allowed is None else _limits_table(allowed),
        "drives": [
            {
                "excitation_hz": one.rate,
                "waveform": one.waveform,
                "drive_min": float(one.value.min()),
                "drive_max": float(one.value.max()),
                "slew_max": _slew(one),
                "samples": one.size,
            }
            for one in made
        ],
        "provenance": provenance("rapi drive", options, ()),
    }
    written, removed = _write(made, allowed, report, output)
    out = console(json)
    print_removed(out, output, removed)
    if json:
        print_json(report)
        return 0
    for one in made:
        out.print(
            f"{one.waveform} at {one.rate:g} Hz: {one.value.min():g} to {one.value.max():g} V, "
            f"{one.size} samples a period, {_slew(one):.4g} V/s at most",
            markup=False,
        )
    if allowed is None:
        out.print(
            "No limits were given, so none were checked. State in a file what the device allows, "
            "and give it: `--limits limits.toml`.",
            markup=False, soft_wrap=True,
        )  # fmt: skip
    else:
        out.print("All drives are within the limits.", markup=False)
    names = ", ".join(path.name for path in written)
    out.print(f"written to {output}: {names}", markup=False, soft_wrap=True)
    return 0


def _make(
    frequency: list[float], low: float, high: float, waveform: str, samples: int,
    limits: Path | None,
) -> tuple[list[Any], Any]:  # fmt: skip
    """The drives, each within the limits, and these (`None` for none)."""
    import numpy as np

    from fitting.commands.shared._limits import check_limits_unit
    from fitting.commands.shared.files._drive_files import check_rates
    from rapi_jax import LimitError, ModelError, sine, triangle
    from rapi_jax.internal import join_refusals
    from rapi_jax.io import read_limits

    if not frequency or not all(np.isfinite(hz) and hz > 0 for hz in frequency):
        raise ModelError(f"`--frequency` must be positive rates in Hz, but is {frequency}.")
    check_rates(frequency)
    allowed = None if limits is None else read_limits(limits)
    check_limits_unit(allowed, limits, "V")
    shape = triangle if waveform == "triangle" else sine
    made, refused = [], []
    for hz in frequency:
        (one,) = shape(hz, amplitude=high - low, bias=(low + high) / 2.0, samples=samples)
        try:
            if allowed is not None:
                allowed.check(one)
        except LimitError as error:
            refused.append((f"the drive at {hz:g} Hz", error))
        made.append(one)
    if refused:
        raise join_refusals(refused)
    return made, allowed


def _write(
    made: list[Any], allowed: Any, report: dict[str, Any], output: Path
) -> tuple[list[Path], list[str]]:
    """All files, or none, and the names of those removed; `report` comes last, with hashes."""
    from fitting._json import json_text
    from fitting._result_files import begin_result, check_output, list_files
    from fitting.commands.shared._out import output_folder
    from fitting.commands.shared.files._drive_files import (
        check_no_other_drives,
        earlier_files,
        file_stem,
        generator_waveforms,
        remove_earlier,
    )
    from rapi_jax.io import write_afg, write_atomic, write_drive

    waves = generator_waveforms(made, "V", allowed)
    names = [f"{file_stem(one.rate)}.{kind}" for one in made for kind in ("csv", "afg")]
    check_output(output, LIST, names)
    check_no_other_drives(output, LIST)
    folder = output_folder(output)
    removed = earlier_files(folder, names, LIST)
    earlier = begin_result(folder, LIST, names)
    remove_earlier(folder, removed)
    earlier = [file for file in earlier if file not in removed]
    for one, wave in zip(made, waves, strict=True):
        write_drive(one, folder / f"{file_stem(one.rate)}.csv")
        write_afg(wave, folder / f"{file_stem(one.rate)}.afg")
    written = [folder / name for name in names]
    report |= list_files(written, earlier)
    write_atomic(folder / LIST, json_text(report))
    return [*written, folder / LIST], removed


def _limits_table(limits: Any) -> dict[str, Any]:
    """Limits in the keys of their file; those that are not set are null."""
    import dataclasses

    table = dataclasses.asdict(limits)
    return {key: None if value == float("inf") else value for key, value in table.items()}


def _slew(drive: Any) -> float:
    """Steepest slope between samples, V/s."""
    import numpy as np

    return float(np.abs(np.diff(drive.value)).max()) / drive.step_s
