"""What must still happen when the process ends: by its end, an exception, or a request to stop."""

import atexit
import signal
import sys
import threading
from collections.abc import Callable

_TERMINATED = 143  # what a shell reports for SIGTERM
_actions: list[Callable[[], None]] = []


def on_exit(action: Callable[[], None]) -> None:
    """Do `action` at the end of the process, SIGTERM included where nobody else handles it.

    The signal becomes a `SystemExit` in the main thread, so that everything is left in order.
    """
    atexit.register(action)
    _actions.append(action)
    main = threading.current_thread() is threading.main_thread()
    if main and signal.getsignal(signal.SIGTERM) is signal.SIG_DFL:
        signal.signal(signal.SIGTERM, _leave)


def forget(action: Callable[[], None]) -> None:
    """`action` need not be done any more."""
    atexit.unregister(action)
    if action in _actions:
        _actions.remove(action)
    main = threading.current_thread() is threading.main_thread()
    if main and not _actions and signal.getsignal(signal.SIGTERM) is _leave:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)


def _leave(number: int, frame: object) -> None:
    sys.exit(_TERMINATED)
