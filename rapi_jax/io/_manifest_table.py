"""What tables of a manifest have in common, checked by pydantic: loaded when one is read."""

import difflib
import itertools
from typing import Any

import pydantic

from ._safe import printable


class ManifestTable(pydantic.BaseModel):
    """A table of a manifest: keys may be added freely by others, but none is misspelt."""

    model_config = pydantic.ConfigDict(extra="allow", strict=True, protected_namespaces=())

    @pydantic.model_validator(mode="before")
    @classmethod
    def _no_misspelt_key(cls, data: Any) -> Any:
        if isinstance(data, dict):
            missing = [field.alias or key for key, field in cls.model_fields.items()]
            missing = [key for key in missing if key not in data]
            for key in itertools.islice(data.keys() - cls.model_fields.keys(), 100):
                if near := difflib.get_close_matches(str(key)[:40], missing, n=1, cutoff=0.9):
                    raise ValueError(f"unknown key '{printable(key, 40)}': is `{near[0]}` meant?")
        return data
