#pragma once

#include <squeal/eigen/rim_survey.h>
#include <squeal/equations/sector.h>
#include <squeal/reduction/bracketed_count.h>
#include <squeal/reduction/reduced_model.h>

#include <memory>
#include <vector>

namespace squeal
{
  /// The reduced model of a sector in which a full solution was found,
  ///     V_h^T (l^2 M + l P + Q) V_h y = 0,   x = V_h y:
  /// bases, factors and residuals of half the size, which makes what is of the second and the third
  /// order in them a quarter and an eighth.
  class SectorModel
  {
  public:
    SectorModel(const Sector &sector, const EigensolverOptions &options,
                const ReducedModel::Course course)
        : sector(sector), reduced(options, course), max_imaginary(options.max_imaginary)
    {
    }

    /// Whether the sector's part of a matrix is known.
    bool knows(const std::shared_ptr<const Matrix> &matrix) const
    {
      return restricted.find(matrix) != nullptr;
    }
    /// Takes the sector's part of terms of the whole, which keep to it. @p added has each matrix of
    /// their @p list that is not known as a sum of its own. Collective.
    void set_terms(const std::vector<Term> &of_whole, const TermList &list,
                   const std::vector<std::vector<Term>> &added);
    /// The last ones.
    const std::vector<Term> &terms() const
    {
      return own_terms;
    }

    /// Begins anew with the last terms, of which @p whole is the problem (not needed but for its
    /// layout if the sector is not the whole); @p semidefinite as of BracketedCount.
    void set_expansion_point(const QuadraticEigenproblem &whole, const EigenSolution::Reuse &found,
                             bool semidefinite);
    /// Whether modes of other terms can be found, or the expansion point had none here.
    bool is_ready() const
    {
      return n_modes == 0 || reduced.has_expansion_point();
    }
    bool has_modes() const
    {
      return n_modes > 0;
    }
    /// The derivative in the bases. z^H dA x of a mode of a sector needs V_h^T dA V_h only,
    /// whatever the symmetry of dA.
    ParameterDerivative project(const ParameterDerivative &derivative) const;
    /// Whether the reference problem of the last terms has as many modes in the disc as that of the
    /// expansion point.
    bool has_count_of_expansion_point()
    {
      return reference->count(own_terms) == expansion_count;
    }
    /// The problem of the last terms; the whole has @p n_constraints that are active.
    RimSurvey::InSector in_survey(const unsigned int n_constraints) const
    {
      return {sector.row_range(), own_terms, share_of(n_constraints)};
    }

    Sector sector;
    ReducedModel reduced;
    /// Q of the expansion point, or of other terms, for static states.
    std::shared_ptr<const Factorization> position_factors;

  private:
    unsigned int share_of(const unsigned int n_constraints) const
    {
      return sector.is_whole() ? n_constraints : n_constraints / 2;
    }
    /// The problem at the expansion point, without velocity terms.
    QuadraticEigenproblem expansion_problem(const QuadraticEigenproblem &whole) const;

    double max_imaginary;
    std::vector<Term> own_terms;
    PerMatrix<std::shared_ptr<const Matrix>> restricted; ///< the matrices' parts in the sector
    std::shared_ptr<BracketedCount> reference;
    unsigned int n_modes         = 0; ///< of the expansion point in the disc
    unsigned int expansion_count = 0; ///< of its reference problem
  };

  /// Modes in a sector. A list of all modes has their vectors as coordinates in the sector's bases,
  /// with zeros up to the largest dimension of all sectors and later.
  struct SectorModes
  {
    /// Takes those of a list that lie in the sector, which their parity tells.
    SectorModes(const SectorModel &model, const EigenPairs &list);
    /// Writes a value for each into a list.
    void put(const std::vector<std::complex<double>> &values,
             std::vector<std::complex<double>> &list) const;
    /// Writes the vectors, of which rows may be missing at the end, into those of a list.
    void put_vectors(EigenPairs &list) const;

    const SectorModel &model;
    std::vector<unsigned int> numbers; ///< in the list
    EigenPairs pairs;
  };
} // namespace squeal
