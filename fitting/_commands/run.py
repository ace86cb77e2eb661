"""Running a command: exit codes, one-line errors, interrupts."""

import os
import sys
import traceback

from cyclopts import App, CycloptsError

DONE, INTERNAL, USAGE, BAD_DATA, UNTRUSTED = 0, 1, 2, 3, 4
INTERRUPTED = 130


def fail(kind: str, message: object) -> None:
    """One line on standard error."""
    from rich.console import Console

    Console(stderr=True, soft_wrap=True, highlight=False).print(
        f"[bold red]{kind}:[/] ", end="", markup=True
    )
    Console(stderr=True, soft_wrap=True, highlight=False, markup=False).print(
        " ".join(str(message).split())
    )


def run(app: App, arguments: list[str]) -> int:
    """The exit code of `rapi ARGUMENTS`."""
    try:
        code = app(arguments, exit_on_error=False, print_error=True, result_action="return_value")
    except CycloptsError:
        return USAGE
    except KeyboardInterrupt:
        fail("interrupted", "nothing was written after the last file named above.")
        return INTERRUPTED
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return DONE
    except Exception as error:
        return _classify(error)
    return code if isinstance(code, int) else DONE


def _classify(error: Exception) -> int:
    from rapi_jax import DataError, ModelError
    from rapi_jax.io import OutputError

    if isinstance(error, DataError | ModelError):
        fail("bad data", error)
        return BAD_DATA
    if isinstance(error, OutputError | FileNotFoundError | PermissionError | IsADirectoryError):
        fail("cannot read or write", error)
        return BAD_DATA
    if isinstance(error, MemoryError):
        fail(
            "out of memory", "this recording does not fit; split it, or use fewer samples a period."
        )
        return INTERNAL
    if os.environ.get("RAPI_TRACEBACK"):
        traceback.print_exc()
    fail("internal error", f"{type(error).__name__}: {error} (RAPI_TRACEBACK=1 shows where)")
    return INTERNAL
