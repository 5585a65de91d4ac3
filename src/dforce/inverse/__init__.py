"""From measured curves to parameters, and from a wish to settings."""
