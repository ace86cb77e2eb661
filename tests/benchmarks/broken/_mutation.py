"""One thing that is broken on purpose."""

import dataclasses


@dataclasses.dataclass(frozen=True)
class Mutation:
    """What is broken, where, and the part of the short tier that runs."""

    law: str
    file: str
    old: str
    new: str
    tests: str
