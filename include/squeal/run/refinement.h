#pragma once

#include <squeal/assessment/error_estimators.h>
#include <squeal/assessment/stability.h>
#include <squeal/parameters/parameters.h>

#include <string>
#include <vector>

namespace squeal
{
  /// What each own cell does to the modes that are not yet known well enough, in units of what
  /// @p tolerance allows (relative to |l|; 0: modes without a verdict, in units of their growth
  /// rate); empty if all are.
  std::vector<double> refinement_indicators(const std::vector<ModeRow> &rows,
                                            const EigenvalueErrors &errors, double tolerance);

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
