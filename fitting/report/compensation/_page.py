"""The page of drives that were made: scans, drives, certificate, what to expect of the device."""

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from fitting._units import readable_unit, significant
from fitting.report._pages import PagePicture
from fitting.report._result_page import Section, list_versions, render_result
from fitting.report.diagnosis._numbers import format_number

PAGE = "drives.html"
PART = "the middle 80 % of each branch"
_ROUNDING = 1e-12  # of the span
# Of each limit in the file: its name, and its unit where the drive is in `{u}`.
_LIMITS = {
    "low_v": ("lowest drive", "{u}"),
    "high_v": ("highest drive", "{u}"),
    "slew_v_per_s": ("steepest slope", "{u}/s"),
    "step_v": ("largest step between samples", "{u}"),
    "max_frequency_hz": ("highest scan rate", "Hz"),
}


def render_page(report: dict[str, Any], picture: PagePicture, *, folder: Path | None = None) -> str:
    """The content of `certificate.json` as one page, with a picture of scans and drives.

    `folder`: where the drives are, for the command that the page advises.
    """
    drives, unit, volts = report["drives"], report["unit"], report["drive_unit"]
    rates = ", ".join(f"{one['excitation_hz']:g}" for one in drives)
    expected = report["expected"]
    return render_result(
        title="Drives",
        headline=f"Drives for straight scans of {drives[0]['span']:g} {unit} at {rates} Hz.",
        advice=_advice(expected, folder),
        cautions=report["notes"],
        facts=[
            ("Inverse", drives[0]["inverse"]),
            ("Expected", describe_expected(report)),
            *([("Left out", ", ".join(report["left_out"]))] if report["left_out"] else []),
            ("Limits", "from a file" if report["limits_from"] == "file" else "as identified"),
        ],
        sections=[
            Section(
                "Scans and drives",
                "From the top: the scan asked for, the drive for it, how far the drive is from one "
                "that is as straight as the scan"
                + (", how far it is from the slowest." if len(drives) > 1 else "."),
                picture,
            ),
            Section(
                "Each drive",
                "The smallest slope of the response over every history of drives within the range "
                "is positive, so the model can be inverted there. The nonlinearity is what the "
                "model itself leaves of a straight line, not what the device will.",
                heads=(
                    "rate", f"drive ({volts})", f"steepest ({volts}/s)",
                    f"smallest slope ({unit}/{volts})", "nonlinearity up, down", "file",
                ),
                rows=[_row(one, unit, volts) for one in drives],
            ),
            Section(
                "Limits that were kept",
                heads=("limit", "value"),
                rows=[
                    (name, f"{report['limits'][key]:.6g} {per.format(u=volts)}")
                    for key, (name, per) in _LIMITS.items()
                    if key in report["limits"]
                ],
            ),
        ],
        provenance=[
            ("Versions", list_versions(report["versions"])),
            ("Format", report["schema"]),
            ("Data, SHA-256", str(report["data_sha256"])),
        ],
    )  # fmt: skip


def _advice(expected: dict[str, Any] | None, folder: Path | None) -> str:
    play = "Run them on the bench (`rapi measure`)"
    place = "THIS-FOLDER" if folder is None else shlex.quote(str(folder))
    check = f"`rapi fit NEW-SCANS --check {place}`"
    if expected is None:
        return (
            f"{play}, then let {check} measure how straight the new scans are and how far they "
            "reach. There is no claim to compare them with."
        )
    return f"{play}, then compare the new scans with this certificate: {check}."


def describe_expected(report: dict[str, Any]) -> str:
    """What is claimed of how straight the device will scan: in which part, and at which swings."""
    expected, volts = report["expected"], report["drive_unit"]
    if expected is None:
        return f"nothing is claimed: {report['unclaimed']}."
    name, factor = _error_unit(report["drives"][0]["span"], expected["unit"])
    high = f"{significant(factor * expected['high'], 3)} {name}"
    text = f"at most {high} rms off a straight line in {expected['part']} (97.5 %), from runs "
    if not expected["swings_beside"]:
        return f"{text}that were left out."
    return (
        f"{text}with swings of {_ends(expected['swings'])} {volts} that were left out. Of a drive "
        f"that swings by {_ends(expected['swings_beside'])} {volts}, as here, it is not tested."
    )


def _error_unit(span: float, unit: str) -> tuple[str, float]:
    """The unit of errors of a scan, that in which a thousandth of it reads best, and the factor."""
    return readable_unit(unit, (span / 1000.0,))


def _ends(values: Sequence[float]) -> str:
    low, high = f"{min(values):.3g}", f"{max(values):.3g}"
    return low if low == high else f"{low} to {high}"


def _row(one: dict[str, Any], unit: str, volts: str) -> tuple[str, ...]:
    slope = one["certificate"]
    bent = [one["nonlinearity"][side] for side in ("up", "down")]
    name, factor = _error_unit(one["span"], unit)
    none = "0, to rounding"
    texts = [none if x < _ROUNDING * one["span"] else format_number(factor * x) for x in bent]
    return (
        f"{one['excitation_hz']:g} Hz",
        f"{one['drive_min']:.4g} to {one['drive_max']:.4g}",
        f"{float(format(one['slew_max'], '.4g')):.10g}",  # not as a power of ten
        f"{slope['slope_min']:.4g} at {slope['slope_at']:.4g} {volts}",
        none if texts == [none, none] else f"{'; '.join(texts)} {name}",
        one["file"],
    )
