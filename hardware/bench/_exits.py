"""Actions at the end of a process: by its end, an exception, or a signal to terminate."""

import atexit
import contextlib
import signal
import sys
import threading
from collections.abc import Callable, Iterator

# A request to end, and the end of the terminal that the process was started in.
_REQUESTS = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name))
_actions: list[Callable[[], None]] = []


def register_exit_action(action: Callable[[], None]) -> None:
    """Do `action` at the end of the process; at SIGTERM and SIGHUP too, if nobody handles them.

    The signal becomes a `SystemExit` in the main thread, with the code that a shell reports for it
    (143, 129), so that everything is left in order.
    """
    atexit.register(action)
    _actions.append(action)
    if threading.current_thread() is threading.main_thread():
        for number in _REQUESTS:
            if signal.getsignal(number) is signal.SIG_DFL:
                signal.signal(number, _leave)


def unregister_exit_action(action: Callable[[], None]) -> None:
    """Cancel an action."""
    atexit.unregister(action)
    if action in _actions:
        _actions.remove(action)
    if not _actions and threading.current_thread() is threading.main_thread():
        for number in _REQUESTS:
            if signal.getsignal(number) is _leave:
                signal.signal(number, signal.SIG_DFL)


@contextlib.contextmanager
def exit_on_signals() -> Iterator[None]:
    """Within this block SIGTERM and SIGHUP become a `SystemExit`, whether an output is on or not.

    >>> import signal
    >>> from hardware import exit_on_signals
    >>> with exit_on_signals():
    ...     signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
    False
    """

    def nothing() -> None:
        """The block itself does what is to be done."""

    register_exit_action(nothing)
    try:
        yield
    finally:
        unregister_exit_action(nothing)


def _leave(number: int, frame: object) -> None:
    sys.exit(128 + number)
