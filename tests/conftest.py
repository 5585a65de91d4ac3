"""Settings that every test shares."""

import os

from hypothesis import settings

# Before anything imports matplotlib: no test needs a screen.
os.environ["MPLBACKEND"] = "Agg"

# No deadline: the first example of a case compiles its kernel.
settings.register_profile("here", deadline=None)
# In CI the same examples every time, so that a red run is a change's own fault.
settings.register_profile("ci", deadline=None, derandomize=True, print_blob=True)
settings.load_profile("ci" if os.environ.get("CI") else "here")
