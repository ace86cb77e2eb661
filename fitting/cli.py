"""`rapi`: command line, composition root, only place that prints. Commands load when called."""

import sys

from cyclopts import App

app = App(
    name="rapi",
    help="Identify, compensate and diagnose piezo-scanned lasers.",
    version="0.1.0",
    help_format="plaintext",
    suppress_keyboard_interrupt=False,  # `run` says so, and exits with 130
)
app.command("fitting.commands.bench:app", name="bench")
app.command("fitting.commands.blind:app", name="blind")
app.command("fitting.commands.compensate:compensate", name="compensate")
app.command("fitting.commands.demo:demo", name="demo")
app.command("fitting.commands.diagnose:diagnose", name="diagnose")
app.command("fitting.commands.fit:fit", name="fit")
app.command("fitting.commands.measure:measure", name="measure")
app.command("fitting.commands.predict:predict", name="predict")


def main(arguments: list[str] | None = None) -> None:
    """Run `rapi` and exit with the code of the contract."""
    from .commands.run import run_and_leave

    run_and_leave(app, sys.argv[1:] if arguments is None else arguments)


if __name__ == "__main__":
    main()
