"""What a fit leaves behind: tables for people, JSON for machines, pictures, the loadable model."""

from ._files import MODEL as MODEL
from ._files import TABLE as TABLE
from ._files import json_text as json_text
from ._files import save_figure as save_figure
from ._files import write_fit as write_fit
from ._table import html as html
from ._table import summary as summary
from ._table import tables as tables
