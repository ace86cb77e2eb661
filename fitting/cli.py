"""`rapi`: command line, composition root, only place that prints. Commands load when called."""

import os
import sys
from typing import Annotated, Any

from cyclopts import App, Parameter

app = App(
    name="rapi",
    help="Identify, compensate and diagnose piezo-scanned lasers, and range with them.",
    version="0.1.0",
    help_format="plaintext",
    suppress_keyboard_interrupt=False,  # `run` says so, and exits with 130
)
app.command("fitting.commands.batch:batch", name="batch")
app.command("fitting.commands.bench.app:app", name="bench")
app.command("fitting.commands.blind:app", name="blind")
app.command("fitting.commands.cache:cache", name="cache")
app.command("fitting.commands.check:check", name="check")
app.command("fitting.commands.compensate:compensate", name="compensate")
app.command("fitting.commands.demo:demo", name="demo")
app.command("fitting.commands.diagnose:diagnose", name="diagnose")
app.command("fitting.commands.fit:fit", name="fit")
app.command("fitting.commands.import_files:import_files", name="import")
app.command("fitting.commands.measure:measure", name="measure")
app.command("fitting.commands.population.command:population", name="population")
app.command("fitting.commands.predict:predict", name="predict")
app.command("fitting.commands.range:range_command", name="range")
app.meta.end_of_options_delimiter = ""  # `--` is for the commands
app.meta.suppress_keyboard_interrupt = False


@app.meta.default
def launch(
    *tokens: Annotated[str, Parameter(show=False, allow_leading_hyphen=True)],
    no_compile_cache: Annotated[
        bool, Parameter(negative="", group="Options of all commands", show_default=False)
    ] = False,
) -> Any:
    """Run one command, with what it compiles kept for the next one.

    Parameters
    ----------
    tokens
        The command and its arguments.
    no_compile_cache
        Neither read nor keep compiled programs (`rapi cache` tells where they are).
    """
    command, bound, _ = app.parse_args(tokens, exit_on_error=False, print_error=False)
    if isinstance(getattr(command, "__self__", None), App):  # help, version
        return command(*bound.args, **bound.kwargs)
    from .commands.run import fail
    from .compile_cache import SWITCH, compiled_programs_kept

    if no_compile_cache:
        os.environ[SWITCH] = "0"
    with compiled_programs_kept(lambda line: fail("note", line)):
        return command(*bound.args, **bound.kwargs)


def main(arguments: list[str] | None = None) -> None:
    """Run `rapi` and exit with the code of the contract."""
    from .commands.run import run_and_leave

    run_and_leave(app.meta, sys.argv[1:] if arguments is None else arguments)


if __name__ == "__main__":
    main()
