"""From measured curves back to forces, parameters and settings."""
