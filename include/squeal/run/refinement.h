#pragma once

#include <squeal/assessment/stability.h>
#include <squeal/bars/error_estimators.h>
#include <squeal/contact/contact.h>
#include <squeal/parameters/parameters.h>

#include <deal.II/distributed/tria.h>

#include <array>
#include <string>
#include <vector>

namespace squeal
{
  template <int dim>
  using Mesh = dealii::parallel::distributed::Triangulation<dim>;

  /// What each own cell does to the modes that are not yet known well enough, in units of what
  /// @p tolerance allows (relative to |l|; 0: modes without a verdict, in units of their growth
  /// rate); empty if all are.
  std::vector<double> refinement_indicators(const std::vector<ModeRow> &rows,
                                            const EigenvalueErrors &errors, double tolerance);

  /// One for each own cell in which some contact pressures are active and others have been
  /// released, so that the contact ends inside of it, else zero; empty if there is none.
  /// Collective.
  template <int dim>
  std::vector<double> cells_at_contact_edge(const Contact<dim> &contact);

  /// Flags the cells that make up the greater part of the sum of @p by_cell (bulk criterion,
  /// Doerfler 1996), one number for each own cell. Collective.
  template <int dim>
  void flag_cells(Mesh<dim> &mesh, const std::vector<double> &by_cell);

  /// The factor by which the flagged cells increase the number of unknowns, roughly: every unknown
  /// of a volume becomes 2^dim. Collective.
  template <int dim>
  double growth_by_flags(const Mesh<dim> &mesh);

  /// Cells of all ranks (dealii::CellId::binary_type).
  using CellNames = std::vector<std::array<unsigned int, 4>>;
  /// Divides the flagged cells and returns their names. Collective.
  template <int dim>
  CellNames divide(Mesh<dim> &mesh);
  /// Divides the cells of these names; none: nothing is done. Collective.
  template <int dim>
  void divide_again(Mesh<dim> &mesh, const CellNames &names);

  /// What a sequence of meshes may cost: Maximum unknowns, time and memory of section Refinement.
  ///
  /// Time and memory of the next mesh are predicted by a power of the number of unknowns, taken
  /// from the last two meshes. After the first mesh it is that of a sparse factorisation in three
  /// dimensions by nested dissection: 4/3 for memory and, between that of the solves, 4/3, and that
  /// of the factorisation, 2, 3/2 for time.
  class RefinementBudget
  {
  public:
    explicit RefinementBudget(const Parameters::Refinement &limits) : limits(limits) {}

    struct Mesh
    {
      double n_unknowns, seconds, memory; ///< the peak so far, GiB
    };
    void add_mesh(const Mesh &finished)
    {
      meshes.push_back(finished);
    }

    /// Why a mesh of about so many unknowns must not be begun, for the log; empty if it may.
    std::string objection(double n_unknowns) const;

  private:
    /// The value of a member for the next mesh; exponents below one are not believed.
    double predict(double Mesh::*value, double n_unknowns, double first_exponent) const;

    const Parameters::Refinement &limits;
    std::vector<Mesh> meshes;
  };
} // namespace squeal
