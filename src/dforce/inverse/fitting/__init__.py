"""Parameters of a case from measured curves, with errors; and the parameters that a curve constrains."""

from dforce.inverse.fitting.foresight import identify
from dforce.inverse.fitting.foresight_words import identify_in_words, identify_report
from dforce.inverse.fitting.many import fit_many
from dforce.inverse.fitting.repeat import fit_again
from dforce.inverse.fitting.report import chi2_in_words, compare_fits, fit_report
from dforce.inverse.fitting.run import fit

__all__ = [
    "chi2_in_words",
    "compare_fits",
    "fit",
    "fit_again",
    "fit_many",
    "fit_report",
    "identify",
    "identify_in_words",
    "identify_report",
]
