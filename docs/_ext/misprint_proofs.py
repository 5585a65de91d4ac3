r"""Equations of the 2015 paper that cannot be used as printed: the right equation, and a computation that proves it.

H. V. Guzman, P. D. Garcia, R. Garcia, Beilstein J. Nanotechnol. 6, 369 (2015). pint proves a wrong dimension, numbers prove a
wrong factor.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from dforce.case import example
from dforce.checks.validation.recipes import SILICON, bound, force, force_number, layer_ratio
from dforce.core import units
from dforce.forces.bottom_effect import coefficients
from dforce.instrument import beam
from dforce.spectroscopy import follow

JKR = {"model": "jkr", "surface_energy": 0.05, "tip.radius": 20e-9, "contact.E_eff": 1e9 / 0.91, "latched": 1.0}
SPHERE = {
    "model": "tatara",
    "tip.radius": 5e-9,
    "tip.youngs_modulus": 170e9,
    "tip.poisson_ratio": 0.28,
    "sample.radius": 10e-9,
    "sample.youngs_modulus": 100e6,
    "sample.poisson_ratio": 0.3,
}


@dataclass(frozen=True)
class Misprint:
    """An equation by its number in the paper, as printed and corrected (both LaTeX), and the proof."""

    equation: str
    printed: str
    right: str
    shown: str


def dimension(text: str) -> str:
    """Return the unit of a product of units, in SI.

    >>> dimension("Pa s m^0.5 m m/s")
    'kg m^1.5 s^-2'
    """
    found = units.registry().parse_units(text.replace("^", "**"))
    base = units.registry().Quantity(1.0, found).to_base_units().units
    shown = f"{base:~D}"  # such as kilogram as kg, in the form "kg * m / s ** 2"
    over, _, under = shown.partition(" / ")
    powers = [(part, 1) for part in over.split(" * ")] + [(part, -1) for part in under.split(" / ") if part]
    out = []
    for part, sign in powers:
        name, _, power = part.partition(" ** ")
        total = sign * float(power or 1.0)
        out.append(name if total == 1.0 else f"{name}^{total:g}")
    return " ".join(sorted(word for word in out if word not in ("1", ""))) or "1"


def _beam_equation() -> Misprint:
    rest, printed, right = (dimension(text) for text in ("kg/m^3 m m m/s^2", "Pa m^4 m/m", "Pa m^4 m/m^4"))
    return Misprint(
        "(2)",
        r"E I\, \frac{\partial}{\partial x^4} \left[ w + \alpha_1 \frac{\partial w}{\partial t} \right]",
        r"E I\, \frac{\partial^4}{\partial x^4} \left[ w + \alpha_1 \frac{\partial w}{\partial t} \right]",
        f"The inertia ρbh ∂²w/∂t² is in {rest}; with a first derivative the bending is in {printed}, with the fourth in "
        f"{right}.",
    )


def _one_mass() -> Misprint:
    first, second = example("table-1-bimodal").problem.modes
    ratio = second.k / second.f0**2 / (first.k / first.f0**2)
    return Misprint(
        "(3)",
        r"m = 0.25\, m_c \text{ for all modes}",
        r"m_n = k_n / \omega_n^2",
        "Exact for a uniform beam, but the paper has another beam: from table 1 follows "
        f"m₂/m₁ = {ratio:.3f}, so one mass for both would change k₂ or f₂.",
    )


def _quality_factor() -> Misprint:
    internal, medium = "s", "kg/m/s"
    printed = dimension(f"{internal} /(kg/m)"), dimension(f"{medium} /s^2")
    right = dimension(f"{medium} /(kg/m)"), dimension(f"{internal} /s^2")
    return Misprint(
        "(4)",
        r"Q_n = \frac{\omega_n}{\alpha_1 / \rho b h + \alpha_0 \omega_n^2}",
        r"Q_n = \frac{\omega_n}{\alpha_0 / \rho b h + \alpha_1 \omega_n^2}",
        f"With α₁ in s and α₀ in kg/(m s), as in equation 2, the printed terms are in {printed[0]} and {printed[1]}; "
        f"exchanged both are in {right[0]}."
        if right[0] == right[1]
        else "",
    )


def _frequency() -> Misprint:

    kappa, mode = beam.wavenumber(1), beam.vacuum_mode(1, **SILICON)
    stiffness = SILICON["youngs_modulus"] * SILICON["thickness"] ** 2 / (12.0 * SILICON["density"])  # EI / ρbh
    printed = (kappa / SILICON["length"]) ** 4 * stiffness
    omega = 2.0 * math.pi * mode.frequency
    return Misprint(
        "(5)",
        r"\omega_n = \left( \frac{\kappa_n}{L} \right)^4 \frac{E I}{\rho b h}",
        r"\omega_n = \left( \frac{\kappa_n}{L} \right)^2 \sqrt{\frac{E I}{\rho b h}}",
        f"The printed right side is in {dimension('Pa m^4 / (kg/m) / m^4')}. A silicon lever of 225 × 28 × 3 µm: printed "
        f"{printed:.5g}, whose root {math.sqrt(printed):.6g} is the ω₁ = {omega:.6g} 1/s of {mode.frequency / 1e3:.2f} kHz.",
    )


def _sphere() -> Misprint:
    common = {"model": "van_der_waals", "hamaker": 0.8e-20, "tip.radius": 2e-9}
    over = [
        force({**common, "d": d}) / force({**common, "d": d, "geometry": "exact_sphere"}) - 1.0
        for d in (0.165e-9, 0.5e-9)
    ]
    return Misprint(
        "(6), (7)",
        r"-\frac{H R}{6 d^2}",
        r"-\frac{2 H R^3}{3 d^2 (d + 2R)^2} \text{ where } d \ll R \text{ fails}",
        f"Right for d ≪ R. For the paper's tip of 2 nm it is {100 * over[0]:.0f} % too large at contact and "
        f"{100 * over[1]:.0f} % at 0.5 nm. In equation 7 ε is the relative permittivity.",
    )


def _adhesion() -> Misprint:
    hamaker, a0 = 0.8e-20, 0.165e-9
    common = {"model": "dmt", "tip.radius": 2e-9, "contact.E_eff": 1e9}
    gamma = force_number({**common, "hamaker": hamaker, "number": "gamma"})
    doubled = force({**common, "hamaker": hamaker, "surface_energy": 2.0 * gamma, "depth": 1e-16})
    outside = force({**common, "hamaker": hamaker, "d": a0})
    return Misprint(
        "(10), (11)",
        r"4 \pi R \gamma = \frac{H R}{6 a_0^2}",
        r"\text{the same, with } \gamma = \frac{H}{24 \pi a_0^2} = \tfrac{1}{2} W \text{ of equal materials}",
        f"H determines γ: 0.8e-20 J is {1e3 * gamma:.4g} mJ/m². With twice this γ the force at contact jumps from "
        f"{1e12 * outside:.1f} to {1e12 * doubled:.1f} pN.",
    )


def _jkr_branch() -> Misprint:
    model = bound(JKR)
    unit, depth = force_number({**JKR, "number": "length"}), 3.0 ** (2.0 / 3.0)
    end = force({**JKR, "depth": -depth * unit})
    strongest = 3.0 * math.pi * model.surface_energy * model.radius  # type: ignore[attr-defined]
    return Misprint(
        "(12)",
        r"\bar\delta(\bar F) \text{ with } +2\sqrt{1 + \bar F}",
        r"\bar\delta = 3 q^4 - 4 q,\ \bar F = q^6 - 2 q^3,\ q \ge 3^{-1/3}",
        f"The printed root ends at the largest pull, {1e9 * strongest:.3f} nN at δ = -u. A tip at a controlled position "
        f"stays in contact to δ = -{depth:.4f} u, where the pull is {-1e9 * end:.3f} nN; that part has the other sign of the "
        f"root.",
    )


def _jkr_length() -> Misprint:
    model = bound(JKR)
    gamma, radius, modulus = model.surface_energy, model.radius, model.E_eff  # type: ignore[attr-defined]
    printed = (gamma**2 * radius * math.pi**2 / (3.0 * modulus**2)) ** (1.0 / 3.0)
    unit = force_number({**JKR, "number": "length"})
    # far inside, adhesion does not matter and the law must be Hertz'
    depth = 1e4 * unit
    hertz = 4.0 / 3.0 * modulus * math.sqrt(radius) * depth**1.5
    shares = [force({**JKR, "depth": depth * scale}) / hertz for scale in (unit / printed, 1.0)]
    return Misprint(
        "(13)",
        r"\bar\delta = \delta \left( \frac{\pi^2 \gamma^2 R}{3 E_\mathrm{eff}^2} \right)^{-1/3}",
        r"\bar\delta = \delta \left( \frac{3 \pi^2 \gamma^2 R}{16 E_\mathrm{eff}^2} \right)^{-1/3}",
        f"The printed length is {printed / unit:.4f} times too long. At a depth of 10,000 u the force over Hertz's force is "
        f"{shares[0]:.4f} with it and {shares[1]:.4f} with the right length.",
    )


def _jkr_force() -> Misprint:
    model = bound(JKR)
    unit = force_number({**JKR, "number": "length"})
    pull = -min(force({**JKR, "depth": share * unit}) for share in np.linspace(-1.001, -0.999, 201))
    scale = math.pi * model.surface_energy * model.radius  # type: ignore[attr-defined]
    return Misprint(
        "(14)",
        r"\bar F = \frac{F}{\pi \gamma R}",
        r"\bar F = \frac{F}{3 \pi \gamma R}",
        f"The largest pull is (3/2)πWR = {pull / scale:.4f} πγR with W = 2γ; by the printed unit it would be πγR. "
        "No other meaning of γ corrects (13) and (14) at once.",
    )


def _tatara() -> Misprint:
    n, n_c = (force_number({**SPHERE, "number": name, "depth": 0.0}) for name in ("n", "n_c"))
    small = 1e-15
    series = (force({**SPHERE, "depth": small}) / n / small**1.5, 2.0 ** (-2.0 / 3.0), 2.0**-1.5)
    depth = 1e-12

    def third(depth: float) -> float:
        rest = (
            float(force({**SPHERE, "depth": depth})) - n * depth**1.5 / 2.0**1.5 - 3.0 * n**2 * depth**2 / (8.0 * n_c)
        )
        return float(rest / (n**3 * depth**2.5 / (2.0**5.5 * n_c**2)))

    # the next term is of the order √δ: it goes as the depth falls
    limit = 2.0 * third(depth) - third(4.0 * depth)
    return Misprint(
        "(15)",
        r"\frac{n}{2^{2/3}} \delta^{3/2} + \frac{3 n^2}{8 n_c^2} \delta^2 + \frac{15 n^3}{2^{11/2} n_c^2} \delta^{5/2}",
        r"\frac{n}{2^{3/2}} \delta^{3/2} + \frac{3 n^2}{8 n_c} \delta^2 + \frac{21 n^3}{2^{11/2} n_c^2} \delta^{5/2}",
        f"Two equal contacts share the compression, so a small one meets {series[0]:.4f} n δ^1.5: 2^-1.5 = {series[2]:.4f}, "
        f"not 2^-2/3 = {series[1]:.4f}. With n_c in N/m the second term is in {dimension('(N/m^1.5)^2 m^2 / (N/m)^2')} as "
        f"printed. The expansion of the implicit law has the third coefficient {limit:.2f}.",
    )


def _tatara_stiffness() -> Misprint:
    return Misprint(
        "(17)",
        r"n_c = \frac{4 \pi E_t R_t E_s R_s}{6 + \nu_t - 2 \nu_t^2 + \nu_s - 2 \nu_s^2}",
        r"\frac{1}{n_c} = \frac{3 + \nu_t - 2 \nu_t^2}{4 \pi E_t R_t} + \frac{3 + \nu_s - 2 \nu_s^2}{4 \pi E_s R_s}",
        f"The printed n_c is in {dimension('(Pa m)^2')}, where a stiffness is in {dimension('N/m')}. For E_t R_t = E_s R_s "
        "the sum has the printed bracket.",
    )


def _thin_sample() -> Misprint:
    def printed(x: float) -> float:
        return 1.0 + 1.7795 * 2.0 / math.pi**2 * x + 50.67 * x * x

    rows = [(x, printed(x), layer_ratio({"geometry": "cone", "reach": x})) for x in (0.1, 0.5)]
    text = "; ".join(f"{right:.3f}, printed {wrong:.3f}, at X = {x:g}" for x, wrong, right in rows)
    first, second = coefficients("cone", 0.5)[:2]
    prefactor = 8.0 / (3.0 * math.pi) / (2.0 / math.pi)
    return Misprint(
        "(19)",
        r"\frac{8 E_\mathrm{eff}}{3 \pi} \tan\theta\, \delta^2 \left[ 1 + 1.7795 \frac{2}{\pi^2} X + 50.67 X^2 \right]",
        r"\frac{2 E_\mathrm{eff}}{\pi} \tan\theta\, \delta^2 "
        rf"\left[ 1 + {first:.4f} X + {second:.4f} X^2 + \ldots \right]",
        f"X = tan θ δ/h, ν = 0.5. Force relative to a thick sample, from the integral equation of the contact: {text}. The "
        f"prefactor "
        f"8/3π already contains 1/(1 - ν²): with E_eff it is {prefactor:.4f} times too large.",
    )


def _viscous() -> Misprint:
    printed, right = dimension("Pa s m^0.5 m m/s"), dimension("Pa s m^0.5 m^0.5 m/s")
    return Misprint(
        "(20)",
        r"-\eta \sqrt{R}\, \delta\, \frac{d\delta}{dt}",
        r"+\eta \sqrt{R \delta}\, \frac{d\delta}{dt}",
        f"As printed in {printed}; with δ under the root in {right}, the newton. Its sign is the sign of dδ/dt of the "
        "indentation: a viscous contact resists compression.",
    )


def _standard_linear_solid() -> Misprint:

    instant, relaxed, tau, radius, a0, depth = 1e9, 1e8, 1e-5, 20e-9, 0.165e-9, 1e-9
    instrument = {"tip.radius": radius, "sample.poisson_ratio": 0.0}
    solid = {"instant_modulus": instant, "relaxed_modulus": relaxed, "relaxation_time": tau}
    model = bound({"model": "sls_simple", **solid, **instrument})
    ramp = 1e-9

    def motion(t: float) -> tuple[float, float]:
        return (a0 - depth * t / ramp, -depth / ramp) if t < ramp else (a0 - depth, 0.0)

    times = np.concatenate([np.linspace(0.0, ramp, 50), np.linspace(ramp, 10.0 * tau, 2000)[1:]])
    held = follow(model, motion, times.tolist()).force
    hertz = 4.0 / 3.0 * relaxed * math.sqrt(radius) * depth**1.5
    return Misprint(
        "(21)",
        r"F = -\frac{E_0 \eta}{E_0 + E_\infty} \left( \sqrt{R \delta}\, \dot\delta - \frac{\dot F}{E_0} \right)",
        r"\dot F + \frac{F}{\tau} = E_0 \dot H + \frac{E_\infty}{\tau} H, \quad H = \tfrac{4}{3} \sqrt{R}\, \delta^{3/2}",
        "Held at a depth the printed equation is F = (η/(E₀ + E∞)) dF/dt: the force grows, by "
        f"{math.exp(10.0):.0f} in ten of its own times. The right equation relaxes: of the initial force "
        f"{held[-1] / held[49]:.3f} is left after ten τ, equal to E∞/E₀, and to Hertz' force with E∞ within "
        f"{abs(held[-1] / hertz - 1.0):.0e}. (Valid while the contact grows; then Ting's integral.)",
    )


def _settling() -> Misprint:
    left = [100.0 * math.exp(-n) for n in (2.0, 5.0)]
    return Misprint(
        "text",
        r"2 \text{ to } 5 \text{ times } Q/\pi \text{ periods}",
        r"\text{at least } 6\, Q/\pi + 30, \text{ and a test}",
        f"The transient falls by 1/e in Q/π periods, as in the paper; two to five of these leave {left[0]:.0f} to "
        f"{left[1]:.1f} % of it, six {100.0 * math.exp(-6.0):.2f} %.",
    )


def misprints() -> list[Misprint]:
    """Return all of them, in the order of the paper."""
    return [
        _beam_equation(),
        _one_mass(),
        _quality_factor(),
        _frequency(),
        _sphere(),
        _adhesion(),
        _jkr_branch(),
        _jkr_length(),
        _jkr_force(),
        _tatara(),
        _tatara_stiffness(),
        _thin_sample(),
        _viscous(),
        _standard_linear_solid(),
        _settling(),
    ]


def misprints_text() -> str:
    """Return the misprints in Markdown, with equations in dollar signs: a heading in bold, both equations, and the proof."""
    blocks = []
    for m in misprints():
        name = f"Equation {m.equation}" if m.equation.startswith("(") else "In the text"
        blocks.append(
            f"**{name}**, as printed:\n\n$$\n{m.printed}\n$$\n\nUse instead:\n\n$$\n{m.right}\n$$\n\n{m.shown}"
        )
    return "\n\n---\n\n".join(blocks) + "\n"
