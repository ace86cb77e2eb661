"""What limits a distance: each source's standard error, predicted from models, or from records."""

from ._conditions import Budget as Budget
from ._conditions import BudgetLine as BudgetLine
from ._conditions import Conditions as Conditions
from ._conditions import Vibration as Vibration
from ._measured import measured_budget as measured_budget
from ._predicted import predicted_budget as predicted_budget
from ._sensitivity import interpolation_spread as interpolation_spread
