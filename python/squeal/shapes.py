"""Shapes of modes and the modal assurance criterion."""

import numpy


class Shape:
    """The displacement of a mode: points (n, 3) in m, displacement (n, 3), complex, body (n,)."""

    def __init__(self, points, displacement, body=None):
        points, displacement = numpy.asarray(points, float), numpy.asarray(displacement)
        body = numpy.zeros(len(points), int) if body is None else numpy.rint(body).astype(int)
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
        """The displacement at other points, by a linear function through the nearest nodes of the same body (moving least
        squares): exact for linear displacements, an error of the order of the square of the nodes' spacing otherwise."""
        points = numpy.asarray(points, float)
        body = numpy.zeros(len(points), int) if body is None else numpy.asarray(body)
        result = numpy.empty((len(points), 3), complex)
        for number in numpy.unique(body):
            own, wanted = self.body == number, numpy.flatnonzero(body == number)
            nodes, values = self.points[own], self.displacement[own]
            if not len(nodes):
                raise ValueError(f"the shape has no nodes of body {number}")
            for start in range(0, len(wanted), 1024):
                chunk = wanted[start:start + 1024]
                result[chunk] = interpolate(nodes, values, points[chunk], min(n_neighbours, len(nodes)))
        return result


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
    """Shapes as columns of one array, at the points of the reference."""
    if isinstance(shapes, Shape):
        shapes = [shapes]
    if len(shapes) and isinstance(shapes[0], Shape):
        return numpy.column_stack([(shape.displacement if shape.same_points(reference)
                                    else shape.at(reference.points, reference.body)).ravel() for shape in shapes])
    columns = numpy.asarray(shapes)
    return columns.reshape(-1, 1) if columns.ndim == 1 else columns


def mac(a, b):
    """The modal assurance criterion |a_i^H b_j|^2 / (a_i^H a_i  b_j^H b_j) of every pair: 1 for equal shapes, 0 for
    orthogonal ones, whatever their phases and sizes.

    a and b: a Shape, a list of Shapes, or arrays whose columns are vectors. Shapes of another mesh are evaluated at the
    points of the first of a.
    """
    first = a if isinstance(a, Shape) else a[0] if len(a) and isinstance(a[0], Shape) else None
    left, right = columns_of(a, first), columns_of(b, first)
    products = numpy.abs(left.conj().T @ right)**2
    sizes = (numpy.abs(left)**2).sum(axis=0)[:, None] * (numpy.abs(right)**2).sum(axis=0)[None, :]
    return products / sizes
