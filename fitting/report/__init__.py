"""What people read: tables on a terminal and in a notebook."""

from ._table import html as html
from ._table import summary as summary
from ._table import tables as tables
