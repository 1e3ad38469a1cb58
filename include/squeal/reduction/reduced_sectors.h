#pragma once

#include <squeal/eigen/rim_survey.h>
#include <squeal/equations/sector.h>
#include <squeal/linalg/gmres.h>
#include <squeal/model/model.h>
#include <squeal/reduction/bracketed_count.h>
#include <squeal/reduction/reduced_model.h>

#include <memory>
#include <optional>
#include <vector>

namespace squeal
{
  /// The reduced models of the sectors in which a full solution was found,
  ///     V_h^T (l^2 M + l P + Q) V_h y = 0,   x = V_h y:
  /// bases, factors and residuals of half the size, which makes what is of the second and the third
  /// order in them a quarter and an eighth. Coordinates of a mode are those of its sector, which
  /// its parity tells, and zeros up to the largest dimension of all sectors and later.
  class ReducedSectors
  {
  public:
    explicit ReducedSectors(const EigensolverOptions &options)
        : options(options), rim(options.max_imaginary)
    {
    }
    /// To be told before the first expansion point.
    void expect(const ReducedModel::Course of_parameters)
    {
      course = of_parameters;
    }

    /// Begins anew, as ReducedModel::set_expansion_point(); @p semidefinite as of BracketedCount.
    void set_expansion_point(QuadraticEigenproblem problem, const std::vector<Term> &terms,
                             const EigenSolution::Reuse &found, const Sectors &sectors,
                             bool semidefinite);
    std::vector<double> varying_terms() const;
    void keep_apart(const std::vector<double> &varying_terms);
    /// Which coefficients are to vary, from such terms before the first solution.
    void learn(const std::vector<Term> &terms);

    bool has_expansion_point() const;
    /// Whether nothing grows outside of the disc at the expansion point, as far as there are signs.
    bool has_no_growth_beyond() const
    {
      return no_growth_beyond;
    }
    /// x = Q^{-1} b of the expansion point, or of the terms of renew_inverse() for a symmetric b;
    /// empty without. To be used before the next expansion point.
    LinearOperator inverse() const
    {
      if (inverse_factors.empty())
        return {};
      return [this](const MultiVector &b) { return apply_inverse(b); };
    }
    /// How often it was applied.
    unsigned int n_inverse() const
    {
      return n_inverse_;
    }
    /// Factorises for inverse() the Q of the terms, of symmetric vectors if there are parity
    /// sectors: static states are symmetric. Without an effect if it is singular.
    void renew_inverse(const std::vector<Term> &terms);

    /// Whether the reference problems of these terms have as many modes in the disc as those of the
    /// expansion point. False also if the terms have lost the symmetry.
    bool has_count_of_expansion_point(const std::vector<Term> &terms);

    /// Solves in every sector (ReducedModel::solve()). Nothing either where strongly damped modes
    /// may have come into the disc (RimSurvey). @p n_constraints are those that are active with the
    /// terms.
    std::optional<EigenPairs> solve(const std::vector<Term> &terms, unsigned int n_constraints);
    bool is_crowded() const;
    bool is_full() const;
    /// Gives these modes in the new coordinates.
    EigenPairs restart(const EigenPairs &modes);
    ReducedModel::RayleighForms rayleigh_forms(const EigenPairs &modes) const;
    EigenPairs expand(const EigenPairs &modes) const;
    /// As the function of that name, of the projected problem; zero between sectors.
    std::vector<std::complex<double>> biorthogonality(const EigenPairs &of_left,
                                                      const EigenPairs &of_right) const;
    std::vector<std::complex<double>> sensitivities(const ParameterDerivative &derivative,
                                                    const EigenPairs &modes) const;

  private:
    struct Part
    {
      Sector sector;
      ReducedModel reduced;
      std::shared_ptr<BracketedCount> reference;
      unsigned int n_modes         = 0; ///< of the expansion point in the disc
      unsigned int expansion_count = 0;
      /// The matrices' parts in the sector
      PerMatrix<std::shared_ptr<const Matrix>> restricted;
      std::vector<Term> terms; ///< the last ones
    };

    /// Puts the terms into the parts; false if they do not keep to the sectors.
    bool restrict(const std::vector<Term> &terms);
    bool keep_to_sectors(const std::vector<Term> &terms) const;
    MultiVector apply_inverse(const MultiVector &b) const;
    /// The numbers of the modes of a part.
    static std::vector<unsigned int> modes_of(const EigenPairs &modes, const Part &part);
    /// The part's modes in its coordinates.
    static EigenPairs extract(const EigenPairs &modes, const Part &part);
    /// Calls visit(part, numbers, the part's modes) where there are some.
    template <typename Visit>
    void for_parts(const EigenPairs &modes, const Visit &visit) const;
    /// Vectors of a part in so many coordinates that those of all parts have room.
    ComplexMultiVector in_all_coordinates(const ComplexMultiVector &of_part) const;

    /// The problem of the last terms by sectors.
    std::vector<RimSurvey::InSector> in_sectors(unsigned int n_constraints) const;
    /// The part's own problem at the expansion point, without velocity terms.
    QuadraticEigenproblem expansion_problem_of(const Part &part) const;

    EigensolverOptions options;
    ReducedModel::Course course = ReducedModel::Course::path;
    Sectors sectors;
    RowRange whole;
    unsigned int n_expansion_constraints = 0; ///< active at the expansion point
    unsigned int n_local_constraints     = 0;
    bool compliant                       = false;
    RimSurvey rim;
    bool no_growth_beyond = false;
    std::vector<Part> parts;
    std::array<double, 3> norms{}; ///< of the expansion point's matrices by order
    mutable unsigned int n_inverse_ = 0;
    std::vector<std::shared_ptr<const Factorization>> inverse_factors; ///< by part
  };
} // namespace squeal
