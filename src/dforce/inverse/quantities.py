"""The further quantities of measured curves and fits: symbol, units and one sentence each."""

from __future__ import annotations

from dforce.core.quantity import Quantity, table

MEASURED = table(
    Quantity("height", "h", "m", "nm", "height", "measured height, larger is farther from the sample; the average "
             "distance except for an offset", ("point",)),
    Quantity("amplitude_2", "A_2", "m", "nm", "amplitude of tone 2",
             "measured amplitude of the second tone, zero to peak", ("point",)),
    Quantity("phase_2", r"\phi_2", "degree", "°", "phase lag of tone 2", "measured lag behind the second tone",
             ("point",)),
    Quantity("frequency_shift", r"\Delta f", "Hz", "Hz", "frequency shift", "shift of the frequency that keeps the "
             "phase of the free motion", ("point",)),
    Quantity("excitation", "", "1", "1", "excitation", "drive that keeps the amplitude, in the unit of the file",
             ("point",)),
    Quantity("branch", "", "1", "1", "regime", "regime of a measured point: 1 attractive, -1 repulsive", ("point",)),
    Quantity("free", "", "1", "1", "free part", "whether a measured point belongs to the free part of its curve",
             ("point",)),
    Quantity("spike", "", "1", "1", "spike", "whether a measured point is a spike, which a fit leaves out", ("point",)),
    Quantity("passive_margin", "", "1", "1", "margin of the passive sample", "sine of the phase minus the amplitude "
             "ratio (off resonance: minus its value without losses), in errors: below -3 the sample would add energy",
             ("point",)),
    Quantity("virial_error", "", "J", "eV", "error of the virial", "random error of a measured virial, from the noise "
             "of its point", ("point",)),
    Quantity("virial_common_error", "", "J", "eV", "common error of the virial", "systematic error of measured "
             "virials, common to all points: from free amplitude, phase offset, k and Q", ("point",)),
    Quantity("dissipated_energy_error", "", "J", "eV", "error of the dissipated energy",
             "random error of a measured dissipated energy, from the noise of its point", ("point",)),
    Quantity("dissipated_energy_common_error", "", "J", "eV", "common error of the dissipated energy",
             "systematic error of measured dissipated energies, common to all points: from free amplitude, phase "
             "offset, k and Q", ("point",)),
)  # fmt: skip

FITS = table(
    Quantity("value", "", "SI", "", "value", "value of a parameter at the minimum, in its own SI unit (`unit`)",
             ("parameter",)),
    Quantity("error", "", "SI", "", "error", "standard deviation of a value from the covariance; NaN if the data do "
             "not constrain the parameter, infinite if they constrain only a product with others", ("parameter",)),
    Quantity("error_low", "", "SI", "", "error below", "distance below the value at which chi-square rises by 1, more "
             "if few free points show the noise, with the other parameters at their best; from the profile if requested",
             ("parameter",)),
    Quantity("error_high", "", "SI", "", "error above", "distance above the value at which chi-square rises by 1, "
             "as `error_low`", ("parameter",)),
    Quantity("interval_low", "", "SI", "", "95 % interval, lower end", "lowest value at which chi-square is within "
             "3.84 of its least, or more if few free points show the noise, over all minima", ("parameter",)),
    Quantity("interval_high", "", "SI", "", "95 % interval, upper end", "highest value at which chi-square is within "
             "3.84 of its least, as `interval_low`", ("parameter",)),
    Quantity("error_given", "", "SI", "", "error passed on", "contribution of the errors of fixed values, such as k",
             ("parameter",)),
    Quantity("start", "", "SI", "", "start", "start value of the fit", ("parameter",)),
    Quantity("prior", "", "SI", "", "prior", "prior value; NaN without a prior", ("parameter",)),
    Quantity("prior_error", "", "SI", "", "error of the prior", "its standard deviation", ("parameter",)),
    Quantity("at_bound", "", "1", "", "at a bound", "whether the value lies at a bound of its range", ("parameter",)),
    Quantity("seen", "", "1", "", "seen", "whether the data constrain the parameter at all", ("parameter",)),
    Quantity("correlation", "r", "1", "1", "correlation", "correlation of the errors of two parameters",
             ("parameter", "parameter_2")),
    Quantity("amplitude_fit", "A", "m", "nm", "amplitude of the model", "amplitude of the best fit at each point",
             ("point", "tone")),
    Quantity("phase_fit", r"\phi", "degree", "°", "phase lag of the model", "phase of the best fit at each point",
             ("point", "tone")),
    Quantity("amplitude_residual", "", "1", "1", "residual of the amplitude",
             "model minus measured amplitude in standard deviations", ("point", "tone")),
    Quantity("phase_residual", "", "1", "1", "residual of the phase",
             "model minus measured phase in standard deviations", ("point", "tone")),
    Quantity("used", "", "1", "", "used", "whether the fit uses a point", ("point",)),
    Quantity("left_out", "", "1", "", "left out", "why the fit leaves a point out: beside a jump, spike, or not selected "
             "(use, direction, branch); empty for a used point", ("point",)),
    Quantity("lost", "", "1", "", "lost", "whether the best fit has no such state at a point", ("point",)),
    Quantity("bootstrap_value", "", "SI", "", "redrawn value", "value from a fit to redrawn residuals",
             ("draw", "parameter")),
    Quantity("bootstrap_error", "", "SI", "", "error by bootstrap", "half the range that holds the middle 68 % of the "
             "redrawn values", ("parameter",)),
    Quantity("profile_varied", "", "SI", "", "value of the profile", "values of the profile", ("profiled", "step")),
    Quantity("profile_chi2", r"\chi^2", "1", "1", "chi-square of the profile",
             "least chi-square over all other parameters at a value", ("profiled", "step")),
    Quantity("search_chi2", r"\chi^2", "1", "1", "chi-square of the starts", "least chi-square at the start of each "
             "search, on some of the points", ("search",)),
    Quantity("minimum_chi2", r"\chi^2", "1", "1", "chi-square of the minima", "chi-square of each different minimum",
             ("minimum",)),
    Quantity("minimum_excluded", "", "1", "", "minimum excluded", "whether a minimum has lost points, or a chi-square "
             "more than 3.84 above the least, as `interval_low`; the intervals of 95 % cover the others", ("minimum",)),
    Quantity("search_value", "", "SI", "", "value of the starts", "value of a parameter at the start of each search",
             ("search", "parameter")),
    Quantity("minimum_value", "", "SI", "", "value of the minima",
             "value of a parameter at each minimum, the lowest first", ("minimum", "parameter")),
)  # fmt: skip
