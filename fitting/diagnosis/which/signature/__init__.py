"""The signature of a named effect beside the data, over the axis on which it is regular."""
