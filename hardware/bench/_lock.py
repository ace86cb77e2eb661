"""Locks on instruments: one program of a user at a time opens each."""

import contextlib
import hashlib
from collections.abc import Iterable, Iterator

from hardware._errors import InstrumentError
from rapi_jax.internal import cause
from rapi_jax.io import printable


@contextlib.contextmanager
def lock_instruments(resources: Iterable[str]) -> Iterator[None]:
    """Lock instruments by their addresses, as written, against other processes of this user.

    The end of the process releases them. Raises `InstrumentError` where one is locked already.
    """
    wanted = sorted(set(resources))
    try:
        import filelock
        import platformdirs
    except ImportError as error:
        raise InstrumentError(
            wanted[0],
            "open",
            "",
            why=f"A package that instruments need is not installed here ({cause(error)}).",
            cure="Install the extra: pip install 'rapi-jax[lab]'.",
        ) from error
    folder = platformdirs.user_cache_path("rapi-jax")
    with contextlib.ExitStack() as stack:
        for resource in wanted:
            name = hashlib.sha256(resource.encode()).hexdigest()[:32]
            try:
                folder.mkdir(mode=0o700, parents=True, exist_ok=True)
                stack.enter_context(filelock.FileLock(folder / f"{name}.lock", timeout=0))
            except filelock.Timeout as error:
                raise InstrumentError(
                    resource,
                    "open",
                    "",
                    why="Another program on this computer has this instrument open.",
                    cure="End that program first: two would change each other's settings.",
                ) from error
            except OSError as error:
                raise InstrumentError(
                    resource,
                    "open",
                    "",
                    why=f"No note can be left that it is in use ({cause(error)}).",
                    cure=f"Make {printable(folder)} a folder that you may write to.",
                ) from error
        yield
