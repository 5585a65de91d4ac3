r"""
My own data: modulus, adhesion and viscosity
============================================

*You have measured amplitude and phase on a stiff sample, once down to the surface. Which modulus, Hamaker constant and
viscosity fit the curve, and how large are the errors?* This tutorial fits a synthetic curve with noise. Its true values
follow at the end.
"""

# %%
# The curve
# ---------
#
# dForce ships the curve as a text file with columns for height, amplitude and phase. For your own file see
# :doc:`read a measured curve </measured>`. dForce asks for the sign of the phases, because no check of one curve finds it.
# Here they are lags: attraction raises them.

from importlib.resources import files

import matplotlib.pyplot as plt

import dforce as df
from dforce.validity import advice_in

file = files("dforce.library") / "measured" / "stiff.csv"
measured = df.read_measured(str(file), phase_convention="lag")

# %%
# The case describes the instrument: spring constant, f0 and Q from a thermal tune, free amplitude, tip radius.
# Modulus, Hamaker constant and viscosity are poor guesses.

case = df.Case(
    title="A stiff sample in air",
    cantilever=df.Cantilever(f0="70 kHz", k="2.7 N/m", Q=180),
    drive=df.Drive(A0="30 nm"),
    tip=df.Tip(radius="8 nm"),
    sample=df.Sample(youngs_modulus="0.7 GPa", poisson_ratio=0.3),
    forces=[df.forces.DMT(hamaker="2e-19 J"), df.forces.KelvinVoigt(viscosity="60 Pa s")],
)
curve = df.calibrate(measured, case)
df.plot.measured(curve)
plt.show()

# %%
# *The measured curve. The phase lies above 90° before the jump of the amplitude, and far below 90° behind the jump.*
#
# Calibration found the noise in the free part, far from the surface, and set the phase to 90° there:

for name in ("amplitude_error", "phase_error", "free_amplitude"):
    print(name, curve.attrs[name])

# %%
# The fit
# -------
#
# Three parameters of the sample are free. The fit also varies three unknown offsets: height, free amplitude and phase. Q is
# known to 2 %, so it has a prior.

free = ["sample.youngs_modulus", "forces.dmt.hamaker", "forces.kelvin_voigt.viscosity"]
fit = df.fit(case, curve, free=free, priors={"cantilever.Q": "180.0(36)"}, given={"cantilever.k": "2.7(2) N/m"})
print(df.fit_report(fit))

# %%
# Read the report from the top. Chi2 is about the number of degrees of freedom: the model describes the curve within its
# noise. No point is lost. The list below the parameters contains the errors from the uncertain spring constant. Hamaker
# constant and modulus are strongly correlated: a little more of both gives nearly the same curve.

df.plot.fit(fit)
plt.show()

# %%
# *Amplitude and phase with the model in black, and the residuals in standard deviations. They scatter without a pattern.*
#
# Is viscosity needed?
# --------------------
#
# The next lines repeat the fit without viscosity and compare both:

elastic = df.fit(
    case.replace(forces=[df.forces.DMT(hamaker="2e-19 J")]), curve, free=free[:2], priors={"cantilever.Q": "180.0(36)"}
)
table = df.compare_fits({"viscous": fit, "elastic": elastic})
print(table[["chi2", "parameters", "delta_aic"]].to_dataframe())

# %%
# Without viscosity the AIC is 5.9 higher. A difference below 6 does not exclude a model: this curve alone does not prove the
# viscosity.
#
# A curve behind the jump only
# ----------------------------
#
# Predict the errors before the next session:

best = case.replace("sample.youngs_modulus", float(fit["value"].sel(parameter=free[0])))
best = best.replace("forces.dmt.hamaker", float(fit["value"].sel(parameter=free[1])))
best = best.replace("forces.kelvin_voigt.viscosity", float(fit["value"].sel(parameter=free[2])))
told = df.identify(best, free=free, helps=False)
print(df.identify_report(told))

# %%
# The points behind the jump alone constrain the modulus far less than both sides together: behind the jump, a shift of the
# heights looks like stiffness.
#
# The truth
# ---------
#
# The curve was made with E = 2 GPa, H = 6e-20 J and a viscosity of 20 Pa s. Its heights are off by 0.35 nm. Its phase was off
# by 1.2°; the calibration has removed this offset.

truth = {free[0]: 2e9, free[1]: 6e-20, free[2]: 20.0, "zc_offset": 0.35e-9}
for name, value in truth.items():
    one = fit.sel(parameter=name)
    print(f"{name}: off by {(float(one['value']) - value) / float(one['error']):+.2f} errors")

# sphinx_gallery_start_ignore
# the numbers in the text
assert not advice_in(fit) and fit.attrs["lost_points"] == 0
assert (
    abs(fit.attrs["chi2"] / fit.attrs["degrees_of_freedom"] - 1.0) < 0.5
)  # the noise comes from a few points far away
assert float(fit["correlation"].sel(parameter=free[0], parameter_2=free[1])) > 0.8
assert abs(float(table["delta_aic"].sel(model="elastic")) - 5.9) < 0.05
for name, value in truth.items():
    one = fit.sel(parameter=name)
    assert abs(float(one["value"]) - value) < 2.5 * float(one["error"]), name
errors = told["error"].sel(known="prior", parameter=free[0])
assert float(errors.sel(curve="approach and retract")) < 0.25 * float(errors.sel(curve="behind the jump"))
# sphinx_gallery_end_ignore
