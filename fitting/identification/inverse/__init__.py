"""The paper's inverse operator, identified on recordings with drive and response exchanged."""
