"""`python -m rapi_jax`: the command that this distribution installs as `rapi`."""

import sys
from importlib.metadata import entry_points

found = tuple(entry_points(group="console_scripts", name="rapi"))
if not found:
    sys.exit("The command line is not installed: `pip install .` in the project's folder.")
found[0].load()()
