"""The files of drives that linearise: their names, what may be loaded, and the certificate."""

from pathlib import Path
from typing import Any

CERTIFICATE = "certificate.json"


def file_stem(hz: float) -> str:
    return f"drive_{hz:g}Hz"


def check_rates(rates: list[float]) -> None:
    """Refuse rates whose files would have one name."""
    from rapi_jax import ModelError

    for i, hz in enumerate(rates):
        if file_stem(hz) in map(file_stem, rates[:i]):
            raise ModelError(
                f"`--frequency` names {hz!r} Hz and another rate whose files would be called "
                f"{file_stem(hz)}, too. Give each rate once, and rates this near in folders of "
                "their own."
            )


def _kinds(drive_unit: str) -> tuple[str, ...]:
    """Files of a drive; a generator's levels are voltages, so only drives in V have its file."""
    return ("csv", "afg", "nc") if drive_unit == "V" else ("csv", "nc")


def check_no_other_drives(folder: Path, name: str = CERTIFICATE) -> None:
    """Refuse a folder with a drive that the list `name` in it does not hold: `OutputError`.

    Beside a new certificate it would be taken for one of its drives.
    """
    from fitting._result_files import listed_files
    from rapi_jax.io import OutputError, printable

    what = "certificate" if name == CERTIFICATE else "list"
    known = listed_files(folder / name)
    for path in sorted(folder.glob("drive_*Hz.*")):
        if path.name not in known:
            raise OutputError(
                f"the output {printable(folder)} holds {printable(path.name, 80)}, which no "
                f"{name} there lists: it would lie beside the {what} of other drives. "
                "Choose another folder with `-o`, or move it away."
            )


def drive_files(rates: list[float], drive_unit: str, paper: bool, plots: bool) -> list[str]:
    """The files of a compensation but for its certificate."""
    from fitting.report.compensation._page import PAGE

    names = [f"{file_stem(hz)}.{kind}" for hz in rates for kind in _kinds(drive_unit)]
    return names + ["inverse.rapi"] * paper + ["compensation.png", PAGE] * plots


def generator_waveforms(drives: list[Any], drive_unit: str, limits: Any) -> list[Any]:
    """Codes of each drive in V, with no level beyond the limits; `LimitError` where that fails."""
    from rapi_jax import AfgWaveform

    if drive_unit != "V":
        return []
    return [AfgWaveform.of(one, limits=limits) for one in drives]


def write_drives(
    folder: Path,
    made: list[Any],
    about: dict[str, Any],
    report: dict[str, Any],
    inverse: Any,
    plots: bool,
    waves: list[Any],
) -> list[Path]:
    from fitting._json import json_text
    from fitting._result_files import begin_result, hash_files
    from fitting.report import save_figure
    from fitting.report.compensation._page import PAGE, render_page
    from rapi_jax import Recording, Run
    from rapi_jax.io import write_afg, write_atomic, write_drive, write_model, write_recording

    written: list[Path] = []
    kinds = _kinds(about["drive_unit"])
    rates = [one.drive.rate for one in made]
    names = drive_files(rates, about["drive_unit"], inverse is not None, plots)
    earlier = begin_result(folder, CERTIFICATE, names)  # no certificate, no drive
    for i, one in enumerate(made):
        stem = file_stem(one.drive.rate)
        paths = [folder / f"{stem}.{kind}" for kind in kinds]
        pair = Recording(
            (Run(one.drive, one.target.value, stem),),
            response_unit=about["response_unit"],
            drive_unit=about["drive_unit"],
            response_origin="run",
            provenance={"response": "the scan asked for", "inverse": one.inverse},
        )
        write_drive(one.drive, paths[0])
        if waves:
            write_afg(waves[i], paths[1])
        write_recording(pair, paths[-1])
        written += paths
    if inverse is not None:
        write_model(
            folder / "inverse.rapi",
            inverse,
            response_unit=about["drive_unit"],
            drive_unit=about["response_unit"],
        )
        written.append(folder / "inverse.rapi")
    if plots:
        from rapi_jax import plot

        figure = plot.compensation(made, about["response_unit"], about["drive_unit"])
        written.append(save_figure(figure, folder / "compensation.png"))
        write_atomic(folder / PAGE, render_page(report, written[-1].read_bytes()))
        written.append(folder / PAGE)
    report["files"] = hash_files(written) | earlier
    write_atomic(folder / CERTIFICATE, json_text(report))
    return [*written, folder / CERTIFICATE]
