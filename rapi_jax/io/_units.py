"""Units that files may have, what they become, and whether the numbers can be in them."""

import numpy as np

from rapi_jax._errors import DataError
from rapi_jax.recording._recording import Recording
from rapi_jax.recording._run import Run

# unit in the file -> unit in the program, divisor
DRIVE_UNITS = {
    "V": ("V", 1.0),
    "mV": ("V", 1e3),
    "um": ("um", 1.0),
    "mA": ("mA", 1.0),
    "mT": ("mT", 1.0),
    "mrad": ("mrad", 1.0),
    "mN": ("mN", 1.0),
}
RESPONSE_UNITS = {
    "GHz": ("GHz", 1.0),
    "MHz": ("GHz", 1e3),
    "Hz": ("GHz", 1e9),
    "um": ("um", 1.0),
    "nm": ("nm", 1.0),
    "V": ("V", 1.0),
    "uC": ("uC", 1.0),
    "mrad": ("mrad", 1.0),
    "mN": ("mN", 1.0),
    "mA": ("mA", 1.0),
    "mT": ("mT", 1.0),
    "uC/cm2": ("uC/cm2", 1.0),
}

_DRIVE_SPAN = (1e-4, 300.0)  # V
_RESPONSE_SPAN = (1e-4, 2e4)  # GHz
_SLOPE = (0.01, 2000.0)  # GHz/V
_LOOSE = (1e-9, 1e9)
UNITS_CHECKED = "units_checked"  # of a provenance: "true" where the units stand as they are
_OVERRULE = (
    "A manifest has `response_unit` and `drive_unit`, `rapi import` --response-unit and "
    f"--drive-unit. If the units are right all the same, say so: `{UNITS_CHECKED} = true` in the "
    "manifest, or `rapi import --units-checked`."
)
_LONGEST = 1e9  # s
# s from the session's zero: Unix time is 2e9, and there a float64 still tells microseconds apart.
_LATEST = 1e10


def _lookup(table: dict[str, tuple[str, float]], key: str, unit: str) -> tuple[str, float]:
    if unit not in table:
        allowed = ", ".join(table)
        raise DataError(f"`{key}` must be one of {allowed}, not {ascii(unit)[:50]}.")
    return table[unit]


def drive_unit(unit: str) -> tuple[str, float]:
    """The unit that drives in `unit` are converted to, and the divisor that does it."""
    return _lookup(DRIVE_UNITS, "drive_unit", unit)


def response_unit(unit: str) -> tuple[str, float]:
    """The unit that responses in `unit` are converted to, and the divisor that does it."""
    return _lookup(RESPONSE_UNITS, "response_unit", unit)


def convert(values: np.ndarray, divisor: float) -> np.ndarray:
    """`values` over `divisor`, as they are where it is 1."""
    return values if divisor == 1.0 else values / divisor


def check_plausible(recording: Recording) -> None:
    """Refuse numbers that cannot be in the stated units, such as mV called V.

    A drive or response that is constant passes: that is no matter of units. So does any that is
    confirmed: a laser of 5 MHz/V is one of 5 GHz/V whose GHz were called MHz, by its numbers. The
    provenance says so by `units_checked`, "true". Raises `DataError` naming the run and the likely
    slip.

    >>> from rapi_jax import DataError
    >>> from rapi_jax.io import check_plausible
    >>> from rapi_jax import Recording, predict, triangle
    >>> from rapi_jax.examples import paper_device
    >>> drives = triangle([10.0, 20.0], amplitude=4.5, bias=3.0, samples=100)
    >>> recording = Recording.of(drives, [predict(paper_device(), drive) for drive in drives])
    >>> wrong = Recording.of(drives, [1e3 * run.response for run in recording.runs])  # MHz
    >>> try:
    ...     check_plausible(wrong)
    ... except DataError as error:
    ...     print(str(error).split("; ")[1].split(". ")[0])
    it is likely in MHz: say response_unit = "MHz"
    """
    drive_unit(recording.drive_unit)
    response_unit(recording.response_unit)
    confirmed = _are_confirmed(recording)
    optical = (recording.drive_unit, recording.response_unit) == ("V", "GHz")
    for run in recording.runs:
        with np.errstate(over="ignore"):  # an infinite span is refused like a large one
            slip = _optical_slip(run) if optical else _loose_slip(recording, run)
        if slip and not confirmed:
            raise DataError(f"run '{run.name}': {slip} {_OVERRULE}")
        if run.drive.time[-1] > _LONGEST:
            raise DataError(
                f"run '{run.name}': `time_s` ends at {run.drive.time[-1]:.3g} s. Check its unit, "
                "and that the file is not damaged."
            )
        if abs(run.drive.start_s) > _LATEST:
            raise DataError(
                f"run '{run.name}': `start_s` is {run.drive.start_s:.3g} s, beyond {_LATEST:g} s, "
                "where times cannot be told apart finely enough. Give it in s, not in ms or ns, "
                "from the start of the session."
            )


def _are_confirmed(recording: Recording) -> bool:
    """Whether the recording says that its units are right, however unlikely they look."""
    said = recording.provenance.get(UNITS_CHECKED, "false").lower()
    if said not in ("true", "false"):
        raise DataError(f"`{UNITS_CHECKED}` must be true or false, but is {ascii(said)[:40]}.")
    return said == "true"


def _spans(run: Run) -> tuple[float, float]:
    reading = run.response[run.valid]
    return run.drive.u_pp, float(np.ptp(reading)) if reading.size else 0.0


def _optical_slip(run: Run) -> str | None:
    drive, response = _spans(run)
    if drive > _DRIVE_SPAN[1]:
        return _say("drive", drive, "V", _DRIVE_SPAN, 'it is likely in mV: say drive_unit = "mV"')
    if 0 < drive < _DRIVE_SPAN[0]:
        return _say("drive", drive, "V", _DRIVE_SPAN, 'V was likely called mV: say "V"')
    if response > _RESPONSE_SPAN[1]:
        unit = "Hz" if response > 1e3 * _RESPONSE_SPAN[1] else "MHz"
        cure = f'it is likely in {unit}: say response_unit = "{unit}"'
        return _say("response", response, "GHz", _RESPONSE_SPAN, cure)
    if 0 < response < _RESPONSE_SPAN[0]:
        cure = 'GHz was likely called MHz or Hz: say response_unit = "GHz"'
        return _say("response", response, "GHz", _RESPONSE_SPAN, cure)
    if drive == 0 or response == 0:
        return None
    slope = response / drive
    if slope > _SLOPE[1]:
        cure = "either V was called mV, or the response is in MHz or Hz: check both units"
        return _say("response over drive", slope, "GHz/V", _SLOPE, cure)
    if slope < _SLOPE[0]:
        cure = "either the drive is in mV, or GHz was called MHz or Hz: check both units"
        return _say("response over drive", slope, "GHz/V", _SLOPE, cure)
    return None


def _loose_slip(recording: Recording, run: Run) -> str | None:
    units = (recording.drive_unit, recording.response_unit)
    for what, span, unit in zip(("drive", "response"), _spans(run), units, strict=True):
        if span != 0 and not _LOOSE[0] <= span <= _LOOSE[1]:
            return _say(what, span, unit, _LOOSE, "check the unit")
    return None


def _say(what: str, span: float, unit: str, limits: tuple[float, float], cure: str) -> str:
    low, high = limits
    return f"the {what} spans {span:.3g} {unit}, outside {low:g} to {high:g} {unit}; {cure}."
