"""Whether all runs of a recording have about one scan rate, and what then is held in a fit."""

import pytest

from rapi_jax import Recording, triangle
from rapi_jax.operators import FixedRAPI


def recording(*rates):
    drives = triangle(rates, amplitude=4.0, bias=3.0, samples=200)
    return Recording.of(drives, [4.0 * drive.value for drive in drives])


@pytest.mark.parametrize(
    "rates, one",
    [((10.0,), True), ((0.9987, 0.9988), True), ((10.0, 11.9), True), ((10.0, 12.1), False)],
)
def test_rates_within_a_fifth_are_one(rates, one):
    seen = recording(*rates)
    assert seen.one_rate == one
    guess = FixedRAPI.guess(seen, plays=4, each=("rho",))
    assert ("zeta" in guess.held(seen)) == one
