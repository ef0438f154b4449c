"""Tabulates GGX for src/bsdf: how much it reflects, and the linearly transformed cosines [Heitz16] that it is fitted by.

    python3 docs/method/ggx_table.py src/bsdf/ggx_table.bin

Needs numpy and scipy; takes half a minute. GGX has height-correlated Smith masking, and no Fresnel factor unless said. Written are SIZE x
SIZE x 6 little-endian f32, roughness by roughness (perceptual, from LEAST to 1, evenly; alpha is its square), in each the cosine mu to
the eye as sqrt(1 - mu), evenly from 0 to 1:

    E         directional albedo
    B         the same under a Fresnel factor of (1 - cos(theta_d))^5, so that F0 E + (1 - F0) B is that of Schlick's
    m11/alpha, m22/alpha, m13/alpha, angle
              of the matrix M = R(angle) [[m11, 0, m13], [0, m22, 0], [0, 0, 1]] that takes the clamped cosine to the lobe; R turns z by the
              angle towards the mirrored eye, in radians
"""
import sys
import numpy as np
from scipy.optimize import minimize

SIZE, LEAST, SIDE = 32, 0.03, 32

u = (np.arange(SIDE) + 0.5) / SIDE
U1, U2 = (grid.ravel() for grid in np.meshgrid(u, u))


def ggx(v, l, alpha):
    """f_r cos(theta_l) and the density of sampling half vectors by D cos(theta_h)."""
    h = v[:, None] + l
    h /= np.linalg.norm(h, axis=0)
    nh, nl = h[2], l[2]
    a2 = alpha * alpha
    # 1 - nh^2 without cancellation
    sin2 = h[0] ** 2 + h[1] ** 2
    d = a2 / (np.pi * (sin2 + a2 * nh * nh) ** 2)
    nv = v[2]
    lam = lambda c: 0.5 * (np.sqrt(1 + a2 * (1 - c * c) / np.maximum(c * c, 1e-12)) - 1)
    g = 1 / (1 + lam(nv) + lam(nl))
    value = np.where(nl > 0, d * g / (4 * nv), 0.0)
    density = d * np.maximum(nh, 0) / (4 * np.abs((v[:, None] * h).sum(0)))
    return value, density


def albedos(v, alpha):
    """E and B by visible normals [Heitz18]."""
    n = 96
    g = (np.arange(n) + 0.5) / n
    u1, u2 = (grid.ravel() for grid in np.meshgrid(g, g))
    stretched = np.array([alpha * v[0], 0, v[2]])
    stretched /= np.linalg.norm(stretched)
    t1 = np.array([0.0, 1.0, 0.0])
    t2 = np.cross(stretched, t1)
    r, phi = np.sqrt(u1), 2 * np.pi * u2
    p1, p2 = r * np.cos(phi), r * np.sin(phi)
    s = 0.5 * (1 + stretched[2])
    p2 = (1 - s) * np.sqrt(1 - p1 * p1) + s * p2
    h = p1 * t1[:, None] + p2 * t2[:, None] + np.sqrt(np.maximum(0, 1 - p1 * p1 - p2 * p2)) * stretched[:, None]
    h = np.array([alpha * h[0], alpha * h[1], np.maximum(h[2], 0)])
    h /= np.linalg.norm(h, axis=0)
    vh = (v[:, None] * h).sum(0)
    l = 2 * vh * h - v[:, None]
    lam = lambda c: 0.5 * (np.sqrt(1 + alpha ** 2 * (1 - c * c) / np.maximum(c * c, 1e-12)) - 1)
    weight = np.where(l[2] > 0, (1 + lam(v[2])) / (1 + lam(v[2]) + lam(l[2])), 0)
    return weight.mean(), (weight * (1 - np.clip(vh, 0, 1)) ** 5).mean()


def ggx_samples(v, alpha):
    phi, r = 2 * np.pi * U1, alpha * np.sqrt(U2 / (1 - U2))
    h = np.array([r * np.cos(phi), r * np.sin(phi), np.ones_like(r)])
    h /= np.linalg.norm(h, axis=0)
    return 2 * (v[:, None] * h).sum(0) * h - v[:, None]


class Ltc:
    def __init__(self, m11, m22, m13, basis, amplitude):
        self.m = basis @ np.array([[m11, 0, m13], [0, m22, 0], [0, 0, 1.0]])
        self.inverse = np.linalg.inv(self.m)
        self.det = abs(np.linalg.det(self.m))
        self.amplitude = amplitude

    def value(self, l):
        o = self.inverse @ l
        length = np.linalg.norm(o, axis=0)
        cosine = np.maximum(o[2] / length, 0)
        # d(omega_o)/d(omega) = |M^-1| / |M^-1 w|^3
        return self.amplitude * cosine / np.pi / (self.det * length ** 3)

    def samples(self):
        theta = np.arccos(np.sqrt(U1))
        phi = 2 * np.pi * U2
        o = np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])
        l = self.m @ o
        return l / np.linalg.norm(l, axis=0)


def error(ltc, v, alpha, brdf_samples):
    total = 0.0
    for l in (ltc.samples(), brdf_samples):
        f, density = ggx(v, l, alpha)
        g = ltc.value(l)
        weight = density + g / ltc.amplitude
        total += (np.abs(f - g) ** 3 / np.maximum(weight, 1e-30)).mean()
    return total


def main(path):
    table = np.zeros((SIZE, SIZE, 6), np.float32)
    start_of_row = None
    for row in reversed(range(SIZE)):
        alpha = (LEAST + (1 - LEAST) * row / (SIZE - 1)) ** 2
        guess = start_of_row
        for column in range(SIZE):
            x = column / (SIZE - 1)
            mu = max(1 - x * x, 0.02)
            v = np.array([np.sqrt(1 - mu * mu), 0, mu])
            samples = ggx_samples(v, alpha)
            f, density = ggx(v, samples, alpha)
            weights = np.where(density > 0, f / density, 0)
            amplitude = weights.mean()
            mean = (samples * weights).mean(1)
            mean[1] = 0
            mean /= np.linalg.norm(mean)
            if column == 0:
                basis = np.eye(3)
                first = guess[0] if guess is not None else 1.0
                run = minimize(lambda p: error(Ltc(max(abs(p[0]), 1e-5), max(abs(p[0]), 1e-5), 0, basis, amplitude), v, alpha, samples),
                               [first], method="Nelder-Mead", options={"xatol": 1e-6, "maxiter": 60, "initial_simplex": [[first], [first * 0.8]]})
                p = np.array([abs(run.x[0]), abs(run.x[0]), 0.0])
                start_of_row = p
            else:
                basis = np.array([[mean[2], 0, mean[0]], [0, 1, 0], [-mean[0], 0, mean[2]]])  # x, y, z in columns
                fit = lambda p: error(Ltc(max(abs(p[0]), 1e-5), max(abs(p[1]), 1e-5), p[2], basis, amplitude), v, alpha, samples)
                # From the eye before, and from what smooth surfaces tend to.
                runs = []
                for start in (guess, np.array([2 * alpha, 2 * alpha * mu, 0])):
                    simplex = start * np.array([[1, 1, 1], [1.1, 1, 1], [1, 1.1, 1], [1, 1, 1]]) + 0.05 * alpha * np.eye(4, 3, -1)
                    runs.append(minimize(fit, start, method="Nelder-Mead", options={"xatol": 1e-6 * alpha, "maxiter": 200, "initial_simplex": simplex}))
                run = min(runs, key=lambda run: run.fun)
                p = np.array([abs(run.x[0]), abs(run.x[1]), run.x[2]])
            angle = np.arctan2(basis[2, 0], basis[2, 2])
            table[row, column] = *albedos(v, alpha), abs(p[0]) / alpha, abs(p[1]) / alpha, p[2] / alpha, angle
            guess = p
        print(row, alpha, table[row, 0], table[row, SIZE // 2], table[row, -1], flush=True)
    table.astype("<f4").tofile(path)


if __name__ == "__main__":
    main(sys.argv[1])
