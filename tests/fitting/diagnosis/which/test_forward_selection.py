"""Forward selection: beside which effects a second one is looked for."""

from edge_worlds import drives, record

from fitting.diagnosis.refit._whitened_model import WhitenedModel
from fitting.diagnosis.which._base import fit_base
from fitting.diagnosis.which._forward_selection import select_effects
from rapi_jax.effects import Etalon, Pickup


def test_where_a_pair_explains_the_data_it_is_not_looked_for_from_its_other_member():
    session = drives((10.0, 40.0), amplitudes=(3.0, 2.0))
    etalon = Etalon(amplitude=0.3, spacing=15.0, phase=0.4)
    pickup = Pickup.at(amplitude=0.3, hertz=50.0)
    lines: list[str] = []
    fitted = fit_base(WhitenedModel.of(record(session, etalon, pickup)), None)
    found = select_effects(fitted, (Etalon, Pickup), lines.append)
    assert found.best.name == "etalon+pickup"
    assert len([line for line in lines if line.endswith("and another")]) == 1
