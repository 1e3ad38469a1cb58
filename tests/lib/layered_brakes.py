"""Brakes with layered pads (lining, shim, plate) between which the estimated errors are tried: shared by
test_error_bars.py and benchmark/layered_pads.py."""

import dataclasses

import mesh_files

LINING = {"Young modulus": 8e9, "Poisson ratio": 0.2, "Axial Young modulus": 1e9, "Axial Poisson ratio": 0.3,
          "Axial shear modulus": 1e9, "Density": 2600, "Stiffness proportional damping": 1e-6,
          "Law": "transversely_isotropic"}


def lining(axial_modulus):
    return {**LINING, "Axial Young modulus": axial_modulus, "Axial shear modulus": 0.8 * axial_modulus,
            "Young modulus": 4 * axial_modulus}


def shim(modulus, poisson):
    return {"Young modulus": modulus, "Poisson ratio": poisson,
            "Density": 7800 if modulus > 1e11 else 1500, "Stiffness proportional damping": 2e-7}


@dataclasses.dataclass
class Brake:
    """A disc and two equal pads. Thicknesses in mm."""

    shim: dict = None
    shim_thickness: float = 0
    lining: dict = dataclasses.field(default_factory=lambda: LINING)
    shape: dict = dataclasses.field(default_factory=dict)
    settings: dict = dataclasses.field(default_factory=dict)


WINDOW = 4500  # Hz
COMPUTED = {"Contact/Steady pressure": "computed"}
BRAKES = {
    "soft_shim": Brake(shim(0.5e9, 0.4), 1),
    "rubber_shim": Brake(shim(0.05e9, 0.49), 0.3),
    "steel_shim": Brake(shim(200e9, 0.3), 2),
    "soft_lining": Brake(lining=lining(0.3e9)),
    "hard_lining": Brake(shim(5e9, 0.35), 0.5, lining(3e9)),
    "chamfers": Brake(shim(1e9, 0.4), 1, shape={"chamfer": 6}, settings=COMPUTED),
    "slot": Brake(shape={"slot": True}, settings=COMPUTED),
    "hat": Brake(shim(0.1e9, 0.45), 0.5, shape={"hat": True}),
}


def files(brake, directory, cells_of_lining=2, **cells):
    """Writes the mesh, of rotor_cells and pad_cells; returns the settings of a run."""
    layers = [("lining", 8, cells_of_lining)]
    if brake.shim:
        layers.append(("shim", brake.shim_thickness, 1))
    layers.append(("plate", 5, 1))
    mesh = mesh_files.layered_brake(layers, **brake.shape, **cells)
    (directory / "brake.msh").write_text(mesh_files.msh2(mesh))
    settings = {
        **mesh_files.LAYERED_SCENE, "Mesh/File": "brake.msh", "Stage": "full",
        "Operation/Angular velocity": 10, "Contact/Steady pressure": "uniform", "Contact/Friction/Coefficient": 0.5,
        "Pads/Pressure": 2e6, "Eigenproblem/Maximum frequency": WINDOW, "Output/Fields": "none",
        "Rotor/Material/Young modulus": 1.15e11, "Rotor/Material/Poisson ratio": 0.26,
        "Rotor/Material/Stiffness proportional damping": 1e-7,
        **{f"Pads/Material/{key}": value for key, value in brake.lining.items()},
        "Mesh/Part 1/Volumes": "upper.plate, lower.plate", "Mesh/Part 1/Body": "pads",
        **brake.settings,
    }
    if brake.shim:
        settings |= {"Mesh/Part 2/Volumes": "upper.shim, lower.shim", "Mesh/Part 2/Body": "pads",
                     **{f"Mesh/Part 2/Material/{key}": value for key, value in brake.shim.items()}}
    return settings
