"""A brake of seven parts as Abaqus CAE writes it, in mm, t, s, and as one mesh without parts, in SI units.

A disc, linings, plates and pistons of C3D10; ties, springs and a mass at points, two pressures.
"""

import math

import element_files
import mesh_files

BODIES = {"rotor": ("Disc", "Iron"), "upper": ("LiningUp", "Lining"), "lower": ("LiningLow", "Lining"),
          "plate_up": ("PlateUp", "Steel"), "plate_low": ("PlateLow", "Steel"),
          "piston_up": ("PistonUp", "Steel"), "piston_low": ("PistonLow", "Steel")}
SUPPORTS = {"_held": ["rotor.inner"], "_guided": ["piston_up.high", "piston_low.low"]}


def elements():
    mesh, half = mesh_files.brake(rotor_cells=(2, 16, 1), pad_cells=(1, 2, 1)), math.radians(25)
    for name, low in (("plate_up", 0.018), ("plate_low", -0.023)):
        mesh.sector(name, [0.088, 0.142], mesh_files.equal(-half, half, 3), [low, low + 0.005])
    for name, low in (("piston_up", 0.023), ("piston_low", -0.033)):
        mesh.sector(name, [0.105, 0.125], [-0.15, 0.15], [low, low + 0.01])
    result = element_files.Elements(mesh, lambda name: 4)
    result.make_quadratic({"rotor": element_files.on_circle})
    return result


def joints(mm, first):
    """Ties, springs and a mass at points that couplings hold to the plates, numbered from first + 1, by the names of CAE."""
    m, of_force, of_mass = (1e3, 1e-3, 1e-3) if mm else (1, 1, 1)
    x, y, z = (m * value for value in (0.115 * math.cos(math.radians(25)), 0.115 * math.sin(math.radians(25)), 0.0205))
    lines = ["*Node", f"{first + 1}, {x!r}, {y!r}, {z!r}", f"{first + 2}, {x!r}, {y!r}, {-z!r}"]
    for k, plate in ((1, "plate_up"), (2, "plate_low")):
        lines += [f"*Nset, nset=m_Set-{k}", f"{first + k},", f"** Constraint: RP-{k}",
                  f"*Coupling, constraint name=RP-{k}, ref node=m_Set-{k}, surface={plate}.end", "*Distributing, weighting method=UNIFORM"]
    for k, (slave, master) in enumerate([("upper.high", "plate_up.low"), ("lower.low", "plate_low.high"),
                                         ("piston_up.low", "plate_up.high"), ("piston_low.high", "plate_low.low")]):
        lines += [f"** Constraint: Constraint-{k}", f"*Tie, name=Constraint-{k}, adjust=yes", f"{slave}, {master}"]
    lines += ["*Spring, elset=Springs/Dashpots-1-spring", "", f"{3e7 * of_force!r}",
              "*Element, type=SpringA, elset=Springs/Dashpots-1-spring", f"{first + 1}, {first + 1}, {first + 2}",
              "*Spring, elset=Springs/Dashpots-2-spring", "2", f"{5e6 * of_force!r}",
              "*Element, type=Spring1, elset=Springs/Dashpots-2-spring", f"{first + 2}, {first + 1}",
              "*Element, type=MASS, elset=Inertia-1_", f"{first + 3}, {first + 2}",
              "*Mass, elset=Inertia-1_", f"{0.2 * of_mass!r},"]
    return "\n".join([*lines, ""])


def model(mm):
    of_stress, of_density = (1e-6, 1e-12) if mm else (1, 1)
    lines = []
    for name, density, young, nu, beta in [("Iron", 7200., 125e9, 0.25, 1e-7), ("Lining", 2500., 10e9, 0.3, 2e-6),
                                           ("Steel", 7800., 210e9, 0.3, 1e-7)]:
        lines += [f"*Material, name={name}", "*Density", f" {density * of_density!r},", f"*Damping, beta={beta!r}",
                  "*Elastic", f"{young * of_stress!r}, {nu}"]
    return "\n".join([*lines, f"""*Surface Interaction, name=IntProp-1
1.,
*Friction, slip tolerance=0.005
 0.5,
*Surface Behavior, pressure-overclosure=HARD
** Interaction: Int-1
*Contact Pair, interaction=IntProp-1, small sliding, type=SURFACE TO SURFACE
upper.low, rotor.high
** Interaction: Int-2
*Contact Pair, interaction=IntProp-1, small sliding, type=SURFACE TO SURFACE
lower.high, rotor.low
*Boundary
_held, ENCASTRE
_guided, 1, 1
_guided, 2, 2
** STEP: Pressure
*Step, name=Pressure, nlgeom=NO
*Static
1., 1., 1e-05, 1.
*Dsload
piston_up.high, P, {4e6 * of_stress!r}
piston_low.low, P, {5e6 * of_stress!r}
*Motion, rotation, type=VELOCITY
_held, 20., 0., 0., 0., 0., 0., 1.
*Restart, write, frequency=0
*Output, field, variable=PRESELECT
*End Step
** STEP: Modes
*Step, name=Modes, nlgeom=NO, unsymm=YES
*Frequency, eigensolver=Lanczos, sim=NO, acoustic coupling=off, normalization=displacement
20, , 5000., , ,
*End Step
*Step, name=Complex, nlgeom=NO, unsymm=YES
*Complex Frequency, friction damping=NO
20, , 5000.
*End Step
"""])


def parts(mesh):
    """(deck, included file nodes.txt) with parts, in mm, t, s."""
    deck, nodes = element_files.brake_deck(mesh, BODIES, SUPPORTS)
    return deck.replace("*End Assembly", joints(True, 0) + "*End Assembly") + "\n" + model(True), nodes


def flat(mesh):
    """The deck without parts, in SI units."""
    return element_files.flat_deck(mesh, BODIES, SUPPORTS) + joints(False, 900000) + model(False)
