"""The withheld-effect check: simulated lasers whose effect is known to the examiner alone.

The simulator (`fitting.blind.simulator`) rests on
NumPy and SciPy only. It shares no code with the model or the estimator, so that a diagnosis is
never scored on data made by its own code.

`draw` in `fitting.blind.simulator._simulated_device` gives one world, `bank` in
`fitting.blind.simulator._bank` the specifications of many.
"""
