"""A brake model of industrial origin, 4669 unknowns, whose matrices lie outside of this repository."""

import math

# Published with the data to six digits behind the point, computed anew by Newton's method with residuals in extended precision.
GROWING = [5.47417369747 + 4932.23886717402j, 74.83064247481 + 17399.58775273572j]


def settings(data):
    """With the directory of the matrices."""
    return {"Scene": "matrices", "Matrices/Mass": data / "mass.mtx", "Matrices/Velocity": data / "damping.mtx",
            "Matrices/Stiffness": data / "stiffness.mtx", "Eigenproblem/Maximum frequency": 20000 / (2 * math.pi),
            "Output/Fields": "none"}
