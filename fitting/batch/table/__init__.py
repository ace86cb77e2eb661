"""The results of a batch in one table and on one page."""

from ._write import write_page as write_page
from ._write import write_table as write_table
