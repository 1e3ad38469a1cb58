"""Shapes of modes, computed and measured, and the modal assurance criterion."""

import csv

import numpy


class Shape:
    """The displacement of a mode: points (n, 3) in m, displacement (n, 3), complex, body (n,)."""

    def __init__(self, points, displacement, body=None):
        points, displacement = numpy.asarray(points, float), numpy.asarray(displacement)
        if points.ndim != 2 or points.shape[1] != 3 or displacement.shape != points.shape:
            raise ValueError("a shape needs points (n, 3) and displacements (n, 3)")
        body = numbers_of_bodies(body, len(points))
        # Cells of a file do not share their nodes: one point of each place and body.
        size = numpy.abs(points).max(initial=0) or 1
        keys = numpy.column_stack([numpy.rint(points / (1e-7 * size)).astype(numpy.int64), body])
        _, first = numpy.unique(keys, axis=0, return_index=True)
        first.sort()
        self.points, self.displacement, self.body = points[first], displacement[first].astype(complex), body[first]

    def same_points(self, other):
        return self.points.shape == other.points.shape and numpy.array_equal(self.body, other.body) and \
            numpy.allclose(self.points, other.points, rtol=0, atol=1e-6 * numpy.abs(self.points).max())

    def at(self, points, body=None, n_neighbours=10):
        """The displacement at other points (n, 3), by a linear function through the nearest nodes of the same body (moving
        least squares): exact for linear displacements, an error of the order of the square of the nodes' spacing otherwise.
        `body`: one number for all points, or one for each; 0, the rotor, if it is not given."""
        points = numpy.asarray(points, float)
        if points.ndim != 2 or points.shape[1] != 3 or n_neighbours < 1:
            raise ValueError("points (n, 3) are needed, and at least one neighbour")
        body = numbers_of_bodies(body, len(points))
        result = numpy.full((len(points), 3), numpy.nan + 0j)
        for number in numpy.unique(body):
            own, wanted = self.body == number, numpy.flatnonzero(body == number)
            nodes, values = self.points[own], self.displacement[own]
            if not len(nodes):
                raise ValueError(f"the shape has no nodes of body {number}")
            for start in range(0, len(wanted), 1024):
                chunk = wanted[start:start + 1024]
                result[chunk] = interpolate(nodes, values, points[chunk], min(n_neighbours, len(nodes)))
        return result


class MeasuredShape:
    """What was measured of a mode: at each of some points (n, 3), m, the component along a direction (n, 3), which need not
    be of unit length, as complex numbers (n,), of the bodies (n,), numbered as in a Shape: 0 is the rotor."""

    def __init__(self, points, directions, values, body=None):
        self.points, self.directions = numpy.asarray(points, float), numpy.asarray(directions, float)
        lengths = numpy.linalg.norm(self.directions, axis=1, keepdims=True)
        if not len(self.points) or self.points.shape != self.directions.shape or self.points.shape[1:] != (3,) or \
                not (lengths > 0).all():
            raise ValueError("a measured shape needs points (n, 3), directions (n, 3) that are not zero, and n values")
        self.directions = self.directions / lengths
        self.values = numpy.asarray(values, complex).reshape(len(self.points))
        self.body = numbers_of_bodies(body, len(self.points))

    def of(self, shape):
        """The same components of a computed shape."""
        return (shape.at(self.points, self.body) * self.directions).sum(axis=1)


def numbers_of_bodies(body, n_points):
    """The number of the body of each point, from one for all or one for each; 0 where there is none."""
    numbers = numpy.rint(numpy.zeros(()) if body is None else numpy.asarray(body, float))
    if numbers.shape not in ((), (n_points,)) or not numpy.isfinite(numbers).all():
        raise ValueError(f"one number of a body, or one for each of {n_points} points is needed")
    return numpy.broadcast_to(numbers, (n_points,)).astype(int)


def read_measured(path):
    """Measured shapes of a CSV file: a line for each point and direction with the columns x_m, y_m, z_m, nx, ny, nz, real and,
    if they are there, imaginary, body, mode. One MeasuredShape for each mode, in the order of the file."""
    with open(path, newline="", encoding="utf-8-sig") as file:
        reader = csv.DictReader(file, skipinitialspace=True)
        rows = list(reader)
    needed = ["x_m", "y_m", "z_m", "nx", "ny", "nz", "real"]
    missing = [name for name in needed if name not in (reader.fieldnames or [])]
    if missing or not rows:
        raise ValueError(f"{path}: " + ("no columns " + ", ".join(missing) if missing else "no lines"))
    by_mode = {}
    for number, row in enumerate(rows, 2):
        try:
            numbers = [float(row[name]) for name in needed] + [float(row.get(name) or 0) for name in ("imaginary", "body")]
        except (TypeError, ValueError):
            raise ValueError(f"{path}, line {number}: a field is no number") from None
        by_mode.setdefault(row.get("mode"), []).append(numbers)
    return [MeasuredShape(data[:, :3], data[:, 3:6], data[:, 6] + 1j * data[:, 7], data[:, 8])
            for data in map(numpy.array, by_mode.values())]


def interpolate(nodes, values, points, n_neighbours):
    square = ((points**2).sum(axis=1)[:, None] - 2 * points @ nodes.T + (nodes**2).sum(axis=1)[None, :]).clip(min=0)
    near = numpy.argpartition(square, n_neighbours - 1, axis=1)[:, :n_neighbours]
    square = numpy.take_along_axis(square, near, axis=1)
    scale = numpy.sqrt(square.max(axis=1, keepdims=True)) + 1e-300
    offsets = (nodes[near] - points[:, None, :]) / scale[:, :, None]
    # A node at the point itself gets all the weight.
    weight = 1 / (square / scale**2 + 1e-8)
    basis = numpy.concatenate([numpy.ones((*near.shape, 1)), offsets], axis=2)
    normal = numpy.einsum("pni,pn,pnj->pij", basis, weight, basis)
    # Nodes in a plane do not tell the slope across it: the smallest such slope is taken.
    right = numpy.einsum("pni,pn,pnc->pic", basis, weight, values[near])
    return (numpy.linalg.pinv(normal, rcond=1e-10) @ right)[:, 0, :]


def columns_of(shapes, reference):
    """Shapes as columns of one array, at the points of the reference; of a measured one the components measured."""
    if isinstance(shapes, (Shape, MeasuredShape)):
        shapes = [shapes]
    if len(shapes) and isinstance(reference, MeasuredShape):
        return numpy.column_stack([shape.values if isinstance(shape, MeasuredShape) else reference.of(shape) for shape in shapes])
    if len(shapes) and isinstance(shapes[0], Shape):
        return numpy.column_stack([(shape.displacement if shape.same_points(reference)
                                    else shape.at(reference.points, reference.body)).ravel() for shape in shapes])
    columns = numpy.asarray(shapes)
    return columns.reshape(-1, 1) if columns.ndim == 1 else columns


def mac(a, b):
    """The modal assurance criterion |a_i^H b_j|^2 / (a_i^H a_i  b_j^H b_j) of every pair: 1 for equal shapes, 0 for
    orthogonal ones, whatever their phases and sizes.

    a and b: a Shape or MeasuredShape, a list of them, or arrays whose columns are vectors. Shapes of another mesh are
    evaluated at the points of the first of a; with measured shapes, all at the same points, what was measured is compared.
    """
    def first_of(shapes, kinds):
        several = shapes if isinstance(shapes, list) else [shapes]
        return several[0] if several and isinstance(several[0], kinds) else None
    first = next((found for shapes, kinds in ((a, MeasuredShape), (b, MeasuredShape), (a, Shape))
                  if (found := first_of(shapes, kinds)) is not None), None)
    left, right = columns_of(a, first), columns_of(b, first)
    products = numpy.abs(left.conj().T @ right)**2
    sizes = (numpy.abs(left)**2).sum(axis=0)[:, None] * (numpy.abs(right)**2).sum(axis=0)[None, :]
    return products / sizes


def pair(a, b, least=0.):
    """Pairs shapes one to one by mac(a, b), the most alike first: a list of (i, j, MAC) by ascending i. What is less alike
    than `least` has no partner."""
    alike = mac(a, b)
    pairs = []
    for _ in range(min(alike.shape)):
        i, j = numpy.unravel_index(alike.argmax(), alike.shape)
        if alike[i, j] < least:
            break
        pairs.append((int(i), int(j), float(alike[i, j])))
        alike[i, :] = alike[:, j] = -1
    return sorted(pairs)
