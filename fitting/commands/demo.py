"""`rapi demo`: the main job from end to end, on a simulated bench like the paper's."""

import dataclasses
from pathlib import Path
from typing import Annotated, Any

from cyclopts import Parameter

SPAN = 75.0  # GHz
# An effect of the second laser that the model lacks: interference of A (GHz) every F (GHz).
ETALON = {"amplitude": 0.05, "spacing": 7.0, "phase": 0.4}
NOISE = 0.02  # GHz, of one reading of the second laser
# Table 1 of the paper, rms nonlinearity in MHz: up without and with compensation, then down.
PAPER = {
    10.0: (435.0, 63.7, 3280.0, 271.0),
    20.0: (400.0, 75.8, 3240.0, 243.0),
    30.0: (391.0, 61.9, 3120.0, 179.0),
    40.0: (400.0, 33.8, 3030.0, 154.0),
}


def demo(
    *,
    output: Annotated[Path, Parameter(name=["--output", "-o"])] = Path("rapi-demo"),
    seed: int = 0,
    json: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Scan a simulated laser at 10 to 40 Hz, identify it, make it scan straight; diagnose another.

    The laser behaves like the one of the paper: a triangle of 4.5 V peak to peak, centred on 3 V,
    scans about 75 GHz with the nonlinearity of the paper's Table 1. Its frequency is read from the
    fringes of a 5 m interferometer and a Fabry-Perot cavity, as digitized at 30 MS/s; drives pass
    the 14 bits of a generator. The second laser has an effect in its light path that the model
    lacks; its frequency is read with 20 MHz of noise, and the diagnosis is to find the effect.

    Parameters
    ----------
    output
        Folder for the recordings, the model, the drives, the pictures and the diagnosis; made if
        missing.
    seed
        Seed of the noise.
    json
        Print one JSON object on standard output.
    """
    from fitting.commands.shared._out import console, output_folder, print_json
    from fitting.commands.shared._progress import progress
    from fitting.diagnosis import diagnose
    from fitting.identification._identify import identify
    from fitting.report import save_figure, write_fit
    from hardware import SimulatedBench
    from rapi_jax import Identified, compensate, linear_scan, linearity, plot
    from rapi_jax.examples import paper_drives
    from rapi_jax.io import read_recording, write_drive, write_recording

    from .run import DONE, UNTRUSTED

    _check_output(output)
    folder = output_folder(output)
    with progress("demo", json) as report_step:
        report_step("scanning the simulated laser with triangles")
        bench = SimulatedBench.like_paper(seed=seed)
        drives = paper_drives()
        truth = [bench.truth(drive) for drive in drives]
        write_recording(bench.measure(drives), folder / "recording")
        data = read_recording(folder / "recording")
        result = identify(data, throw=False, progress=report_step)
        written = write_fit(result, folder, plots=True)
        report_step("making the drives for a straight scan")
        targets = linear_scan(list(PAPER), span=SPAN)
        identified = Identified.of(data)
        made = [compensate(result.ecdl, target, identified=identified) for target in targets]
        for one in made:
            path = folder / f"drive_{one.drive.rate:g}Hz.csv"
            write_drive(one.drive, path)
            written.append(path)
        report_step("scanning the laser with them")
        write_recording(bench.measure([one.drive for one in made]), folder / "compensated")
        after = read_recording(folder / "compensated")
        for name, figure in (
            ("compensation.png", plot.compensation(made, "GHz", "V")),
            ("scans.png", plot.scans(data, after)),
        ):
            written.append(save_figure(figure, folder / name))
        report_step("scanning a laser that holds something more")
        write_recording(_scan_second_laser(seed), folder / "second")
        second = read_recording(folder / "second")
        report = diagnose(None, second, limits=bench.limits, progress=report_step)
        written += report.save(folder / "diagnosis", name="second")
    rows = [
        {
            "excitation_hz": run.drive.rate,
            "before_mhz": [1e3 * x for x in linearity(run).rms_ghz],
            "after_mhz": [1e3 * x for x in linearity(straight).rms_ghz],
        }
        for run, straight in zip(data.runs, after.runs, strict=True)
    ]
    noise_free = [_noise_free_rmse(p, t) for p, t in zip(result.predicted, truth, strict=True)]
    if json:
        print_json(
            {
                "schema": "rapi.demo/1",
                "folder": str(folder),
                "files": [path.relative_to(folder).as_posix() for path in written],
                "noise_free_rmse_ghz": noise_free,
                "nonlinearity": rows,
                "model": result.to_dict(),
                "diagnosis": report.to_dict(),
            }
        )
    else:
        from fitting.report import render_brief
        from fitting.report.diagnosis._terminal import render_lines

        out = console(json)
        out.print(render_brief(result))
        out.print(_table(rows))
        out.print(
            f"The recordings, the model, the drives and the pictures are in {folder.resolve()}; "
            "scans.png shows the scans before and after:",
            markup=False,
        )
        for path in written:
            out.print(f"  {path.relative_to(folder)}", markup=False)
        out.rule("a second laser")
        out.print(render_lines(report.to_dict()))
        page = (folder / "diagnosis" / "report.html").resolve()
        out.print(
            f"It was an etalon of {1e3 * ETALON['amplitude']:g} MHz every {ETALON['spacing']:g} "
            f"GHz. The diagnosis with all its figures is a page for your browser: {page}",
            markup=False,
        )
    return DONE if result.verdict.trusted else UNTRUSTED


def _check_output(folder: Path) -> None:
    """Refuse a folder with a model or recordings that no demo wrote. Raises `OutputError`."""
    from fitting._result_files import check_output
    from fitting.commands.shared.files._measured_output import check_recording_output

    check_output(folder, "model.json")
    for name in ("recording", "compensated"):
        check_recording_output(folder / name)


def _scan_second_laser(seed: int) -> Any:
    """Two amplitudes at three rates, four periods each, of a laser with a parasitic etalon."""
    import numpy as np

    from hardware import SimulatedBench
    from hardware.simulated import Device
    from rapi_jax import ECDL, Recording, triangle
    from rapi_jax.effects import Etalon
    from rapi_jax.examples import BIAS, paper_device

    bench = SimulatedBench.like_paper(seed=seed)
    device = Device(ECDL(paper_device().operator, (Etalon.at(**ETALON),)))
    bench.laboratory = dataclasses.replace(bench.laboratory, device=device)
    rng = np.random.default_rng([seed, 1])
    drives, readings = [], []
    for amplitude in (2.5, 4.5):  # V peak to peak
        for drive in triangle(
            [10, 20, 40], amplitude=amplitude, bias=BIAS, samples=1600, periods=4
        ):
            bench.wait(0.5)
            drives.append(dataclasses.replace(drive, start_s=bench.session_s))
            readings.append(bench.truth(drives[-1]) + NOISE * rng.standard_normal(drive.size))
            bench.wait(drive.periods / drive.rate)
    return Recording.of(drives, readings)


def _noise_free_rmse(predicted: Any, truth: Any) -> float:
    """The rms error against the truth, GHz; fringes do not determine a constant."""
    return float((predicted - truth).std())


def _table(rows: list[dict[str, Any]]) -> Any:
    from rich.table import Table

    table = Table(
        title="rms nonlinearity of the scan, read from fringes (MHz); in brackets the paper's",
        title_justify="left",
    )
    for name in ("rate (Hz)", "up", "up, compensated", "down", "down, compensated"):
        table.add_column(name, justify="right")
    for row in rows:
        numbers = zip(row["before_mhz"], row["after_mhz"], strict=True)
        seen = [value for pair in numbers for value in pair]
        paper = PAPER[row["excitation_hz"]]
        cells = [f"{value:.3g} ({theirs:g})" for value, theirs in zip(seen, paper, strict=True)]
        table.add_row(f"{row['excitation_hz']:g}", *cells)
    return table
