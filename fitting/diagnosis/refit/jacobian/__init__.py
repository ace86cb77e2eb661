"""Derivatives of the errors: of the operator in closed form, of effects by secants."""
