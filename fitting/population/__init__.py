"""Many recordings of one device: shared means, drift, scatter, and what a new one has changed."""

from ._change import Change as Change
from ._change import ParameterChange as ParameterChange
from ._check_against import check_against as check_against
from ._fit_population import fit_population as fit_population
from ._parameters import Effect as Effect
from ._parameters import PopulationParameter as PopulationParameter
from ._population import Expectation as Expectation
from ._population import Population as Population
from ._recordings import PopulationRecording as PopulationRecording
