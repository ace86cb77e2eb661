"""The withheld-effect check: simulated lasers whose effect is known to the examiner alone.

The generator of worlds (`_world`, `_bank` and the modules beside them that they import) rests on
NumPy and SciPy only. It shares no code with the model or the estimator, so that a diagnosis is
never scored on data made by its own code.

`from fitting.blind._world import draw` gives one world, `from fitting.blind._bank import bank` the
specifications of many.
"""
