"""`measured_budget`: what records themselves tell of each source."""

import dataclasses
from typing import TYPE_CHECKING

import numpy as np

from rapi_jax._metrics import SPEED_OF_LIGHT as C

from ._conditions import Budget, BudgetLine, Conditions
from ._light import measure_light
from ._predicted import predicted_budget

if TYPE_CHECKING:
    from rapi_jax.ranging._ranging import Ranging


def measured_budget(ranging: "Ranging") -> Budget:
    """The standard error of one scan's distance by each source, from one ranging, m.

    Noise of the light is told apart by its size on the two interferometers: that of detectors and
    digitizer is the same for both, a linewidth's grows with the delay. Vibration is the scatter
    of single scans, each as of a target at rest, that all else leaves. Empty where no scan could be
    read.
    """
    good = np.isfinite(ranging.target.distance)
    if not good.any():
        return Budget()
    several = _conditions(ranging, good)
    conditions = several[0]
    lines = _rms_of(tuple(predicted_budget(one) for one in several))
    bend = " and ".join(
        f"{np.median(ranging.table.bend_ghz[good & (ranging.table.rising == shape.rising)]):.3g}"
        for shape in ranging.shapes
    )
    straight = lines["nonlinearity"]
    lines["nonlinearity"] = dataclasses.replace(straight, note=f"rms {bend} GHz; {straight.note}")
    lines["motion"] = _motion(ranging, good)
    known = np.sqrt(sum(lines[name].stderr ** 2 for name in _KNOWN))
    scatter = float(np.median(ranging.target.scatter[good]))
    beyond = float(np.sqrt(max(scatter**2 - known**2, 0.0)))
    lines["vibration"] = BudgetLine("vibration", beyond, "scatter of single scans beyond the rest")
    relative = ranging.air_index.stderr / ranging.air_index.value if ranging.air_index.parts else 0
    note = "" if ranging.air_index.parts else "the state of the air is not given"
    lines["air"] = BudgetLine("air", conditions.distance_m * relative, note)
    scale = ranging.scale
    if np.isfinite(scale.stderr_s) and not conditions.counts:
        shared = conditions.distance_m * scale.stderr_s / scale.delay_s
        lines["cavity"] = BudgetLine("cavity", shared, "shared by all scans")
    elif not np.isfinite(scale.stderr_s):
        lines["cavity"] = BudgetLine("cavity", 0.0, "no cavity: the scale is as given")
    return Budget(lines.values())


_KNOWN = ("nonlinearity", "linewidth", "detector", "digitizer")


def _rms_of(budgets: tuple[tuple[BudgetLine, ...], ...]) -> dict[str, BudgetLine]:
    """Each line's root mean square over up- and down-scans."""
    out = {}
    for lines in zip(*budgets, strict=True):
        rms = float(np.sqrt(np.mean([line.stderr**2 for line in lines])))
        out[lines[0].source] = dataclasses.replace(lines[0], stderr=rms)
    return out


def _conditions(ranging: "Ranging", good: np.ndarray) -> list[Conditions]:
    """The conditions of the typical scan of each direction."""
    records, scale = ranging.records, ranging.scale
    first = records.records[0]
    seen, other = (measure_light(c) for c in (first.measurement, first.interferometer))
    unit = records.volts_per_code
    codes = first.measurement.dtype.kind == "i"
    step = unit if codes else 0.0
    distance = float(np.median(ranging.target.distance[good]))
    delay = 2.0 * distance * ranging.air_index.value / C
    # Phase noise a sample, of both: s^2 = noise^2 + 2 pi width delay.
    phase = [2.0 * (one.noise / max(one.amplitude, 1e-30)) ** 2 for one in (seen, other)]
    apart = scale.delay_s - delay
    width = max((phase[1] - phase[0]) / (2 * np.pi * apart), 0.0) if apart > 0 else 0.0
    white = max(phase[0] - 2 * np.pi * width * delay, 0.0) / 2.0 * (seen.amplitude * unit) ** 2
    noise = float(np.sqrt(max(white - step**2 / 12.0, 0.0)))
    comb = scale.comb_hz if np.isfinite(scale.comb_hz) else 0.0
    first_shape = ranging.shapes[0]
    typical = Conditions(
        time=first_shape.time,
        nu=first_shape.nu,
        margin=first_shape.margin,
        distance_m=distance,
        method=ranging.method,
        centre_hz=C / records.wavelength_m,
        sample_hz=records.sample_hz,
        step_v=step,
        noise_v=noise,
        amplitude_v=(seen.amplitude * unit, other.amplitude * unit),
        interferometer_s=scale.delay_s,
        linewidth_hz=width,
        spacing_hz=records.cavity_spacing_hz or 1.5e9,
        comb_hz=comb,
        scans=int(good.sum()),
    )
    return [
        dataclasses.replace(typical, time=one.time, nu=one.nu, margin=one.margin)
        for one in ranging.shapes
    ]


def _motion(ranging: "Ranging", good: np.ndarray) -> BudgetLine:
    if ranging.target.track is None:
        gain = float(np.median(np.abs(ranging.table.velocity_s[good])))
        note = f"{gain:.0f} um for each um/s; no filter ran, so the velocity is not known"
        return BudgetLine("motion", 0.0, note)
    return BudgetLine("motion", ranging.target.motion, "what the filter's velocity leaves")
