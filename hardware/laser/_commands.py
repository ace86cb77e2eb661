"""The TLB-6700's commands as data, and what its answers look like.

Every command is answered, a setter with `OK`. Wavelengths are in nm, the piezo in percent of its
range, currents in mA, temperatures in degrees Celsius, speeds in nm/s.
"""

import re

# By firmware its maker is New Focus, New_Focus or Newport; some answer as the vendor's library
# lists it, `6700 SN1012`.
_MAKER = r"(?:(?:New[ _]?Focus|Newport)[ ,_]+)"
IDENTITY = rf"{_MAKER}{{1,2}}(?:TLB-?)?67\d\d.{{0,50}}|(?:TLB-?)?6700[ ,]+(?:v|SN)\d.{{0,40}}"
HEAD = r"(TLB-)?6712.{0,24}"
MODEL = "SYSTem:LASer:MODEL"
CONTROL = "SYSTem:MCONtrol"  # REM or LOC
OUTPUT = "OUTPut:STATe"
TRACK = "OUTPut:TRACk"
WAVELENGTH_INPUT = "SYSTem:WINPut"  # whether a voltage at the rear sets the wavelength
CONSTANT_POWER = "SOURce:CPOWer"  # whether the power is held instead of the current
WAVELENGTH = "SOURce:WAVElength"
PIEZO = "SOURce:VOLTage:PIEZo"
CURRENT = "SOURce:CURRent:DIODe"
SCAN_FROM = "SOURce:WAVE:START"
SCAN_TO = "SOURce:WAVE:STOP"
SPEED_UP = "SOURce:WAVE:SLEW:FORWard"
SPEED_BACK = "SOURce:WAVE:SLEW:RETurn"
SCAN_OPTION = "SOURce:WAVE:SCANCFG"  # whether the laser is off while a scan returns
SCANS = "SOURce:WAVE:DESSCANS"  # how many a start makes
SCAN_BEGIN = "OUTPut:SCAN:START"
SCAN_END = "OUTPut:SCAN:STOP"
SCAN_RESET = "OUTPut:SCAN:RESET"
# What is sensed is asked for without a question mark.
SENSED_WAVELENGTH = "SENSe:WAVElength"
SENSED_PIEZO = "SENSe:VOLTage:PIEZo"
SENSED_CURRENT = "SENSe:CURRent:DIODe"
DIODE_TEMPERATURE = "SENSe:TEMPerature:DIODe"
CAVITY_TEMPERATURE = "SENSe:TEMPerature:CAVity"
DONE, STATUS, ERROR = "*OPC?", "*STB?", "ERRSTR?"
FAULTS_WAITING = 128  # in *STB?
MOST_BYTES = 64  # of an answer, its end included

FAULTS = {
    116: "SYNTAX ERROR",
    126: "WRONG NUM OF PARAMS",
    201: "VALUE OUT OF RANGE",
    424: "TEC OVER TEMP",
    501: "LDD INTERLOCK FLT",
    502: "LDD CURRENT LIMIT",
    514: "LDD MODE CHANGE",
    524: "LDD OVER TEMP",
    802: "WAVE FOLLOW ERROR",
    803: "WAVE OVER TEMP",
    804: "PIEZO OVER TEMP",
    805: "CMD NOT SUPPORTED",
    902: "KEY ENABLE OFF",
    919: "LASER DISCONNECTED",
    920: "LASER EEPROM ERROR",
}
CURES = {
    424: "Let it cool down, then switch the controller off and on.",
    501: "Close the interlock at the rear of the controller.",
    502: "Look at the current limit, and at the set current.",
    524: "Let it cool down before the output is switched on again.",
    802: "Scan more slowly, and switch tracking on again.",
    803: "Let it cool down before tracking is switched on again.",
    804: "Let it cool down; the piezo was set to 0 % by the controller.",
    902: "Turn the key switch.",
    919: "Connect the laser head with its cable, with the controller off.",
    920: "Use the cable that belongs to the laser head.",
}

_STRAY = re.compile(  # whole, or cut at either end
    rf"{_MAKER}{{1,2}}(?:TLB-?)?67\d{{0,2}}\b.{{0,50}}"
    r"|.{0,30}v\d{1,2}\.\d{1,3}[ ,]+\d\d/\d\d/\d\d.{0,20}"
    r"|.{0,30}\d\d/\d\d/\d\d[ ,]+SN\d{1,8}\s*"
    r"|(?:New_Focus\s.{0,24})?v\d{1,2}\.\d.{0,30}SN\d{1,8}\s*"
    r"|(?:TLB-?)?6700[ ,]+SN\d{1,8}\s*",
    re.ASCII | re.IGNORECASE,
)
_SERIAL = re.compile(r"(?:(?:TLB-?)?67\d\d[ ,]+)?(?:SN ?)?(\d{1,8})", re.IGNORECASE)


def is_stray(line: str) -> bool:
    """Whether this is the identity, or a part of it, which may come with any answer."""
    return _STRAY.fullmatch(line) is not None


def is_query(command: str) -> bool:
    """Whether the answer is a value, which is never `OK`."""
    return command.strip().endswith("?") or command.strip().upper().startswith("SENS")


def serial_number(text: str) -> str:
    """`SN1012` for `SN1012`, `1012`, or `6700 SN1012`, as the vendor's programs name a controller.

    Raises `ValueError` for anything else.
    """
    found = _SERIAL.fullmatch(text.strip())
    if not found:
        raise ValueError(f"{text!r} is no serial number such as SN1012")
    return f"SN{found[1]}"


def fault(line: str) -> tuple[int, str]:
    """Number and text of an answer to `ERRSTR?`; 0 is none. `ValueError` for anything else."""
    found = re.fullmatch(r'(-?\d{1,4})(?:\s*,\s*(?:"([^"]*)"|([^"]*)))?', line)
    if found:
        text = (found[2] or found[3] or "").strip()
        return int(found[1]), text or FAULTS.get(int(found[1]), "")
    if line.strip().upper() == "NO ERROR":
        return 0, "NO ERROR"
    raise ValueError('it is not an entry such as 501,"LDD INTERLOCK FLT"')
