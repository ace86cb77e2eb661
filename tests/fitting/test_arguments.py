"""What is given in place of what is wanted is named, with the way from the one to the other."""

import inspect
from collections.abc import Callable
from pathlib import Path
from typing import get_args, get_origin

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest

import fitting
import rapi_jax
from fitting import compare, diagnose, fit, fit_many, identify, prediction_band
from rapi_jax import (
    ECDL,
    Drive,
    Identified,
    Recording,
    Run,
    Target,
    certify,
    compensate,
    exact_inverse,
    linear_scan,
    linearity,
    predict,
    triangle,
)
from rapi_jax.examples import paper_device, paper_recording
from rapi_jax.io import Imported, write_drive, write_recording

RECORDING, _ = paper_recording(samples=100)
DEVICE = paper_device()
DRIVE = RECORDING.runs[0].drive
SCANS = linear_scan(20.0, span=45.0, samples=64)


class FitResult:
    """Of the name alone: a real one takes a fit."""


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (
            lambda: identify("rec-plain"),
            "Argument `recording` must be a Recording, but is a str ('rec-plain'). Read it first: "
            "`rapi_jax.io.read_recording(path)`.",
        ),
        (lambda: fit(DEVICE, Path("rec-plain")), "Path ('rec-plain'). Read it first"),
        (
            lambda: identify(Imported(RECORDING, ())),
            "but is an Imported. Give the recording in it: `imported.recording`.",
        ),
        (
            lambda: predict(DEVICE, RECORDING),
            "Argument `drive` must be a Drive, but is a Recording. Give the drive of a run: "
            "`recording.runs[0].drive`.",
        ),
        (
            lambda: predict(FitResult(), DRIVE),
            "Argument `ecdl` must be an ECDL, but is a FitResult. Give the model in it: "
            "`result.ecdl`.",
        ),
        (
            lambda: compensate(DEVICE, SCANS, bias=3.0),
            "Argument `target` must be a Target, but is a tuple of 1 Target. `linear_scan` gives a "
            "target for each rate: `(target,) = linear_scan(...)`.",
        ),
        (
            lambda: compensate(DEVICE, SCANS[0], identified=RECORDING),
            "`identified` must be an Identified or None, but is a Recording. Give its range: "
            "`Identified.of(recording)`.",
        ),
        (lambda: compensate(DEVICE, SCANS[0], limits="limits.toml"), "`rapi_jax.io.read_limits("),
        (lambda: compare(RECORDING, "after"), "Argument `after` must be a Recording, but is a str"),
        (
            lambda: diagnose(RECORDING, DEVICE),
            "Argument `ecdl` must be an ECDL or None, but is a",
        ),
        (lambda: diagnose(DEVICE.operator, RECORDING), "`ECDL(operator)`"),
        (
            lambda: fit_many(DEVICE, RECORDING),
            "`recordings` must be a list of Recording, but is a Recording. Give a list",
        ),
        (lambda: fit_many(DEVICE, ["a", "b"]), "`recordings[0]` must be a Recording, but is a str"),
        (lambda: prediction_band(DEVICE, DRIVE), "be a FitResult or a ModelDraws, but is an ECDL"),
        (lambda: certify(DEVICE, 0.75, 5.25, 10.0), "`ecdl.operator`"),
        (lambda: exact_inverse(DEVICE, np.zeros(8), 10.0, within=(0.0, 1.0)), "`ecdl.operator`"),
        (lambda: linearity(RECORDING), "Give one of its runs: `recording.runs[0]`"),
        (lambda: write_drive(triangle(10.0, amplitude=4.0, bias=3.0), "d.csv"), "`(drive,) ="),
        (lambda: write_recording(None, "folder"), "must be a Recording, but is None."),
        (lambda: Identified.of(DRIVE), "must be a Recording, but is a Drive."),
    ],
)
def test_another_class_is_refused_in_words(call, words):
    with pytest.raises(TypeError) as caught:
        call()
    assert words in str(caught.value)
    assert type(caught.value) is TypeError  # not that of the checks of annotations in tests


OWN_CLASSES = (Drive, ECDL, Recording, Run, Target, fitting.FitResult)


@pytest.mark.parametrize("package", [rapi_jax, fitting])
def test_every_public_function_says_what_it_wants(package):
    """Of each parameter of one of these classes, before anything else is missed."""
    silent, seen = [], 0
    for name in vars(package) if package is rapi_jax else package.__all__:
        function = getattr(package, name)
        if not inspect.isfunction(function):
            continue
        for one in inspect.signature(function).parameters.values():
            kinds = (one.annotation, *get_args(one.annotation))
            if get_origin(one.annotation) is Callable or not any(k in OWN_CLASSES for k in kinds):
                continue
            seen += 1
            with pytest.raises(TypeError) as caught:
                function(**{one.name: object()})
            if f"`{one.name}` must be" not in str(caught.value):
                silent.append((name, one.name))
    assert silent == [] and seen >= (5 if package is rapi_jax else 15)


def test_traced_models_and_arrays_pass():
    operator = paper_device().operator

    def back(operator, y):
        return exact_inverse(operator, y, 10.0, within=(0.5, 5.5))

    assert eqx.filter_eval_shape(back, operator, jnp.linspace(0.0, 60.0, 8)).shape == (8,)
