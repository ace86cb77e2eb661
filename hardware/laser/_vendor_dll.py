"""The vendor's USB library for New Focus controllers, Windows alone: `usbdll.dll`.

Its functions as public drivers declare them: `newp_usb_init_product`, `newp_usb_get_device_info`,
`newp_usb_send_ascii`, `newp_usb_get_ascii`, `newp_usb_uninit_system`; each gives 0 where it worked.
"""

import ctypes
import sys
import time
from typing import Any

from hardware._errors import InstrumentError

from . import _commands as commands
from ._link import AbstractLaserLink, select_answer

PRODUCT = 0x100A
_INFO_BYTES = 4096


class VendorDllLink(AbstractLaserLink):
    """The controller with serial number `serial` ("SN1012"), through the vendor's library.

    Also as the vendor's programs name it, "6700 SN1012".

    The library is the vendor's and does not come with this package: install the vendor's
    application, and give its path as `library`, or put its
    folder on the search path.

    >>> from hardware import InstrumentError, VendorDllLink
    >>> try:
    ...     link = VendorDllLink("SN1012", library="missing.dll")
    ... except InstrumentError as error:  # it exists on Windows, with the vendor's application
    ...     print(error.command)
    (connect)
    """

    def __init__(
        self, serial: str, *, library: str = "usbdll.dll", timeout_s: float = 2.0, dll: Any = None
    ) -> None:
        """`dll`: a loaded library, instead of loading `library`.

        Raises `InstrumentError`, and `ValueError` for what is no serial number.
        """
        self.resource = f"{library} {serial}"
        self.timeout_s = timeout_s
        self._serial = commands.serial_number(serial)
        self._dll = self._loaded(library) if dll is None else dll
        self._id: int | None = None
        self._open()

    def now(self) -> float:
        """Seconds of the computer's steady clock."""
        return time.monotonic()

    def sleep(self, seconds: float) -> None:
        """Wait."""
        time.sleep(max(seconds, 0.0))

    def query(self, command: str) -> str:
        """The line that answers `command`."""
        if self._id is None:
            self._open()
        data = command.encode("ascii")
        if len(data) >= commands.MOST_BYTES:
            raise ValueError(f"A command has fewer than {commands.MOST_BYTES} bytes: {command!r}.")
        packet = ctypes.create_string_buffer(data, commands.MOST_BYTES)
        if self._dll.newp_usb_send_ascii(self._id, packet, ctypes.c_ulong(len(data))) != 0:
            raise self._error(command, "The library could not send it.")
        until = self.now() + self.timeout_s
        while True:
            lines = self._read(command)
            asked = command.strip().upper() == "*IDN?"
            if any(asked or not commands.is_stray(line) for line in lines):
                break
            if self.now() >= until:
                raise self._error(command, "There was no answer in time.")
        try:
            return select_answer(command, lines)
        except ValueError as error:
            raise self._error(command, f"The answer cannot be used: {error}.", lines) from None

    def close(self) -> None:
        """Release the library; more than once does no harm."""
        if self._id is not None:
            self._id = None
            self._dll.newp_usb_uninit_system()

    def _read(self, command: str) -> list[str]:
        # The count that the library gives is the buffer's size, whatever came: the text ends at a
        # zero byte.
        buffer, count = ctypes.create_string_buffer(commands.MOST_BYTES + 1), ctypes.c_ulong(0)
        size = ctypes.c_ulong(commands.MOST_BYTES)
        if self._dll.newp_usb_get_ascii(self._id, buffer, size, ctypes.byref(count)) != 0:
            raise self._error(command, "The library could not read an answer.")
        text = buffer.value.decode("ascii", "backslashreplace")
        return [line.strip() for line in text.splitlines() if line.strip()]

    def _open(self) -> None:
        self._dll.newp_usb_init_product(PRODUCT)
        info = ctypes.create_string_buffer(_INFO_BYTES)
        if self._dll.newp_usb_get_device_info(info) != 0:
            raise self._error("(connect)", "The library does not list its instruments.")
        listed = info.value.decode("ascii", "backslashreplace")
        for entry in filter(None, listed.split(";")):
            number, _, about = entry.partition(",")
            if self._serial in about.split() and number.strip().isdigit():
                self._id = int(number)
                return
        self._dll.newp_usb_uninit_system()
        raise self._error(
            "(connect)", f"There is no controller {self._serial} among those found.", [listed]
        )

    def _error(self, command: str, why: str, lines: list[str] | None = None) -> InstrumentError:
        self.close()  # the library stays in its error until it is opened anew
        return InstrumentError(
            self.resource,
            command,
            "; ".join(lines or []),
            why=why,
            cure="Look at the cable and the serial number, and close other programs that hold it.",
        )

    def _loaded(self, library: str) -> Any:
        if not sys.platform.startswith("win"):
            raise InstrumentError(
                self.resource,
                "(connect)",
                "",
                why="The vendor's library exists for Windows alone.",
                cure="Start the bridge on the Windows computer that has the controller, and give "
                "its address here.",
            )
        try:
            return ctypes.WinDLL(library)  # pyright: ignore[reportAttributeAccessIssue]
        except OSError as error:
            raise InstrumentError(
                self.resource,
                "(connect)",
                str(error),
                why="The vendor's library could not be loaded.",
                cure="Install the vendor's application in the version (32 or 64 bit) of this "
                "Python, and give the library's path.",
            ) from error
