"""Running a command: exit codes, one-line errors, interrupts."""

import _thread  # noqa: PLC2701 (of the standard library)
import os
import sys
import threading
import traceback
from typing import Any, NoReturn

from cyclopts import App, CycloptsError, MissingArgumentError, UnusedCliTokensError

DONE, INTERNAL, USAGE, BAD_DATA, UNTRUSTED, PARTLY_FAILED, INSTRUMENT = 0, 1, 2, 3, 4, 5, 6
INTERRUPTED = 130


def one_line(message: object) -> str:
    """`message` on one line, with nothing in it that a terminal would obey."""
    line = " ".join(str(message).split())
    return "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in line)


def fail(kind: str, message: object, console: Any = None) -> None:
    """One line on standard error; on `console` where a bar is drawn there."""
    from rich.console import Console
    from rich.text import Text

    line = Text.assemble((f"{kind}: ", "bold red"), one_line(message))
    (console or Console(stderr=True)).print(line, soft_wrap=True, highlight=False)


def _usage_message(error: CycloptsError) -> str:
    """What is wrong with the arguments, and where they are explained."""
    command = " ".join(("rapi", *(error.command_chain or ())))
    what = str(error)
    if isinstance(error, MissingArgumentError) and error.argument and error.keyword is None:
        name = error.argument.name
        positional = error.argument.field_info.is_positional
        what = f"{name.lstrip('-').upper() if positional else name} is missing."
    elif isinstance(error, UnusedCliTokensError):
        what = f"too many arguments: {' '.join(error.unused_tokens or ())}."
    return f"{what} `{command} --help` lists what there is."


def run(app: App, arguments: list[str]) -> int:
    """The exit code of `rapi ARGUMENTS`."""
    as_json = "--json" in arguments
    try:
        code = app(arguments, exit_on_error=False, print_error=False, result_action="return_value")
    except CycloptsError as error:
        return _conclude(USAGE, "usage", _usage_message(error), as_json)
    except KeyboardInterrupt:
        message = "no file is half-written; run it again to go on."
        return _conclude(INTERRUPTED, "interrupted", message, as_json)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return DONE
    except Exception as error:
        return _report_error(error, as_json)
    return code if isinstance(code, int) else DONE


def run_and_leave(app: App, arguments: list[str]) -> NoReturn:
    """Run `rapi ARGUMENTS` as the whole of this process, and end it with the exit code.

    An interrupt that reaches a callback of a library (garbage collection, in JAX) is dropped
    there, so it is sent again. After an interrupt the interpreter is not taken down: with a
    compilation cut off half-way, that often ends in a segmentation fault.
    """
    sys.unraisablehook = _resend_interrupt
    code = run(app, arguments)
    if code != INTERRUPTED:
        sys.exit(code)
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


def _resend_interrupt(dropped: Any) -> None:
    """Send an interrupt again that was dropped where no exception can be raised."""
    if issubclass(dropped.exc_type, KeyboardInterrupt):
        threading.Timer(0.05, _thread.interrupt_main).start()
    else:
        sys.__unraisablehook__(dropped)


def _conclude(code: int, kind: str, message: str, as_json: bool) -> int:
    """The exit code, with the message on standard error and, for machines, as an object."""
    fail(kind, message)
    if as_json:
        from fitting._json import json_text

        content = {"exit_code": code, "kind": kind, "message": one_line(message)}
        sys.stdout.write(json_text({"schema": "rapi.error/1", **content}))
    return code


def _report_error(error: Exception, as_json: bool) -> int:
    """The exit code for `error`, which is told in one line."""
    code, kind, message = explain_error(error)
    if code == INTERNAL and kind == "internal error" and os.environ.get("RAPI_TRACEBACK"):
        traceback.print_exception(error)
    return _conclude(code, kind, message, as_json)


def explain_error(error: Exception) -> tuple[int, str, str]:
    """The exit code for `error`, what kind of error it is, and what it says."""
    from fitting.batch.jobs._job import BatchError
    from fitting.commands.shared._model import UntrustedModel
    from rapi_jax import DataError, LimitError, ModelError, NotInvertible
    from rapi_jax.io import OutputError

    if isinstance(error, UntrustedModel):
        return UNTRUSTED, "not to be trusted", str(error)
    if isinstance(error, LimitError):
        return BAD_DATA, "beyond the limits", str(error)
    if isinstance(error, NotInvertible):
        return BAD_DATA, "no inverse", str(error)
    if isinstance(error, DataError | ModelError):
        return BAD_DATA, "bad data", str(error)
    if isinstance(error, OutputError | FileNotFoundError | PermissionError | IsADirectoryError):
        return BAD_DATA, "cannot read or write", str(error)
    if isinstance(error, BatchError):
        return BAD_DATA, "batch", str(error)
    hardware = sys.modules.get("hardware")  # not loaded: no instrument was asked
    if hardware is not None and isinstance(error, hardware.InstrumentError):
        return INSTRUMENT, "instrument", str(error)
    if isinstance(error, MemoryError):
        cure = "this recording does not fit; split it, or use fewer samples a period."
        return INTERNAL, "out of memory", cure
    where = f"{type(error).__name__}: {error} (RAPI_TRACEBACK=1 shows where)"
    return INTERNAL, "internal error", where
