"""The jobs that the command line of `rapi batch` names."""

import difflib
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from cyclopts import CycloptsError

if TYPE_CHECKING:
    from fitting.batch.jobs._job import Job

Task = Literal["fit", "compensate", "diagnose", "range"]


def usage_error(message: str) -> CycloptsError:
    """A command line that cannot be one."""
    return CycloptsError(msg=message, command_chain=("batch",))


def job_source(
    tokens: Sequence[str], do: Task | None, output: Path, retry: bool, watched: bool
) -> Callable[[], Iterable[list["Job"]]]:
    """What makes the jobs that the command line names; options and paths are checked before."""
    from fitting.batch.jobs._find import find_recordings
    from fitting.commands.shared._tasks import parse_options

    first = next((i for i, token in enumerate(tokens) if token.startswith("-")), len(tokens))
    given, options = list(tokens[:first]), tokens[first:]
    if not given:
        raise usage_error("JOBS is missing: name it before the options.")
    if len(given) == 1 and given[0].endswith(".toml") and Path(given[0]).name != "manifest.toml":
        if watched:
            raise usage_error("--watch is for folders, and not for a list of jobs.")
        listed = _listed_jobs(Path(given[0]), do, options, output, retry)
        return lambda: [listed]
    task = do or "fit"
    options = [*_tokens_of_file(task, given, options), *options]
    made = _Maker(task, parse_options(task, options, Path()), output, retry)
    if watched:
        from fitting.batch.jobs._watch import watch

        return lambda: (made.jobs(paths) for paths in watch(task, given))
    found = made.jobs(find_recordings(task, given))
    return lambda: [found]


def _tokens_of_file(task: Task, paths: Sequence[str], given: Sequence[str]) -> list[str]:
    """What the table of the task in a `rapi.toml` beside the data sets, and `given` does not."""
    from fitting.batch.jobs._jobs_file import option_tokens
    from fitting.commands.run import fail
    from fitting.commands.shared._options_file import find_options_file, locate, read_options
    from fitting.commands.shared._tasks import option_hints

    file = find_options_file([Path(path) for path in paths])
    if file is None or not (options := read_options(file, task)):
        return []
    hints = option_hints(task)
    unknown = [key for key in options if key not in hints]
    if unknown:
        close = difflib.get_close_matches(unknown[0], hints, 1)
        hint = f" Did you mean `{close[0]}`?" if close else ""
        raise usage_error(f"{file}: [{task}] has no option `{unknown[0]}` for a batch.{hint}")
    typed = {token.partition("=")[0] for token in given}
    free = {
        key: locate(value, hints[key], file.parent)
        for key, value in options.items()
        if not typed & {f"--{kind}{key.replace('_', '-')}" for kind in ("", "no-")}
    }
    if free:
        kept = ", ".join(f"{key} = {value}" for key, value in free.items())
        fail("note", f"options of `{task}` from {file}: {kept}.")
    return option_tokens(free)


class _Maker:
    """Makes jobs of paths; each has a name of its own."""

    def __init__(self, task: Task, options: dict[str, Any], output: Path, retry: bool) -> None:
        from fitting.commands.shared._tasks import complete_options

        self._task, self._output, self._retry = task, output, retry
        self._options = complete_options(task, options)
        self._names: dict[str, str] = {}

    def jobs(self, paths: Sequence[str]) -> list["Job"]:
        from fitting.batch.jobs._find import name_jobs

        new = [path for path in paths if path not in self._names]
        names = name_jobs(new, self._names.values())
        self._names |= dict(zip(new, names, strict=True))
        return [self.job(path, self._names[path], self._options) for path in paths]

    def job(self, path: str, name: str, options: dict[str, Any]) -> "Job":
        from fitting.batch.jobs._job import Job
        from rapi_jax import DataError
        from rapi_jax.io import printable

        whole = Path(path).resolve()
        if (self._output / name).resolve() in (whole, *whole.parents):
            raise DataError(
                f"{printable(path)}: its results would be written into it. Choose another output "
                "folder with `-o`."
            )
        return Job(name, path, whole, self._task, options, redo=self._retry)


def _listed_jobs(
    path: Path, do: Task | None, tokens: Sequence[str], output: Path, retry: bool
) -> list["Job"]:
    """The jobs of a TOML file. A job's own options count most, then those of the command line."""
    from fitting.batch.jobs._find import name_jobs
    from fitting.batch.jobs._jobs_file import option_tokens, read_jobs_file
    from fitting.commands.shared._tasks import complete_options, parse_options

    table = read_jobs_file(path)
    task = do or table.do or "fit"
    folder = path.parent
    common = parse_options(task, option_tokens(table.options), folder)
    common |= parse_options(task, tokens, Path())
    maker = _Maker(task, common, output, retry)
    recordings = [str(folder / one.recording) for one in table.job]
    unnamed = [r for r, one in zip(recordings, table.job, strict=True) if one.name is None]
    named = [one.name for one in table.job if one.name is not None]
    rest = iter(name_jobs(unnamed, named))
    return [
        maker.job(
            recording,
            one.name or next(rest),
            complete_options(
                task, common | parse_options(task, option_tokens(one.options), folder)
            ),
        )
        for recording, one in zip(recordings, table.job, strict=True)
    ]
