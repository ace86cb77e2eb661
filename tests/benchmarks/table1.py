"""Table 1, Figs. 7 and 10: a simulated laser read from fringes, with both inverses, and beyond.

    uv run python tests/benchmarks/table1.py [--seed 0] [-o FOLDER] [--unseen]

Prints the paper's figures beside ours; with `--unseen` also rates, spans and biases that were never
identified. With `-o`, writes the scans and the inverse's overlay (Fig. 7) as pictures.
"""

import argparse
from pathlib import Path

import numpy as np

RATES = (10.0, 20.0, 30.0, 40.0)
# The paper's: rms up and down in MHz without and with compensation; peak widths' improvement.
PAPER_UP = ((435, 400, 391, 400), (63.7, 75.8, 61.9, 33.8))
PAPER_DOWN = ((3280, 3240, 3120, 3030), (271, 243, 179, 154))
PAPER_PEAKS = (10.93, 12.77, 31.25, 16.75)
PEAK_DELAY_S = 24.5e-9  # the delay at which beats are looked at: the auxiliary interferometer's
UNSEEN = [(f, 75.0, 3.0) for f in (15.0, 25.0, 55.0)]
UNSEEN += [(20.0, 45.0, 3.0), (20.0, 75.0, 2.7), (20.0, 75.0, 3.3), (25.0, 45.0, 3.3)]


def prepared(seed):
    """A bench, its training recording, and the fits of a model and of the paper's inverse."""
    from fitting import identify, identify_inverse
    from hardware import SimulatedBench
    from rapi_jax.examples import paper_drives

    bench = SimulatedBench.like_paper(seed=seed)
    training = bench.measure(paper_drives())
    forward = identify(training, throw=False)
    return bench, training, forward, identify_inverse(training, forward, throw=False)


def straight(bench, ecdl, training, rate, span=75.0, bias=3.0, extrapolate=False):
    """The linearity of a compensated scan, read from fringes."""
    from rapi_jax import Identified, compensate, linear_scan, linearity

    (target,) = linear_scan(rate, span=span)
    made = compensate(
        ecdl,
        target,
        identified=Identified.of(training),
        limits=bench.limits,
        bias=bias,
        extrapolate=extrapolate,
    )
    recording = bench.measure(made.drive)
    return linearity(recording.runs[0]), recording, made


def cells(scans):
    """rms up, rms down, 1 - r^2 up and down, worst share of the excursion, a row each."""
    up, down = [s.up for s in scans], [s.down for s in scans]
    return {
        "rms up (MHz)": [1e3 * b.rms_ghz for b in up],
        "rms down (MHz)": [1e3 * b.rms_ghz for b in down],
        "1-r2 up": [b.one_minus_r2() for b in up],
        "1-r2 down": [b.one_minus_r2() for b in down],
        "1-r2 down, at 54.5 GHz": [b.one_minus_r2(54.5) for b in down],
        "rms up (% of excursion)": [100 * b.rms_ghz / b.excursion_ghz for b in up],
        "rms down (% of excursion)": [100 * b.rms_ghz / b.excursion_ghz for b in down],
        "peak width up (Hz)": [b.peak_width_hz(PEAK_DELAY_S) for b in up],
        "peak width down (Hz)": [b.peak_width_hz(PEAK_DELAY_S) for b in down],
        "Eq. 5 down (Hz)": [b.eq5_width_hz(PEAK_DELAY_S) for b in down],
        "Eq. 7 down (um)": [1e6 * b.nonlinear_resolution_m(PEAK_DELAY_S) for b in down],
    }


def show(name, rows):
    """A block of the table."""
    print(f"\n{name}; rates {', '.join(f'{r:g}' for r in RATES)} Hz")
    for label, values in rows.items():
        print(f"  {label:28s}" + "".join(f"{v:12.4g}" for v in values))


def main():
    """Print it."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("-o", "--output", type=Path)
    parser.add_argument("--unseen", action="store_true")
    options = parser.parse_args()
    from rapi_jax import linearity

    bench, training, forward, inverse = prepared(options.seed)
    print(f"forward trusted: {forward.verdict.trusted}; inverse: {inverse.verdict.trusted}")
    print("inverse's RMSE, mV (Fig. 7):", [round(1e3 * run.rmse, 3) for run in inverse.runs])
    plain = [linearity(run) for run in training.runs]
    show("paper, without", {"rms up (MHz)": PAPER_UP[0], "rms down (MHz)": PAPER_DOWN[0]})
    before = cells(plain)
    show("ours, without", before)
    show("paper, with", {"rms up (MHz)": PAPER_UP[1], "rms down (MHz)": PAPER_DOWN[1]})
    for name, ecdl in (("paper's inverse", inverse.ecdl), ("exact inverse", forward.ecdl)):
        scans = [straight(bench, ecdl, training, rate) for rate in RATES]
        after = cells([s[0] for s in scans])
        show(f"ours, {name}", after)
        narrower = {
            key: list(np.divide(before[key], after[key]))
            for key in ("peak width up (Hz)", "peak width down (Hz)")
        }
        show("peaks narrower by", {"paper": PAPER_PEAKS} | narrower)
        if options.output:
            pictures(options.output, name, training, scans, inverse)
    if options.unseen:
        print("\nnever identified: rate, span, bias; rms up and down in MHz")
        for rate, span, bias in UNSEEN:
            row = []
            for ecdl in (inverse.ecdl, forward.ecdl):
                scan = straight(bench, ecdl, training, rate, span, bias, extrapolate=True)[0]
                row += [1e3 * x for x in scan.rms_ghz]
            print(
                f"  {rate:5g} Hz {span:5g} GHz {bias:4g} V   paper's {row[0]:8.3g} {row[1]:8.3g}"
                f"   exact {row[2]:8.3g} {row[3]:8.3g}",
                flush=True,
            )


def pictures(folder, name, training, scans, inverse):
    """Fig. 9 for one inverse, and Fig. 7."""
    from rapi_jax import Recording, Run, plot

    folder.mkdir(parents=True, exist_ok=True)
    runs = tuple(
        Run(s[1].runs[0].drive, s[1].runs[0].response, f"r{i}") for i, s in enumerate(scans)
    )
    after = Recording(runs, response_origin="run")
    stem = name.replace("'", "").replace(" ", "_")
    (folder / f"scans_{stem}.png").write_bytes(plot.png(plot.scans(training, after)))
    overlay = plot.loops(inverse.recording, inverse.predicted)
    (folder / "fig7.png").write_bytes(plot.png(overlay))


if __name__ == "__main__":
    main()
