"""The smallest sizes that show: what is demanded is just reached there, and noise sets them."""

import pytest
from edge_worlds import drives, record

from fitting.diagnosis.detectability._detectability import SizeSearch, smallest_sizes
from fitting.diagnosis.refit._whitened_model import WhitenedModel
from fitting.diagnosis.which._base import fit_base
from fitting.diagnosis.which._candidate import Candidate
from fitting.diagnosis.which._forward_selection import without_effects
from rapi_jax.effects import ALL, AmplitudeLaw, Delay, Etalon, Pickup

FEW = (Delay, AmplitudeLaw, Etalon, Pickup)


def none(session, **options) -> Candidate:
    """What stands for no effect on a session without any."""
    fitted = fit_base(WhitenedModel.of(record(session, **options)), None)
    return without_effects(fitted.refit, fitted.state, fitted.eta_fixed[1])


@pytest.fixture(scope="module")
def two_amplitudes() -> Candidate:
    return none(drives((10.0, 40.0), amplitudes=(3.0, 2.0)))


def test_every_effect_has_a_size_in_its_own_unit(two_amplitudes):
    found = {size.effect: size for size in smallest_sizes(two_amplitudes, ALL)}
    assert list(found) == [cls.name for cls in ALL]
    assert (found["delay"].parameter, found["delay"].unit) == ("tau", "s")
    assert (found["etalon"].parameter, found["etalon"].unit) == ("amplitude", "GHz")
    assert found["etalon"].others["spacing"]["unit"] == "GHz"
    assert all(size.value is not None and size.value > 0.0 for size in found.values())
    assert all(size.to_dict()["level"] == 0.95 for size in found.values())


@pytest.mark.parametrize("cls", FEW, ids=lambda cls: cls.name)
def test_at_that_size_what_is_demanded_is_just_reached(two_amplitudes, cls, monkeypatch):
    search = SizeSearch(two_amplitudes)
    seen = []
    refined = search._refined

    def spy(ray, strength):
        seen.append((ray, refined(ray, strength)))
        return seen[-1][1]

    monkeypatch.setattr(search, "_refined", spy)
    search.of(cls)
    ((ray, strength),) = seen
    assert search._share(ray, strength) == pytest.approx(1.0, abs=0.05)
    assert search._share(ray, strength / 3.0) < 0.2


def test_half_the_noise_shows_half_the_size(two_amplitudes):
    quiet = none(drives((10.0, 40.0), amplitudes=(3.0, 2.0)), noise=0.01)
    for cls in (Delay, Etalon):
        loud, less = (smallest_sizes(c, (cls,))[0].value for c in (two_amplitudes, quiet))
        assert loud is not None and less is not None
        assert loud / less == pytest.approx(2.0, rel=0.35), cls.name


def test_what_no_size_would_show_has_none():
    """One amplitude says nothing of a dependence on amplitude; one period nothing of noise."""
    (law,) = smallest_sizes(none(drives((10.0, 40.0), amplitudes=(3.0,))), (AmplitudeLaw,))
    assert (law.value, law.parameter) == (None, "gain")
    single = none(drives((10.0, 40.0), amplitudes=(3.0,), periods=1))
    assert [size.value for size in smallest_sizes(single, (Delay, Etalon))] == [None, None]
