"""Many recordings of one device: shared means, drift, scatter, and what a new one has changed."""

from ._change import Change as Change
from ._change import ParameterChange as ParameterChange
from ._check_against import check_against as check_against
from ._fit_population import fit_population as fit_population
from ._population import Effect as Effect
from ._population import Expectation as Expectation
from ._population import Population as Population
from ._population import PopulationParameter as PopulationParameter
from ._population import PopulationRecording as PopulationRecording
