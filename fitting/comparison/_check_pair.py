"""Whether two recordings can be compared at all, and what to be careful of."""

from rapi_jax import DataError, Recording

Pair = tuple[Recording, Recording]


def check_pair(before: Recording, after: Recording) -> None:
    """Raise `DataError` for recordings that are not comparable.

    That is where units or the origin of the response differ, where no drive value is common, or
    where both are the same data.
    """
    for key, what in (("response_unit", "response"), ("drive_unit", "drive")):
        units = getattr(before, key), getattr(after, key)
        if units[0] != units[1]:
            raise DataError(
                f"`{key}` is {units[0]} before and {units[1]} after: the {what} was read or "
                "written in different units, so no parameter means the same. Convert one "
                "recording (its manifest and column) and compare again."
            )
    (low, high), (below, above) = drive_range(before), drive_range(after)
    if min(high, above) <= max(low, below):
        unit = before.drive_unit
        raise DataError(
            f"`drive` goes from {low:.4g} to {high:.4g} {unit} before and from {below:.4g} to "
            f"{above:.4g} {unit} after: no common range, so no response can be compared. Record "
            "once more over the range of the other, or check the unit and offset of the drive."
        )
    if before.sha256() == after.sha256():
        raise DataError(
            "`before` and `after` hold the same data, so nothing can have changed. Give two "
            "recordings."
        )


def drive_range(recording: Recording) -> tuple[float, float]:
    """The lowest and highest drive of all runs."""
    drives = recording.drives
    return min(d.value.min() for d in drives), max(d.value.max() for d in drives)


def cautions(before: Recording, after: Recording) -> list[str]:
    """Ways in which the sessions differ, so that a misfit of the model may look like a change."""
    notes = []
    unit = before.drive_unit
    rates = [{round(rate, 6) for rate in one.rates} for one in (before, after)]
    if rates[0] != rates[1]:
        notes.append(
            f"scan rates differ ({_list(before.rates)} Hz before, {_list(after.rates)} Hz after): "
            "an error of the model's rate law may look like a change. Record the same rates."
        )
    swings = [one.amplitudes for one in (before, after)]
    if _list(swings[0]) != _list(swings[1]):
        notes.append(
            f"swings differ ({_list(swings[0])} {unit} before, {_list(swings[1])} {unit} after): "
            "an error of the model's amplitude law may look like a change. Record the same swings."
        )
    if before.response_lag_s != after.response_lag_s:
        notes.append(
            f"`response_lag_s` differs ({before.response_lag_s:g} s before, "
            f"{after.response_lag_s:g} s after): each is taken out before the fit."
        )
    return notes


def _list(values: list[float]) -> str:
    return ", ".join(f"{value:.3g}" for value in values)
