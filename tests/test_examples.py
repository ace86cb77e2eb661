"""Every public name has an example in its docstring, and each example is right."""

import doctest
import importlib
from types import ModuleType

import pytest

MODULES = (
    "rapi_jax",
    "rapi_jax.effects",
    "rapi_jax.examples",
    "rapi_jax.io",
    "rapi_jax.operators",
    "rapi_jax.plot",
    "rapi_jax.ranging",
    "rapi_jax.readout",
    "fitting",
    "hardware",
)


def public(name: str) -> dict[str, object]:
    """What a user imports from a module, without what it has from another module here."""
    module = importlib.import_module(name)
    late = getattr(module, "_HOME", {})
    own = {key: getattr(module, key) for key in {**vars(module), **late} if key[:1] != "_"}
    package = name.split(".")[0]
    return {
        key: value
        for key, value in own.items()
        if not isinstance(value, ModuleType)
        and getattr(value, "__module__", "").startswith(package)
        and (name == package or getattr(importlib.import_module(package), key, None) is not value)
    }


@pytest.mark.parametrize("module", MODULES)
def test_every_public_name_has_an_example(module):
    assert {
        name
        for name, value in public(module).items()
        if callable(value) and ">>>" not in (value.__doc__ or "")
    } == set()


@pytest.mark.slow
@pytest.mark.parametrize("module", MODULES)
def test_examples(module, tmp_path, monkeypatch):
    finder, runner = doctest.DocTestFinder(recurse=False), doctest.DocTestRunner(verbose=False)
    for name, value in sorted(public(module).items()):
        for example in finder.find(value, name, globs={}):
            folder = tmp_path / name
            folder.mkdir(exist_ok=True)
            monkeypatch.chdir(folder)
            runner.run(example)
    assert runner.summarize(verbose=False).failed == 0
