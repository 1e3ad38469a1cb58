#pragma once

#include <squeal/base/log.h>
#include <squeal/bodies/body_operators.h>
#include <squeal/contact/contact_forces.h>
#include <squeal/contact/contact_zone.h>
#include <squeal/eigen/block_davidson.h>
#include <squeal/joints/points.h>
#include <squeal/joints/superelements.h>
#include <squeal/joints/ties.h>
#include <squeal/mesh/finite_element_space.h>
#include <squeal/model/model.h>
#include <squeal/projection/eigenpairs.h>
#include <squeal/statics/static_solver.h>

#include <cmath>
#include <memory>

namespace squeal
{
  /// One term of the equations of motion of a body, as a multiple of a matrix of body_operators.h.
  struct BodyTerm
  {
    enum class Kind
    {
      M,
      K,
      G,
      M_star,
      V
    };
    Origin origin;
    unsigned int order; ///< of the time derivative
    Kind matrix;
    double coefficient;
  };

  /// M q'' + (D + 2 Omega G) q' + (K - Omega^2 M*) q of theory.md, section 2, as far as the stage
  /// has it, for what is made of one material.
  std::vector<BodyTerm> body_terms(const Parameters::All &parameters,
                                   const Parameters::BodyMaterial &body);

  /// What the static equilibrium of a new mesh begins with, and what it is for.
  struct StateOptions
  {
    const ContactZone *zone = nullptr; ///< first active set; null: everything touches
    bool with_edge          = true; ///< asks for the edge of the contact, if there are error bars
  };

  /// Rotor and pads on a mesh: their equations of motion, linearised about the static sliding
  /// equilibrium (theory.md, sections 2 and 3).
  template <int dim>
  class BrakeModel : public Model
  {
  public:
    /// @p timer is told the phases mesh, assembly, contact and static.
    BrakeModel(const Geometry<dim> &geometry, const Parameters::All &parameters, MPI_Comm comm,
               Log &log, PhaseTimer &timer);

    /// Takes the brake and the mesh of another model, which must stay as they are, with elements of
    /// another degree.
    BrakeModel(const BrakeModel &other, const Parameters::All &parameters, PhaseTimer &timer);

    /// Numbers the unknowns of the present mesh and forgets all matrices. Call it after every
    /// change of the mesh.
    void distribute();

    /// The contact surfaces and the steady pressure at these parameters: the static equilibrium
    /// where that is computed. With @p nearby it follows from the state before; see
    /// Model::assemble(). The state stays until the next call. Throws InputError, SolverError.
    const SteadyState<dim> &find_steady_state(const Parameters::All &parameters,
                                              const LinearOperator &nearby = {},
                                              const StateOptions &options  = {});
    /// M, D + 2 Omega G + P_R and K - Omega^2 M* + N + mu T + Q_R about a state of this mesh. They
    /// depend on the state alone, whose parameters it was found at; the matrices of its contact
    /// stay with it for the state that follows. Throws SolverError. Collective.
    EquationsOfMotion linearise(SteadyState<dim> &state);
    /// Linearises about the present state, which equations() and derivatives() are of from then on:
    /// the second step of assemble().
    const EquationsOfMotion &linearise()
    {
      return equations_ = linearise(steady);
    }

    void assemble(const Parameters::All &parameters, const LinearOperator &nearby = {}) override;
    std::vector<ParameterDerivative> derivatives(const std::string &only,
                                                 const LinearOperator &nearby = {}) const override;

    std::pair<std::vector<std::string>, std::vector<unsigned int>> bodies_of_rows() const override;
    bool has_semidefinite_terms() const override
    {
      return true;
    }
    Sectors sectors() const override
    {
      return sectors_for(parameters());
    }
    /// Makes what marks cells the same for those that are images of each other, so that the mesh
    /// keeps its sectors. Collective.
    void keep_sectors(std::vector<double> &by_cell) const
    {
      if (parameters().eigenproblem.mirror_symmetry)
        average_over_images(spaces_, by_cell);
    }

    /// The equations without the bodies' matrices, and multigrid as the preconditioner, for
    /// parameters whose solver is block_davidson. The model must outlive it unchanged. Collective.
    DavidsonProblem davidson_problem() const;

    FiniteElementSpace<dim> &spaces()
    {
      return spaces_;
    }
    /// Null without pads.
    const Contact<dim> *contact() const
    {
      return steady.contact ? &*steady.contact : nullptr;
    }
    /// The static equilibrium, or null if none was computed.
    const StaticEquilibrium *equilibrium() const
    {
      return steady.equilibrium ? &*steady.equilibrium : nullptr;
    }
    /// The steady pressure and its resultants.
    const ContactPressure &pressure() const
    {
      return steady.pressure;
    }
    const SteadyState<dim> &steady_state() const
    {
      return steady;
    }
    std::vector<ContactResultants> resultants() const;
    const FiniteElementSpace<dim> &spaces() const
    {
      return spaces_;
    }
    /// Parameters of the present state.
    const Parameters::All &parameters() const
    {
      return steady.parameters;
    }

    /// The loads at these parameters on a space of the mesh: the geometry's, scaled from the
    /// Pads/Pressure that it was made with, and the centrifugal one.
    MultiVector static_load(const Parameters::All &parameters,
                            const FiniteElementSpace<dim> &spaces) const;

    static ContactModel<dim> contact_model(const Parameters::All &parameters);
    /// The pressure of pads that are fully worn at these parameters; none where it is another.
    std::optional<WornPressure<dim>> worn_pressure(const Parameters::All &parameters,
                                                   const Contact<dim> &contact) const;
    /// The pressure that is known without an equilibrium: that of worn pads or the uniform one.
    static ContactPressure known_pressure(const Parameters::All &parameters,
                                          const std::optional<WornPressure<dim>> &worn,
                                          const Contact<dim> &contact);
    /// N, mu T, P_R and Q_R of theory.md, section 3, and the turning, as far as the parameters ask.
    static std::vector<Term> contact_terms(const Contact<dim> &contact,
                                           const ContactPressure &pressure,
                                           const Parameters::All &parameters,
                                           ContactMatrices<dim> &matrices);
    /// The gain of friction on the contact pressure; zero without friction.
    SelfLocking self_locking() const;
    /// What a force changes in the static state while its contacts stay as they are, and while the
    /// rotor rests, which is stiff beside what presses on it: the tangent of theory.md, section 3,
    /// of the other bodies is factorised, but where modes are found without factors. Collective;
    /// throws SolverError.
    MultiVector static_response(const MultiVector &force) const;
    /// Where friction feeds energy into a mode.
    FrictionWork friction_work(const EigenPairs &modes, unsigned int mode) const;

    /// The matrices of a material are assembled once a mesh; the terms scale them to the present
    /// material.
    struct AssembledBody
    {
      BodyMatrices matrices;
      Material material; ///< with which they were assembled
      /// In place of K the stiffnesses of elastic_components(), once the moduli have changed by
      /// different factors from one followed state to the next.
      std::vector<std::shared_ptr<const Matrix>> stiffnesses = {};

      /// What makes up the stiffness of a material that has such matrices.
      std::vector<std::pair<double, std::shared_ptr<const Matrix>>>
      stiffness_of(const Material &present) const;
      /// The wanted terms of a material that has such matrices.
      std::vector<Term> terms(const std::vector<BodyTerm> &wanted, const Material &present) const;
    };

    const AssembledBody &body(const unsigned int material) const
    {
      return bodies[material];
    }
    /// Geometric stiffnesses of the bodies whose static stress the parameters ask for.
    std::vector<Matrix> stress_stiffnesses(const Parameters::All &parameters,
                                           const MultiVector &state) const;
    static bool is_body_term(const Term &term)
    {
      return term.origin == Origin::elasticity || term.origin == Origin::transport ||
             term.origin == Origin::material_damping || term.origin == Origin::joint;
    }
    const Ties &ties() const
    {
      return ties_;
    }
    const Points &points() const
    {
      return points_;
    }
    /// The terms of joints, of all orders; none that are zero. Damping is that of the stages that
    /// have damping.
    static std::vector<Term> joint_terms(const Ties &ties, const Points &points,
                                         const Superelements &superelements, bool has_damping);
    /// The joints' terms on another space of the mesh. Collective.
    std::vector<Term> joint_terms(const FiniteElementSpace<dim> &spaces) const;

  private:
    Sectors sectors_for(const Parameters::All &parameters) const
    {
      return parameters.eigenproblem.mirror_symmetry ? find_sectors(spaces_) : Sectors();
    }
    /// The terms of the bodies and joints, of order zero only or all. Matrices that are there
    /// already stay; @p follows: others than these are expected to come as well.
    std::vector<Term> bodies_and_joints(const Parameters::All &parameters, bool with_motion,
                                        bool follows);
    /// What relaxes in the bodies, whose stiffnesses are there.
    std::vector<RelaxationTerm> relaxation_of_bodies(const Parameters::All &parameters) const;
    /// The matrices that a material lacks for the terms that are wanted.
    void assemble_missing(unsigned int number, const Material &material,
                          const BodyMatrixChoice &choice, bool follows);
    /// Assembles what joins the bodies, once a mesh.
    void assemble_joints();
    double stiffness_of_joints();
    /// The terms of the bodies without matrices, as products by the state's iterative solver.
    std::vector<Term> matrix_free_bodies(const SteadyState<dim> &state) const;
    /// The terms of one order, those of the bodies in one pass over the cells.
    Matrix matrix_free_sum(unsigned int order) const;
    /// Makes the iterative solver and tells the log.
    std::shared_ptr<IterativeStatics<dim>> make_iterative_solver(const Parameters::All &parameters,
                                                                 bool needs_edge) const;
    /// Whether the static equilibrium is solved without factors.
    bool solves_iteratively(const Parameters::All &parameters) const;
    /// Finds the state at the parameters and with the bodies' terms that @p state has; with @p
    /// nearby it follows from @p before.
    void find_state(SteadyState<dim> &state, SteadyState<dim> before, const LinearOperator &nearby,
                    const StateOptions &options);
    /// Wears the pads of a state in.
    void bed_in(SteadyState<dim> &state, double tolerance);
    /// The centrifugal load of the rotor's materials.
    MultiVector centrifugal_load(const Parameters::All &parameters,
                                 const FiniteElementSpace<dim> &spaces) const;
    const Geometry<dim> geometry;
    const MPI_Comm comm;
    Log &log;
    PhaseTimer &timer;
    FiniteElementSpace<dim> spaces_;
    const double load_pressure;        ///< of the geometry's loads, Pa
    std::vector<AssembledBody> bodies; ///< by material
    Ties ties_;                        ///< without matrix before it is needed
    Points points_;                    ///< likewise
    Superelements superelements_;      ///< likewise
    double joint_stiffness = 0;        ///< N/m, as large as the bodies' rows
    SteadyState<dim> steady;           ///< found last
    StaticSolver<dim> static_solver;
  };
} // namespace squeal
