#pragma once

#include <squeal/base/names.h>

namespace squeal
{
  // What a key lets choose among names.

  SQUEAL_CHOICE(Scene, brake, strip, mesh, matrices)

  /// The paper's modelling ladder (theory.md, section 5), each stage with all before it. ladder:
  /// all of them one after the other; what is checked is checked for the last.
  SQUEAL_CHOICE(Stage, elastic, transport, friction, friction_damping, full, ladder)

  /// Whether the rotor's material moves through its mesh, or turning is felt by what slides on it
  /// only.
  SQUEAL_CHOICE(Transport, full, none)
  /// The sense in which the rotor turns: about +z or -z.
  SQUEAL_CHOICE(Direction, forward, backward)

  /// The cylinder of the rotor that is held.
  SQUEAL_CHOICE(Clamped, none, inner, outer)
  /// The pads that there are.
  SQUEAL_CHOICE(Arrangement, both, upper, none)
  SQUEAL_CHOICE(BackFace, guided, free, fixed)
  SQUEAL_CHOICE(ElasticLaw, isotropic, transversely_isotropic)

  SQUEAL_CHOICE(Formulation, mortar, penalty, mortar_penalty)
  SQUEAL_CHOICE(SteadyPressure, computed, uniform, worn)

  SQUEAL_CHOICE(Strategy, none, uniform, adaptive)

  /// How the static equilibrium is solved for.
  enum class LinearSolver
  {
    automatic,
    direct,
    iterative
  };
  inline std::array<std::string, 3> names_of(LinearSolver)
  {
    return {{"auto", "direct", "iterative"}};
  }
  /// Algebraic multigrid of PETSc, Trilinos and hypre.
  SQUEAL_CHOICE(Multigrid, gamg, ml, boomeramg)
  /// How modes are found.
  SQUEAL_CHOICE(ModeSolver, block_krylov, krylov, dense, block_davidson, none)
  /// block_krylov finds modes of a window whose lower end is at least this part of its upper one
  /// without those below.
  constexpr double far_from_zero = 0.75;

  /// A coordinate of a mesh file, its bodies whose cells follow circles, and what a part belongs
  /// to.
  SQUEAL_CHOICE(Axis, x, y, z)
  SQUEAL_CHOICE(CurvedBodies, none, rotor, all)
  SQUEAL_CHOICE(DividedElements, own, divided)
  SQUEAL_CHOICE(OtherVolumes, refused, left_out)
  SQUEAL_CHOICE(PartOf, rotor, pads, parts)

  /// How a frequency response is computed.
  SQUEAL_CHOICE(ResponseMethod, modal, direct)

  /// The modes whose fields are written.
  SQUEAL_CHOICE(FieldOutput, none, unstable, all)
} // namespace squeal
