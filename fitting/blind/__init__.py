"""The withheld-effect check: simulated lasers whose effect is known to the examiner alone.

The generator of worlds (`_world` and the modules beside it that it imports) rests on NumPy and SciPy
only. It shares no code with the model or the estimator, so that a diagnosis is never scored on data
made by its own code.
"""
