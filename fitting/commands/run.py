"""Running a command: exit codes, one-line errors, interrupts."""

import _thread  # noqa: PLC2701 (of the standard library)
import contextlib
import difflib
import errno
import io
import os
import sys
import threading
import traceback
from collections.abc import Iterator
from typing import Any, NoReturn

from cyclopts import (
    App,
    CoercionError,
    CycloptsError,
    MissingArgumentError,
    UnusedCliTokensError,
)

DONE, INTERNAL, USAGE, BAD_DATA, UNTRUSTED, PARTLY_FAILED, INSTRUMENT = 0, 1, 2, 3, 4, 5, 6
INTERRUPTED = 130
_FULL = (errno.ENOSPC, errno.EDQUOT, errno.EIO)
_PLATFORM = "Unable to initialize backend"  # what JAX says of a name in JAX_PLATFORMS
_LONGEST = 1500  # characters of an error: more than any sentence of ours, less than a page


def one_line(message: object) -> str:
    """`message` on one line, cut where it is very long, with nothing that a terminal would obey."""
    line = " ".join(str(message)[: 2 * _LONGEST].split())
    safe = "".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in line)
    return safe if len(safe) <= _LONGEST else f"{safe[: _LONGEST - 3]}..."


def fail(kind: str, message: object, console: Any = None) -> None:
    """One line on standard error; on `console` where a bar is drawn there."""
    from rich.console import Console
    from rich.text import Text

    line = Text.assemble((f"{kind}: ", "bold red"), one_line(message))
    with contextlib.suppress(OSError):  # nobody reads it, or the device is full: the code says it
        (console or Console(stderr=True)).print(line, soft_wrap=True, highlight=False)


def _usage_message(error: CycloptsError) -> str:
    """What is wrong with the arguments, and where they are explained."""
    command = " ".join(("rapi", *(error.command_chain or ())))
    what = str(error)
    if isinstance(error, MissingArgumentError) and error.argument and error.keyword is None:
        name = error.argument.name
        positional = error.argument.field_info.is_positional
        what = f"{name.lstrip('-').upper() if positional else name} is missing."
        what = _unknown_option(error) or what
    elif isinstance(error, UnusedCliTokensError):
        what = f"too many arguments: {' '.join(error.unused_tokens or ())}."
    elif isinstance(error, CoercionError) and _is_list_of_numbers(error):
        parts = error.token.value.split(",") if error.token else []
        what = f"{what} Separate numbers by spaces, not by commas."
        if len(parts) == 2 and all(part.lstrip("+-").isdigit() for part in parts):
            what += f" A decimal comma is a point here: {parts[0]}.{parts[1]}."
    return f"{what} `{command} --help` lists what there is."


def _unknown_option(error: MissingArgumentError) -> str | None:
    """An option that the command does not have, which may be the missing one, mistyped."""
    unknown = next((token for token in error.unused_tokens or () if token.startswith("--")), None)
    if unknown is None or error.argument is None:
        return None
    typed = unknown.partition("=")[0]
    meant = next((name for name in error.argument.names if name.startswith(typed)), None)
    meant = meant or next(iter(difflib.get_close_matches(typed, error.argument.names)), None)
    hint = f" Did you mean {meant}?" if meant else f" And {error.argument.name} is missing."
    return f"Unknown option: {typed}.{hint}"


_RESUMED = ("batch", "blind")  # commands that go on where they were interrupted


def _is_list_of_numbers(error: CoercionError) -> bool:
    """Whether one number was wanted, and several are there with commas between."""
    parts = error.token.value.split(",") if error.token else ()
    if len(parts) < 2 or error.target_type not in (float, int):
        return False
    with contextlib.suppress(ValueError):
        return bool([float(part) for part in parts])
    return False


def run(app: App, arguments: list[str]) -> int:
    """The exit code of `rapi ARGUMENTS`."""
    as_json = "--json" in arguments
    for word in ("-out", "-output"):
        if word in arguments:
            text = f"`{word}` reads as `-o {word[2:]}`. Write `-o FOLDER`, or `--output FOLDER`."
            return _conclude(USAGE, "usage", text, as_json)
    try:
        code = app(arguments, exit_on_error=False, print_error=False, result_action="return_value")
        sys.stdout.flush()  # here, where a full device is still told
    except CycloptsError as error:
        return _conclude(USAGE, "usage", _usage_message(error), as_json)
    except KeyboardInterrupt:
        resumes = bool(arguments) and arguments[0] in _RESUMED
        message = "no file is half-written; " + (
            "run it again to go on." if resumes else "run again, it begins from the start."
        )
        if arguments[:1] == ["measure"]:
            message = "finished runs are kept; give another `-o` to measure again."
        return _conclude(INTERRUPTED, "interrupted", message, as_json)
    except BrokenPipeError:  # the reader has what it wants
        _discard_output()
        return DONE
    except Exception as error:
        if isinstance(error, OSError) and error.errno in _FULL and error.filename is None:
            _discard_output()  # what is left in the buffer would fail again at the end
        return _report_error(error, as_json)
    return code if isinstance(code, int) else DONE


def _discard_output() -> None:
    """Send what is still to be written to standard output nowhere."""
    with contextlib.suppress(OSError, ValueError):  # in a test it may be no file
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def run_and_leave(app: App, arguments: list[str]) -> NoReturn:
    """Run `rapi ARGUMENTS` as the whole of this process, and end it with the exit code.

    An interrupt that reaches a callback of a library (garbage collection, in JAX) is dropped
    there, so it is sent again. After an interrupt the interpreter is not taken down: with a
    compilation cut off half-way, that often ends in a segmentation fault.
    """
    sys.unraisablehook = _resend_interrupt
    for stream in (sys.stdout, sys.stderr):  # letters that a terminal lacks are escaped
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
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


@contextlib.contextmanager
def failing_alone(name: str, failed: list[str], *, alone: bool) -> Iterator[None]:
    """Report a failure of one recording of several in one line, so that the others are done.

    `name`: of the recording, appended to `failed` then. `alone`: whether it is the only one; its
    failure is raised. So is what would fail the others alike, such as a full disk.
    """
    from rapi_jax import DataError, ModelError

    try:
        yield
    except (DataError, ModelError) as error:
        if alone:
            raise
        failed.append(name)
        _, kind, message = explain_error(error)
        fail(kind, f"{name}: {message}")


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
    from rapi_jax.internal import OpenQuestion, cause
    from rapi_jax.io import OutputError, printable

    if isinstance(error, OpenQuestion):
        return BAD_DATA, "question", str(error)
    if isinstance(error, UntrustedModel):
        return UNTRUSTED, "not to be trusted", str(error)
    if isinstance(error, LimitError):
        return BAD_DATA, "beyond the limits", str(error)
    if isinstance(error, NotInvertible):
        return BAD_DATA, "no inverse", str(error)
    if isinstance(error, DataError | ModelError):
        return BAD_DATA, "bad data", str(error)
    if isinstance(error, OutputError):
        return BAD_DATA, "cannot read or write", str(error)
    if isinstance(error, OSError) and not isinstance(error, ConnectionError | TimeoutError):
        what = "standard output" if error.filename is None else printable(error.filename)
        cure = "Check the path, the space that is free and the disk."
        return BAD_DATA, "cannot read or write", f"{what}: {cause(error)}. {cure}"
    if isinstance(error, BatchError):
        return BAD_DATA, "batch", str(error)
    hardware = sys.modules.get("hardware")  # not loaded: no instrument was asked
    if hardware is not None and isinstance(error, hardware.InstrumentError):
        return INSTRUMENT, "instrument", str(error)
    if isinstance(error, RuntimeError) and _PLATFORM in str(error):
        where = f"JAX_PLATFORMS={printable(os.environ.get('JAX_PLATFORMS', ''), 60)}"
        cure = f"Unset it, or name a platform that is there, such as cpu ({where})."
        return USAGE, "usage", f"JAX has no such platform ({printable(cause(error), 200)}). {cure}"
    if isinstance(error, ValueError) and "embedded null byte" in str(error):
        return (
            BAD_DATA,
            "cannot read or write",
            "a path has a NUL in it. Check the paths.",
        )
    if isinstance(error, MemoryError):
        cure = "this recording does not fit; split it, or use fewer samples a period."
        return INTERNAL, "out of memory", cure
    where = f"{type(error).__name__}: {error} (RAPI_TRACEBACK=1 shows where)"
    return INTERNAL, "internal error", where
