"""The withheld-effect check: diagnoses scored on simulated lasers of known effect.

The simulator (`fitting.blind.simulator`) rests on NumPy and SciPy only. It shares no code with the
model or the estimator, so that a diagnosis is never scored on data made by its own code.
`draw_device` in `_simulated_device` simulates one device, `bank` in `_bank` specifies many.
"""
