"""Limits of a bench's drives: behind the amplifier, ahead of it, and of the generator's driver."""

from collections.abc import Sequence

from hardware.generator._base import AbstractOutput
from rapi_jax import Drive, DriveLimits, LimitError

from ._base import amplify, check_drives
from ._file import BenchFile


def check_against_bench(drives: Drive | Sequence[Drive], file: BenchFile) -> tuple[Drive, ...]:
    """The drives, if all may be played; `LimitError` or `DataError` otherwise.

    >>> from pathlib import Path
    >>> from hardware import check_against_bench, read_bench
    >>> from hardware.simulated import bench_toml
    >>> from rapi_jax import LimitError, triangle
    >>> at = {"generator": "GEN", "laser": "LAS", "digitizer": "DIG"}  # VISA addresses
    >>> _ = Path("bench.toml").write_text(bench_toml(at, delay_s=24.5e-9))
    >>> file = read_bench("bench.toml")
    >>> good, fast = triangle([10.0, 400.0], amplitude=4.5, bias=3.0, samples=1000)
    >>> len(check_against_bench(good, file))
    1
    >>> try:
    ...     check_against_bench(fast, file)
    ... except LimitError as error:
    ...     print("refused")
    refused
    """
    several = (drives,) if isinstance(drives, Drive) else tuple(drives)
    amplifier = file.amplifier
    behind = [amplify(d, gain=amplifier.gain, offset_v=amplifier.offset_v) for d in several]
    check_drives(behind, file.limits.of())
    return several


def refuse_wider(output: AbstractOutput, asked: DriveLimits, load_ohm: float) -> None:
    """Refuse an output whose driver has wider limits, or another load, than it was given."""
    got = output.limits
    within = got.low_v >= asked.low_v and got.high_v <= asked.high_v
    for name in ("slew_v_per_s", "step_v", "max_frequency_hz"):
        within &= getattr(got, name) <= getattr(asked, name)
    if not within:
        raise LimitError(
            f"The generator's driver has wider limits, {got}, than the bench: {asked}."
        )
    if output.load_ohm != load_ohm:
        raise LimitError(
            f"The generator's driver reckons with {output.load_ohm:g} ohm, but the load is "
            f"{load_ohm:g} ohm: its voltages would be others than the limits are for."
        )


def limits_before_amplifier(limits: DriveLimits, file: BenchFile) -> DriveLimits:
    """The same limits for the generator's output, ahead of the amplifier."""
    gain, offset = file.amplifier.gain, file.amplifier.offset_v
    ends = sorted(((limits.low_v - offset) / gain, (limits.high_v - offset) / gain))
    return DriveLimits(
        *ends,
        slew_v_per_s=limits.slew_v_per_s / abs(gain),
        step_v=limits.step_v / abs(gain),
        max_frequency_hz=limits.max_frequency_hz,
    )
