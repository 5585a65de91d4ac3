"""Viscoelastic contact with one relaxation time, memory between taps included."""

from __future__ import annotations

from dforce.forces._rheology import StandardSolid, Viscoelastic


class SLS(StandardSolid, Viscoelastic):
    r"""Standard linear solid under a sphere: a spring in parallel with a spring and a dashpot in series.

    .. math:: F = \frac{4\sqrt{R}}{3} \int_0^{t_1(t)} \psi(t - s)\, d[\delta^{3/2}], \qquad
        \psi(t) = \frac{E_\infty + (E_0 - E_\infty) e^{-t/\tau}}{1 - \nu^2}

    with :math:`t_1 = t` while the contact grows (Lee and Radok) and, while it shrinks, the earlier time with the same contact:
    :math:`\int_{t_1}^{t} \psi(t - s)\, \dot\delta\, ds = 0` (Ting). The force never pulls. Later taps meet the partly recovered
    surface. The contact is a row of elements (method of dimensionality reduction), exact for the first and for all following
    taps. A circuit of a spring :math:`E_s` in series with a spring :math:`E_p` and a dashpot :math:`\eta` in parallel is the
    same solid with :math:`E_0 = E_s`, :math:`E_\infty = E_s E_p/(E_s + E_p)` and :math:`\tau = \eta/(E_s + E_p)`.

    The tip is rigid; set Young's moduli. Valid for indentations small relative to the radius and a relaxation time longer than
    the step of the solver. The contact radius ends at :math:`\sqrt{R \delta_\mathrm{max}}`: beyond it the tip is a cylinder.
    """

    name = "sls"
    title = "Standard linear solid"
    also_called = ("Zener", "three-element", "Ting", "Lee-Radok")
    source = (
        "E. H. Lee, J. R. M. Radok, J. Appl. Mech. 27, 438 (1960); T. C. T. Ting, J. Appl. Mech. 33, 845 "
        "(1966); V. L. Popov, M. Heß, Method of Dimensionality Reduction, Springer (2015)"
    )
