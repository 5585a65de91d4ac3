"""Files that are opened and saved."""
