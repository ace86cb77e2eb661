"""One more effect among others: where it acts, and where that matters, at the other end."""

from fitting.diagnosis.which._effect_sets import insert_effect
from rapi_jax.effects import AmplifierLowpass, Delay, ModeHop, Quantisation, Saturation

HOP = ModeHop.at(size=0.7, threshold=60.0, width=0.5)
LAG = Delay.at(tau=2e-4)


def test_one_more_effect_on_the_drive_may_come_first_or_last():
    rounded, lag, cut = (
        Quantisation.at(step=0.1),
        AmplifierLowpass.at(tau=1e-4),
        Saturation.at(high=4),
    )
    assert insert_effect((lag,), rounded) == (rounded, lag)
    assert insert_effect((lag,), rounded, other_order=True) == (lag, rounded)
    assert insert_effect((rounded,), lag, other_order=True) == (lag, rounded)
    assert insert_effect((rounded, lag), cut) == (rounded, cut, lag)
    assert insert_effect((rounded, lag), cut, other_order=True) == (rounded, lag, cut)
    assert insert_effect((rounded, HOP), lag, other_order=True) == (lag, rounded, HOP)
    assert insert_effect((HOP,), rounded, other_order=True) == (rounded, HOP)  # none to come first
    assert insert_effect((HOP,), LAG, other_order=True) == insert_effect((HOP,), LAG)
