"""An operator of the user's own, in one file, through the command line."""

import json

import pytest

from fitting.cli import app
from rapi_jax import DataError, ModelError
from rapi_jax.examples import paper_recording
from rapi_jax.io import read_model, write_recording

SOURCE = '''
from typing import Any, ClassVar

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from rapi_jax import AbstractOperator, RAPI, parameter
from rapi_jax.operators import Fields, Plays


class Uniform(AbstractOperator):
    """Symmetric plays of one weight, evenly spaced up to half the drive's range."""

    alpha: Float[Array, ""] = parameter(unit="1", positive=True)
    a: Float[Array, ""] = parameter(unit="{x}/{u}", positive=True)
    d: Float[Array, " order"] = parameter(unit="{x}/{u}^k", linear=True)
    d_0: Float[Array, ""] = parameter(unit="{x}", linear=True)
    count: int = eqx.field(static=True, kw_only=True)
    fields: ClassVar = Fields("d", "d_0")

    @classmethod
    def initial_guesses(cls, recording, *, plays=10, order=3, each=(), count=8):
        found = RAPI.initial_guesses(recording, plays=plays, order=order, each=each, count=count)
        return [cls(alpha=g.alpha, a=g.a, d=g.d, d_0=g.d_0, count=plays) for g in found]

    def plays(self, u_pp, freq):
        rank = jnp.arange(1.0, self.count + 1.0) / self.count
        one = jnp.ones_like(rank)
        return Plays(self.alpha * rank * u_pp / 2.0, one, one, self.a * one)
'''


def run(*arguments):
    return app([str(a) for a in arguments], exit_on_error=False, result_action="return_value")


def test_an_operator_is_one_file(tmp_path):
    recording = paper_recording(samples=400)[0]
    write_recording(recording, data := tmp_path / "data.nc")
    (plugin := tmp_path / "uniform.py").write_text(SOURCE)
    plug = ("--plugin", plugin)
    model = tmp_path / "model"
    options = ("--operator", "Uniform", "--starts", 2, "--plays", 6, "--no-plots")
    assert run("fit", data, "-o", model, *plug, *options) in (0, 4)
    assert json.loads((model / "model.json").read_text())["operator"] == "Uniform"
    with pytest.raises(DataError, match=r"Uniform is not one of this package.*operators=\(Uni"):
        read_model(model / "model.rapi")
    assert run("predict", model, data, "-o", tmp_path / "predicted", *plug, "--no-plots") == 0
    assert len(list((tmp_path / "predicted").glob("*.csv"))) == len(recording.runs)
    scan = ("--span", 5, "--frequency", 10, "--no-plots", "--samples", 512)
    out = tmp_path / "drives"
    got = run("compensate", model, *scan, "-o", out, *plug, *untrusted())
    assert got == 0 and (out / "drive_10Hz.csv").exists()


@pytest.mark.parametrize("name", ["Nothing", "AbstractOperator", "Plays"])
def test_an_operator_that_is_not_known_is_refused(tmp_path, name):
    with pytest.raises(ModelError, match=f"operator {name} is not known.*--plugin"):
        run("fit", tmp_path, "-o", tmp_path / "out", "--operator", name)


def untrusted():
    """`--untrusted`, where the command refuses models that are not trusted."""
    import inspect

    from fitting.commands.compensate.command import compensate

    return ("--untrusted",) if "untrusted" in inspect.signature(compensate).parameters else ()
