"""What to do after a fit, by its verdict."""

import re
import shlex
from collections.abc import Sequence

# Reasons that say nothing against the recording: the model lacks something.
_OF_THE_MODEL = ("poor fit", "does not generalise", "not predicted", "starts disagree")
_OF_ONE_RUN = ("does not generalise", "not predicted")  # its fault, or the model's
_BETTER_LAW = re.compile(
    r"(?P<fits>describe these runs|predict a swing that was left out) better"
    r".*--operator (?P<name>\w+)"
)


def lacks_an_effect(reasons: Sequence[str]) -> bool:
    """Whether the model leaves more than noise and nothing is wrong with the recording."""
    kinds = [reason.split(":")[0] for reason in reasons]
    return "poor fit" in kinds and all(kind in _OF_THE_MODEL for kind in kinds)


def describe_next(
    reasons: Sequence[str],
    *,
    with_gap: bool = False,
    source: str | None = None,
    folder: str | None = None,
    notes: Sequence[str] = (),
) -> str:
    """The next step, a sentence or two, by the reasons of a verdict: none where it is trusted.

    `with_gap`: whether a trusted fit leaves more than noise. `source`: where the recording is, for
    the command; `folder`: where the result is. `notes`: of the verdict, one of
    which may advise another operator.
    """
    where = "RECORDING" if source is None else shlex.quote(source)
    command = f"`rapi diagnose {where} -o diagnosis`"
    advised = next(filter(None, map(_BETTER_LAW.search, notes)), None)
    too_free = [reason for reason in reasons if not reason.startswith("unidentifiable")]
    if advised and (lacks_an_effect(too_free) or (not too_free and (with_gap or reasons))):
        does = "describes" if advised["fits"].startswith("describe") else "predicts"
        what = advised["fits"].partition(" ")[2]
        return (
            f"Another law of the thresholds {does} {what} better: "
            f"`rapi fit {where} -o result --operator {advised['name']}`. What is left then is for "
            "`rapi diagnose`."
        )
    if lacks_an_effect(reasons):
        some = any(note.startswith("outliers:") for note in notes)
        but = " but for the readings left out" if some else ""
        return (
            f"Nothing was found wrong with the recording{but}: the model lacks something. "
            f"{command} says which effect it is, and adds it to the model."
        )
    if reasons and all(reason.split(":")[0] in _OF_ONE_RUN for reason in reasons):
        return (
            "Where nothing is wrong with what was not predicted (`rapi check` looks at the "
            f"recording alone), the model lacks something: {command} says which effect it is."
        )
    if reasons:
        return "Mend what is listed here and fit again; `rapi check` looks at the recording alone."
    if any(note.startswith("no inverse:") for note in notes):
        return (
            "The model predicts, but has no inverse within the recorded drives, so no drive can be "
            "computed from it (see the note): fit another operator, or record more rates and "
            "swings."
        )
    if with_gap:
        return f"The residual is more than noise: {command} finds its cause."
    made = "" if folder is None else f" {shlex.quote(folder)} --span SPAN --frequency HZ -o drives"
    return f"`rapi compensate{made}` makes drives from this model."
