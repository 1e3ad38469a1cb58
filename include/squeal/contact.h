#pragma once

#include <squeal/eigenproblem.h>
#include <squeal/friction_laws.h>
#include <squeal/mortar.h>
#include <squeal/spaces.h>

#include <functional>

namespace squeal
{
  /// What the contact's linearisation depends on (theory.md, section 3).
  struct ContactModel
  {
    bool        mortar            = true; ///< Lagrange multiplier, else penalty
    double      penalty_stiffness = 0;    ///< k_C, N/m^3
    FrictionLaw friction;
    double      angular_velocity = 0; ///< Omega, rad/s
  };

  /// Resultants of the contact pressure on one pad.
  struct ContactResultants
  {
    std::string name;
    double      normal_force = 0, friction_force = 0, friction_torque = 0, area = 0, max_pressure = 0;
    double      tension_area    = 0; ///< part of the area where the pressure is negative
    double      max_penetration = 0; ///< meaningful only for a computed state
  };

  /// The interfaces of a scene on one mesh: pairing and the matrices built on it. Both bodies are in contact
  /// on the whole pad face.
  template <int dim>
  class Contact
  {
  public:
    /// Pairs the surfaces. The rotor's contact faces are gathered on all ranks, because the ghost cells of a
    /// distributed mesh do not contain the opposite surface; each rank works on its own pad faces.
    Contact(const Spaces<dim> &spaces, const ContactModel &model);

    /// Multipliers are stored as p = pressure_scale * Lambda and constraint rows are multiplied by it, so
    /// that the saddle point's entries are of one size. Set before assembly.
    double pressure_scale = 1;

    /// N: penalty int d[[u]].n k_C D[[u]].n, mortar the two off-diagonal blocks.
    Matrix normal() const;

    /// mu T: int mu d[[u]].e Dp.
    Matrix friction() const;

    /// The steady pressure p_0 at every quadrature point of every interface.
    using Pressure = std::vector<std::vector<double>>;
    Pressure uniform_pressure(double value) const;
    /// From a static solution (one column).
    Pressure pressure_of(const Block &state) const;

    /// P_R and Q_R: those of the turning direction, int (mu p_0/|v_0|) d[[u]].P_perp ..., and those of
    /// mu'(|v_0|), int mu' p_0 (d[[u]].e)(e. ...). Empty where they vanish.
    struct FrictionDamping
    {
      Matrix P, Q, P_falling, Q_falling;
    };
    FrictionDamping friction_damping(const Pressure &pressure) const;

    /// Force, torque, area; penetration if a static solution is given.
    std::vector<ContactResultants> resultants(const Pressure &pressure, const Block *state) const;

    /// Seconds-independent size of the pairing, for the log.
    unsigned int n_points() const;

  private:
    /// A face with the equations of its nodes: each node is interpolated from free nodes.
    struct FreeNode
    {
      double                   weight;
      std::array<int, dim + 1> equations; ///< displacement components and multiplier; -1: none
    };
    struct Face
    {
      SurfaceFace<dim>                   shape;
      std::vector<std::vector<FreeNode>> nodes;
    };
    struct Interface
    {
      std::string                   name;
      std::vector<Face>             pad_faces, rotor_faces;
      std::vector<FacePair<dim>>    pairs;
    };
    struct Kinematics;
    struct Rows;

    std::vector<Face> local_faces(dealii::types::boundary_id boundary) const;

    /// Calls the function with the kinematics of each pair of faces and the index of its first point.
    void for_each_pair(const std::function<void(unsigned int interface, const Kinematics &)> &work) const;

    const Spaces<dim>     &spaces;
    const ContactModel     model;
    FaceElement<dim>       element;
    std::vector<Interface> interfaces;
  };
} // namespace squeal
