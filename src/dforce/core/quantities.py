"""The standard names of what a run gives: symbol, units and one sentence each.

Datasets, pictures, tables and documentation take their words from here.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Observable:
    """A quantity in a result: its name in the Dataset, symbol, stored unit, unit shown and meaning."""

    name: str
    symbol: str
    unit: str
    shown: str
    label: str
    doc: str
    dims: tuple[str, ...] = ()


def jumps_along(place: str) -> list[str]:
    """Return the names of what a result notes of jumps along the distance ("zc") or the frequency."""
    return [f"jump_{word}" for word in (place, "before", "after", "direction")]


def _table(*rows: Observable) -> dict[str, Observable]:
    return {row.name: row for row in rows}


OBSERVABLES = _table(
    Observable("amplitude", "A", "m", "nm", "amplitude",
               "amplitude that the detector reads at each drive tone (lock-in): of the total deflection by default",
               ("tone",)),
    Observable("amplitude_ratio", "A/A_0", "1", "1", "amplitude ratio",
               "amplitude of the first tone as a share of its free amplitude A0: what a feedback holds at the set point"),
    Observable("phase", r"\phi", "degree", "°", "phase lag",
               "lag that the detector reads behind each drive tone: 90° when free at resonance, above in net attraction",
               ("tone",)),
    Observable("mode_amplitude", "A_n", "m", "nm", "mode amplitude",
               "amplitude of each mode at the tone that drives it (the first tone where none does)", ("mode",)),
    Observable("mode_phase", r"\phi_n", "degree", "°", "mode phase lag",
               "lag of each mode behind the tone that drives it (the first tone where none does)", ("mode",)),
    Observable("tip_amplitude", r"A_\mathrm{tip}", "m", "nm", "tip amplitude",
               "amplitude of the tip in the laboratory at each drive tone: of its deflection and the base together", ("tone",)),
    Observable("tip_phase", r"\phi_\mathrm{tip}", "degree", "°", "tip phase lag",
               "lag of the tip in the laboratory behind each drive tone", ("tone",)),
    Observable("base_amplitude", "Y", "m", "nm", "base amplitude", "amplitude of the shaken base at each drive tone",
               ("tone",)),
    Observable("harmonic_amplitude", "A_h", "m", "nm", "harmonic amplitude",
               "amplitude of the total deflection at multiples of the drive frequency", ("harmonic",)),
    Observable("harmonic_phase", r"\phi_h", "degree", "°", "harmonic phase lag",
               "lag of each harmonic behind the same multiple of the drive's phase", ("harmonic",)),
    Observable("mean_deflection", "z_0", "m", "nm", "mean deflection", "mean of the total deflection"),
    Observable("min_deflection", r"z_\mathrm{min}", "m", "nm", "lowest deflection", "lowest total deflection"),
    Observable("max_deflection", r"z_\mathrm{max}", "m", "nm", "highest deflection", "highest total deflection"),
    Observable("half_peak_to_peak", r"A_\mathrm{pp}/2", "m", "nm", "half peak-to-peak",
               "half the distance between highest and lowest deflection; differs from the amplitude by harmonics"),
    Observable("peak_force", r"F_\mathrm{max}", "N", "nN", "peak force", "largest force on the tip (repulsive positive)"),
    Observable("min_force", r"F_\mathrm{min}", "N", "nN", "lowest force",
               "lowest force on the tip: the strongest attraction, where there is one"),
    Observable("mean_force", r"\langle F \rangle", "N", "pN", "mean force", "mean force on the tip"),
    Observable("min_distance", r"d_\mathrm{min}", "m", "nm", "closest distance",
               "smallest tip–surface distance; below a0 in contact"),
    Observable("max_indentation", r"\delta_\mathrm{max}", "m", "nm", "indentation",
               "largest indentation a0 - d; zero without contact"),
    Observable("contact_time", "t_c", "s", "µs", "contact time", "time in contact (d < a0) per period of the first tone"),
    Observable("contact_fraction", "t_c/T", "1", "%", "contact fraction", "contact time as a share of the period"),
    Observable("peak_velocity", r"v_\mathrm{max}", "m/s", "µm/s", "peak velocity", "largest speed of the tip"),
    Observable("virial", "V_n", "J", "eV", "virial",
               "mean of force times each mode's motion at its tone: positive in net attraction", ("mode",)),
    Observable("dissipated_energy", "E_n", "J", "eV", "dissipated energy",
               "energy that the sample takes from each mode's motion at its tone, per period of that tone", ("mode",)),
    Observable("total_virial", "V", "J", "eV", "total virial", "mean of force times total deflection about its mean"),
    Observable("total_dissipated_energy", "E", "J", "eV", "total dissipated energy",
               "energy that the sample takes per period of the first tone, all motion included"),
    Observable("base_energy", r"E_\mathrm{base}", "J", "eV", "energy through the base",
               "part of the total dissipated energy that the moving base brings by itself, per period of the first tone"),
    Observable("apparent_dissipated_energy", r"E_\mathrm{app}", "J", "eV", "apparent dissipated energy",
               "dissipated energy that amplitude and phase seem to tell, as for a force that drives one mode at resonance, "
               "per period of each tone", ("tone",)),
    Observable("power", "P", "W", "fW", "dissipated power", "mean power that the sample takes"),
    Observable("settling_periods", "N", "1", "1", "settling periods",
               "periods of the first tone until amplitudes and phases had stopped moving"),
    Observable("drift", r"\Delta A/A_0", "1", "1", "remaining drift",
               "how far from steady the motion is, relative to the free amplitude: what is still to come of the "
               "settling, or by how much a periodic orbit misses its start"),
    Observable("corrections", "N", "1", "1", "Newton corrections", "corrections by which the periodic orbit was found"),
    Observable("error_estimate", r"\epsilon", "1", "1", "estimated error",
               "largest estimated error of a quantity by the steps of the integration, as a share of its scale: A0, 1 rad A0/A,"
               " omega A0, period, largest force, k A0^2 or k A0^2/Q"),
    Observable("multiplier_modulus", r"|\mu|", "1", "1", "Floquet multiplier",
               "factor by which a small disturbance of the orbit grows until the motion repeats: stable below 1",
               ("multiplier",)),
    Observable("multiplier_angle", r"\arg\mu", "degree", "°", "angle of the Floquet multiplier",
               "angle by which a small disturbance turns until the motion repeats", ("multiplier",)),
)  # fmt: skip

TRACES = _table(
    Observable("deflection", "z", "m", "nm", "deflection", "total tip deflection, up positive", ("time",)),
    Observable("mode_deflection", "z_n", "m", "nm", "mode deflection", "deflection of each mode", ("mode", "time")),
    Observable("base", "Y", "m", "nm", "base", "motion of the shaken base, up positive", ("time",)),
    Observable("velocity", r"\dot z", "m/s", "µm/s", "velocity", "tip velocity, up positive", ("time",)),
    Observable("distance", "d", "m", "nm", "distance", "instantaneous tip–surface distance", ("time",)),
    Observable("force", "F", "N", "nN", "force", "force on the tip, repulsive positive", ("time",)),
    Observable("indentation", r"\delta", "m", "nm", "indentation", "indentation a0 - d in contact, else zero", ("time",)),
    Observable("partial_force", "F_i", "N", "nN", "force of each model",
               "force on the tip by each model alone", ("model", "time")),
    Observable("energy", "E", "J", "eV", "energy taken",
               "energy that the sample has taken so far", ("time",)),
    Observable("spectrum", "A(f)", "m", "nm", "spectrum",
               "amplitude spectrum of the deflection", ("frequency",)),
)  # fmt: skip

NOISES = _table(
    Observable("amplitude_noise", r"\delta A", "m", "pm", "amplitude noise",
               "standard deviation of the amplitude that a lock-in of the given bandwidth reads at each drive tone", ("tone",)),
    Observable("phase_noise", r"\delta\phi", "degree", "°", "phase noise",
               "standard deviation of the phase that a lock-in of the given bandwidth reads at each drive tone", ("tone",)),
    Observable("spectral_density", "S(f)", "m^2/Hz", "m^2/Hz", "spectral density",
               "one-sided spectral density of what the detector reads", ("frequency",)),
    Observable("fitted_density", r"S_\mathrm{fit}(f)", "m^2/Hz", "m^2/Hz", "fitted spectral density",
               "white noise and a resonance for each mode, as fitted to the spectral density", ("frequency",)),
    Observable("fitted_f0", r"f_\mathrm{fit}", "Hz", "kHz", "fitted frequency", "resonance frequency by the fit", ("mode",)),
    Observable("fitted_Q", r"Q_\mathrm{fit}", "1", "1", "fitted quality factor", "quality factor by the fit", ("mode",)),
    Observable("spring_constant", "k", "N/m", "N/m", "spring constant",
               "spring constant that a calibration gives", ("calibration",)),
    Observable("true_spring_constant", r"k_\mathrm{true}", "N/m", "N/m", "true spring constant",
               "spring constant of the case that a calibration means to give: of mode 1, or for a steady force",
               ("calibration",)),
    Observable("spring_constant_ratio", r"k/k_\mathrm{true}", "1", "1", "spring constant over the true one",
               "spring constant that a calibration gives over the true one", ("calibration",)),
    Observable("spring_constant_error", r"\delta k/k", "1", "%", "error of the spring constant",
               "relative standard error of a thermal spring constant by the noise of the spectrum"),
    Observable("mode_spring_constant", "k_n", "N/m", "N/m", "spring constant of each mode",
               "thermal spring constant of each mode by its own calibration", ("mode",)),
    Observable("true_mode_spring_constant", r"k_{n,\mathrm{true}}", "N/m", "N/m", "true spring constant of each mode",
               "spring constant of each mode of the case", ("mode",)),
    Observable("switching_rate", r"\Gamma", "1/s", "1/s", "switching rate",
               "how often thermal motion takes a state to another one", ("temperature",)),
    Observable("switching_rate_low", r"\Gamma_\mathrm{low}", "1/s", "1/s", "lower end of the switching rate",
               "lower end of the 95 % interval of the switching rate", ("temperature",)),
    Observable("switching_rate_high", r"\Gamma_\mathrm{high}", "1/s", "1/s", "upper end of the switching rate",
               "upper end of the 95 % interval of the switching rate", ("temperature",)),
    Observable("switches", "N", "1", "1", "switches", "number of switches that were seen", ("temperature",)),
    Observable("watched_time", "t", "s", "s", "time at risk",
               "time of all lanes together in which they could have switched", ("temperature",)),
    Observable("barrier", r"\Delta U", "J", "eV", "barrier",
               "energy by which the switching rate goes with temperature; of a still lever the barrier itself"),
    Observable("seed", "", "1", "1", "seed", "seed of the random numbers of a run"),
    Observable("temperature", "T", "K", "K", "temperature", "temperature of the medium"),
    Observable("calibration", "", "", "", "calibration", "how a spring constant is made of a thermal spectrum"),
    Observable("rest_distance", "d_a", "m", "nm", "rest distance", "distance at which a still lever rests"),
    Observable("barrier_distance", "d_b", "m", "nm", "distance of the barrier",
               "distance beyond which a still lever snaps in"),
    Observable("snap_in_zc", r"\langle z_c \rangle", "m", "nm", "snap-in distance",
               "average distance at which a still lever snaps in on its way to the surface, the mean", ("speed",)),
    Observable("snap_in_spread", r"\sigma_{z_c}", "m", "nm", "spread of the snap-in distance",
               "its standard deviation by thermal motion", ("speed",)),
    Observable("static_snap_in_zc", "z_0", "m", "nm", "static snap-in distance",
               "average distance at which a still lever snaps in without thermal motion"),
    Observable("speed", "v", "m/s", "µm/s", "speed", "speed of the approach"),
)  # fmt: skip

MOTION, REPEATS = "motion", "repeat_periods"  # the motion at each point, from which anything can go on

JUMPS = _table(
    Observable("jump_zc", "z_c", "m", "nm", "distance of the jump",
               "average distance at which the motion went to another state: where its own ended, or behind a sudden step",
               ("jump",)),
    Observable("jump_frequency", "f", "Hz", "kHz", "frequency of the jump",
               "drive frequency at which the motion went to another state: where its own ended, or behind a sudden step",
               ("jump",)),
    Observable("jump_before", "A", "m", "nm", "amplitude before the jump", "amplitude before the jump", ("jump",)),
    Observable("jump_after", "A", "m", "nm", "amplitude after the jump", "amplitude after the jump", ("jump",)),
    Observable("jump_direction", "", "1", "1", "direction of the jump",
               "approach or retract; of a frequency sweep up or down", ("jump",)),
)  # fmt: skip

DRIFTING = _table(
    Observable("free_amplitude", "A_0", "m", "nm", "free amplitude",
               "amplitude that the detector reads without tip–sample forces, at a distance with which the lever changes",
               ("tone",)),
    Observable("resonance_frequency", "f_0", "Hz", "kHz", "resonance frequency",
               "resonance frequency of a mode at a distance with which the lever changes", ("mode",)),
    Observable("quality_factor", "Q", "1", "1", "quality factor",
               "quality factor of a mode at a distance with which the lever changes", ("mode",)),
)  # fmt: skip

AXES = DRIFTING | _table(
    Observable("zc", "z_c", "m", "nm", "average tip–surface distance",
               "average tip–surface distance: rest position of the undeflected tip above the undeformed surface"),
    Observable("zc_ratio", "z_c/A_0", "1", "1", "distance ratio",
               "average tip–surface distance as a share of the first tone's free amplitude A0"),
    Observable("time", "t", "s", "µs", "time", "time"),
    Observable("frequency", "f", "Hz", "kHz", "frequency", "frequency"),
    Observable("tone", "j", "1", "1", "tone", "drive tone, counted from 1"),
    Observable("mode", "n", "1", "1", "mode", "cantilever mode, counted from 1"),
    Observable("harmonic", "h", "1", "1", "harmonic", "multiple of the drive frequency"),
    Observable("multiplier", "k", "1", "1", "multiplier", "Floquet multiplier, counted from the largest"),
    Observable("model", "", "1", "1", "model", "force model"),
    Observable("direction", "", "1", "1", "direction",
               "approach (far to near) or retract (near to far); of a frequency sweep up or down"),
    Observable("point", "", "1", "1", "point", "point on a curve of states, counted from 1"),
    Observable("branch", "", "1", "1", "curve", "number of the connected curve that a point lies on"),
    Observable("stable", "", "1", "1", "stable", "whether small disturbances die out, so that an experiment can see the state"),
    Observable("special", "", "", "", "special point",
               "fold (the curve turns back), period_doubling, torus (stability is lost to a slow beat), grazing (the tip just "
               "reaches a distance where a force is not smooth), end (the curve could not be followed beyond), or nothing"),
    Observable("escape", "", "m", "nm", "distance to the unstable state",
               "how far a stable state is from the nearest unstable one, at the start of the period: the largest change, over "
               "the modes, of the deflection and of the velocity over the angular frequency; a measure of how fragile it is"),
    Observable("repeat_periods", "n", "1", "1", "periods until the motion repeats",
               "periods of the first tone after which the motion repeats: the common period of the tones, or twice that and "
               "more behind a period doubling"),
    Observable("searched", "", "1", "1", "searched value", "value at which states on other curves were looked for"),
    Observable("index_sum", "", "1", "1", "sum of the indices",
               "sum of sign det(1 - M) over the states found at a searched value, M the monodromy matrix of each: other than 1 "
               "where a state is missing, unless a force jumps, has branches or a memory"),
    Observable("start_amplitude", "A", "m", "nm", "initial amplitude", "amplitude that the motion starts with"),
    Observable("start_phase", r"\phi", "degree", "°", "initial phase lag",
               "lag behind the first tone that the motion starts with"),
    Observable("start_deflection", "z", "m", "nm", "initial deflection", "deflection that the motion starts with"),
    Observable("start_velocity", r"\dot z", "m/s", "µm/s", "initial velocity", "velocity that the motion starts with"),
    Observable("state", "", "1", "1", "state", "steady state, counted from the one that most starts lead to"),
    Observable("reached", "", "1", "1", "state reached", "steady state that the motion settles to; 0: none"),
    Observable("motion", "", "SI", "", "motion",
               "motion at the start of a common period: deflection and velocity of each mode, then the fluid that follows "
               "late, then memory and branches of the forces"),
    Observable("component", "", "", "", "component", "number of the motion; component_units gives its unit"),
    Observable("share", "", "1", "%", "share", "share of the starts that lead to a state"),
)  # fmt: skip

RECONSTRUCTED = _table(
    Observable("force_error", r"\sigma_F", "N", "nN", "error of the force",
               "standard deviation of a reconstructed force: by noise, by what the smoothing hides and by what gaps hide",
               ("distance",)),
    Observable("force_noise", r"\sigma_F", "N", "nN", "noise of the force",
               "standard deviation of a reconstructed force by the errors of amplitude and phase alone", ("distance",)),
    Observable("gap_error", r"\sigma_F", "N", "nN", "error of the force by gaps",
               "standard deviation of a reconstructed force by what gaps nearby or farther out hide", ("distance",)),
    Observable("resolution", r"\Delta d", "m", "nm", "resolution",
               "distance over which a reconstructed force is averaged", ("distance",)),
    Observable("force_status", "", "1", "1", "status of the force",
               "determined, blind (no motion turned at this distance) or uncertain (the error is above a tenth of the range)",
               ("distance",)),
    Observable("classic_force", "F", "N", "nN", "force by a formula",
               "force by a formula in use, which takes the path for a sinusoid: sader_jarvis, holscher, payam, or the inverse "
               "of this program with sinusoids", ("formula", "distance")),
    Observable("law_force", "F", "N", "nN", "force of the law", "force of the case's own law, moved slowly towards the sample",
               ("distance",)),
    Observable("damping", r"\Gamma", "kg/s", "ug/s", "damping coefficient",
               "drag on the tip over its velocity that takes the energy which the sample takes", ("distance",)),
    Observable("damping_error", r"\sigma_\Gamma", "kg/s", "ug/s", "error of the damping coefficient",
               "standard deviation of the damping coefficient", ("distance",)),
    Observable("closest_approach", "D", "m", "nm", "closest approach",
               "smallest distance of the tip's path at a point of the curve, harmonics and mean deflection included",
               ("point",)),
    Observable("fundamental_virial", "V", "J", "eV", "virial of the fundamental",
               "mean of force times the tip's motion at the drive frequency, from amplitude and phase", ("point",)),
    Observable("virial_error", r"\sigma_V", "J", "eV", "error of the virial",
               "standard deviation of the virial, with what an error of the amplitude does to the path", ("point",)),
    Observable("virial_residual", r"\Delta V/\sigma_V", "1", "1", "residual of the virial",
               "virial less that of the reconstructed force, over its error", ("point",)),
    Observable("fundamental_energy", "E_1", "J", "eV", "energy of the fundamental",
               "energy that the force takes from the tip's motion at the drive frequency in a period, from amplitude and phase",
               ("point",)),
    Observable("sample_energy", r"E_\mathrm{dis}", "J", "eV", "energy that the sample takes",
               "energy of the fundamental less what the harmonics of the path lose in the medium", ("point",)),
    Observable("energy_error", r"\sigma_E", "J", "eV", "error of the energy",
               "standard deviation of the energy of the fundamental", ("point",)),
    Observable("gap_low", "", "m", "nm", "lower end of a gap", "distance below which motions turned again", ("gap",)),
    Observable("gap_high", "", "m", "nm", "upper end of a gap", "distance above which motions turned", ("gap",)),
)  # fmt: skip

MEASURED = _table(
    Observable("height", "h", "m", "nm", "height",
               "height as it was measured, larger is farther from the sample; the average distance but for an offset",
               ("point",)),
    Observable("amplitude_2", "A_2", "m", "nm", "amplitude of tone 2", "measured amplitude of the second tone, zero to peak",
               ("point",)),
    Observable("phase_2", r"\phi_2", "degree", "°", "phase lag of tone 2", "measured lag behind the second tone", ("point",)),
    Observable("frequency_shift", r"\Delta f", "Hz", "Hz", "frequency shift",
               "shift of the frequency that keeps the phase of the free motion", ("point",)),
    Observable("excitation", "", "1", "1", "excitation", "drive that keeps the amplitude, in the unit of the file", ("point",)),
    Observable("branch", "", "1", "1", "regime", "regime of a measured point: 1 attractive, -1 repulsive", ("point",)),
    Observable("free", "", "1", "1", "free part", "whether a measured point belongs to the free part of its curve", ("point",)),
    Observable("passive_margin", "", "1", "1", "margin of the passive sample",
               r"sine of the phase less the amplitude ratio (off resonance: less what a sample without losses has), in errors: "
               "below -3 the sample would give energy", ("point",)),
    Observable("virial_error", "", "J", "eV", "error of the virial", "error of a measured virial by the noise of its point",
               ("point",)),
    Observable("virial_common_error", "", "J", "eV", "common error of the virial",
               "error of measured virials by what all points share: free amplitude, phase offset, k and Q", ("point",)),
    Observable("dissipated_energy_error", "", "J", "eV", "error of the dissipated energy",
               "error of a measured dissipated energy by the noise of its point", ("point",)),
    Observable("dissipated_energy_common_error", "", "J", "eV", "common error of the dissipated energy",
               "error of measured dissipated energies by what all points share: free amplitude, phase offset, k and Q",
               ("point",)),
)  # fmt: skip

FITS = _table(
    Observable("value", "", "SI", "", "value", "value of a parameter at the minimum, in its own SI unit (`unit`)",
               ("parameter",)),
    Observable("error", "", "SI", "", "error", "standard deviation of a value by the covariance; NaN where the data do not see "
               "the parameter, infinite where only a product with others is known", ("parameter",)),
    Observable("error_low", "", "SI", "", "error below", "how far below the value chi-square rises by 1, with the other "
               "parameters where they lower it; by the profile where one was asked for", ("parameter",)),
    Observable("error_high", "", "SI", "", "error above", "how far above the value chi-square rises by 1", ("parameter",)),
    Observable("interval_low", "", "SI", "", "95 % interval, lower end", "value below at which chi-square rises by 3.84",
               ("parameter",)),
    Observable("interval_high", "", "SI", "", "95 % interval, upper end", "value above at which chi-square rises by 3.84",
               ("parameter",)),
    Observable("error_given", "", "SI", "", "error passed on", "error that those of the values given, such as k, leave in it",
               ("parameter",)),
    Observable("start", "", "SI", "", "start", "value that the fit was given to start from", ("parameter",)),
    Observable("prior", "", "SI", "", "prior", "value known beforehand; NaN where there is none", ("parameter",)),
    Observable("prior_error", "", "SI", "", "error of the prior", "its standard deviation", ("parameter",)),
    Observable("at_bound", "", "1", "", "at a bound", "whether the value lies at a bound of its range", ("parameter",)),
    Observable("seen", "", "1", "", "seen", "whether the data see the parameter at all", ("parameter",)),
    Observable("correlation", "r", "1", "1", "correlation", "correlation of the errors of two parameters",
               ("parameter", "parameter_2")),
    Observable("amplitude_fit", "A", "m", "nm", "amplitude of the model", "amplitude of the best fit at each point",
               ("point", "tone")),
    Observable("phase_fit", r"\phi", "degree", "°", "phase lag of the model", "phase of the best fit at each point",
               ("point", "tone")),
    Observable("amplitude_residual", "", "1", "1", "residual of the amplitude",
               "model minus measured amplitude in standard deviations", ("point", "tone")),
    Observable("phase_residual", "", "1", "1", "residual of the phase",
               "model minus measured phase in standard deviations", ("point", "tone")),
    Observable("used", "", "1", "", "used", "whether a point counts in the fit", ("point",)),
    Observable("lost", "", "1", "", "lost", "whether the best fit has no such state at a point", ("point",)),
    Observable("bootstrap_value", "", "SI", "", "redrawn value", "value that a fit to redrawn residuals found",
               ("draw", "parameter")),
    Observable("bootstrap_error", "", "SI", "", "error by bootstrap",
               "half the range that holds the middle 68 % of the redrawn values", ("parameter",)),
    Observable("profile_varied", "", "SI", "", "value of the profile", "values at which the profile was found",
               ("profiled", "step")),
    Observable("profile_chi2", r"\chi^2", "1", "1", "chi-square of the profile",
               "least chi-square over all other parameters at a value", ("profiled", "step")),
    Observable("search_chi2", r"\chi^2", "1", "1", "chi-square of the starts", "least chi-square where each search began, on "
               "some of the points", ("search",)),
    Observable("minimum_chi2", r"\chi^2", "1", "1", "chi-square of the minima", "of each different minimum that was found",
               ("minimum",)),
    Observable("search_value", "", "SI", "", "value of the starts", "value of a parameter where each search began",
               ("search", "parameter")),
    Observable("minimum_value", "", "SI", "", "value of the minima", "value of a parameter at each minimum, the lowest first",
               ("minimum", "parameter")),
)  # fmt: skip
