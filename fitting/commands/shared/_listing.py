"""What `rapi --help` says of each command, and what it shows as examples. Imports nothing."""

import dataclasses


@dataclasses.dataclass(frozen=True)
class Command:
    """One command: where its function is, what it does in a sentence, command lines to copy."""

    target: str
    sentence: str
    examples: tuple[str, ...]

    @property
    def epilogue(self) -> str:
        """The examples, under the help of the command."""
        return "\n".join(("Examples:", "", *(f"  {line}" for line in self.examples)))


COMMANDS = {
    "demo": Command(
        "fitting.commands.demo:demo",
        "Show everything on a simulated laser, without data of your own (one to two minutes).",
        ("rapi demo", "rapi demo -o my-demo --seed 1"),
    ),
    "drive": Command(
        "fitting.commands.drive:drive",
        "Make triangles or sines to record a laser with that has no model yet.",
        (
            "rapi drive --rate 10 20 40 --low 0.75 --high 5.25 -o triangles",
            "rapi drive --rate 20 --low 10 --high 60 --limits limits.toml -o triangle",
        ),
    ),
    "import": Command(
        "fitting.commands.import_files.command:import_files",
        "Make a recording from files of an oscilloscope or another program.",
        (
            "rapi import scope.csv",
            "rapi import scope.csv --drive CH1 --drive-unit V --response CH2 --response-scale 4.5 "
            "--response-unit GHz -o my-recording",
            'rapi import scope.csv --drive CH1 --fringes CH2 --interferometer "40.8 MHz" '
            '--cavity CH3 --cavity-spacing "1.5 GHz" -o my-recording',
            "rapi import scope.csv --drive CH1 --response CH2 --drive-as fitted --skip-periods 1 "
            "-o my-recording",
            "rapi import data.mat --drive u --response y --sample-rate 100000 -o my-recording",
        ),
    ),
    "check": Command(
        "fitting.commands.check:check",
        "Say what a recording holds and what it allows, without a fit.",
        ("rapi check my-recording", "rapi check monday tuesday --json"),
    ),
    "fit": Command(
        "fitting.commands.fit:fit",
        "Identify a model from a recording and say whether it can be trusted.",
        (
            "rapi fit my-recording -o result",
            "rapi fit my-recording -o result --plays 12 --intervals profile",
            "rapi fit new-runs --check result",
        ),
    ),
    "predict": Command(
        "fitting.commands.predict:predict",
        "Compute a model's response to the drives of a recording.",
        (
            "rapi predict result another-recording -o prediction",
            "rapi predict result drives/drive_20Hz.csv -o prediction",
        ),
    ),
    "compensate": Command(
        "fitting.commands.compensate.command:compensate",
        "Make the drives with which the laser scans in a straight line.",
        (
            "rapi compensate result --span 60 --frequency 10 20 40 -o drives",
            "rapi compensate result --span 60 --frequency 20 --limits limits.toml -o drives",
            "rapi compensate diagnosis --span 60 --frequency 20 --without etalon -o drives",
        ),
    ),
    "diagnose": Command(
        "fitting.commands.diagnose:diagnose",
        "Find what a model lacks: where, which effect, and how much it explains.",
        (
            "rapi diagnose my-recording -o diagnosis",
            "rapi diagnose another-recording --model result -o diagnosis",
            "rapi diagnose --compare before after -o changes",
        ),
    ),
    "measure": Command(
        "fitting.commands.measure:measure",
        "Play a drive on a bench, real or simulated, and record the response.",
        (
            "rapi measure bench.toml drives/drive_40Hz.csv -o sent --dry-run",
            "rapi measure bench.toml drives/drive_40Hz.csv -o recording",
        ),
    ),
    "bench": Command(
        "fitting.commands.bench.app:app",
        "Check the instruments of a bench, or start a simulated laboratory.",
        (),
    ),
    "range": Command(
        "fitting.commands.range:range_command",
        "Compute distance and velocity from fringes of frequency scans.",
        ("rapi range records -o result", "rapi range records -o result --method counting"),
    ),
    "batch": Command(
        "fitting.commands.batch.command:batch",
        "Fit, diagnose or compensate many recordings; interrupted, it resumes.",
        (
            "rapi batch recordings -o results --workers 8",
            "rapi batch 'day*/scan*' -o diagnoses --do diagnose --model result",
        ),
    ),
    "population": Command(
        "fitting.commands.population.command:population",
        "Follow the parameters of one device over many fits.",
        (
            "rapi population results -o population",
            "rapi population results -o population --check new-recording",
        ),
    ),
    "blind": Command(
        "fitting.commands.blind:app",
        "Check the diagnosis on simulated devices whose effect it is not told.",
        (),
    ),
    "cache": Command(
        "fitting.commands.cache:cache",
        "Show or clear the compiled programs that are kept.",
        ("rapi cache", "rapi cache --clear"),
    ),
}

FIRST_STEPS = """\
rapi makes the frequency scan of a piezo-tuned laser linear. Where to begin:

  rapi demo                          everything on a simulated laser, one to two minutes
  rapi drive --rate 10 20 40 --low 0.75 --high 5.25 -o triangles
                                     triangles to send to the laser, to record its response
  rapi import scope.csv              your own file: lists its columns, says what to add
  rapi check my-recording            what the recording allows, in seconds
  rapi fit my-recording -o result    identify a model and say whether it can be trusted
  rapi compensate result --span 60 --frequency 10 20 -o drives
                                     the drives for a straight scan
  rapi diagnose my-recording -o diagnosis
                                     what the model lacks: where, and which effect

`rapi --help` lists all commands, `rapi COMMAND --help` explains one with examples.
"""
