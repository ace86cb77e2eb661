"""Options of `rapi import` that contradict each other, or say half; the drive that some make."""

from typing import TYPE_CHECKING, Literal

from cyclopts import CycloptsError

if TYPE_CHECKING:
    from rapi_jax.io import MadeDrive


def check_drive_and_skips(
    drive_as: str, drive_amplitude: float | None, skip_periods: int, skip_seconds: float
) -> None:
    """Refuse a drive that was recorded and was not, and two ways to leave out the beginning."""
    if drive_as != "measured" and drive_amplitude is not None:
        refuse(
            "--drive-as is for a drive that was recorded, and --drive-amplitude makes one that was "
            "not. Give one of the two."
        )
    if skip_periods and skip_seconds:
        refuse("--skip-periods and --skip-seconds say the same in two units. Give one of them.")


def check_fringes(
    fringes: str | None,
    interferometer: str | None,
    response: str | None,
    response_unit: str | None,
    response_scale: float,
    cavity: str | None,
    cavity_spacing: str | None,
) -> None:
    """Refuse a response beside fringes, and a cavity without them."""
    if fringes is not None or interferometer is not None:
        of_response = response is not None or response_unit not in (None, "GHz")
        if of_response or abs(response_scale) != 1.0:
            refuse(
                "with --fringes the response is the optical frequency in GHz that is read from "
                "them. Leave out --response; --response-unit can only be GHz, and --response-scale "
                "only 1 or -1."
            )
    elif cavity is not None or cavity_spacing is not None:
        refuse(
            "--cavity and --cavity-spacing are used only with fringes. Give --fringes and "
            "--interferometer, too, or leave them out."
        )


def made_drive(
    amplitude: float | None,
    offset: float,
    rate: float | None,
    phase: float,
    waveform: Literal["triangle", "sine"],
    *,
    column: bool,
) -> "MadeDrive | None":
    """The drive that was sent but not recorded; `None` where the options describe none."""
    if amplitude is None and rate is None:
        if offset or phase:
            refuse(
                "--drive-offset and --drive-phase describe a drive that was not recorded. Give its "
                "--drive-amplitude and --drive-rate, too."
            )
        return None
    if amplitude is None or rate is None:
        refuse(
            "a drive that was not recorded is made from its amplitude and its rate. Give both "
            "--drive-amplitude and --drive-rate."
        )
        return None
    if column:
        refuse(
            "give either a column of the drive, or --drive-amplitude and --drive-rate of one that "
            "was not recorded."
        )
    from rapi_jax.io import MadeDrive

    return MadeDrive(amplitude, rate, offset, phase, waveform)


def refuse(message: str) -> None:
    raise CycloptsError(msg=message, command_chain=("import",))
