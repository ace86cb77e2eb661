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
    "d_1": "tuning coefficient",
    "d_2": "quadratic nonlinearity of the tuning",
    "d_3": "cubic nonlinearity of the tuning",
}


def describe_parameter(name: str) -> str:
    """A parameter in words; `name` itself where there is no other.

    A parameter of an effect is its field and the label of the effect, and one with a value for each
    play is named as what they share.
    """
    owner, _, field = name.rpartition(".")
    if owner:
        labels = {cls.__name__: cls.label for cls in effects.ALL}
        return f"{field.replace('_', ' ')} of {labels.get(owner, owner)}"
    if name in _WORDS:
        return _WORDS[name]
    base, _, number = name.rpartition("_")
    if base == "d" and number.isdigit():
        return f"nonlinearity of the tuning of order {number}"
    return f"{_WORDS[base]}, play {number}" if base in _WORDS and number.isdigit() else name


def briefly(words: str) -> str:
    """A parameter in words, without what stands in brackets behind them."""
    return words.partition(" (")[0]
