"""Linearity gain: scans compensated with and without the effects named, on the device."""

import dataclasses
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from fitting.blind.simulator._scan import Scan, scan_from_samples
from rapi_jax import ECDL, Identified, Recording, Run, compensate, linear_scan, linearity, predict

from ._model_response import model_response, to_drive
from ._realised_gap import Array, NoiseFreeDevice
from ._thresholds import THRESHOLDS

PERIODS = 3
PAUSE_S = 2.0


def linearity_gain(
    device: NoiseFreeDevice,
    session: Sequence[Scan],
    models: tuple[ECDL, ECDL],
    promised: Mapping[str, Any],
) -> dict[str, Any]:
    """Nonlinearity (rms, GHz) under either model's drive, and by what factor it fell.

    The target is a straight scan of 80 % of the base model's span, at the recorded rate of the full
    swing that is nearest to the middle. Each drive is the exact inverse of its model within the
    range of the session, and is played a while after it. `refused`: why a model has no such drive.
    `inside`: whether the factor lies in the interval promised (`straighter`). `foreseen`: the
    nonlinearity that the model with the effects says the base's drive leaves.
    """
    scan = _reference_scan(session)
    span = THRESHOLDS.compensated_span * float(
        np.ptp(model_response(models[1], session)[list(session).index(scan)])
    )
    (target,) = linear_scan(scan.rate_hz, span=span)
    drives = [to_drive(one) for one in session]
    seen = Identified.of(Recording.of(drives, [drive.value for drive in drives]))
    record: dict[str, Any] = {"rate_hz": scan.rate_hz, "span": span, "refused": None}
    found: dict[str, float] = {}
    for name, ecdl in zip(("after", "before"), models, strict=True):
        try:
            made = compensate(ecdl, target, identified=seen, bias=scan.bias)
        except Exception as error:  # any reason there is counts as a refusal, and is said
            record["refused"] = f"{name}: {type(error).__name__}: {error}"
            return record
        played = _repeat_after_session(session, made.drive.value, scan.rate_hz)
        found[name] = nonlinearity(played, device.simulate([*session, played])[-1])
        if name == "before":
            found["foreseen"] = nonlinearity(
                played, np.asarray(predict(models[0], to_drive(played)))
            )
    factor = found["before"] / found["after"] if found["after"] > 0 else None
    interval = promised.get("straighter") or {}
    low, high = interval.get("low"), interval.get("high")
    inside = None
    if factor is not None and low is not None:
        inside = low <= factor <= (np.inf if high is None else high)
    return record | found | {
        "factor": factor,
        "promised": interval or None,
        "ratio": factor / interval["value"] if factor and interval.get("value") else None,
        "down": found["after"] < found["before"],
        "inside": inside,
    }  # fmt: skip


def nonlinearity(scan: Scan, answer: Array) -> float:
    """Rms over both ramps of an answer to `scan`, GHz.

    About each ramp's own line, in the middle 80 % of its time (Section 4.1 of the paper).
    """
    up, down = linearity(Run(dataclasses.replace(to_drive(scan), start_s=0.0), answer)).rms_ghz
    return float(np.sqrt((up**2 + down**2) / 2))


def _repeat_after_session(session: Sequence[Scan], volts: Array, rate_hz: float) -> Scan:
    begin = session[-1].start_s + session[-1].duration_s + PAUSE_S
    return scan_from_samples(volts, rate_hz, periods=PERIODS, start_s=begin, waveform="triangle")


def _reference_scan(session: Sequence[Scan]) -> Scan:
    widest = max(scan.swing for scan in session)
    full = sorted(
        (scan for scan in session if scan.swing > THRESHOLDS.full_swing * widest),
        key=lambda scan: scan.rate_hz,
    )
    return full[len(full) // 2]
