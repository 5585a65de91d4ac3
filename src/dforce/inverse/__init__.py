"""From a wish to the settings of an instrument."""
