"""Settings that hold for every test: 64 bits, strict shapes, checked annotations, compile cache."""

# ruff: noqa: E402 (what comes between the imports must come before the next of them)

import contextlib
import os
import signal
from collections.abc import Iterator
from pathlib import Path

# Read when NumPy and XLA load: test processes with two threads each would wait for each other.
for name in ("NPROC", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(name, "1")
# Commands are silent while they work: what they say every 10 s would depend on the machine's speed.
os.environ.setdefault("RAPI_PROGRESS", "0")

import jaxtyping

# Shapes and types of every function and dataclass of ours are checked when called, unless
# RAPI_TYPE_CHECKS=off: a diagnosis takes 1.6 times as long with them. This must come before the
# first import of ours, so nothing in this file or above it may import our packages.
if os.environ.get("RAPI_TYPE_CHECKS") != "off":
    jaxtyping.install_import_hook(
        ["rapi_jax", "fitting", "hardware"],
        "beartype.beartype(conf=beartype.BeartypeConf(strategy=beartype.BeartypeStrategy.On))",
    )

from fitting.compile_cache import drop_oldest, machine_folder, variables
from fitting.compile_cache._memory_maps import OWN, count_maps

# JAX's compiled programs are kept in the checkout: for all workers, for the processes that tests
# start (hence environment variables, set before JAX is imported), and for the next time.
ROOT = Path(__file__).resolve().parents[1]
COMPILED, COMPILED_BYTES = ROOT / ".pytest_cache/d/compiled", 2 * 2**30
for name, value in variables(machine_folder(COMPILED)).items():
    os.environ.setdefault(name, value)

import hypothesis
import jax
import pytest
from tiers import mark_listed

# A shell makes what it starts in the background deaf to Ctrl-C, and its children with it; tests of
# interrupts must be heard there too.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_configure(config: pytest.Config) -> None:
    """Drop the oldest compiled programs where all take more than `COMPILED_BYTES`."""
    if not hasattr(config, "workerinput"):
        drop_oldest(COMPILED, COMPILED_BYTES)


jax.config.update("jax_enable_x64", True)
jax.config.update("jax_numpy_rank_promotion", "raise")
jax.config.update("jax_numpy_dtype_promotion", "strict")

# The first example of a test compiles, so times of single examples mean nothing.
hypothesis.settings.register_profile("local", deadline=None)
hypothesis.settings.register_profile("ci", deadline=None, derandomize=True)
hypothesis.settings.load_profile("ci" if os.environ.get("CI") else "local")


LONGEST = ("bank", "notebook")  # marks of tests that take a minute and more


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> Iterator[None]:
    """Mark what `slow.txt` and `release.txt` list, by `benchmarks/slow_tests.py` from a timed run.

    And begin with the longest tests, whatever the order of the others: one that begins last is
    waited for by all workers but one.
    """
    listed = (
        set((ROOT / f"tests/{name}.txt").read_text(encoding="utf-8").splitlines())
        for name in ("slow", "release")
    )
    mark_listed([item for item in items if isinstance(item, pytest.Function)], *listed, ROOT)
    yield
    items.sort(key=lambda item: not any(item.get_closest_marker(name) for name in LONGEST))


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """The folder of measured data, where there is one beside the repository."""
    folder = ROOT.parent / "shared" / "data"
    if not folder.is_dir():
        pytest.skip("no measured data: the folder shared/data is not beside the repository")
    return folder


@pytest.fixture(autouse=True, scope="module")
def _compiled_code_is_dropped() -> Iterator[None]:
    """Forget what was compiled where it holds many memory maps, of which Linux grants 65530.

    A worker that keeps all programs grows to 5 GB, and in the end the compiler meets a refused map
    and takes the process with it.
    """
    yield
    with contextlib.suppress(OSError):  # a system that does not tell: forgotten each time
        if count_maps() <= OWN:
            return
    jax.clear_caches()
