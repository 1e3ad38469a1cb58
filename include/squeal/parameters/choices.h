#pragma once

#include <squeal/base/names.h>

namespace squeal
{
  // What a key lets choose among names. The names stand in the order of the values.

  enum class Scene
  {
    brake,
    strip,
    mesh,
    matrices
  };
  inline auto names_of(Scene)
  {
    return make_names("brake", "strip", "mesh", "matrices");
  }

  /// The paper's modelling ladder (theory.md, section 5), each stage with all before it.
  enum class Stage
  {
    elastic,
    transport,
    friction,
    friction_damping,
    full,
    ladder ///< all of them one after the other; what is checked is checked for the last
  };
  inline auto names_of(Stage)
  {
    return make_names("elastic", "transport", "friction", "friction_damping", "full", "ladder");
  }

  /// The cylinder of the rotor that is held.
  enum class Clamped
  {
    none,
    inner,
    outer
  };
  inline auto names_of(Clamped)
  {
    return make_names("none", "inner", "outer");
  }

  /// The pads that there are.
  enum class Arrangement
  {
    both,
    upper,
    none
  };
  inline auto names_of(Arrangement)
  {
    return make_names("both", "upper", "none");
  }

  enum class BackFace
  {
    guided,
    free,
    fixed
  };
  inline auto names_of(BackFace)
  {
    return make_names("guided", "free", "fixed");
  }

  enum class ElasticLaw
  {
    isotropic,
    transversely_isotropic
  };
  inline auto names_of(ElasticLaw)
  {
    return make_names("isotropic", "transversely_isotropic");
  }

  enum class Formulation
  {
    mortar,
    penalty,
    mortar_penalty
  };
  inline auto names_of(Formulation)
  {
    return make_names("mortar", "penalty", "mortar_penalty");
  }

  enum class SteadyPressure
  {
    computed,
    uniform
  };
  inline auto names_of(SteadyPressure)
  {
    return make_names("computed", "uniform");
  }

  enum class Strategy
  {
    none,
    uniform,
    adaptive
  };
  inline auto names_of(Strategy)
  {
    return make_names("none", "uniform", "adaptive");
  }

  /// How the static equilibrium is solved for.
  enum class LinearSolver
  {
    automatic,
    direct,
    iterative
  };
  inline auto names_of(LinearSolver)
  {
    return make_names("auto", "direct", "iterative");
  }

  /// Algebraic multigrid of PETSc, Trilinos and hypre.
  enum class Multigrid
  {
    gamg,
    ml,
    boomeramg
  };
  inline auto names_of(Multigrid)
  {
    return make_names("gamg", "ml", "boomeramg");
  }

  /// How modes are found.
  enum class ModeSolver
  {
    block_krylov,
    krylov,
    dense,
    block_davidson,
    none
  };
  inline auto names_of(ModeSolver)
  {
    return make_names("block_krylov", "krylov", "dense", "block_davidson", "none");
  }

  /// A coordinate of a mesh file.
  enum class Axis
  {
    x,
    y,
    z
  };
  inline auto names_of(Axis)
  {
    return make_names("x", "y", "z");
  }

  /// Bodies of a mesh file whose cells follow circles.
  enum class CurvedBodies
  {
    none,
    rotor,
    all
  };
  inline auto names_of(CurvedBodies)
  {
    return make_names("none", "rotor", "all");
  }

  enum class PartOf
  {
    rotor,
    pads
  };
  inline auto names_of(PartOf)
  {
    return make_names("rotor", "pads");
  }

  /// The modes whose fields are written.
  enum class FieldOutput
  {
    none,
    unstable,
    all
  };
  inline auto names_of(FieldOutput)
  {
    return make_names("none", "unstable", "all");
  }
} // namespace squeal
