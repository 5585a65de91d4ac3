"""dForce: a simulator of tapping-mode and bimodal atomic force microscopy. Its public names are in `__init__.pyi`."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
