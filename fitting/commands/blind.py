"""`rapi blind`: make a bank of simulated lasers, diagnose it, score and calibrate."""

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import App, Parameter, validators

Bank = Annotated[Path, Parameter(name="BANK", negative="")]
Workers = Annotated[int | None, Parameter(validator=validators.Number(gte=1, lte=256))]
Count = Annotated[int, Parameter(validator=validators.Number(gte=1, lte=100_000))]
Follow = Annotated[int, Parameter(validator=validators.Number(gte=0, lte=1000))]
Limit = Annotated[int | None, Parameter(validator=validators.Number(gte=1))]
Seed = Annotated[int | None, Parameter(validator=validators.Number(gte=0))]
Json = Annotated[bool, Parameter(negative="")]

app = App(
    name="blind",
    help="Check the diagnosis on simulated lasers whose effect is withheld from it.",
    help_format="plaintext",
    help_epilogue="",
)


@app.command
def commit(bank: Path, /, *, json: Json = False) -> int:
    """Commit to a sealed bank in the folder BANK: draw its secret, print the hash to publish.

    Publish the hash before `rapi blind make BANK --tier sealed`: the seed of the bank is computed
    from the secret and from the code at the time it is made.

    Parameters
    ----------
    bank
        A new folder.
    json
        Print one JSON object on standard output.
    """
    from fitting.blind.protocol._folder import BankFolder
    from fitting.blind.protocol._sealed import commit_to_secret
    from fitting.commands.shared._out import console, print_json

    value = commit_to_secret(BankFolder(bank))
    if json:
        print_json({"schema": "rapi.blind-commitment/1", "secret_sha256": value})
    else:
        console(json).print(value, markup=False)
    return 0


@app.command
def make(
    bank: Path,
    /,
    *,
    tier: Literal[
        "open", "calibration", "nulls", "withheld", "sessions", "seen", "hysteresis", "sealed"
    ] = "open",
    count: Count = 200,
    seed: Seed = None,
    json: Json = False,
) -> int:
    """Simulate a bank of lasers in the folder BANK, or what is missing of it.

    Parameters
    ----------
    bank
        Folder for the bank; made if missing.
    tier
        `open`: for development; `calibration`: for thresholds and probabilities; `nulls`: no
        effect at all; `withheld`: the true effect is not among the candidates; `sessions`: recorded
        in sessions of many designs, of 1 to 12 runs; `seen`: the second set of forms and unlisted
        effects, once unseen, for development; `hysteresis`: actuators of four other families, half
        of them with an effect; `sealed`: seeded by the code and a secret, to be
        scored once, half of its forms and unlisted effects in no other tier.
    count
        How many lasers.
    seed
        Seed of the bank; by default each tier has one of its own.
    json
        Print one JSON object on standard output.
    """
    from fitting.blind.protocol._folder import BankFolder
    from fitting.blind.protocol._make import make_bank
    from fitting.commands.shared._out import console, print_json

    with _progress("making") as report:
        about = make_bank(BankFolder(bank), tier, count=count, seed=seed, progress=report)
    if json:
        print_json(about)
    else:
        out = console(json)
        noun = "recording" if about["count"] == 1 else "recordings"
        out.print(f"{about['count']} {noun} of tier {tier} in {bank}", markup=False)
    return 0


@app.command
def predict(
    bank: Path,
    /,
    *,
    workers: Workers = None,
    limit: Limit = None,
    baselines: bool = True,
    json: Json = False,
) -> int:
    """Diagnose the recordings of BANK in processes that cannot read the answers.

    Predictions that exist are kept. `rapi blind score` makes missing predictions too.

    Parameters
    ----------
    bank
        A folder that `rapi blind make` wrote.
    workers
        Processes; by default two, or one where there is one processor.
    limit
        Diagnose only the first so many recordings.
    baselines
        Also record the verdicts of simpler methods.
    json
        Print one JSON object on standard output.
    """
    from fitting.blind.prediction._predictions import predict_bank
    from fitting.blind.protocol._folder import BankFolder
    from fitting.commands.shared._out import console, print_json

    with _progress("predicting") as report:
        done = predict_bank(
            BankFolder(bank), workers=workers, limit=limit, baselines=baselines, progress=report
        )
    if json:
        print_json({"schema": "rapi.blind-progress/1", **done})
    else:
        console(json).print(
            f"{done['predictions']} predictions, {done['new']} of them new; {done['raised']} "
            f"diagnoses ended in an error. They are in {bank / 'predictions'}.",
            markup=False,
        )
    return 0


@app.command
def score(
    bank: Path, /, *, follow: Follow = 40, workers: Workers = None, json: Json = False
) -> int:
    """Diagnose what is missing, freeze the predictions, reveal the answers of BANK and score.

    Writes `scores.json`, `scores.md` and `failures.csv` to BANK. Nothing is scored where an answer
    or a prediction is not the one committed to.

    Parameters
    ----------
    bank
        A folder that `rapi blind make` wrote.
    follow
        How many devices whose 95 % credible set holds several causes are measured once more, with
        the advised scan and with a random one, and diagnosed again.
    workers
        Processes; by default two, or one where there is one processor.
    json
        Print `scores.json` on standard output.
    """
    from fitting.blind.protocol._folder import BankFolder
    from fitting.blind.scoring._score_bank import FAILURES, SCORES, TABLE, score_bank
    from fitting.commands.shared._out import console, print_json

    with _progress("scoring") as report:
        scores = score_bank(BankFolder(bank), follow=follow, workers=workers, progress=report)
    if json:
        print_json(scores)
        return 0
    out = console(json)
    out.print((bank / TABLE).read_text(encoding="utf-8"), markup=False)
    out.print(f"written to {bank}: {SCORES}, {TABLE}, {FAILURES}", markup=False)
    return 0


@app.command
def calibrate(
    bank: Path,
    /,
    *,
    output: Annotated[Path, Parameter(name=["--output", "-o"])],
    sets: bool = False,
    workers: int | None = None,
    json: Json = False,
) -> int:
    """Calibrate the diagnosis' probabilities on BANK: diagnose what is missing, reveal, fit.

    Writes a calibration file, which takes effect where it replaces the one in this package.
    With `--sets` the constants stay, and sets are widened until they hold the answer in 95 %.

    Parameters
    ----------
    bank
        A bank of tier calibration (or open), not a sealed one: that is for scoring only.
    output
        File for the calibration.
    sets
        Widen the sets alone; BANK must be another one than the constants were fitted to.
    workers
        Processes; by default two, or one where there is one processor.
    json
        Print the calibration on standard output.
    """
    from fitting.blind.protocol._folder import BankFolder, write_json
    from fitting.blind.scoring._calibrate import calibrate_to_bank
    from fitting.blind.scoring._widening import widen_to_bank
    from fitting.commands.shared._out import console, print_json

    folder, lines, told = BankFolder(bank), [], {}
    with _progress("predicting") as report:
        if sets:
            found, types = widen_to_bank(folder, workers=workers, progress=report)
            told = {"coverage": types}
            for name, one in types.items():
                shares = f"sets hold {one['held']} of {one['n']}"
                lines.append(f"{name}: factor {one['factor']:.3g}, {shares}")
        else:
            found, loss = calibrate_to_bank(folder, workers=workers, progress=report)
            told = {"loss": loss}
            before, after = loss["before"], loss["after"]
            lines.append(f"mean log loss {before:.3f}, with this calibration {after:.3f}")
    write_json(output, found.to_dict())
    if json:
        print_json({**found.to_dict(), **told})
    else:
        for line in [*lines, f"written to {output}"]:
            console(json).print(line, markup=False)
    return 0


@contextlib.contextmanager
def _progress(title: str) -> Iterator[Callable[[int, int, str], None]]:
    """Show progress on standard error, where that is a terminal."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn
    from rich.progress import TimeRemainingColumn as TimeLeft

    target = Console(stderr=True)
    columns: Any = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeLeft(),
        TextColumn("{task.fields[name]}", markup=False),
    )
    with Progress(*columns, console=target, transient=True, disable=not target.is_terminal) as bar:
        task = bar.add_task(title, total=None, name="")

        def report(done: int, total: int, name: str) -> None:
            bar.update(task, completed=done, total=total, name=name)

        yield report
