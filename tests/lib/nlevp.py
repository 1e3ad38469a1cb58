"""The sandwich beams of NLEVP (Betcke, Higham, Mehrmann, Schroeder, Tisseur), whose matrices lie outside of this repository."""

import math

import squeal_testing as st

# Eigenvalues w = -i l of the sandwich beams of NLEVP with 200 < Re w < 30000 1/s. Those published with the matrices
# (../shared/data/nlevp/README.md) are right to 5e-9 for N = 840 and 4e-6 for N = 3360: there |Ke| is up to 1e9 |w^2 M|, and the
# rounding of w^2 M + Ke itself moves the lowest. These are by inverse iteration with factors of the band matrices as the files
# have them in numbers of 113 bits.
SANDWICH_EIGENVALUES = {
    168: [723.3716258074 + 82.94044663757j, 1920.743070863 + 298.4879917799j, 3580.018058478 + 657.77567072j,
          5674.922787724 + 1132.728441534j, 8183.208488811 + 1701.46777699j, 11096.73284254 + 2342.346346699j,
          14414.98313637 + 3039.046575517j, 18141.05994818 + 3779.264247144j, 22280.1896929 + 4553.579803252j,
          26838.92871089 + 5354.624017111j],
    840: [723.1864736062 + 82.97532939802j, 1919.719213672 + 298.7517184241j, 3576.710451288 + 658.9587450965j,
          5666.584248967 + 1136.494905235j, 8164.936885536 + 1710.856990401j, 11060.54268443 + 2361.957962213j,
          14348.88762761 + 3075.119140059j, 18028.16945765 + 3839.69296207j, 22097.81859121 + 4647.909931646j,
          26557.6867988 + 5494.031732993j],
    3360: [723.1792392765 + 82.976682826j, 1919.679282616 + 298.7619313181j, 3576.581863667 + 659.0046307237j,
           5666.261411725 + 1136.641345396j, 8164.232658874 + 1711.223020316j, 11059.1541908 + 2362.724753292j,
           14346.3632038 + 3076.534224416j, 18023.87710948 + 3842.072474759j, 22090.91580435 + 4651.640325692j,
           26547.09095417 + 5499.571492261j],
}


def sandwich_beam(n):
    """The settings of the sandwich beam with n unknowns."""
    data = st.SHARED / "data" / "nlevp"
    relaxed, glassy = 350.4e3, 3.062e9
    core = "Matrices/Viscoelastic 1/"
    return {"Scene": "matrices", "Matrices/Mass": data / f"sandwich_beam_{n}_M.mtx",
            "Matrices/Stiffness": data / f"sandwich_beam_{n}_Ke.mtx",
            core + "Stiffness": data / f"sandwich_beam_{n}_Kv.mtx", core + "Factor": relaxed,
            core + "Fractional Zener": f"{glassy / relaxed!r} : 8.230e-9 : 0.675",
            "Eigenproblem/Minimum frequency": 200 / (2 * math.pi),
            "Eigenproblem/Maximum frequency": 30000 / (2 * math.pi), "Eigenproblem/Tolerance": 1e-12}
