"""`rapi`: command line, composition root, only place that prints. Commands load when called."""

import os
import sys
from typing import Annotated, Any

from cyclopts import App, Parameter

from .commands.shared._help import FilledHelp, description
from .commands.shared._listing import COMMANDS, FIRST_STEPS
from .commands.shared._options_file import apply_options_file, options_hint

app = App(
    name="rapi",
    help="Identify, compensate and diagnose piezo-scanned lasers, and measure distances with them.",
    version="0.1.0",
    help_format="plaintext",
    help_formatter=FilledHelp(),
    help_epilogue="`rapi` alone says where to begin; `rapi COMMAND --help` has examples. "
    "Commands that read data also take options from a `rapi.toml` beside them: a table `[fit]`, "
    "then `starts = 12`. The command line wins.",
    config=apply_options_file,
    suppress_keyboard_interrupt=False,  # `run` says so, and exits with 130
)
for _place, (_name, _one) in enumerate(COMMANDS.items()):
    if _one.examples:
        app.command(
            _one.target,
            name=_name,
            help=_one.sentence,
            sort_key=_place,
            help_epilogue="\n\n".join(filter(None, (options_hint(_name), _one.epilogue))),
        )
    else:  # of several commands of its own
        app.command(_one.target, name=_name, help=_one.sentence, sort_key=_place)
app.register_install_completion_command()
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
    if not tokens:
        sys.stdout.write(FIRST_STEPS)
        return 0
    command, bound, _ = app.parse_args(tokens, exit_on_error=False, print_error=False)
    if isinstance(getattr(command, "__self__", None), App):  # version
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

    given = sys.argv[1:] if arguments is None else arguments
    if given and given[0] in COMMANDS and not {"--help", "-h"}.isdisjoint(given):
        command = app[given[0]]
        if command.default_command is not None:  # its sentence is for the list alone
            command.help = description(command.default_command)
    run_and_leave(app.meta, given)


if __name__ == "__main__":
    main()
