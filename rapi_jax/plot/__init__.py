"""Pictures: the only package that imports matplotlib. Functions return figures and show nothing.

Most take `ax=`: axes of your own to draw one picture, or one run, into.
"""

from matplotlib.figure import Figure as Figure

from ._diagnoses import answers as answers
from ._diagnoses import gap_of_runs as gap_of_runs
from ._diagnoses import signature as signature
from ._fits import convergence as convergence
from ._fits import correlation as correlation
from ._fits import residuals as residuals
from ._fits import spectrum as spectrum
from ._population import population as population
from ._ranging import ranging as ranging
from ._recordings import loops as loops
from ._recordings import overview as overview
from ._recordings import predictions as predictions
from ._scans import compensation as compensation
from ._scans import learning as learning
from ._scans import scans as scans
from ._scans import word_lengths as word_lengths
from ._style import Picture as Picture
from ._style import narrowed as narrowed
from ._style import png as png
from ._style import svg as svg
