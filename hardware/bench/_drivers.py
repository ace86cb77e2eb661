"""The drivers that `bench.toml` can name: those of this package, and those handed over."""

import inspect
from collections.abc import Iterable, Mapping
from typing import Any, TypeAlias

from hardware._driver import AbstractDriver, AbstractDriverTable
from hardware.digitizer._base import AbstractDigitizer, AbstractDigitizerTable
from hardware.digitizer._infiniivision import InfiniiVision
from hardware.digitizer._niscope import NiScope
from hardware.digitizer._replay import ReplayDigitizer
from hardware.generator._afg31000 import AFG31000
from hardware.generator._base import AbstractGenerator, AbstractGeneratorTable
from hardware.laser._base import AbstractLaser, AbstractLaserTable
from hardware.laser._tlb6700 import TLB6700
from rapi_jax import DataError
from rapi_jax.io import printable

Driver: TypeAlias = type[AbstractDriver]
Drivers: TypeAlias = Mapping[str, Mapping[str, Driver]]  # by family, then by kind

FAMILIES: dict[str, tuple[Driver, type[AbstractDriverTable]]] = {
    "generator": (AbstractGenerator, AbstractGeneratorTable),
    "laser": (AbstractLaser, AbstractLaserTable),
    "digitizer": (AbstractDigitizer, AbstractDigitizerTable),
}
# The first of a family is meant where the file names no kind.
PACKAGED: tuple[Driver, ...] = (AFG31000, TLB6700, InfiniiVision, NiScope, ReplayDigitizer)


def collect_drivers(own: Iterable[Driver] = ()) -> Drivers:
    """The drivers of this package and `own`, by family and kind.

    Raises `DataError` for a class that is no driver, or whose kind is taken.
    """
    found: dict[str, dict[str, Driver]] = {family: {} for family in FAMILIES}
    for driver in (*PACKAGED, *own):
        family = _family(driver)
        if found[family].setdefault(driver.kind, driver) is not driver:
            raise DataError(
                f"There are two drivers of kind '{printable(driver.kind)}' for a {family}. Give "
                f"{driver.__name__} another `kind`."
            )
    return found


def find_driver(drivers: Drivers, family: str, kind: str) -> Driver:
    """The driver of that kind. Raises `DataError` that lists the kinds there are."""
    if kind not in drivers[family]:
        known = ", ".join(f"'{one}'" for one in drivers[family])
        raise DataError(f"there is no driver '{printable(kind, 40)}', only {known}")
    return drivers[family][kind]


def validate_table(drivers: Drivers, family: str, value: Any) -> AbstractDriverTable:
    """What the file holds for an instrument, as the table of the driver that it names.

    Raises `DataError` for an unknown driver, `pydantic.ValidationError` for a wrong table.
    """
    if isinstance(value, AbstractDriverTable):
        return value
    default = next(iter(drivers[family]))
    kind = value.get("kind", default) if isinstance(value, dict) else default
    driver = find_driver(drivers, family, str(kind))
    if isinstance(value, dict):
        value = {**value, "kind": driver.kind}
    return driver.Table.model_validate(value)


def _family(driver: Driver) -> str:
    """The family of a driver that declares all that it must."""
    name = driver.__name__
    family = next((one for one, (base, _) in FAMILIES.items() if issubclass(driver, base)), None)
    if family is None:
        raise DataError(f"{name} is no driver of a {', '.join(FAMILIES)}.")
    if inspect.isabstract(driver):
        raise DataError(f"The driver {name} lacks {', '.join(sorted(driver.__abstractmethods__))}.")
    if not isinstance(getattr(driver, "kind", None), str) or not driver.kind:
        raise DataError(f"The driver {name} has no `kind`, its name in `bench.toml`.")
    table = FAMILIES[family][1]
    if not issubclass(getattr(driver, "Table", object), table):
        raise DataError(f"`Table` of the driver {name} must derive from {table.__name__}.")
    return family
