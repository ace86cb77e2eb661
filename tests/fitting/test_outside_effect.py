"""One file with an effect of one's own: diagnosed, named and predicted from the command line."""

import json

import pytest
from command_output import without_progress
from edge_worlds import NOISE, drives, record

from fitting.cli import app
from fitting.commands.run import run
from fitting.commands.shared._plugins import plugin_effects
from rapi_jax import effects
from rapi_jax.effects import AmplifierLowpass, Etalon
from rapi_jax.io import write_recording

EFFECT = r'''
"""A ripple over the drive's voltage, as a converter with a weak bit has."""

from typing import ClassVar

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from rapi_jax import parameter
from rapi_jax.effects import AbstractCouplingEffect, ResidualSummary


class DriveRipple(AbstractCouplingEffect):
    r"""$\nu + A \sin(2\pi u/P + \phi)$, $u$ the drive that is sent."""

    name: ClassVar[str] = "drive_ripple"
    label: ClassVar[str] = "a ripple over the voltage of the drive"
    remedy: ClassVar[str] = "Replace the converter."
    steady: ClassVar[bool] = True
    amplitude: Float[Array, ""] = parameter(unit="{x}", default=0.0)  # A
    period: Float[Array, ""] = parameter(unit="{u}", default=1.0, positive=True)  # P
    phase: Float[Array, ""] = parameter(unit="rad", default=0.0)  # phi

    def __call__(self, t, nu, u):
        return nu + self.amplitude * jnp.sin(2.0 * jnp.pi * u / self.period + self.phase)

    @classmethod
    def initial_guesses(cls, summary: ResidualSummary) -> "list[DriveRipple]":
        cycles = np.arange(1.0, 20.0, 0.1)
        best = cycles[np.argmax(summary.sines(summary.drive, cycles))]
        amplitude = max(float(np.std(summary.residual)), summary.noise)
        return [
            cls.at(amplitude=amplitude, period=1.0 / best, phase=phase)
            for phase in np.arange(4) * np.pi / 2
        ]
'''
LABEL = "a ripple over the voltage of the drive"


@pytest.fixture
def world(tmp_path, monkeypatch):
    """The file, and a recording of a device that has the effect; two candidates beside it."""
    monkeypatch.setattr(effects, "ALL", (AmplifierLowpass, Etalon))
    file = tmp_path / "drive_ripple.py"
    file.write_text(EFFECT)
    (ripple,) = plugin_effects([file])
    truth = ripple(amplitude=0.3, period=0.31, phase=0.4)
    write_recording(record(drives(), truth), tmp_path / "recording")
    return file, tmp_path / "recording"


def test_an_effect_from_a_file_is_named_explained_and_predicts(world, tmp_path, capfd):
    file, recording = world

    def rapi(*arguments: object) -> tuple[int, str, str]:
        capfd.readouterr()
        code = run(app, list(map(str, arguments)))
        out, err = capfd.readouterr()
        return code, " ".join(out.split()), err

    given = (recording, "--plugin", file, "--no-scan", "-o", tmp_path / "out")
    code, out, err = rapi("diagnose", *given)
    assert (code, without_progress(err)) == (0, "")
    found = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert found["verdict"]["name"] == "drive_ripple"
    assert found["model"]["effects"] == ["DriveRipple"]
    amplitude = next(h for h in found["hypotheses"] if h["name"] == "drive_ripple")["parameters"]
    assert abs(amplitude["amplitude"]["value"]) == pytest.approx(0.3, rel=0.05)
    assert f"The gap is {LABEL}" in out and "Replace the converter." in out
    assert LABEL.capitalize() in (tmp_path / "out" / "report.html").read_text()

    given = (tmp_path / "out", recording, "--no-plots", "--json", "-o", tmp_path / "predicted")
    code, out, err = rapi("predict", *given, "--plugin", file)
    assert (code, err) == (0, "")
    assert all(one["rmse"] == pytest.approx(NOISE, rel=0.2) for one in json.loads(out)["runs"])
    code, out, err = rapi("predict", *given)
    assert code == 3 and "rapi.error/1" in out and "DriveRipple" in err and "--plugin" in err
