"""The page around everything: its start, its guard, its header, and the one view that ties the parts together."""
