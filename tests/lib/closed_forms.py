"""Formulas for discs that tests compare with."""

import math


def plate_frequencies(n, highest, thickness=1e-3, inner=0.05, outer=0.15, young=1.25e11, nu=0.25, rho=7200):
    """Kirchhoff's annular plate, clamped inside, free outside, n nodal diameters: frequencies up to the highest, Hz.

    (d_rr + d_r/r - n^2/r^2)^2 w = k^4 w is integrated from the clamp, w = w' = 0, with the two starts that leaves;
    moment w'' + nu (w' - n^2 w) and Kirchhoff's shear force vanish at r = 1 for one combination of them if the
    determinant does."""
    def determinant(f):
        ends = [_at_the_rim(n, nu, path[-1][1]) for path in _from_the_clamp(n, f, thickness, inner, outer, young, nu, rho)]
        return ends[0][0] * ends[1][1] - ends[0][1] * ends[1][0]

    return sign_changes(determinant, 5., 15., highest, 25)


def _at_the_rim(n, nu, y):
    """Moment and shear force."""
    w, w1, w2, w3 = y
    return w2 + nu * (w1 - n * n * w), w3 + w2 - w1 - n * n * (w1 - 2 * w) - (1 - nu) * n * n * (w1 - w)


def _from_the_clamp(n, f, thickness, inner, outer, young, nu, rho, n_steps=80):
    """Both solutions: r and the derivatives 0 to 3 of w, step by step, lengths in units of the outer radius."""
    bending = young * thickness ** 3 / 12 / (1 - nu ** 2)
    k4 = rho * thickness * (2 * math.pi * f) ** 2 / bending * outer ** 4

    def derivative(r, y):
        w, w1, w2, w3 = y
        return (w1, w2, w3, k4 * w - 2 * w3 / r + (1 + 2 * n * n) * (w2 / r ** 2 - w1 / r ** 3)
                - (n ** 4 - 4 * n * n) * w / r ** 4)

    paths = []
    for y in ((0., 0., 1., 0.), (0., 0., 0., 1.)):
        r, h = inner / outer, (1 - inner / outer) / n_steps
        path = [(r, y)]
        for _ in range(n_steps):  # Runge and Kutta
            a = derivative(r, y)
            b = derivative(r + h / 2, [u + h / 2 * v for u, v in zip(y, a)])
            c = derivative(r + h / 2, [u + h / 2 * v for u, v in zip(y, b)])
            d = derivative(r + h, [u + h * v for u, v in zip(y, c)])
            y = [u + h / 6 * (p + 2 * q + 2 * s + t) for u, p, q, s, t in zip(y, a, b, c, d)]
            r += h
            path.append((r, y))
        paths.append(path)
    return paths


def _shape(n, frequency, thickness, inner, outer, young, nu, rho):
    """Of the mode w = R(r) cos(n phi): r, R, R' in 800 steps, and the weights of an integral over r."""
    first, second = _from_the_clamp(n, frequency, thickness, inner, outer, young, nu, rho, 800)
    moments = [_at_the_rim(n, nu, path[-1][1])[0] for path in (first, second)]
    shape = [(r * outer, moments[1] * a[0] - moments[0] * b[0], (moments[1] * a[1] - moments[0] * b[1]) / outer)
             for (r, a), (_, b) in zip(first, second)]
    h = shape[1][0] - shape[0][0]
    return shape, [h / 2, *[h] * (len(shape) - 2), h / 2]


def plate_shape(n, frequency, radius, thickness=1e-3, inner=0.05, outer=0.15, young=1.25e11, nu=0.25, rho=7200):
    """Of the mode w = R(r) cos(n phi), n > 0, of plate_frequencies(): R^2/m in 1/kg with its modal mass m, and R'/R in 1/m,
    at a radius (the nearest of 800 steps)."""
    shape, weights = _shape(n, frequency, thickness, inner, outer, young, nu, rho)
    mass = rho * thickness * math.pi * sum(weight * w * w * r for weight, (r, w, _) in zip(weights, shape))
    _, w, slope = min(shape, key=lambda point: abs(point[0] - radius))
    return w * w / mass, slope / w


def spinning_stiffness(n, frequency, thickness=1e-3, inner=0.05, outer=0.15, young=1.25e11, nu=0.25, rho=7200):
    """What the stress of spinning with Omega adds to the square of a frequency of plate_frequencies(), divided by Omega^2:
    Rayleigh's quotient int (s_r w_r^2 + s_phi w_phi^2/r^2) / int rho w^2.

    Plane stress of u = C_1 r + C_2/r - (1 - nu^2) rho Omega^2 r^3/(8 E), which vanishes at the clamp, s_r = 0 at the rim."""
    modulus = young / (1 - nu ** 2)
    # Rows: u(inner) = 0 and s_r(outer) = 0 for C_1, C_2
    (a, b), (c, d) = (inner, 1 / inner), ((1 + nu) * modulus, -(1 - nu) * modulus / outer ** 2)
    e, f = rho * inner ** 3 / (8 * modulus), (3 + nu) * rho * outer ** 2 / 8
    c_1, c_2 = (e * d - b * f) / (a * d - b * c), (a * f - e * c) / (a * d - b * c)
    shape, weights = _shape(n, frequency, thickness, inner, outer, young, nu, rho)
    energy = mass = 0
    for weight, (r, w, slope) in zip(weights, shape):
        radial = modulus * ((1 + nu) * c_1 - (1 - nu) * c_2 / r ** 2) - (3 + nu) * rho * r * r / 8
        hoop = modulus * ((1 + nu) * c_1 + (1 - nu) * c_2 / r ** 2) - (1 + 3 * nu) * rho * r * r / 8
        energy += weight * r * (radial * slope ** 2 + hoop * (n * w / r) ** 2)
        mass += weight * r * rho * w * w
    return energy / mass


def mindlin_frequencies(n, highest, thickness, clamped, inner=0.05, outer=0.15, young=1.25e11, nu=0.25, rho=7200):
    """Mindlin's annular plate, clamped or free inside, free outside, n nodal diameters: frequencies up to the highest, Hz.

    With w = W cos(n phi), rotations psi_r = A cos, psi_phi = T sin, moments M_r = M cos, M_rphi = S sin, shear force
    Q_r = Q cos, D = E h^3/(12 (1 - nu^2)), G = (pi^2/12) h E/(2 (1 + nu)), the six equations

        W' = Q/G - A,   A' = M/D - nu (A + n T)/r,   T' = 2 S/(D (1 - nu)) + (T + n A)/r,
        M' = Q - (n S + M - M_phi)/r - (rho h^3/12) w^2 A,    M_phi = D ((A + n T)/r + nu A'),
        S' = Q_phi + (n M_phi - 2 S)/r - (rho h^3/12) w^2 T,   Q_phi = G (T - n W/r),
        Q' = -(n Q_phi + Q)/r - rho h w^2 W

    are integrated from the inner edge with the three starts that its conditions leave, made orthonormal again at each step,
    since the growing solutions would swallow the others; M, S, Q vanish outside where their determinant does."""
    bending = young * thickness ** 3 / 12 / (1 - nu ** 2)
    shear = math.pi ** 2 / 12 * thickness * young / 2 / (1 + nu)
    scale = (1, outer, outer, bending / outer, bending / outer, bending / outer ** 2)  # of W, 1/A, 1/T, M, S, Q

    def determinant(f, n_steps=60):
        square = (2 * math.pi * f) ** 2

        def derivative(r, y):
            w, a, t, m, s, q = (value * unit for value, unit in zip(y, scale))
            a1 = m / bending - nu * (a + n * t) / r
            hoop = bending * ((a + n * t) / r + nu * a1)
            across = shear * (t - n * w / r)
            turning = rho * thickness ** 3 / 12 * square
            result = (q / shear - a, a1, 2 * s / bending / (1 - nu) + (t + n * a) / r,
                      q - (n * s + m - hoop) / r - turning * a, across + (n * hoop - 2 * s) / r - turning * t,
                      -(n * across + q) / r - rho * thickness * square * w)
            return [value / unit for value, unit in zip(result, scale)]

        starts = [[float(i == (3 if clamped else 0) + k) for i in range(6)] for k in range(3)]
        r, h = inner, (outer - inner) / n_steps
        for _ in range(n_steps):
            for k, y in enumerate(starts):  # Runge and Kutta
                a = derivative(r, y)
                b = derivative(r + h / 2, [u + h / 2 * v for u, v in zip(y, a)])
                c = derivative(r + h / 2, [u + h / 2 * v for u, v in zip(y, b)])
                d = derivative(r + h, [u + h * v for u, v in zip(y, c)])
                starts[k] = [u + h / 6 * (p + 2 * q + 2 * s + t) for u, p, q, s, t in zip(y, a, b, c, d)]
            r += h
            for k in range(3):
                for other in starts[:k]:
                    part = sum(u * v for u, v in zip(starts[k], other))
                    starts[k] = [u - part * v for u, v in zip(starts[k], other)]
                length = math.sqrt(sum(u * u for u in starts[k]))
                starts[k] = [u / length for u in starts[k]]
        (a, b, c), (p, q, s), (x, y, z) = (y[3:] for y in starts)
        return a * (q * z - s * y) - b * (p * z - s * x) + c * (p * y - q * x)

    step = highest / 40
    return sign_changes(determinant, step / 7, step, highest)


def sign_changes(function, low, step, highest, n_halvings=30):
    """Where a function changes its sign between points that far apart, up to the highest."""
    roots, at_low = [], function(low)
    while low < highest:
        high = low + step
        at_high = function(high)
        if at_low * at_high < 0:
            a, b = low, high
            for _ in range(n_halvings):
                middle = (a + b) / 2
                a, b = (middle, b) if function(middle) * at_low > 0 else (a, middle)
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
