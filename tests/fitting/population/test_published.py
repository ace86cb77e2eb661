"""Published meta-analyses, whose model is that of a population: estimates with known variances.

BCG vaccine against tuberculosis, 13 trials (Colditz et al. 1994, JAMA 271, 698), log relative
risks; results by REML as in the documentation of R's metafor (Viechtbauer 2010, J. Stat. Softw.
36(3), and its `dat.bcg`). Five trials of periodontal treatment with two outcomes (Berkey et al.
1998, Stat. Med. 17, 2537), by REML as in the documentation of metafor's `dat.berkey1998`.
"""

import numpy as np
import pytest
from populations import record

from fitting.population._fit_population import fit_records

# vaccinated: cases, others; not vaccinated: cases, others; latitude, year
BCG = np.array([
    [4, 119, 11, 128, 44, 1948], [6, 300, 29, 274, 55, 1949], [3, 228, 11, 209, 42, 1960],
    [62, 13536, 248, 12619, 52, 1977], [33, 5036, 47, 5761, 13, 1973],
    [180, 1361, 372, 1079, 44, 1953], [8, 2537, 10, 619, 19, 1973],
    [505, 87886, 499, 87892, 13, 1980], [29, 7470, 45, 7232, 27, 1968],
    [17, 1699, 65, 1600, 42, 1961], [186, 50448, 141, 27197, 18, 1974],
    [5, 2493, 3, 2338, 33, 1969], [27, 16886, 29, 17825, 33, 1976],
], dtype=float)  # fmt: skip
# difference in attachment level (AL), in probing depth (PD); variances AL, PD; covariance
BERKEY = np.array([
    [-0.32, 0.47, 0.0077, 0.0075, 0.0030], [-0.60, 0.20, 0.0008, 0.0057, 0.0009],
    [-0.12, 0.40, 0.0014, 0.0021, 0.0007], [-0.31, 0.26, 0.0015, 0.0029, 0.0009],
    [-0.39, 0.56, 0.0304, 0.0148, 0.0072],
])  # fmt: skip


def bcg(**columns):
    cases, others, cases_0, others_0 = BCG[:, :4].T
    value = np.log(cases / (cases + others)) - np.log(cases_0 / (cases_0 + others_0))
    variance = 1 / cases - 1 / (cases + others) + 1 / cases_0 - 1 / (cases_0 + others_0)
    extra = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    extra = extra or [{}] * len(value)
    return [
        record([y], [[v]], label=f"{i}", **more)
        for i, (y, v, more) in enumerate(zip(value, variance, extra, strict=True))
    ]


def plain_stderr(population):
    """Standard errors as if the variance between trials were known, as published."""
    return np.sqrt(np.diag(population.model.covariance))


def test_the_variance_and_mean_of_the_bcg_trials():
    found = fit_records(bcg(), covariates=(), keep_outliers=True)
    (p,) = found.parameters
    assert p.scatter**2 == pytest.approx(0.3132, abs=5e-5)
    assert found.model.diagonal_stderr[0] * found.estimates.scale[0] ** 2 == pytest.approx(
        0.1664, abs=5e-5
    )
    assert p.mean.value == pytest.approx(-0.7145, abs=5e-5)
    assert plain_stderr(found)[0] * found.estimates.scale[0] == pytest.approx(0.1798, abs=5e-5)
    assert p.scatter_low < 0.56 < p.scatter_high and p.mean.stderr > 0.1798


def test_the_regression_of_the_bcg_trials_on_latitude_and_year():
    """Latitude stands for temperature, a year for a day."""
    latitude, year = BCG[:, 4], BCG[:, 5]
    found = fit_records(bcg(warm=latitude, days=year - 1948.0), drift="line", keep_outliers=True)
    (p,) = found.parameters
    assert p.scatter**2 == pytest.approx(0.1108, abs=5e-5)
    assert p.temperature.value == pytest.approx(-0.0280, abs=5e-5)
    assert p.time.value == pytest.approx(0.0019, abs=5e-5)
    spreads, scale = np.array(found.covariates.spreads), found.estimates.scale[0]
    errors = plain_stderr(found)[1:] * scale / spreads
    assert errors == pytest.approx([0.0147, 0.0102], abs=5e-5)


def test_two_correlated_outcomes():
    records = [
        record([al, pd], [[v_al, both], [both, v_pd]], label=f"{i}")
        for i, (al, pd, v_al, v_pd, both) in enumerate(BERKEY)
    ]
    found = fit_records(records, covariates=(), structure="full", keep_outliers=True)
    al, pd = found.parameters
    assert (al.scatter**2, pd.scatter**2) == pytest.approx((0.0327, 0.0117), abs=5e-5)
    assert found.correlation[0, 1] == pytest.approx(0.6088, abs=5e-4)
    assert (al.mean.value, pd.mean.value) == pytest.approx((-0.3392, 0.3534), abs=5e-5)
    errors = plain_stderr(found) * found.estimates.scale
    assert errors == pytest.approx([0.0879, 0.0588], abs=5e-5)
