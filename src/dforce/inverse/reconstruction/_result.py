"""The Dataset of a reconstructed force."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.ndimage import gaussian_filter1d, maximum_filter1d

from dforce.core import units
from dforce.core.arrays import Array, Bools
from dforce.inverse.checks import doubts
from dforce.inverse.reconstruction._formulas import FORMULAS, holscher, payam, sader_jarvis
from dforce.inverse.reconstruction._gaps import Gap
from dforce.inverse.reconstruction._invert import SEEN, Inverse
from dforce.inverse.reconstruction._law import Law, force_of
from dforce.inverse.reconstruction._points import CurvePoints
from dforce.results.dataset import describe
from dforce.results.provenance import of_case
from dforce.spectroscopy import force_curve

if TYPE_CHECKING:
    import xarray as xr

    from dforce.case import Case

DETERMINED, BLIND, UNCERTAIN = 0, 1, 2
SENTENCES = (
    "the curve determines the force",
    "no turning point at this distance: the force is unknown",
    "the error of the force is above a tenth of the range of the force, behind a gap or by noise, or only noise leads here",
)
BY_NODES = 2e-3  # of the largest force near: errors of the nodes, by known laws
NEAR, RINGS = 81, 5  # nodes: of that force; around a kink, where the force rings
BY_CHANCE = 3.0  # errors of the distance
EVEN = 5.0  # nodes over which shares of nodes are averaged
AROUND = 9  # distances within an error of one
UNSURE = 0.1  # of the range of the force, as far as it is above its errors
UNSETTLED = 0.01  # of the largest virial
HALF, WITHIN = 0.5, 0.1  # shares of the largest mean force
WALL = (
    "the force doubles over less than the error of the distance, and is determined nowhere: amplitude and height need "
    "smaller errors"
)
DRAG = (
    "the sample dissipates energy; the damping is valid for a drag on the tip, not for adhesion hysteresis: its loss belongs "
    "to the whole path"
)
BY_PATH = "the sample dissipates energy; the loss belongs to the whole path, so there is no damping"
FAR, TOO_FAR = 0.05, 0.01  # virial at the far end over the largest: worth a note, and small enough


def dataset_of(inverse: Inverse, reading: CurvePoints, case: Case, source: xr.Dataset, known: bool) -> xr.Dataset:
    """Return force, errors and further quantities over the distance, and the points behind them."""
    import xarray as xr

    law, balance = inverse.law, inverse.balance
    distance = law.nodes
    fit, hidden = inverse.fit, inverse.hidden
    blind = np.zeros(len(distance), dtype=bool)
    for gap in inverse.gaps:
        blind |= (distance > gap.low) & (distance < gap.high)
    shifted = _by_distance(law, inverse.gaps, reading.distance_error)
    found = _excess(inverse) * np.linalg.norm((fit.error, hidden, inverse.beyond, inverse.unsettled, shifted), axis=0)
    seen = ~blind & (np.abs(law.force) > SEEN * found)
    span = float(np.ptp(np.append(law.force[seen], 0.0)))
    resolution = _resolution(inverse)
    total = np.linalg.norm((found, _by_resolution(law, resolution), _by_nodes(law.force)), axis=0)
    unsure = (total > UNSURE * span) | _by_noise(inverse, reading.distance_error)
    walled = _is_a_wall(inverse, reading.distance_error)
    if walled or _unsettled(inverse) > UNSETTLED:
        unsure[:] = True
    status = np.where(blind, BLIND, np.where(unsure, UNCERTAIN, DETERMINED)).astype(np.int8)
    open_ = np.where(blind, np.nan, 1.0)  # a gap stays a gap
    classic = classic_forces(inverse, reading, case, distance)
    variables: dict[str, Any] = {
        "force": ("distance", law.force * open_),
        "force_error": ("distance", total * open_),
        "force_noise": ("distance", np.sqrt(np.diag(fit.noise)) * open_),
        "gap_error": ("distance", hidden * open_),
        "resolution": ("distance", resolution * open_),
        "force_status": ("distance", status),
        "classic_force": (("formula", "distance"), classic * open_),
        "zc": ("point", reading.height),
        "closest_approach": ("point", inverse.rows.closest),
        "amplitude": ("point", reading.amplitude),
        "phase": ("point", np.rad2deg(reading.phase)),
        "fundamental_virial": ("point", balance.virial),
        "virial_error": ("point", inverse.virial_error),
        "virial_residual": (
            "point",
            (balance.virial - inverse.rows.virial @ inverse.fit.values) / inverse.virial_error,
        ),
        "fundamental_energy": ("point", balance.energy),
        "sample_energy": ("point", inverse.sample_energy),
        "energy_error": ("point", inverse.energy_error),
    }
    by_path = any(force.memory or force.switch is not None for force in case.forces)  # its loss is no drag
    loss = "" if inverse.damping is None else BY_PATH if by_path else DRAG
    if inverse.damping is not None and not by_path:
        variables |= {
            "damping": ("distance", inverse.damping.values * open_),
            "damping_error": ("distance", inverse.damping.error * open_),
        }
    if known:
        variables["law_force"] = ("distance", _known(case, distance))
    data = xr.Dataset(variables, {"distance": distance, "formula": list(FORMULAS)})
    data = data.assign_coords(
        gap_low=("gap", [gap.low for gap in inverse.gaps]), gap_high=("gap", [gap.high for gap in inverse.gaps])
    )
    describe(data)
    data["force_status"].attrs |= {
        "flag_values": np.array([DETERMINED, BLIND, UNCERTAIN], dtype=np.int8),
        "flag_meanings": "determined blind uncertain",
        "flag_sentences": "\n".join(SENTENCES),
    }
    kept = {key: source.attrs[key] for key in ("source", "sha256", "calibration") if key in source.attrs}
    data.attrs = of_case(case, case.to_toml(), str(source.attrs.get("title", ""))) | kept
    notes = [f"doubts about the measured curve: {text}" for text in doubts(source.attrs)]
    notes += [*_notes(inverse, reading), *(note for note in (loss, WALL if walled else "") if note)]
    data.attrs |= {"chi2": inverse.fit.chi2, "rounds": inverse.rounds, "notes": "\n".join(notes)}
    return data


def _by_distance(law: Law, gaps: list[Gap], error: float) -> Array:
    """Return half the range of the force (N) within one error of the distances (m) of each node, no gap crossed.

    Errors of amplitude and height are errors of the distance at which the tip turns: least squares, which take the distances
    as they are, give a steep force too flat.
    """
    edges = [law.nodes[0], *(edge for gap in gaps for edge in gap), law.nodes[-1]]
    place = np.searchsorted(edges[1:-1], law.nodes)
    low, high = np.take(edges, place), np.take(edges, place + 1)
    around = law.nodes + error * np.linspace(-1.0, 1.0, AROUND)[:, None]
    return np.asarray(0.5 * np.ptp(force_of(law, law.force, np.clip(around, low, high)), axis=0))


def _by_nodes(force: Array) -> Array:
    """Return the error (N) by the nodes: a share of the largest force near, and half the ringing around a kink between nodes.

    Ringing is the deviation of each value from the cubic through the nodes on both sides, as a mean over some nodes.
    """
    off = np.zeros(len(force))
    off[3:-3] = force[3:-3] - (9.0 * (force[2:-4] + force[4:-2]) - (force[:-6] + force[6:])) / 16.0
    rings = 0.5 * np.sqrt(np.convolve(off**2, np.full(RINGS, 1.0 / RINGS), "same"))
    return np.asarray(np.hypot(BY_NODES * maximum_filter1d(np.abs(force), NEAR), rings))


def _by_resolution(law: Law, resolution: Array) -> Array:
    """Return a third of the deviation (N) of the force at each node from the line through the force a resolution (m) aside.

    A Gaussian of this width at half its height takes a half of it off a kink, and a fifth off a force that bends evenly.
    """
    nodes = law.nodes
    away = np.minimum(resolution, np.minimum(nodes - nodes[0], nodes[-1] - nodes))
    before, after = (force_of(law, law.force, nodes + side * away) for side in (-1.0, 1.0))
    return np.asarray(np.abs(law.force - 0.5 * (before + after)) / 3.0)


def _by_noise(inverse: Inverse, error: float) -> Bools:
    """Return the nodes so near to the closest distance, or to a gap, that turning points are there by their noise alone.

    The force there is found too flat, and its error too small.
    """
    nodes, wide = inverse.law.nodes, BY_CHANCE * error
    found = np.zeros(len(nodes), dtype=bool)
    for end in (nodes[0], *(edge for gap in inverse.gaps for edge in gap)):
        if (np.abs(inverse.rows.closest - end) < wide).sum() > 1:  # farther apart, noise does not set their order
            found |= np.abs(nodes - end) < wide
    return found


def _excess(inverse: Inverse) -> float:
    """Return the ratio of residuals to their errors if it is clearly above 1, else 1.

    Errors are multiplied by it (R. T. Birge, Phys. Rev. 40, 207 (1932)).
    """
    return 1.0 if inverse.fit.reached else float(np.sqrt(inverse.fit.chi2 / len(inverse.balance.virial)))


def _unsettled(inverse: Inverse) -> float:
    """Return by how much the last round still changed a virial, as a share of the largest one."""
    return float(np.max(inverse.off / np.abs(inverse.balance.virial).max()))


def _is_a_wall(inverse: Inverse, error: float) -> bool:
    """Return whether the mean force grows from half to its largest over less than the error of the distances.

    The curve sets no limit to the steepness of such a force. The force found is too flat there, and reaches too far.
    """
    mean = np.abs(inverse.balance.virial / inverse.balance.motions.amplitude)
    share, closest = mean / mean.max(), inverse.rows.closest
    half, most = closest[np.abs(share - HALF) < WITHIN], closest[share > 1.0 - WITHIN]
    return len(half) > 0 and float(np.abs(np.median(half) - np.median(most))) < error


def classic_forces(inverse: Inverse, reading: CurvePoints, case: Case, distance: Array) -> Array:
    """Return the force by each formula at distances, shape (formulas, distances); NaN where a formula does not reach.

    They need distances in order and no gap: so they stop at the first gap, or where the closest approach turns back.
    """
    motions, k = inverse.balance.motions, case.problem.modes[0].k
    low = motions.height - motions.amplitude
    order = np.argsort(low)
    keep = np.concatenate([[True], np.diff(low[order]) > 0.0])
    order = order[keep]
    stop = max((gap.high for gap in inverse.gaps), default=-np.inf)
    order = order[inverse.rows.closest[order] >= stop]
    amplitude, d = motions.amplitude[order], low[order]
    out = np.full((len(FORMULAS), len(distance)), np.nan)
    if len(d) >= 2:
        shift = -inverse.balance.virial[order] / (k * amplitude**2)
        for number, formula in enumerate((sader_jarvis, holscher, payam)):
            out[number] = np.interp(distance, d, formula(d, shift, amplitude, k), left=np.nan, right=np.nan)
    plain: Law = inverse.sinusoid
    reached = (distance >= plain.nodes[0]) & (distance <= plain.nodes[-1])
    out[-1] = np.where(reached, force_of(plain, plain.force, distance), np.nan)
    return out


def _resolution(inverse: Inverse) -> Array:
    """Return over which length the force is averaged at each node (m): its spacing over its share in its own value.

    The shares of single nodes go up and down where several nodes lie between two points.
    """
    nodes = inverse.law.nodes
    own = gaussian_filter1d(np.einsum("ij,ji->i", inverse.fit.gain, inverse.rows.virial), EVEN, mode="nearest")
    return np.asarray(np.gradient(nodes) / np.clip(own, 1e-6, 1.0))


def _known(case: Case, distance: Array) -> Array:
    """Return the force of the case's own law at distances."""
    curve = force_curve(case, distance=distance[::-1]).sel(direction="approach")
    return np.asarray(curve["force"].values[::-1])


def _notes(inverse: Inverse, reading: CurvePoints) -> list[str]:
    """Return the notes on the result, a sentence each."""
    found = [
        f"No turning points from {units.show_range(gap.low, gap.high, 'm', 3)}: force unknown there, less certain below."
        for gap in inverse.gaps
    ]
    if not inverse.fit.reached:
        found.append(
            f"chi2 is {_excess(inverse) ** 2:.3g} times the number of points: the errors are too small, or no force of the "
            "distance alone explains the curve. The errors of the force are multiplied by the root of this number"
        )
    moved = _unsettled(inverse)
    if moved > UNSETTLED:
        found.append(
            f"the paths did not settle: the last round still changed a virial by {100.0 * moved:.2g} % of the largest one. "
            "The force is steep relative to the lever, and determined nowhere"
        )
    virial = np.abs(inverse.balance.virial)
    far = float(virial[np.argmax(reading.height)] / virial.max())
    if far > FAR:
        away = float((far / TOO_FAR) ** (2.0 / 3.0) * inverse.rows.closest.max())
        found.append(
            f"at the far end the virial is still {100.0 * far:.2g} % of its largest value, so the force beyond is a guess: "
            f"retract by some {units.show(max(away - float(inverse.rows.closest.max()), 0.0), 'm', 2)} more"
        )
    return found
