"""Are the errors of a reconstructed force right? Noisy repeats of one curve, and known laws without noise.

A curve of all states of the DMT law in air (free amplitude 20 nm, 48.9 kHz, 0.9 N/m, Q 255) gets fresh noise of 4 pm and 0.05
degrees at each repeat; the spread of the force over the repeats is compared with the error that each repeat predicts, and the
distance to the law with it. Then curves without noise of DMT, Morse and Lennard-Jones: the largest error over the range.

    python benchmarks/reconstruction.py [repeats]

prints the ratio of spread and prediction (root mean square over the distances, and quantiles), the shares within one and two
errors of the law, and for each law the largest error outside gaps. One thread of BLAS is quickest: OPENBLAS_NUM_THREADS=1.
"""

import sys
import time

import numpy as np

import dforce as df

AMPLITUDE_ERROR, PHASE_ERROR = 4e-12, 0.05  # m, degrees


def dmt():
    return df.example("figure-3-air").replace("drive.A0", "20 nm")


def stiff(force, radius):
    """Return a case with a lever of 300 kHz, 40 N/m, Q 300, as laws with a steep wall take."""
    case = df.example("figure-3-air").replace("forces", [force]).replace("tip.radius", radius)
    for name, value in (("f0", "300 kHz"), ("k", "40 N/m"), ("Q", 300)):
        case = case.replace(f"cantilever.{name}", value)
    return case


CASES = {
    "DMT": (dmt, ("28 nm", "2 nm")),
    "Morse": (
        lambda: stiff(df.forces.Morse(bond_energy=2.15e-19, decay=1.55e10, bond_length=2.357e-10), "2 nm"), ("14 nm", "2 nm"),
    ),
    "Lennard-Jones": (lambda: stiff(df.forces.LennardJones(work_of_adhesion=0.05), "10 nm"), ("14 nm", "2 nm")),
}  # fmt: skip


def repeats(count):
    make, zc = CASES["DMT"]
    curve = df.branches(make(), zc=zc)
    plain = df.reconstruct(curve)
    distance = float(plain.distance[0]) + np.linspace(0.02e-9, 2e-9, 100)
    law = np.interp(distance, plain.distance, plain.law_force)
    generator = np.random.default_rng(1)
    forces, noises, errors = [], [], []
    begin = time.process_time()
    for _ in range(count):
        noisy = curve.drop_vars("virial")
        shape = curve.amplitude.shape
        noisy["amplitude"] = curve.amplitude + AMPLITUDE_ERROR * generator.standard_normal(shape)
        noisy["phase"] = curve.phase + PHASE_ERROR * generator.standard_normal(shape)
        found = df.reconstruct(noisy, amplitude_error=AMPLITUDE_ERROR, phase_error=PHASE_ERROR)
        for kept, name in ((forces, "force"), (noises, "force_noise"), (errors, "force_error")):
            kept.append(np.interp(distance, found.distance, found[name]))
    seconds = (time.process_time() - begin) / count
    spread, predicted = (
        np.nanstd(forces, axis=0, ddof=1),
        np.sqrt(np.nanmean(np.square(noises), axis=0)),
    )  # gaps are NaN
    off = (np.abs(np.array(forces) - law) / np.array(errors))[np.isfinite(forces)]
    print(f"{count} repeats, {seconds:.2f} s of CPU each")
    print(f"spread over prediction: {np.sqrt(np.mean(spread**2) / np.mean(predicted**2)):.3f} (root mean square)")
    print("quantiles 5, 25, 50, 75, 95 %:", np.round(np.quantile(spread / predicted, [0.05, 0.25, 0.5, 0.75, 0.95]), 2))
    bias = np.abs(np.nanmean(forces, axis=0) - law).max()
    print(f"within one error of the law {np.mean(off < 1.0):.3f}, within two {np.mean(off < 2.0):.3f}")
    print(f"of the range: largest spread {spread.max() / np.ptp(law):.4f}, largest bias {bias / np.ptp(law):.4f}")


def laws():
    for name, (make, zc) in CASES.items():
        begin = time.process_time()
        curve = df.branches(make(), zc=zc)
        middle = time.process_time()
        found = df.reconstruct(curve)
        seconds = time.process_time() - middle
        off = float(abs(found.force - found.law_force).max() / (found.law_force.max() - found.law_force.min()))
        print(
            f"{name}: largest error {off:.4f} of the range; curve {middle - begin:.1f} s, reconstruction {seconds:.1f} s of CPU"
        )


if __name__ == "__main__":
    laws()
    repeats(int(sys.argv[1]) if len(sys.argv) > 1 else 200)
