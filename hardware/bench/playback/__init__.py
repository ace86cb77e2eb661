"""A drive played and recorded: loaded, settled, compared, ended, parked and switched off."""
