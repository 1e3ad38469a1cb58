#pragma once

#include <squeal/body_operators.h>
#include <squeal/log.h>
#include <squeal/model.h>
#include <squeal/static_equilibrium.h>

#include <memory>

namespace squeal
{
  /// Rotor and pads on a mesh: their equations of motion, linearised about the static sliding
  /// equilibrium (theory.md, sections 2 and 3).
  template <int dim>
  class BrakeModel : public Model
  {
  public:
    /// @p timer is told the phases mesh, assembly, contact and static.
    BrakeModel(const Geometry<dim> &geometry, const Parameters::All &parameters, MPI_Comm comm,
               Log &log, PhaseTimer &timer);

    /// Numbers the unknowns of the present mesh and forgets all matrices. Call it after every
    /// change of the mesh.
    void distribute();

    void assemble(const Parameters::All &parameters) override;
    QuadraticEigenproblem problem() const override;
    std::vector<ParameterDerivative> derivatives() const override;

    Spaces<dim> &spaces()
    {
      return spaces_;
    }
    /// Null without pads.
    const Contact<dim> *contact() const
    {
      return contact_.get();
    }
    /// The static equilibrium, or null if none was computed.
    const StaticEquilibrium *equilibrium() const
    {
      return equilibrium_ ? equilibrium_.get() : nullptr;
    }
    /// The steady pressure and its resultants.
    const typename Contact<dim>::Pressure &pressure() const
    {
      return pressure_;
    }
    std::vector<ContactResultants> resultants() const;

  private:
    /// The matrices of a material are assembled once a mesh; the terms scale them to the present
    /// material.
    struct AssembledBody
    {
      BodyMatrices matrices;
      Material material; ///< with which they were assembled
    };
    std::vector<Body> bodies_of(bool rotor) const;
    const Material &material_of(bool rotor) const;

    void add_bodies();
    void find_steady_state();
    void add_contact();
    void add_prestress();

    const Geometry<dim> geometry;
    const MPI_Comm comm;
    Log &log;
    PhaseTimer &timer;
    Spaces<dim> spaces_;
    Parameters::All prm;                 ///< of the terms
    std::array<AssembledBody, 2> bodies; ///< pads, rotor
    std::unique_ptr<Contact<dim>> contact_;
    std::unique_ptr<StaticEquilibrium> equilibrium_;
    typename Contact<dim>::Pressure pressure_;
  };
} // namespace squeal
