"""`python -m fitting`: the command line, where `rapi` is not on the path."""

from .cli import main

main()
