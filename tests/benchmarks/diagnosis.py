"""How often a diagnosis is right on simulated sessions: single effects, none, unlisted, pairs.

Every session is made by the paper's device with effects of the size in `examples_*.py`, and noise
such that the projected size is `--sigma` times that of a sample.
"""

import argparse
import sys
import time
from itertools import combinations
from pathlib import Path

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "support"))

import jax  # noqa: E402

jax.config.update("jax_enable_x64", True)

import numpy as np  # noqa: E402
from worlds import TRUTHS, projected, recorded  # noqa: E402

from fitting import diagnose  # noqa: E402
from fitting.diagnosis.refit._effect_vector import effect_values  # noqa: E402
from rapi_jax.effects import ALL  # noqa: E402

# Pairs whose members differ in what they act on and in what they depend on.
PAIRS = (
    ("amplifier_lowpass", "etalon"), ("creep", "resonance"), ("delay", "gain_drift"),
    ("drift", "rate_law"), ("etalon", "pickup"), ("mode_hop", "amplifier_lowpass"),
    ("pickup", "resonance"), ("saturation", "etalon"), ("gain_drift", "etalon"),
    ("quantisation", "delay"),
)  # fmt: skip


def show(names, *, sigma, seed, without=()) -> bool:
    truth = [TRUTHS[name] for name in names]
    noise = min(projected([t]) for t in truth) / sigma if truth else 0.02
    recording = recorded(truth, noise=noise, seed=seed)
    began = time.perf_counter()
    candidates = tuple(cls for cls in ALL if cls.name not in without)
    report = diagnose(None, recording, candidates=candidates, scan=False)
    seconds = time.perf_counter() - began
    wanted = "+".join(sorted(names)) or "none"
    if without:
        wanted = "unlisted"
    verdict = report.verdict
    right = wanted in verdict.set
    off = ""
    if verdict.name == wanted and len(names) == 1 and not without:
        hypothesis = next(h for h in report.to_dict()["hypotheses"] if h["name"] == wanted)
        true = effect_values(tuple(truth))
        found = hypothesis["parameters"].items()
        z = [
            f"{name} {(p['value'] - v) / p['stderr'] if p['stderr'] else np.nan:+.1f}"
            for (name, p), v in zip(found, true, strict=True)
        ]
        off = "off by, in standard errors: " + ", ".join(z)
    closed = report.content["shrinkage"]["closed_fraction"]
    share = "" if closed is None else f"closed {closed['value']:.3f}"
    mark = "ok  " if verdict.name == wanted else "set " if right else "MISS"
    print(
        f"{mark} {wanted:32s} {verdict.name:32s} p {verdict.probability:.3f} set "
        f"{'/'.join(verdict.set)} {share} {seconds:.1f} s {off}",
        flush=True,
    )
    return right


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", nargs="*", default=["single", "unlisted", "pairs"])
    parser.add_argument("--sigma", type=float, default=4.0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--all-pairs", action="store_true")
    args = parser.parse_args()
    options = {"sigma": args.sigma, "seed": args.seed}
    for what in args.what:
        if what == "single":
            rows = [show((), **options)] + [show((name,), **options) for name in TRUTHS]
        elif what == "unlisted":
            rows = [show((name,), without=(name,), **options) for name in TRUTHS]
        elif what == "pairs":
            pairs = tuple(combinations(TRUTHS, 2)) if args.all_pairs else PAIRS
            rows = [show(pair, **options) for pair in pairs]
        else:
            rows = [show(tuple(what.split("+")), **options)]
        print(f"{what}: {sum(rows)} of {len(rows)}")


if __name__ == "__main__":
    main()
