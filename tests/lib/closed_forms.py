"""Formulas for discs that tests compare with."""

import math


def plate_frequencies(n, highest, thickness=1e-3, inner=0.05, outer=0.15, young=1.25e11, nu=0.25, rho=7200):
    """Kirchhoff's annular plate, clamped inside, free outside, n nodal diameters: frequencies up to the highest, Hz.

    (d_rr + d_r/r - n^2/r^2)^2 w = k^4 w is integrated from the clamp, w = w' = 0, with the two starts that leaves;
    moment w'' + nu (w' - n^2 w) and Kirchhoff's shear force vanish at r = 1 for one combination of them if the
    determinant does."""
    bending = young * thickness ** 3 / 12 / (1 - nu ** 2)

    def determinant(f, n_steps=80):
        k4 = rho * thickness * (2 * math.pi * f) ** 2 / bending * outer ** 4

        def derivative(r, y):
            w, w1, w2, w3 = y
            return (w1, w2, w3, k4 * w - 2 * w3 / r + (1 + 2 * n * n) * (w2 / r ** 2 - w1 / r ** 3)
                    - (n ** 4 - 4 * n * n) * w / r ** 4)

        ends = []
        for y in ((0., 0., 1., 0.), (0., 0., 0., 1.)):
            r, h = inner / outer, (1 - inner / outer) / n_steps
            for _ in range(n_steps):  # Runge and Kutta
                a = derivative(r, y)
                b = derivative(r + h / 2, [u + h / 2 * v for u, v in zip(y, a)])
                c = derivative(r + h / 2, [u + h / 2 * v for u, v in zip(y, b)])
                d = derivative(r + h, [u + h * v for u, v in zip(y, c)])
                y = [u + h / 6 * (p + 2 * q + 2 * s + t) for u, p, q, s, t in zip(y, a, b, c, d)]
                r += h
            w, w1, w2, w3 = y
            ends.append((w2 + nu * (w1 - n * n * w),
                         w3 + w2 - w1 - n * n * (w1 - 2 * w) - (1 - nu) * n * n * (w1 - w)))
        return ends[0][0] * ends[1][1] - ends[0][1] * ends[1][0]

    roots, step, low, at_low = [], 15., 5., determinant(5.)
    while low < highest:
        high, at_high = low + step, determinant(low + step)
        if at_low * at_high < 0:
            a, b = low, high
            for _ in range(25):
                middle = (a + b) / 2
                a, b = (middle, b) if determinant(middle) * at_low > 0 else (a, middle)
            roots.append(a)
        low, at_low = high, at_high
    return [f for f in roots if f <= highest]


def polynomial_roots(coefficients):
    """All roots of a polynomial, highest power first, by Weierstrass' simultaneous iteration."""
    a = [complex(c) / coefficients[0] for c in coefficients[1:]]
    size = max(abs(c) ** (1 / (k + 1)) for k, c in enumerate(a))
    roots = [size * (0.4 + 0.9j) ** k for k in range(len(a))]
    for _ in range(500):
        largest = 0
        for k, x in enumerate(roots):
            value = 1
            for c in a:
                value = value * x + c
            for m, other in enumerate(roots):
                if m != k:
                    value /= x - other
            roots[k] = x - value
            largest = max(largest, abs(value) / size)
        if largest < 1e-15:
            break
    return roots


def doublet_between_pads(n, omega_0, speed, stiffness, s, friction):
    """Eigenvalues of a doublet w = R(r) (a cos n phi + b sin n phi) of a thin disc between massless pads on one radius r:

        a'' + 2 n Omega b' + (w^2 - n^2 Omega^2 + k (1 + s)) a + nu (1 - s) b = 0
        b'' - 2 n Omega a' + (w^2 - n^2 Omega^2 + k (1 - s)) b - nu (1 + s) a = 0

    @param omega_0: w, 1/s; stiffness: k, the mean stiffness of the doublet per modal mass, 1/s^2; s = sin(n theta)/(n theta)
    of the pads' angle theta; friction: nu = k mu h n/(2 r), since Kirchhoff's faces move by u_phi = -+ (h/2) w_phi/r."""
    of_a = omega_0**2 - (n * speed)**2 + stiffness * (1 + s)
    of_b = omega_0**2 - (n * speed)**2 + stiffness * (1 - s)
    g = 2 * n * speed
    # (l^2 + A)(l^2 + B) + (g l + nu (1 - s))(g l + nu (1 + s)) = 0
    return polynomial_roots([1, 0, of_a + of_b + g * g, 2 * g * friction, of_a * of_b + friction**2 * (1 - s * s)])
