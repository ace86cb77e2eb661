"""Reports: tables for people, JSON for machines, figures, the loadable model."""

from .fit._claim_check import render_claim_check as render_claim_check
from .fit._files import MODEL as MODEL
from .fit._files import TABLE as TABLE
from .fit._files import save_figure as save_figure
from .fit._files import write_fit as write_fit
from .fit._table import fold_notes as fold_notes
from .fit._table import render_brief as render_brief
from .fit._table import render_html as render_html
from .fit._table import render_tables as render_tables
from .fit._table import render_text as render_text
