"""The instrument: cantilever, drive, read-out, tip, sample, contact and medium, as a user describes them."""

from dforce.instrument.base import BaseMotion, Piezo
from dforce.instrument.beam_lever import Beam
from dforce.instrument.drift import Drift
from dforce.instrument.drive import Drive, Tone, ToneNumbers
from dforce.instrument.heights import Heights, heights_of
from dforce.instrument.lever import Cantilever, Mode
from dforce.instrument.medium import Medium
from dforce.instrument.modes import ModeNumbers
from dforce.instrument.noise import Noise, NoiseNumbers
from dforce.instrument.readout import Readout, ReadoutNumbers
from dforce.instrument.sample import Contact, Sample, effective_modulus
from dforce.instrument.tip import Tip

__all__ = [
    "BaseMotion",
    "Beam",
    "Cantilever",
    "Contact",
    "Drift",
    "Drive",
    "Heights",
    "Medium",
    "Mode",
    "ModeNumbers",
    "Noise",
    "NoiseNumbers",
    "Piezo",
    "Readout",
    "ReadoutNumbers",
    "Sample",
    "Tip",
    "Tone",
    "ToneNumbers",
    "effective_modulus",
    "heights_of",
]
