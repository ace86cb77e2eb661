"""Memory of this process: resident now, and the peak since then."""

import resource
from pathlib import Path

_STATUS, _RESET = Path("/proc/self/status"), Path("/proc/self/clear_refs")


def resident() -> int:
    """Bytes in memory now; the peak is counted from here on, where the system allows that."""
    if not _STATUS.exists():
        return _highest()
    try:
        _RESET.write_text("5")
    except OSError:
        return max(_status("VmRSS"), _highest())
    return _status("VmRSS")


def peak_above(before: int) -> int:
    """By how many bytes the peak since `resident` lies above it."""
    peak = _status("VmHWM") if _STATUS.exists() else _highest()
    return max(peak - before, 0)


def _status(name: str) -> int:
    line = next(row for row in _STATUS.read_text().splitlines() if row.startswith(name + ":"))
    return 1024 * int(line.split()[1])


def _highest() -> int:
    return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
