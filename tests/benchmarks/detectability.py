"""How often an effect of the smallest size that should show is seen, and one of a third of it.

    python3 -m uv run python -m tests.benchmarks.detectability [--seeds N] [--shares S ...]

The paper's device, two amplitudes at three rates, four periods, white noise of 20 MHz. A session
without effects says the sizes; then each effect is put in at that size times each share, with a
phase drawn where it has one, and sessions of other noise are judged by the evidence before any data
are held out. One line a session: the fall in chi-square, the likeliest answer, the probability of
`none`. An effect is seen where the likeliest answer is not `none`.
"""

import argparse
import sys
from collections import Counter
from pathlib import Path

import numpy as np

from fitting.diagnosis.detectability._detectability import SmallestSize, smallest_sizes
from fitting.diagnosis.noise._periods import decimate
from fitting.diagnosis.refit._whitened_model import WhitenedModel
from fitting.diagnosis.which._base import FittedBase, fit_base
from fitting.diagnosis.which._forward_selection import Attribution, select_effects
from fitting.diagnosis.which.evidence._evidence import Evidence
from fitting.diagnosis.which.evidence._probability import hypothesis_probabilities
from fitting.diagnosis.which.screening._screen import summarise_residual
from rapi_jax import Recording
from rapi_jax.effects import ALL, AbstractEffect, ResidualSummary
from rapi_jax.internal import float64

sys.path.insert(0, str(Path(__file__).parents[1] / "support"))
from worlds import recorded  # noqa: E402  # pyright: ignore[reportMissingImports]

NOISE = 0.02  # GHz a sample
HELD = {"amplitude_law": {"reference": 2.5, "centre": 3.0}}  # in the middle of the session


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seeds", type=int, default=4, help="sessions of each effect and share")
    parser.add_argument("--shares", type=float, nargs="+", default=[1.0, 1.0 / 3.0])
    args = parser.parse_args()
    fitted, attribution = judged(recorded((), noise=NOISE, seed=1))
    noise = float(np.sqrt(fitted.spectrum.total))
    summary = summarise_residual(fitted.refit.whitened, attribution.none.on_base, noise)
    seen: Counter[float] = Counter()
    count: Counter[float] = Counter()
    for cls, size in zip(ALL, float64(smallest_sizes)(attribution.none, ALL), strict=True):
        print(f"{size.effect}: {size.parameter} {size.value} {size.unit}", flush=True)
        if size.value is None:
            continue
        for share in args.shares:
            for seed in range(args.seeds):
                effect = put_in(cls, size, share, summary, np.random.default_rng(seed))
                fitted, found = judged(recorded((effect,), noise=NOISE, seed=100 + seed))
                evidence = Evidence.of(found, noise_known=fitted.spectrum.measured)
                ranked = hypothesis_probabilities(evidence)
                fall, none = found.none.cost - found.best.cost, dict(ranked)["none"]
                count[share] += 1
                seen[share] += ranked[0][0] != "none"
                print(
                    f"  {share:.2f} {seed} {fall:8.1f} {ranked[0][0]} none {none:.3f}", flush=True
                )
    for share in args.shares:
        print(f"of {share:.2f} of the size: {seen[share]} of {count[share]} seen")


@float64
def judged(recording: Recording) -> tuple[FittedBase, Attribution]:
    """The base, and every hypothesis refitted."""
    with np.errstate(over="ignore", invalid="ignore"):
        fitted = fit_base(WhitenedModel.of(decimate(recording)), None)
        return fitted, select_effects(fitted, ALL, lambda line: None)


def put_in(
    cls: type[AbstractEffect],
    size: SmallestSize,
    share: float,
    summary: ResidualSummary,
    rng: np.random.Generator,
) -> AbstractEffect:
    """An effect of the kind that the size is for, `share` times as strong."""
    values = {name: found["value"] for name, found in size.others.items()}
    if "phase" in values:
        values["phase"] = rng.uniform(0.0, 2.0 * np.pi)
    onset = float(getattr(cls.onset(summary), size.parameter))
    assert size.value is not None
    values[size.parameter] = onset + share * (size.value - onset)
    return cls.at(**values, **HELD.get(size.effect, {}))


if __name__ == "__main__":
    main()
