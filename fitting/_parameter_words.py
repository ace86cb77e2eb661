"""What parameters are called in the words of the field."""

from rapi_jax import effects

_WORDS = {
    "alpha": "width of the hysteresis loop (thresholds per half swing)",
    "zeta": "growth of the hysteresis with scan rate",
    "lam": "asymmetry of the loop (slope of the falling bound)",
    "eta": "asymmetry of the loop (intercept of the falling bound)",
    "a": "amount of hysteresis (weights of the plays)",
    "b": "decay of the hysteresis weights with threshold",
    "d_0": "origin of the response",
}
_TUNING = {
    "d_1": "tuning coefficient",
    "d_2": "quadratic nonlinearity of the tuning",
    "d_3": "cubic nonlinearity of the tuning",
}
_RESPONSE = {
    "d_1": "slope of the response",
    "d_2": "quadratic nonlinearity of the response",
    "d_3": "cubic nonlinearity of the response",
}
_FREQUENCIES = ("THz", "GHz", "MHz", "kHz", "Hz")
_OF_EFFECTS = {
    "Quantisation.step": "step of the drive's quantisation",
    "Quantisation.origin": "place of a level of the drive's quantisation",
    "SlewLimit.limit": "slew limit of the drive",
    "Saturation.low": "lower limit of the drive",
    "Saturation.high": "upper limit of the drive",
    "Saturation.knee": "width of the corner of the drive's saturation",
    "AmplifierLowpass.tau": "time constant of the amplifier's low-pass",
    "RateLaw.exponent": "exponent of the growth of thresholds with scan rate",
    "AmplitudeLaw.threshold": "exponent of the growth of thresholds with swing",
    "AmplitudeLaw.gain": "growth of the gain with swing",
    "AmplitudeLaw.tilt": "growth of the gain with bias",
    "AmplitudeLaw.pivot": "pivot of the growth of the gain",
    "AmplitudeLaw.reference": "swing of reference of the gain",
    "AmplitudeLaw.centre": "bias of reference of the gain",
    "Delay.tau": "delay between drive and reading",
    "Creep.gain": "creep in a decade of time",
    "Creep.history": "state of the creep before the session",
    "Creep.lead_s": "time that a drive was on before its run",
    "Creep.rest": "response at rest before the session",
    "Creep.lead_periods": "periods that a drive was on before its run",
    "Creep.fastest_s": "shortest time constant of the creep",
    "Resonance.hertz": "frequency of the resonance",
    "Resonance.damping": "damping of the resonance",
    "Resonance.share": "share of the response that resonates",
    "GainDrift.rate": "rate of the gain's drift",
    "GainDrift.centre": "fixed point of the gain's drift",
    "GainDrift.start": "start of the gain's drift",
    "GainDrift.tau": "time constant of the gain's drift",
    "Drift.amplitude": "amplitude of the drift",
    "Drift.tau": "time constant of the drift",
    "Drift.start": "start of the drift",
    "CurrentCoupling.coupling": "response to the drive's slope",
    "CurrentCoupling.lag_s": "lag of the response to the drive's slope",
    "ModeHop.size": "size of the jumps",
    "ModeHop.threshold": "threshold of the jumps",
    "ModeHop.width": "hysteresis of the jumps",
    "ModeHop.settle_s": "settling time of the jumps",
    "Etalon.amplitude": "amplitude of the ripple",
    "Etalon.phase": "phase of the ripple",
    "Etalon.spacing": "spacing of the ripple",
    "Etalon.sharpness": "sharpness of the ripple",
    "Pickup.amplitude": "amplitude of the pickup",
    "Pickup.hertz": "frequency of the pickup",
    "Pickup.phase": "phase of the pickup",
    "Pickup.third_sine": "third harmonic of the pickup (sine)",
    "Pickup.third_cosine": "third harmonic of the pickup (cosine)",
}


def describe_parameter(name: str, response_unit: str = "GHz") -> str:
    """A parameter in words; `name` itself where there is no other.

    A response in `response_unit` that is no frequency is not tuned. One with a value for each play
    is named as what they share. A parameter of an effect that has no words here is its field and
    the label of the effect.
    """
    owner, _, field = name.rpartition(".")
    if owner and name not in _OF_EFFECTS:
        labels = {cls.__name__: cls.label for cls in effects.ALL}
        return f"{field.replace('_', ' ')} of {labels.get(owner, owner)}"
    optical = response_unit in _FREQUENCIES
    known = _WORDS | _OF_EFFECTS | (_TUNING if optical else _RESPONSE)
    if name in known:
        return known[name]
    base, _, number = name.rpartition("_")
    if base == "d" and number.isdigit():
        return f"nonlinearity of the {'tuning' if optical else 'response'} of order {number}"
    return f"{_WORDS[base]}, play {number}" if base in _WORDS and number.isdigit() else name


def briefly(words: str) -> str:
    """A parameter in words, without what stands in brackets behind them."""
    return words.partition(" (")[0]
