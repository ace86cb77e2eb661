"""What the axes are called over which an effect is regular."""

_QUANTITIES = {
    "phase": "phase of the period",
    "since_turn": "time since the turning point",
    "session": "time in the session",
    "gain": "time in the session",
    "drive": "drive",
}


def signature_axis(axis: str, response_unit: str) -> str:
    """The quantity along an axis of `signature` in `diagnosis.json`, in words."""
    response = "optical frequency" if response_unit.endswith("Hz") else "response"
    return _QUANTITIES.get(axis, response)
