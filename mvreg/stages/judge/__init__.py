"""Say whether a registration is reliable."""
