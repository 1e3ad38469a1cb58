#pragma once

#include <squeal/equations/eigenproblem.h>
#include <squeal/equations/term_list.h>

#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

namespace squeal
{
  /// Tells whether strongly damped modes may have crossed the rim of the disc since an expansion
  /// point, a problem whose modes are known. As long as forces have changed by less than its
  /// clearance (clearance_of()), none has. Where they have changed by more, both problems must be
  /// definite on the rim (is_definite_on_rim()); what was found definite is remembered by the
  /// strengths of its forces.
  class RimSurvey
  {
  public:
    /// The problem in a sector.
    struct InSector
    {
      RowRange rows;
      std::vector<Term> terms;
      unsigned int n_constraints; ///< active ones
    };

    explicit RimSurvey(const double max_imaginary = 0) : max_imaginary(max_imaginary) {}
    /// Begins anew at an expansion point; @p terms are those of the whole.
    void begin(double clearance, const std::vector<Term> &terms, std::vector<InSector> in_sectors);
    /// Whether none has crossed between the expansion point and these terms. Takes factorisations
    /// only beyond what is known: is_definite_on_rim() in each sector. Throws SolverError.
    /// Collective.
    bool covers(const std::vector<Term> &terms, const std::vector<InSector> &in_sectors);

  private:
    /// The sizes of what makes modes overdamped, by origin and order.
    using Strengths = std::map<std::pair<Origin, unsigned int>, double>;
    /// Strengths between which nothing crosses the rim.
    struct Surveyed
    {
      Strengths from, to;
    };
    Strengths strengths_of(const std::vector<Term> &terms);
    bool is_within_clearance(const Strengths &now) const;
    bool survey(const Strengths &now, const std::vector<InSector> &in_sectors);
    /// Whether all are definite, with factors of their velocity terms by origin.
    bool are_definite(const std::vector<InSector> &in_sectors,
                      const std::map<Origin, double> &factors) const;

    double max_imaginary;
    double clearance = 1;
    std::vector<InSector> expansion;
    std::optional<bool> is_expansion_definite;
    std::vector<Surveyed> surveyed; ///< the expansion point alone first
    PerMatrix<double> matrix_norms; ///< of the last terms
  };
} // namespace squeal
