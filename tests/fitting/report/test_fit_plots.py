"""The pictures of a fit show what its tables list."""

from types import SimpleNamespace

import numpy as np

from fitting.report.fit._plots import FitPlots


def test_the_correlation_is_of_the_parameters_listed():
    listed = [SimpleNamespace(name=name) for name in ("alpha", "zeta")]
    matrix = np.array([[1.0, 0.1, 0.2], [0.1, 1.0, 0.3], [0.2, 0.3, 1.0]])
    result = SimpleNamespace(
        parameters=listed, names=("alpha", "drift", "zeta"), correlation=matrix
    )
    picture = FitPlots(result).correlation().axes[0]
    assert [text.get_text() for text in picture.get_xticklabels()] == ["alpha", "zeta"]
    np.testing.assert_array_equal(picture.images[0].get_array(), [[1.0, 0.2], [0.2, 1.0]])
