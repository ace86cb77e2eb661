"""Limits of a drive: of a file, of what was identified, at a generator."""

from ._mutation import Mutation

_DRIVE = "tests/rapi_jax/test_limits.py"
_FILES = "tests/rapi_jax/io/test_drive_files.py"
_SEEN = "tests/rapi_jax/inversion/test_identified.py"
_WAVES = "tests/hardware/generator/test_afg_waveforms.py"
_LEVELS = "tests/hardware/generator/test_afg_levels.py"

LIMITS = (
    Mutation(
        "DriveLimits: the first step is not looked at",
        "rapi_jax/_limits.py",
        "        step = np.diff(value)\n",
        "        step = np.diff(value)[1:]\n",
        _DRIVE,
    ),
    Mutation(
        "DriveLimits: nothing is too low",
        "rapi_jax/_limits.py",
        '            (value < self.low_v - slack, "low_v", self.low_v),\n',
        "",
        _DRIVE,
    ),
    Mutation(
        "DriveLimits: nothing is too high",
        "rapi_jax/_limits.py",
        '            (value > self.high_v + slack, "high_v", self.high_v),\n',
        "",
        _DRIVE,
    ),
    Mutation(
        "DriveLimits: a thousandth of the range beyond is let through",
        "rapi_jax/_limits.py",
        "THRESHOLDS.limit_rounding * (self.high_v - self.low_v)",
        "1e-3 * (self.high_v - self.low_v)",
        _DRIVE,
    ),
    Mutation(
        "DriveLimits: steps down are not looked at",
        "rapi_jax/_limits.py",
        "self._check_steps(np.abs(step), drive.step_s",
        "self._check_steps(step, drive.step_s",
        _DRIVE,
    ),
    Mutation(
        "DriveLimits: the step that closes the period is not looked at",
        "rapi_jax/_limits.py",
        "        if drive.repeats:\n",
        "        if False:\n",
        _DRIVE,
    ),
    Mutation(
        "DriveLimits: the slope of a step is taken for its size",
        "rapi_jax/_limits.py",
        "(self.slew_v_per_s * step_s, ",
        "(self.slew_v_per_s, ",
        _DRIVE,
    ),
    Mutation(
        "DriveLimits: a tenth above the highest rate",
        "rapi_jax/_limits.py",
        "self.max_frequency_hz * (1 + THRESHOLDS.limit_rounding)",
        "self.max_frequency_hz * 1.1",
        _DRIVE,
    ),
    Mutation(
        "DriveLimits: limits that are no number",
        "rapi_jax/_limits.py",
        "if not getattr(self, name) > 0:",
        "if getattr(self, name) <= 0:",
        _DRIVE,
    ),
    Mutation(
        "DriveLimits: a record that ends within a period closes at its first sample",
        "rapi_jax/_limits.py",
        "np.interp(at, drive.time, drive.value)",
        "drive.value[0]",
        _DRIVE,
    ),
    Mutation(
        "limits file: a misspelt key is left out",
        "rapi_jax/io/drives/_limits_file.py",
        'extra="forbid"',
        'extra="ignore"',
        _FILES,
    ),
    Mutation(
        "limits file: `true` and a text are numbers",
        "rapi_jax/io/drives/_limits_file.py",
        "strict=True",
        "strict=False",
        _FILES,
    ),
    Mutation(
        "limits file: an endless slope",
        "rapi_jax/io/drives/_limits_file.py",
        "slew_v_per_s: float = Field(gt=0, allow_inf_nan=False)",
        "slew_v_per_s: float = Field(gt=0)",
        _FILES,
    ),
    Mutation(
        "identified: beyond both ends, not one",
        "rapi_jax/inversion/_identified.py",
        "low < limits.low_v or high > limits.high_v",
        "low < limits.low_v and high > limits.high_v",
        _SEEN,
    ),
    Mutation(
        "identified: twice the fastest rate is inside",
        "rapi_jax/inversion/_identified.py",
        "<= rate <= 1.05 * fast",
        "<= rate <= 2.1 * fast",
        _SEEN,
    ),
    Mutation(
        "identified: any rate where none was recorded",
        "rapi_jax/inversion/_identified.py",
        "rate > 0 and not self.rates_hz",
        "False",
        _SEEN,
    ),
    Mutation(
        "generator: a period is not held against the limits",
        "hardware/generator/_check.py",
        '    limits.check(Drive(time, played, frequency_hz, "multisine"))\n',
        "",
        _WAVES,
    ),
    Mutation(
        "generator: codes may fall as fast as they like",
        "hardware/generator/_check.py",
        "    allowed = np.minimum(ahead, behind)[",
        "    allowed = ahead[",
        _WAVES,
    ),
    Mutation(
        "generator: levels rounded outward, beyond the limits",
        "hardware/generator/_levels.py",
        "    low = max(floor_level(low_v), limits.low_v)\n    high = min(",
        "    low = floor_level(low_v)\n    high = min(",
        _LEVELS,
    ),
    Mutation(
        "generator: limits rounded outward",
        "hardware/generator/_levels.py",
        "ceil_level(limits.low_v), floor_level(limits.high_v)",
        "floor_level(limits.low_v), ceil_level(limits.high_v)",
        _LEVELS,
    ),
    Mutation(
        "generator: levels set by way of a pair that is not legal",
        "hardware/generator/_levels.py",
        "    if low_first >= legal and (low_first",
        "    if (low_first",
        _LEVELS,
    ),
    Mutation(
        "generator: an endless slope is a limit",
        "hardware/generator/_levels.py",
        '    for name in ("slew_v_per_s", "step_v", "max_frequency_hz"):\n        if math.isinf',
        '    for name in ("step_v", "max_frequency_hz"):\n        if math.isinf',
        _LEVELS,
    ),
)
