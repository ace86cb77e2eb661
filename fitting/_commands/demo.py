"""`rapi demo`: the main job from end to end, on a device that behaves like the paper's."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter


def demo(
    *,
    output: Annotated[Path, Parameter(name=["--output", "-o"])] = Path("rapi-demo"),
    seed: int = 0,
    json: Annotated[bool, Parameter(negative="")] = False,
) -> int:
    """Record a simulated laser at 10, 20, 30 and 40 Hz, identify it, and write the pictures.

    The laser behaves like the one of the paper: a 4.5 V triangle on 3 V scans about 75 GHz with the
    nonlinearity of the paper's Table 1; readings have 20 MHz of noise.

    Parameters
    ----------
    output
        Folder for the recording, the model and the pictures; made if missing.
    seed
        Seed of the noise.
    json
        Print one JSON object on standard output.
    """
    from fitting._identify import identify
    from fitting.report import write_fit
    from rapi_jax._paper_device import paper_recording
    from rapi_jax.io import read_recording, write_recording

    from ._out import console, output_folder, progress, say_json
    from .run import DONE, UNTRUSTED

    folder = output_folder(output)
    with progress("demo", json) as say:
        say("recording the simulated laser")
        recording, truth = paper_recording(seed=seed)
        write_recording(recording, folder / "recording")
        data = read_recording(folder / "recording")
        result = identify(data, throw=False, progress=say)
        written = write_fit(result, folder, plots=True)
    missed = [_rms(p - t) for p, t in zip(result.predicted, truth, strict=True)]
    if json:
        say_json(
            {
                "schema": "rapi.demo/1",
                "folder": str(folder),
                "files": [path.name for path in written],
                "noise_free_rmse_ghz": missed,
                "model": result.to_dict(),
            }
        )
    else:
        from fitting.report import tables

        out = console(json)
        out.print(tables(result))
        out.print(
            "Against the truth, without noise: "
            + ", ".join(
                f"{1e3 * m:.2f} MHz at {d.rate:g} Hz"
                for m, d in zip(missed, data.drives, strict=True)
            )
        )
        out.print(
            f"The recording, the model and the pictures are in {folder.resolve()}:", markup=False
        )
        for path in written:
            out.print(f"  {path.name}", markup=False)
    return DONE if result.verdict.trusted else UNTRUSTED


def _rms(values) -> float:
    return float((values**2).mean() ** 0.5)
