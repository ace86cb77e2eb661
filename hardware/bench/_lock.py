"""Locks on instruments: one program of a user at a time opens each."""

import contextlib
import hashlib
import importlib.util
import re
from collections.abc import Iterable, Iterator

from hardware._errors import InstrumentError
from rapi_jax.internal import cause, install_extra
from rapi_jax.io import printable

_NEEDED = ("filelock", "platformdirs", "pyvisa", "pyvisa_py")


def missing_packages() -> list[str]:
    """Which packages of the extra `lab` that a client of instruments needs are not installed.

    >>> from hardware import missing_packages
    >>> "numpy" in missing_packages()  # which is no part of the extra
    False
    """
    return [name for name in _NEEDED if importlib.util.find_spec(name) is None]


@contextlib.contextmanager
def lock_instruments(resources: Iterable[str]) -> Iterator[None]:
    """Lock instruments by their addresses against other processes of this user.

    Addresses that mean the same instrument are one: see `normalised_address`.
    The end of the process releases them. Raises `InstrumentError` where one is locked already.
    """
    wanted = {normalised_address(resource): resource for resource in resources}
    try:
        import filelock
        import platformdirs
    except ImportError as error:
        raise InstrumentError(
            min(wanted.values()),
            "",
            "",
            why=f"A package that instruments need is not installed here ({cause(error)}).",
            cure=install_extra("lab"),
        ) from error
    folder = platformdirs.user_cache_path("rapi-jax")
    with contextlib.ExitStack() as stack:
        for address, resource in sorted(wanted.items()):
            name = hashlib.sha256(address.encode()).hexdigest()[:32]
            try:
                folder.mkdir(mode=0o700, parents=True, exist_ok=True)
                stack.enter_context(filelock.FileLock(folder / f"{name}.lock", timeout=0))
            except filelock.Timeout as error:
                raise InstrumentError(
                    resource,
                    "",
                    "",
                    why="Another program on this computer has this instrument open.",
                    cure="End that program first: two would change each other's settings.",
                ) from error
            except OSError as error:
                raise InstrumentError(
                    resource,
                    "",
                    "",
                    why=f"Its lock file cannot be written ({cause(error)}).",
                    cure=f"Make {printable(folder)} a folder that you may write to.",
                ) from error
        yield


def normalised_address(resource: str) -> str:
    """A VISA address as VISA itself completes it: in upper case, with board, device and class.

    `tcpip::10.0.0.7` is `TCPIP0::10.0.0.7::INST0::INSTR`. A name that is no VISA address, such as
    an alias or a serial number, is compared in upper case.
    """
    parts = [part.strip().upper() for part in resource.strip().split("::")]
    found = re.fullmatch(r"(TCPIP|USB|GPIB|ASRL|PXI|VXI)(\d*)", parts[0])
    if not found or (len(parts) < 2 and found[1] != "ASRL"):
        return "::".join(parts)
    kind, board = found[1], found[2] or "0"
    classes = ("INSTR", "SOCKET", "RAW")
    rest, last = (parts[1:-1], parts[-1]) if parts[-1] in classes else (parts[1:], "INSTR")
    if kind == "TCPIP":
        if rest and rest[0] == "LOCALHOST":
            rest[0] = "127.0.0.1"
        if last == "INSTR" and len(rest) == 1:
            rest.append("INST0")
        rest = [re.sub(r"^HISLIP0,4880$", "HISLIP0", part) for part in rest]
    if kind == "USB":
        if len(rest) == 4:  # an interface number
            rest = rest[:3] if rest[3] == "0" else rest
        rest = [_number(part) if i < 2 else part for i, part in enumerate(rest)]
    return "::".join([f"{kind}{int(board)}", *rest, last])


def _number(text: str) -> str:
    """Maker and product of a USB instrument, which are written in hexadecimal or decimal."""
    hexadecimal = re.fullmatch(r"0X([0-9A-F]{1,8})", text)
    if hexadecimal:
        return str(int(hexadecimal[1], 16))
    return str(int(text)) if re.fullmatch(r"\d{1,8}", text) else text
