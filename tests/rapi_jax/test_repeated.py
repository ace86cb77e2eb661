"""A drive of one period, played again and again."""

import numpy as np
import pytest

from rapi_jax import DataError, Drive, repeated, triangle


@pytest.mark.parametrize("periods", [1, 3])
def test_it_is_the_drive_of_so_many_periods(periods):
    (one,) = triangle(20.0, amplitude=2.0, bias=3.0, samples=500)
    (several,) = triangle(20.0, amplitude=2.0, bias=3.0, samples=500 * periods, periods=periods)
    made = repeated(one, periods)
    np.testing.assert_allclose(made.time, several.time, atol=1e-15)
    np.testing.assert_allclose(made.value, several.value, atol=1e-12)
    assert made.periods == periods and made.rate == 20.0


def test_a_drive_that_has_several_gives_its_first():
    (three,) = triangle(20.0, amplitude=2.0, bias=3.0, samples=600, periods=3)
    assert repeated(three, 2).size == 400


def test_what_does_not_repeat_is_refused():
    once = Drive(np.arange(10.0), np.arange(10.0), None, "step")
    with pytest.raises(DataError, match="drive that repeats"):
        repeated(once, 2)
    (drive,) = triangle(20.0, amplitude=2.0, bias=3.0)
    with pytest.raises(ValueError, match="1 or more"):
        repeated(drive, 0)
