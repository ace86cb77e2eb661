"""What a fit leaves behind: tables for people, JSON for machines, pictures, the loadable model."""

from .fit._files import MODEL as MODEL
from .fit._files import TABLE as TABLE
from .fit._files import save_figure as save_figure
from .fit._files import write_fit as write_fit
from .fit._table import html as html
from .fit._table import summary as summary
from .fit._table import tables as tables
