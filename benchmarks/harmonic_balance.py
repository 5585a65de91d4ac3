"""Two tones that never repeat together: a two-frequency harmonic balance against the settled transient.

The case is figure 6 of the 2015 paper with the second tone at sqrt(39) times the first. The motion is a function of both
tones' phases, so the distance is sought on a grid over the torus of phases: the response of the two modes, a linear filter,
to the force. Newton's method with GMRES solves the equations, in steps towards the surface. Both ways are compared at several
resolutions with the transient at 2048 samples a period; times exclude compilation.

    python benchmarks/harmonic_balance.py

prints for each way its resolution, its time, and the error of the amplitudes and phases of both tones, relative to each
tone's amplitude. On a busy machine with two cores:

    transient, samples 256         133 ms     5.4e-06    2.6e-06
    transient, samples 1024        389 ms     8.3e-08    1.4e-07
    balance, grid (128, 32)        221 ms     1.2e-04    8.9e-05
    balance, grid (256, 64)        670 ms     2.7e-05    1.2e-05
    balance, grid (512, 128)      3206 ms     5.4e-06    5.5e-06

A coarse balance takes twice as long as the transient, at a twentieth of its accuracy. For the same accuracy the transient
is about 30 times cheaper, for the balance needs a grid that resolves the contact in both phases, and each of its equations
couples all points of it. So dForce integrates until the motion has settled.
"""

import math
import time

import numpy as np
from scipy.sparse.linalg import LinearOperator, gmres

import dforce as df
from dforce.experiments.base import initial_motion
from dforce.solvers.block import Block
from dforce.solvers.protocols import settle_at

RATIO = math.sqrt(39.0)
FAR, NEAR, STEPS = 11.5e-9, 8e-9, 8
GRIDS = ((64, 16), (128, 32), (256, 64), (512, 128))
SAMPLES = (256, 512, 1024)
TOLERANCE = 1e-9  # of the free amplitude


def case():
    return df.example("figure-6").replace("drive.tones.2.frequency", RATIO * 50e3)


class Balance:
    """The equations of harmonic balance on a grid over the phases of both tones."""

    def __init__(self, problem, grid):
        self.problem, self.law = problem, problem.forces[0].numbers()
        k1 = np.fft.fftfreq(grid[0], 1.0 / grid[0])[:, None]
        k2 = np.arange(grid[1] // 2 + 1)[None, :]
        self.grid, omega = grid, k1 + RATIO * k2
        self.filter, self.free = (
            np.zeros_like(omega, dtype=complex),
            np.zeros((grid[0], grid[1] // 2 + 1), dtype=complex),
        )
        first = problem.tones[0].frequency
        drive = np.zeros((2, *omega.shape))
        count = grid[0] * grid[1]
        drive[0, 1, 0] = drive[0, -1, 0] = drive[1, 0, 1] = 0.5 * count
        for n, mode in enumerate(problem.modes):
            r = mode.f0 / first
            answer = r**2 / mode.k / (r**2 - omega**2 + 1j * omega * r / mode.Q)
            self.filter += answer
            self.free += answer * (problem.drive[0, n].real * drive[0] + problem.drive[1, n].real * drive[1])

    def back(self, spectrum):
        return np.fft.irfft2(spectrum, self.grid)

    def force(self, d):
        """Return the force of DMT and its slope."""
        stiffness, attraction, adhesion, a0 = self.law
        depth, outside = np.maximum(a0 - d, 0.0), np.maximum(d, a0)
        root = np.sqrt(depth)
        contact = d < a0
        force = np.where(contact, stiffness * depth * root - adhesion, -attraction / outside**2)
        return force, np.where(contact, -1.5 * stiffness * root, 2.0 * attraction / outside**3)

    def solve(self, zc, d):
        """Return the distance on the grid, by Newton's method from a guess."""
        scale = self.problem.tones[0].A0
        for _ in range(40):
            force, slope = self.force(d)
            miss = zc + self.back(self.free + self.filter * np.fft.rfft2(force)) - d
            if np.abs(miss).max() < TOLERANCE * scale:
                return d

            def linear(x, slope=slope):
                v = x.reshape(self.grid)
                return (v - self.back(self.filter * np.fft.rfft2(slope * v))).ravel()

            operator = LinearOperator((miss.size, miss.size), matvec=linear)
            step, _ = gmres(operator, miss.ravel() / scale, rtol=1e-4, restart=60, maxiter=4)
            longest = np.abs(step).max()
            d = d + step.reshape(self.grid) * scale * min(1.0, 0.05 / longest)
        raise RuntimeError("Newton's method has not converged")

    def tones(self, d):
        spectrum = 2.0 * np.fft.rfft2(d) / d.size
        return np.array([spectrum[1, 0], spectrum[0, 1]])


def balanced(problem, grid):
    balance = Balance(problem, grid)
    free = balance.back(balance.free)
    d = FAR + free
    for zc in np.linspace(FAR, NEAR, STEPS):
        d = balance.solve(zc, d + zc - d.mean())
    return balance.tones(d)


def integrated(chosen, samples, tolerance=1e-6):
    settings = df.SolverSettings(method="transient", points_per_period=samples, settle_tolerance=tolerance)
    block = Block.of_one(chosen.problem, settings, 1, lambda: None)
    found = settle_at(block, initial_motion(block.integrator(0, NEAR), "free"), NEAR)
    return found.values["amplitude"] * np.exp(-1j * np.radians(found.values["phase"]))


def main():
    chosen = case()
    exact = integrated(chosen, 2048, 1e-9)
    print("way                           time        error of tone 1   of tone 2 (relative to each tone's amplitude)")
    for name, resolutions, way in (
        ("transient, samples", SAMPLES, lambda samples: integrated(chosen, samples)),
        ("balance, grid", GRIDS, lambda grid: balanced(chosen.problem, grid)),
    ):
        for resolution in resolutions:
            start = time.perf_counter()
            found = way(resolution)
            taken = time.perf_counter() - start
            errors = np.abs(found - exact) / np.abs(exact)
            print(
                f"{name + ' ' + str(resolution):<28} {1e3 * taken:8.1f} ms     {errors[0]:.1e}           {errors[1]:.1e}"
            )


if __name__ == "__main__":
    main()
