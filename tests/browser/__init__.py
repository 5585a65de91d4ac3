"""A package, so that its tests can have a browser together."""
