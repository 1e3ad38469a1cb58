#pragma once

#include <squeal/bars/cell_residuals.h>
#include <squeal/bars/enriched_space.h>
#include <squeal/contact/contact_products.h>
#include <squeal/model/brake_model.h>
#include <squeal/projection/eigenpairs.h>

#include <memory>
#include <vector>

namespace squeal
{
  /// Residuals of right and left vectors on the enriched space,
  ///     r_j = Q+(l_j) x_j,   rho_j = Q+(l_j)^H z_j,
  /// of the modes' interpolated vectors, with all terms of the equations of motion. Where the
  /// eigenvalues depend on the steady pressure, its error is wanted, too: then the static state is
  /// one more vector, with K x_0 + N Lambda_0 + mu T Lambda_0 - f.
  ///
  /// Blocks of columns are [Re X, Im X, Re Z, Im Z], of n_vectors each; the state is the last Re X.
  /// Contact enters through its own terms on V+, paired anew, with the area in contact that it has.
  template <int dim>
  class EnrichedResiduals
  {
  public:
    /// Computes the residuals of at least one mode. Model and modes must outlive it. Collective.
    EnrichedResiduals(const BrakeModel<dim> &model, const EigenPairs &modes);

    template <typename Cell>
    unsigned int material_of(const Cell &cell) const
    {
      return space.base.geometry.parts[cell->material_id()].material;
    }

    /// The terms of what joins the bodies, on V+.
    const std::vector<Term> &joint_terms() const
    {
      return of_joints;
    }
    /// d tau/d p of the steady pressure at the contact's points; empty without friction.
    ContactPressure friction_gradient() const;
    /// N and mu T on a pair of faces; @p slopes is friction_gradient().
    std::vector<ContactProduct> static_products(unsigned int interface,
                                                const ContactKinematics<dim> &k,
                                                const ContactPressure &slopes) const;

    /// Closes what was released at the edge of the contact zone for the local problems. Collective.
    void close_at_edge();

    const unsigned int n_modes;
    const bool with_state;
    const unsigned int n_vectors; ///< modes and state
    EnrichedSpace<dim> space;
    CellResiduals<dim> cells;
    const std::vector<Parameters::BodyMaterial> materials;
    /// By material: the factors of its matrices at each eigenvalue; the state's are the last.
    std::vector<std::vector<OperatorFactors>> factors;
    std::unique_ptr<Contact<dim>> contact;
    ContactPressure pressure;
    MultiVector lifted;         ///< the columns, interpolated
    std::vector<Column> values; ///< the residuals of the columns

  private:
    /// Whether the body has a geometric stiffness, as in BrakeModel::linearise().
    bool is_stressed(const Parameters::BodyMaterial &material) const;
    std::vector<Column> import_columns() const;
    void pair_contact();
    /// Lifts columns and adds the products of the bodies' operators with them to @p forces, as many
    /// of each block as a material has factors.
    void add_bodies(const std::vector<Column> &columns,
                    const std::vector<std::vector<OperatorFactors>> &by_material,
                    MultiVector &in_fine_space, std::vector<Column> &forces);
    void add_contact();
    /// Adds what is there as matrices, that is little.
    void add_matrices();
    void add_elements(const std::vector<Column> &columns, const std::vector<Column> &state,
                      const std::vector<std::vector<OperatorFactors>> &by_material,
                      std::vector<Column> &forces);
    void add_measured_damping();
    void add_static_residual();
    void release_at_edge();

    const BrakeModel<dim> &model;
    const Parameters::All &prm;
    const EigenPairs &modes;
    std::vector<Term> of_joints, turning_terms;
    std::vector<unsigned int> released; ///< multipliers beside the edge of the contact zone
  };
} // namespace squeal
