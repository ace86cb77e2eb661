"""The files of drives that linearise: their names, what may be loaded, and the certificate."""

import re
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from rich.console import Console

CERTIFICATE = "certificate.json"
_OWN = re.compile(r"drive_[^/\\]+Hz\.(csv|afg|nc)|inverse\.rapi|compensation\.png|drives\.html")


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


def earlier_files(folder: Path, files: Iterable[str], name: str = CERTIFICATE) -> list[str]:
    """What earlier drives have left in `folder` that a result of `files` would not write over.

    Only what the list `name` there names, and what drives are written as. Raises `OutputError`
    where one of them was changed since it was written: it is then not theirs alone.
    """
    from fitting._result_files import check_output, listed_files

    kept = set(files)
    left = sorted(
        file
        for file in listed_files(folder / name) - kept
        if _OWN.fullmatch(file) and (folder / file).is_file()
    )
    check_output(folder, name, left)
    return left


def remove_earlier(folder: Path, files: Iterable[str]) -> None:
    """Remove what `earlier_files` found, so that no drive lies beside a list of others."""
    from rapi_jax.internal import cause
    from rapi_jax.io import OutputError, printable

    for file in files:
        try:
            (folder / file).unlink(missing_ok=True)
        except OSError as error:
            raise OutputError(
                f"cannot remove {printable(folder / file)}, which is of earlier drives: "
                f"{cause(error)}. Choose another folder with `-o`, or move it away."
            ) from error


def print_removed(out: "Console", folder: Path, files: list[str]) -> None:
    """Name the drives that were removed, if any."""
    if files:
        out.print(f"removed of the drives that were in {folder}: {', '.join(files)}", markup=False)


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
) -> tuple[list[Path], list[str]]:
    """Write the drives in the place of earlier ones: the files, and the names of those removed."""
    from fitting._json import json_text
    from fitting._result_files import begin_result, list_files
    from fitting.report import save_figure
    from fitting.report._pages import PagePicture
    from fitting.report.compensation._page import PAGE, render_page
    from rapi_jax import Recording, Run
    from rapi_jax.io import write_afg, write_atomic, write_drive, write_model, write_recording

    written: list[Path] = []
    kinds = _kinds(about["drive_unit"])
    rates = [one.drive.rate for one in made]
    names = drive_files(rates, about["drive_unit"], inverse is not None, plots)
    removed = earlier_files(folder, names)
    earlier = begin_result(folder, CERTIFICATE, names)  # no certificate, no drive
    remove_earlier(folder, removed)
    earlier = [file for file in earlier if file not in removed]
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
        write_atomic(folder / PAGE, render_page(report, PagePicture.of(figure), folder=folder))
        written.append(folder / PAGE)
    report |= list_files(written, earlier)
    write_atomic(folder / CERTIFICATE, json_text(report))
    return [*written, folder / CERTIFICATE], removed
