r"""
A viscoelastic sample
=====================

*My polymer relaxes in 300 nanoseconds, and my tip touches it for about as long. Does the tip meet a stiff or a soft sample, and
which relaxation time dissipates most?* This tutorial changes the relaxation time over three decades.
"""

# %%
# The sample
# ----------
#
# The :doc:`standard linear solid </forces/sls>` has a modulus of 1 GPa at once and of 0.1 GPa after a long time. Its
# surface recovers between taps with the relaxation time.

import matplotlib.pyplot as plt
import numpy as np

import dforce as df

case = df.Case(
    title="A polymer that relaxes",
    cantilever=df.Cantilever(f0="300 kHz", k="10 N/m", Q=300),
    drive=df.Drive(A0="20 nm"),
    tip=df.Tip(radius="10 nm"),
    sample=df.Sample(poisson_ratio=0.4),
    forces=[df.forces.SLS(instant_modulus="1 GPa", relaxed_modulus="100 MPa", relaxation_time="300 ns")],
)

# %%
# Taps at full speed
# ------------------
#
# The tip moves on a sinusoid of 16 nm with an indentation of 1 nm. ``df.force_along`` computes the force on this
# path, memory included. Ten taps bring the surface into its steady state.

period = 1 / 300e3
time = np.linspace(0, 10 * period, 10_001)
distance = 16e-9 * (1 + np.cos(2 * np.pi * time / period)) - 1e-9 + 0.165e-9
last = time >= 9 * period

figure, axis = plt.subplots(figsize=(6, 4), layout="constrained")
for relaxation in ("3 ns", "100 ns", "3 us"):
    tap = df.force_along(case.replace("forces.sls.relaxation_time", relaxation), time, distance).isel(time=last)
    axis.plot(tap.indentation * 1e9, tap.force * 1e9, label=relaxation)
axis.set(xlabel="indentation (nm)", ylabel="force (nN)")
axis.legend(title="relaxation time")
plt.show()

# %%
# *Force against indentation in the last tap. With a short relaxation time the tip meets the soft modulus. At 100 ns
# the sample relaxes during the contact, and the loop is wide. At 3 µs, about one period, the tip meets the stiff
# modulus, and the surface has not recovered from the tap before: the force begins at a larger indentation.*
#
# Peak force and energy
# ---------------------

times = np.geomspace(3e-9, 3e-6, 13)
peak, energy = [], []
for relaxation in times:
    taps = df.force_along(case.replace("forces.sls.relaxation_time", float(relaxation)), time, distance)
    peak.append(float(taps.force.isel(time=last).max()))
    energy.append(float(taps.energy[-1] - taps.energy.isel(time=last)[0]) / 1.602176634e-19)
contact = float((taps.indentation.isel(time=last) > 0).mean()) * period

figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.5), layout="constrained")
left.semilogx(times * 1e6, np.array(peak) * 1e9)
left.set(xlabel="relaxation time (µs)", ylabel="peak force (nN)")
right.semilogx(times * 1e6, energy)
right.axvline(contact * 1e6, color="0.6", linestyle="--")
right.set(xlabel="relaxation time (µs)", ylabel="dissipated energy (eV a tap)")
plt.show()

# %%
# *Peak force and dissipated energy for the same indentation. The sample dissipates most where it relaxes within the
# time of contact (dashed), in about a quarter of it.*

print(f"time of contact {df.show(contact, 's', 2)}, most dissipation at {df.show(times[np.argmax(energy)], 's', 2)}")

# sphinx_gallery_start_ignore
assert 0.15 < times[np.argmax(energy)] / contact < 0.4
assert peak[0] < 0.25 * max(peak) and energy[0] < 0.3 * max(energy) and energy[-1] < 0.3 * max(energy)
# sphinx_gallery_end_ignore

# %%
# With a lever you do not set the depth: it follows from the amplitude and the set point. The case of this tutorial is
# complete, so ``df.approach(case, zc=...)`` computes the curve. dForce follows forces with memory tap by tap until
# the surface repeats. This takes far longer than for other forces. For first estimates choose :doc:`kelvin_voigt
# </forces/kelvin_voigt>`, which recovers between taps.
#
# Several relaxation times: :doc:`generalized_maxwell </forces/generalized_maxwell>`. Cells and gels:
# :doc:`power_law </forces/power_law>`.
