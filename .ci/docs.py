"""Reference pages from docstrings, into `site/`. A warning of pdoc's is an error.

Folders get a page, private modules do not. pdoc shows what a package re-exports only where
`__all__` says so, and nothing that is loaded when it is first used: both are seen to first.
"""

import importlib
import pkgutil
import sys
import warnings
from pathlib import Path
from types import ModuleType

import pdoc

PACKAGES = ("rapi_jax", "fitting", "hardware")
PRIVATE = r"!.*\._.*"  # left out


def declare_public_names(module: ModuleType) -> None:
    """Say what a package re-exports, and load what it loads late."""
    names = list(getattr(module, "__all__", ())) or [
        name
        for name, value in vars(module).items()
        if not name.startswith("_")
        and not isinstance(value, ModuleType)
        and getattr(value, "__module__", "").startswith(module.__name__.split(".")[0])
    ]
    for name in names:
        setattr(module, name, getattr(module, name))
    rooms = [found.name for found in pkgutil.iter_modules(getattr(module, "__path__", ()))]
    names += [room for room in rooms if not room.startswith("_") and room not in names]
    module.__all__ = names  # pyright: ignore[reportAttributeAccessIssue]


def main(output: Path) -> None:
    """Write the pages."""
    for package in PACKAGES:
        root = importlib.import_module(package)
        modules = [root] + [
            importlib.import_module(found.name)
            for found in pkgutil.walk_packages(root.__path__, f"{package}.")
            if "._" not in found.name
        ]
        for module in modules:
            declare_public_names(module)
    pdoc.render.configure(docformat="markdown", math=True)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", category=DeprecationWarning, module="(?!pdoc)")
        pdoc.pdoc(*PACKAGES, PRIVATE, output_directory=output)
    print(f"{len(list(output.rglob('*.html')))} pages in {output}")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "site"))
