"""From measured curves back to what they tell: forces, parameters, settings."""
