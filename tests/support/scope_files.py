"""Traces as the makers of oscilloscopes write them: layouts of their public manuals and examples.

Each writer takes times (s), two channels (V) and returns text; columns are named in `MAKERS`.
"""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from rapi_jax import Drive, Recording, predict
from rapi_jax.examples import paper_device
from rapi_jax.io import ImportOptions, import_recording

Writer = Callable[[np.ndarray, np.ndarray, np.ndarray], str]


def rows(*columns, separator=",", decimal=".", digits=9, end="") -> str:
    """Rows of numbers in exponent notation."""
    lines = [
        separator.join(f"{x:.{digits}e}".replace(".", decimal) for x in row) + end
        for row in zip(*(np.asarray(c).tolist() for c in columns), strict=True)
    ]
    return "\n".join(lines) + "\n"


def tektronix(t, u, y) -> str:
    """MDO and MSO series: a preamble, then TIME and channels."""
    head = [
        "Model,MDO3024", "Firmware Version,1.30", "", "Waveform Type,ANALOG", "Point Format,Y",
        "Horizontal Units,s", f"Sample Interval,{t[1] - t[0]:.6e}", f"Record Length,{t.size}",
        "Vertical Units,V,V", "Label,,", "", "TIME,CH1,CH2",
    ]  # fmt: skip
    return "\n".join(head) + "\n" + rows(t, u, y)


def tektronix_beside(t, y) -> str:
    """TDS series, a file a channel: the preamble stands beside the first rows."""
    about = [
        ("Record Length", f"{t.size:.6e}"), ("Sample Interval", f"{t[1] - t[0]:.6e}"),
        ("Trigger Point", "1.0e+03"), ("", ""), ("", ""), ("", ""), ("Source", "CH1"),
        ("Vertical Units", "V"), ("Vertical Scale", "1.0e+00"), ("Vertical Offset", "0.0"),
        ("Horizontal Units", "s"), ("Horizontal Scale", "1.0e-02"), ("Pt Fmt", "Y"),
    ]  # fmt: skip
    about += [("", "")] * (t.size - len(about))
    return "".join(
        f"{key},{value},,{a:.12f},{b:.9f},\n"
        for (key, value), a, b in zip(about, t.tolist(), y.tolist(), strict=True)
    )


def keysight(t, u, y) -> str:
    """InfiniiVision: x-axis and channel numbers, then units."""
    return "x-axis,1,2\nsecond,Volt,Volt\n" + rows(t, u, y)


def rigol(t, u, y) -> str:
    """DS1000Z: samples are counted; start and increment stand in the header alone."""
    head = f"X,CH1,CH2,Start,Increment,\nSequence,Volt,Volt,{t[0]:.6e},{t[1] - t[0]:.9e}\n"
    pairs = zip(u.tolist(), y.tolist(), strict=True)
    return head + "".join(f"{k},{a:.9e},{b:.9e},\n" for k, (a, b) in enumerate(pairs))


def rigol_newer(t, u, y) -> str:
    """MSO5000: no times at all."""
    head = f"CH1(V),CH2(V),t0 = {t[0]:.6e}s, tInc = {t[1] - t[0]:.9e},\n"
    return head + rows(u, y, end=",")


def siglent(t, u, y) -> str:
    """SDS series."""
    head = [
        f"Record Length,Analog:{t.size}", f"Sample Interval,Analog:{t[1] - t[0]:.9e}",
        "Vertical Units,CH1:V,CH2:V", "Vertical Scale,CH1:1.00,CH2:0.50",
        "Vertical Offset,CH1:0.00,CH2:0.00", "Horizontal Units,s", "Horizontal Scale,0.02",
        "Model Number,SDS2104X", "Software Version,1.2", "Source,CH1,CH2", "Second,Value,Value",
    ]  # fmt: skip
    return "\n".join(head) + "\n" + rows(t, u, y)


def rohde_schwarz(t, u, y) -> str:
    """RTB and RTM."""
    return "in s,C1 in V,C2 in V\n" + rows(t, u, y)


def picoscope(t, u, y) -> str:
    """PicoScope: units in brackets, a blank line."""
    return "Time,Channel A,Channel B\n(ms),(V),(mV)\n\n" + rows(1e3 * t, u, 1e3 * y)


def picoscope_german(t, u, y) -> str:
    """The same where the computer writes decimal commas."""
    head = "Zeit;Kanal A;Kanal B\n(ms);(V);(mV)\n\n"
    return head + rows(1e3 * t, u, 1e3 * y, separator=";", decimal=",")


MAKERS: dict[str, tuple[Writer, str, str]] = {
    "Tektronix": (tektronix, "CH1", "CH2"),
    "Keysight": (keysight, "1", "2"),
    "Rigol DS1000Z": (rigol, "CH1", "CH2"),
    "Rigol MSO5000": (rigol_newer, "CH1", "CH2"),
    "Siglent": (siglent, "CH1", "CH2"),
    "Rohde & Schwarz": (rohde_schwarz, "C1", "C2"),
    "PicoScope": (picoscope, "Channel A", "Channel B"),
    "PicoScope, decimal commas": (picoscope_german, "Kanal A", "Kanal B"),
}


def scanned(
    *parts: tuple[float, float, float],
    sample_hz: float = 20e3,
    bias: float = 3.0,
    noise: float = 0.02,
    seed: int = 0,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Time (s), drive (V) and response (GHz) of the paper's device, in one record.

    `parts`: rate (Hz), periods and swing (V) of each stretch, one after the other.
    """
    rng = np.random.default_rng(seed)
    drives, readings = [], []
    for rate, periods, swing in parts:
        cycles = np.arange(round(periods * sample_hz / rate)) * rate / sample_hz
        value = bias + swing / 2.0 * (1.0 - 2.0 * np.abs(1.0 - 2.0 * np.mod(cycles, 1.0)))
        drive = Drive(cycles / rate, value, rate, "triangle")
        drives.append(value)
        readings.append(np.asarray(predict(paper_device(), drive)))
    u, y = np.concatenate(drives), np.concatenate(readings)
    return np.arange(u.size) / sample_hz, u, y + noise * rng.standard_normal(u.size)


def put(path: Path, content: str, encoding: str = "utf-8") -> Path:
    """Write text to a file, and say where."""
    path.write_bytes(content.encode(encoding))
    return path


def joined(recording: Recording) -> tuple[np.ndarray, np.ndarray]:
    """Drive and response of all runs, one after the other."""
    return (
        np.concatenate([run.drive.value for run in recording.runs]),
        np.concatenate([run.response for run in recording.runs]),
    )


# Three scans of the paper's device, as `rapi import` is given them.
T, U, Y = scanned((10.0, 3, 4.5), (20.0, 3, 4.5), (40.0, 3, 4.5), sample_hz=8000.0)
SCOPE = ("--drive", "CH1", "--response", "CH2", "--response-scale", "1", "--response-unit", "GHz")


def scope(folder: Path, t=T, u=U, y=Y, maker: str = "Tektronix") -> Path:
    """A file of a maker."""
    return put(folder / "scope.csv", MAKERS[maker][0](t, u, y))


VOLT_TO_GHZ = ImportOptions(drive_unit="V", response_unit="GHz")


def taken(folder, t, u, y, **more):
    """What is made of these columns."""
    np.savez(folder / "a.npz", time=t, drive=u, response=y)
    return import_recording(folder / "a.npz", replace(VOLT_TO_GHZ, **more))


def said(imported) -> str:
    """All notes."""
    return " | ".join(imported.notes)
