"""The standard names of what a run gives: symbol, units and one sentence each.

Datasets, pictures, tables and documentation take their words from here.
"""

from __future__ import annotations

from dforce.core.quantity import Amount, Observable, Quantity, Scale, table


def jumps_along(place: str) -> list[str]:
    """Return the names of what a result notes of jumps along the distance ("zc") or the frequency."""
    return [f"jump_{word}" for word in (place, "before", "after", "direction")]


OBSERVABLES = table(
    Observable("amplitude", "A", "m", "nm", "amplitude",
               "amplitude of the detector's signal at each drive tone (lock-in): of the total deflection by default",
               ("tone",), scale=Scale.LENGTH),
    Observable("amplitude_ratio", "A/A_0", "1", "1", "amplitude ratio",
               "amplitude of the first tone as a share of its free amplitude A0; a feedback keeps it at the set point",
               scale=Scale.ONE),
    Observable("phase", r"\phi", "degree", "°", "phase lag",
               "lag of the detector's signal behind each drive tone: 90° when free at resonance, above in net attraction",
               ("tone",), scale=Scale.PHASE),
    Observable("mode_amplitude", "A_n", "m", "nm", "mode amplitude",
               "amplitude of each mode at the tone that drives it (else at the first tone)", ("mode",),
               scale=Scale.LENGTH),
    Observable("mode_phase", r"\phi_n", "degree", "°", "mode phase lag",
               "lag of each mode behind the tone that drives it (else behind the first tone)", ("mode",),
               scale=Scale.PHASE),
    Observable("tip_amplitude", r"A_\mathrm{tip}", "m", "nm", "tip amplitude",
               "amplitude of the tip in the laboratory at each drive tone: of its deflection and the base together", ("tone",),
               scale=Scale.LENGTH),
    Observable("tip_phase", r"\phi_\mathrm{tip}", "degree", "°", "tip phase lag",
               "lag of the tip in the laboratory behind each drive tone", ("tone",), scale=Scale.PHASE),
    Observable("base_amplitude", "Y", "m", "nm", "base amplitude", "amplitude of the driven base at each drive tone",
               ("tone",), scale=Scale.LENGTH),
    Observable("harmonic_amplitude", "A_h", "m", "nm", "harmonic amplitude",
               "amplitude of the total deflection at multiples of the drive frequency", ("harmonic",),
               scale=Scale.LENGTH),
    Observable("harmonic_phase", r"\phi_h", "degree", "°", "harmonic phase lag",
               "lag of each harmonic behind the same multiple of the drive's phase", ("harmonic",),
               scale=Scale.PHASE),
    Observable("mean_deflection", "z_0", "m", "nm", "mean deflection", "mean of the total deflection",
               scale=Scale.LENGTH),
    Observable("min_deflection", r"z_\mathrm{min}", "m", "nm", "lowest deflection", "lowest total deflection",
               scale=Scale.LENGTH),
    Observable("max_deflection", r"z_\mathrm{max}", "m", "nm", "highest deflection", "highest total deflection",
               scale=Scale.LENGTH),
    Observable("half_peak_to_peak", r"A_\mathrm{pp}/2", "m", "nm", "half peak-to-peak",
               "half the distance between highest and lowest deflection; differs from the amplitude by harmonics",
               scale=Scale.LENGTH),
    Observable("peak_force", r"F_\mathrm{max}", "N", "nN", "peak force", "largest force on the tip (repulsive positive)",
               scale=Scale.FORCE),
    Observable("min_force", r"F_\mathrm{min}", "N", "nN", "lowest force",
               "lowest force on the tip: the strongest attraction, if any", scale=Scale.FORCE),
    Observable("mean_force", r"\langle F \rangle", "N", "pN", "mean force", "mean force on the tip",
               scale=Scale.FORCE),
    Observable("min_distance", r"d_\mathrm{min}", "m", "nm", "closest distance",
               "smallest tip–surface distance; below a0 in contact", scale=Scale.LENGTH),
    Observable("max_indentation", r"\delta_\mathrm{max}", "m", "nm", "indentation",
               "largest indentation a0 - d; zero without contact", scale=Scale.LENGTH),
    Observable("contact_time", "t_c", "s", "µs", "contact time", "time in contact (d < a0) per period of the first tone",
               scale=Scale.PERIOD),
    Observable("contact_fraction", "t_c/T", "1", "%", "contact fraction", "contact time as a share of the period",
               scale=Scale.ONE),
    Observable("peak_velocity", r"v_\mathrm{max}", "m/s", "µm/s", "peak velocity", "largest speed of the tip",
               scale=Scale.SPEED),
    Observable("virial", "V_n", "J", "eV", "virial",
               "mean of force times each mode's motion at its tone: positive in net attraction", ("mode",),
               scale=Scale.ENERGY),
    Observable("dissipated_energy", "E_n", "J", "eV", "dissipated energy",
               "energy that the sample dissipates from each mode's motion at its tone, per period of this tone", ("mode",),
               scale=Scale.ENERGY),
    Observable("total_virial", "V", "J", "eV", "total virial", "mean of force times total deflection about its mean",
               scale=Scale.ENERGY),
    Observable("total_dissipated_energy", "E", "J", "eV", "total dissipated energy",
               "energy that the sample dissipates per period of the first tone, from the whole motion", scale=Scale.ENERGY),
    Observable("base_energy", r"E_\mathrm{base}", "J", "eV", "energy through the base",
               "part of the total dissipated energy from the moving base, per period of the first tone",
               scale=Scale.ENERGY),
    Observable("apparent_dissipated_energy", r"E_\mathrm{app}", "J", "eV", "apparent dissipated energy",
               "dissipated energy by the formula from amplitude and phase, for a force drive of one mode at resonance, "
               "per period of each tone", ("tone",), scale=Scale.ENERGY),
    Observable("power", "P", "W", "fW", "dissipated power", "mean power that the sample dissipates", scale=Scale.POWER),
    Observable("settling_periods", "N", "1", "1", "settling periods",
               "periods of the first tone until amplitudes and phases were constant", scale=Scale.NONE),
    Observable("drift", r"\Delta A/A_0", "1", "1", "remaining drift",
               "remaining change relative to the free amplitude: extrapolated for a transient, the mismatch of start and end "
               "for a periodic orbit", scale=Scale.NONE),
    Observable("corrections", "N", "1", "1", "Newton corrections", "corrections of Newton's method to the periodic orbit",
               scale=Scale.NONE),
    Observable("error_estimate", r"\epsilon", "1", "1", "estimated error",
               "largest estimated error of a quantity from the steps of the integration, as a share of its scale",
               scale=Scale.NONE),
    Observable("multiplier_modulus", r"|\mu|", "1", "1", "Floquet multiplier",
               "factor by which a small disturbance of the orbit grows until the motion repeats: stable below 1",
               ("multiplier",), scale=Scale.NONE),
    Observable("multiplier_angle", r"\arg\mu", "degree", "°", "angle of the Floquet multiplier",
               "angle by which a small disturbance turns until the motion repeats", ("multiplier",),
               scale=Scale.NONE),
)  # fmt: skip

TRACES = table(
    Quantity("deflection", "z", "m", "nm", "deflection", "total tip deflection, up positive", ("time",)),
    Quantity("mode_deflection", "z_n", "m", "nm", "mode deflection", "deflection of each mode", ("mode", "time")),
    Quantity("base", "Y", "m", "nm", "base", "motion of the driven base, up positive", ("time",)),
    Quantity("velocity", r"\dot z", "m/s", "µm/s", "velocity", "tip velocity, up positive", ("time",)),
    Quantity("distance", "d", "m", "nm", "distance", "instantaneous tip–surface distance", ("time",)),
    Quantity("force", "F", "N", "nN", "force", "force on the tip, repulsive positive", ("time",)),
    Quantity("indentation", r"\delta", "m", "nm", "indentation", "indentation a0 - d in contact, else zero", ("time",)),
    Quantity("partial_force", "F_i", "N", "nN", "force of each model",
             "force of each model on the tip", ("model", "time")),
    Quantity("force_part", "F_i", "N", "nN", "part of the force",
             "part of the force on the tip, by interaction", ("interaction", "time")),
    Quantity("energy", "E", "J", "eV", "energy taken",
             "energy that the sample has dissipated so far", ("time",)),
    Quantity("spectrum", "A(f)", "m", "nm", "spectrum",
             "amplitude spectrum of the deflection", ("frequency",)),
)  # fmt: skip

NOISES = table(
    Quantity("amplitude_noise", r"\delta A", "m", "pm", "amplitude noise",
             "standard deviation of the amplitude at each drive tone, from a lock-in with this bandwidth", ("tone",)),
    Quantity("phase_noise", r"\delta\phi", "degree", "°", "phase noise",
             "standard deviation of the phase at each drive tone, from a lock-in with this bandwidth", ("tone",)),
    Quantity("spectral_density", "S(f)", "m^2/Hz", "m^2/Hz", "spectral density",
             "one-sided spectral density of the detector's signal", ("frequency",)),
    Quantity("fitted_density", r"S_\mathrm{fit}(f)", "m^2/Hz", "m^2/Hz", "fitted spectral density",
             "fit of white noise and a resonance for each mode to the spectral density", ("frequency",)),
    Quantity("fitted_f0", r"f_\mathrm{fit}", "Hz", "kHz", "fitted frequency", "resonance frequency from the fit", ("mode",)),
    Quantity("fitted_Q", r"Q_\mathrm{fit}", "1", "1", "fitted quality factor", "quality factor from the fit", ("mode",)),
    Quantity("spring_constant", "k", "N/m", "N/m", "spring constant",
             "spring constant from a calibration", ("calibration",)),
    Quantity("true_spring_constant", r"k_\mathrm{true}", "N/m", "N/m", "true spring constant",
             "true spring constant for a calibration: of mode 1, or static",
             ("calibration",)),
    Quantity("spring_constant_ratio", r"k/k_\mathrm{true}", "1", "1", "spring constant over the true one",
             "spring constant from a calibration, divided by the true one", ("calibration",)),
    Quantity("spring_constant_error", r"\delta k/k", "1", "%", "error of the spring constant",
             "relative standard error of a thermal spring constant from the noise of the spectrum"),
    Quantity("mode_spring_constant", "k_n", "N/m", "N/m", "spring constant of each mode",
             "thermal spring constant of each mode by its own calibration", ("mode",)),
    Quantity("true_mode_spring_constant", r"k_{n,\mathrm{true}}", "N/m", "N/m", "true spring constant of each mode",
             "spring constant of each mode of the case", ("mode",)),
    Quantity("switching_rate", r"\Gamma", "1/s", "1/s", "switching rate",
             "rate at which thermal motion switches a state to another", ("temperature",)),
    Quantity("switching_rate_low", r"\Gamma_\mathrm{low}", "1/s", "1/s", "lower end of the switching rate",
             "lower end of the 95 % interval of the switching rate", ("temperature",)),
    Quantity("switching_rate_high", r"\Gamma_\mathrm{high}", "1/s", "1/s", "upper end of the switching rate",
             "upper end of the 95 % interval of the switching rate", ("temperature",)),
    Quantity("switches", "N", "1", "1", "switches", "number of counted switches", ("temperature",)),
    Quantity("watched_time", "t", "s", "s", "time at risk",
             "total time of all lanes before their switches", ("temperature",)),
    Quantity("barrier", r"\Delta U", "J", "eV", "barrier",
             "activation energy of the switching rate; for a still lever the barrier itself"),
    Quantity("seed", "", "1", "1", "seed", "seed of the random numbers of a run"),
    Quantity("temperature", "T", "K", "K", "temperature", "temperature of the medium"),
    Quantity("calibration", "", "", "", "calibration", "method for the spring constant from a thermal spectrum"),
    Quantity("rest_distance", "d_a", "m", "nm", "rest distance", "distance at which a still lever rests"),
    Quantity("barrier_distance", "d_b", "m", "nm", "distance of the barrier",
             "distance beyond which a still lever snaps in"),
    Quantity("snap_in_zc", r"\langle z_c \rangle", "m", "nm", "snap-in distance",
             "mean average distance at which a still lever snaps in on approach", ("speed",)),
    Quantity("snap_in_spread", r"\sigma_{z_c}", "m", "nm", "spread of the snap-in distance",
             "standard deviation of the snap-in distance by thermal motion", ("speed",)),
    Quantity("static_snap_in_zc", "z_0", "m", "nm", "static snap-in distance",
             "average distance at which a still lever snaps in without thermal motion"),
    Quantity("speed", "v", "m/s", "µm/s", "speed", "speed of the approach"),
)  # fmt: skip

MOTION, REPEATS = "motion", "repeat_periods"  # the motion at each point, from which anything can go on

JUMPS = table(
    Quantity("jump_zc", "z_c", "m", "nm", "distance of the jump",
             "average distance at which the motion jumped to another state: at the end of its own state, or behind a sudden "
             "step",
             ("jump",)),
    Quantity("jump_frequency", "f", "Hz", "kHz", "frequency of the jump",
             "drive frequency at which the motion jumped to another state: at the end of its own state, or behind a sudden "
             "step",
             ("jump",)),
    Quantity("jump_before", "A", "m", "nm", "amplitude before the jump", "amplitude before the jump", ("jump",)),
    Quantity("jump_after", "A", "m", "nm", "amplitude after the jump", "amplitude after the jump", ("jump",)),
    Quantity("jump_direction", "", "1", "1", "direction of the jump",
             "approach or retract; of a frequency sweep up or down", ("jump",)),
)  # fmt: skip

DRIFTING = table(
    Quantity("free_amplitude", "A_0", "m", "nm", "free amplitude",
             "amplitude of the detector's signal without tip–sample forces, at each distance of a lever that changes",
             ("tone",)),
    Quantity("resonance_frequency", "f_0", "Hz", "kHz", "resonance frequency",
             "resonance frequency of a mode, at each distance of a lever that changes", ("mode",)),
    Quantity("quality_factor", "Q", "1", "1", "quality factor",
             "quality factor of a mode, at each distance of a lever that changes", ("mode",)),
)  # fmt: skip

AXES = DRIFTING | table(
    Quantity("zc", "z_c", "m", "nm", "average tip–surface distance",
             "average tip–surface distance: rest position of the undeflected tip above the undeformed surface"),
    Quantity("zc_ratio", "z_c/A_0", "1", "1", "distance ratio",
             "average tip–surface distance as a share of the first tone's free amplitude A0"),
    Quantity("time", "t", "s", "µs", "time", "time"),
    Quantity("frequency", "f", "Hz", "kHz", "frequency", "frequency"),
    Quantity("tone", "j", "1", "1", "tone", "drive tone, counted from 1"),
    Quantity("mode", "n", "1", "1", "mode", "cantilever mode, counted from 1"),
    Quantity("harmonic", "h", "1", "1", "harmonic", "multiple of the drive frequency"),
    Quantity("multiplier", "k", "1", "1", "multiplier", "Floquet multiplier, counted from the largest"),
    Quantity("model", "", "1", "1", "model", "force model"),
    Quantity("direction", "", "1", "1", "direction",
             "approach (far to near) or retract (near to far); of a frequency sweep up or down"),
    Quantity("point", "", "1", "1", "point", "point on a curve of states, counted from 1"),
    Quantity("branch", "", "1", "1", "curve", "number of the connected curve of a point"),
    Quantity("stable", "", "1", "1", "stable", "whether small disturbances die out: an experiment can show only such states"),
    Quantity("special", "", "", "", "special point",
             "fold: the curve turns back. period_doubling. torus: stability is lost to a slow beat. grazing: the tip just "
             "reaches a distance where a force is not smooth. end: the curve cannot be followed further. Or empty"),
    Quantity("escape", "", "m", "nm", "distance to the unstable state",
             "distance of a stable state from the nearest unstable state, at the start of the period: the largest change, over "
             "the modes, of deflection and of velocity over angular frequency. Fragile states have a small distance"),
    Quantity("repeat_periods", "n", "1", "1", "periods until the motion repeats",
             "periods of the first tone after which the motion repeats: the common period of the tones, or twice that and "
             "more behind a period doubling"),
    Quantity("searched", "", "1", "1", "searched value", "value at which states on other curves were searched"),
    Quantity("index_sum", "", "1", "1", "sum of the indices",
             "sum of sign det(1 - M) over the states at a searched value, with the monodromy matrix M of each. It differs "
             "from 1 "
             "if a state is missing. Forces that jump, have branches or a memory are not covered"),
    Quantity("start_amplitude", "A", "m", "nm", "initial amplitude", "amplitude of the motion at the start"),
    Quantity("start_phase", r"\phi", "degree", "°", "initial phase lag",
             "lag behind the first tone at the start"),
    Quantity("start_deflection", "z", "m", "nm", "initial deflection", "deflection at the start"),
    Quantity("start_velocity", r"\dot z", "m/s", "µm/s", "initial velocity", "velocity at the start"),
    Quantity("state", "", "1", "1", "state", "steady state, counted from the state of most starts"),
    Quantity("reached", "", "1", "1", "state reached", "steady state that the motion settles to; 0: none"),
    Quantity("motion", "", "SI", "", "motion",
             "motion at the start of a common period: deflection and velocity of each mode, then the late parts of the "
             "fluid, then memory and branches of the forces"),
    Quantity("component", "", "", "", "component", "number of the motion; component_units gives its unit"),
    Quantity("share", "", "1", "%", "share", "share of the starts that lead to a state"),
)  # fmt: skip

RECONSTRUCTED = table(
    Quantity("force_error", r"\sigma_F", "N", "nN", "error of the force",
             "standard deviation of a reconstructed force from noise, smoothing and gaps",
             ("distance",)),
    Quantity("force_noise", r"\sigma_F", "N", "nN", "noise of the force",
             "standard deviation of a reconstructed force from the errors of amplitude and phase alone", ("distance",)),
    Quantity("gap_error", r"\sigma_F", "N", "nN", "error of the force from gaps",
             "standard deviation of a reconstructed force from gaps nearby or farther out", ("distance",)),
    Quantity("resolution", r"\Delta d", "m", "nm", "resolution",
             "distance over which a reconstructed force is averaged", ("distance",)),
    Quantity("force_status", "", "1", "1", "status of the force",
             "determined, blind (no turning point at this distance) or uncertain (the error is above a tenth of the range)",
             ("distance",)),
    Quantity("classic_force", "F", "N", "nN", "force by a formula",
             "force by a formula in use for sinusoidal paths: sader_jarvis, holscher, payam, or the inversion "
             "of this program with sinusoids", ("formula", "distance")),
    Quantity("law_force", "F", "N", "nN", "force of the law", "force by the law of the case, in a slow approach",
             ("distance",)),
    Quantity("damping", r"\Gamma", "kg/s", "ug/s", "damping coefficient",
             "drag on the tip over its velocity, equivalent to the energy that the sample dissipates", ("distance",)),
    Quantity("damping_error", r"\sigma_\Gamma", "kg/s", "ug/s", "error of the damping coefficient",
             "standard deviation of the damping coefficient", ("distance",)),
    Quantity("closest_approach", "D", "m", "nm", "closest approach",
             "smallest distance of the tip's path at a point of the curve, with harmonics and mean deflection",
             ("point",)),
    Quantity("fundamental_virial", "V", "J", "eV", "virial of the fundamental",
             "mean of force times the tip's motion at the drive frequency, from amplitude and phase", ("point",)),
    Quantity("virial_error", r"\sigma_V", "J", "eV", "error of the virial",
             "standard deviation of the virial, including the effect of the amplitude error on the path", ("point",)),
    Quantity("virial_residual", r"\Delta V/\sigma_V", "1", "1", "residual of the virial",
             "virial minus the virial of the reconstructed force, over its error", ("point",)),
    Quantity("fundamental_energy", "E_1", "J", "eV", "energy of the fundamental",
             "energy that the force dissipates from the tip's motion at the drive frequency in a period, from amplitude and "
             "phase",
             ("point",)),
    Quantity("sample_energy", r"E_\mathrm{dis}", "J", "eV", "energy that the sample dissipates",
             "energy of the fundamental minus the loss of the harmonics in the medium", ("point",)),
    Quantity("energy_error", r"\sigma_E", "J", "eV", "error of the energy",
             "standard deviation of the energy of the fundamental", ("point",)),
    Quantity("gap_low", "", "m", "nm", "lower end of a gap", "distance below which motions turn again", ("gap",)),
    Quantity("gap_high", "", "m", "nm", "upper end of a gap", "distance above which motions turn", ("gap",)),
)  # fmt: skip

MEASURED = table(
    Quantity("height", "h", "m", "nm", "height",
             "measured height, larger is farther from the sample; the average distance except for an offset",
             ("point",)),
    Quantity("amplitude_2", "A_2", "m", "nm", "amplitude of tone 2", "measured amplitude of the second tone, zero to peak",
             ("point",)),
    Quantity("phase_2", r"\phi_2", "degree", "°", "phase lag of tone 2", "measured lag behind the second tone", ("point",)),
    Quantity("frequency_shift", r"\Delta f", "Hz", "Hz", "frequency shift",
             "shift of the frequency that keeps the phase of the free motion", ("point",)),
    Quantity("excitation", "", "1", "1", "excitation", "drive that keeps the amplitude, in the unit of the file", ("point",)),
    Quantity("branch", "", "1", "1", "regime", "regime of a measured point: 1 attractive, -1 repulsive", ("point",)),
    Quantity("free", "", "1", "1", "free part", "whether a measured point belongs to the free part of its curve", ("point",)),
    Quantity("passive_margin", "", "1", "1", "margin of the passive sample",
             r"sine of the phase minus the amplitude ratio (off resonance: minus its value without losses), in errors: "
             "below -3 the sample would add energy", ("point",)),
    Quantity("virial_error", "", "J", "eV", "error of the virial", "random error of a measured virial, from the noise of its "
                                                                   "point",
             ("point",)),
    Quantity("virial_common_error", "", "J", "eV", "common error of the virial",
             "systematic error of measured virials, common to all points: from free amplitude, phase offset, k and "
             "Q", ("point",)),
    Quantity("dissipated_energy_error", "", "J", "eV", "error of the dissipated energy",
             "random error of a measured dissipated energy, from the noise of its point", ("point",)),
    Quantity("dissipated_energy_common_error", "", "J", "eV", "common error of the dissipated energy",
             "systematic error of measured dissipated energies, common to all points: from free amplitude, phase offset, k "
             "and Q",
             ("point",)),
)  # fmt: skip

FITS = table(
    Quantity("value", "", "SI", "", "value", "value of a parameter at the minimum, in its own SI unit (`unit`)",
             ("parameter",)),
    Quantity("error", "", "SI", "", "error", "standard deviation of a value from the covariance; NaN if the data do not "
                                             "constrain "
             "the parameter, infinite if they constrain only a product with others", ("parameter",)),
    Quantity("error_low", "", "SI", "", "error below", "distance below the value at which chi-square rises by 1, with the "
                                                       "other "
             "parameters at their best; from the profile if requested", ("parameter",)),
    Quantity("error_high", "", "SI", "", "error above", "distance above the value at which chi-square rises by "
                                                        "1", ("parameter",)),
    Quantity("interval_low", "", "SI", "", "95 % interval, lower end", "lowest value at which chi-square is within 3.84 of its "
             "least, over all minima", ("parameter",)),
    Quantity("interval_high", "", "SI", "", "95 % interval, upper end", "highest value at which chi-square is within 3.84 of "
             "its least, over all minima", ("parameter",)),
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
    Quantity("lost", "", "1", "", "lost", "whether the best fit has no such state at a point", ("point",)),
    Quantity("bootstrap_value", "", "SI", "", "redrawn value", "value from a fit to redrawn residuals",
             ("draw", "parameter")),
    Quantity("bootstrap_error", "", "SI", "", "error by bootstrap",
             "half the range that holds the middle 68 % of the redrawn values", ("parameter",)),
    Quantity("profile_varied", "", "SI", "", "value of the profile", "values of the profile",
             ("profiled", "step")),
    Quantity("profile_chi2", r"\chi^2", "1", "1", "chi-square of the profile",
             "least chi-square over all other parameters at a value", ("profiled", "step")),
    Quantity("search_chi2", r"\chi^2", "1", "1", "chi-square of the starts", "least chi-square at the start of each search, on "
             "some of the points", ("search",)),
    Quantity("minimum_chi2", r"\chi^2", "1", "1", "chi-square of the minima", "chi-square of each different minimum",
             ("minimum",)),
    Quantity("minimum_excluded", "", "1", "", "minimum excluded", "whether a minimum has lost points, or a chi-square more "
                                                                  "than 3.84 above the least; "
             "the intervals of 95 % cover the others", ("minimum",)),
    Quantity("search_value", "", "SI", "", "value of the starts", "value of a parameter at the start of each search",
             ("search", "parameter")),
    Quantity("minimum_value", "", "SI", "", "value of the minima", "value of a parameter at each minimum, the lowest first",
             ("minimum", "parameter")),
)  # fmt: skip

OF_RESULTS = OBSERVABLES | TRACES | NOISES | JUMPS | AXES | RECONSTRUCTED  # what the variables of a result may be

NONE = "none"  # what a reader is shown of an amount below its estimated error


AMOUNTS = {
    "peak_force": Amount("force", 1), "min_force": Amount("force", -1), "mean_force": Amount("force"),
    "max_indentation": Amount("length"), "contact_time": Amount("period"), "contact_fraction": Amount("share"),
    "power": Amount("power"), "energy": Amount("work"),
} | dict.fromkeys(
    ("virial", "dissipated_energy", "total_virial", "total_dissipated_energy", "base_energy", "apparent_dissipated_energy"),
    Amount("energy"),
)  # fmt: skip
