#pragma once

#include <squeal/continuation/reduced_model.h>
#include <squeal/eigen/inertia_count.h>
#include <squeal/linalg/gmres.h>
#include <squeal/symmetry/parity_space.h>

#include <map>
#include <memory>
#include <optional>
#include <vector>

namespace squeal
{
  /// The reduced models of the sectors in which a full solution was found, the parity sectors of a
  /// mirror-symmetric problem or the whole as the only one,
  ///     V_h^T (l^2 M + l P + Q) V_h y = 0,   x = V_h y:
  /// bases, factors and residuals of half the size, which makes what is of the second and the third
  /// order in them a quarter and an eighth. Coordinates of a mode are those of its sector, with
  /// zeros for the others, sector after sector.
  class ReducedSectors
  {
  public:
    explicit ReducedSectors(const EigensolverOptions &options) : options(options) {}

    /// Begins anew, as ReducedModel::set_expansion_point(). @p symmetry is that of the sectors.
    void set_expansion_point(const QuadraticEigenproblem &problem, const std::vector<Term> &terms,
                             const EigenSolution::Reuse &found,
                             const std::optional<MirrorSymmetry> &symmetry);
    std::vector<double> varying_terms() const;
    void keep_apart(const std::vector<double> &varying_terms);

    bool has_expansion_point() const;
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

    /// As those of ReducedModel.
    std::optional<EigenPairs> solve(const std::vector<Term> &terms);
    bool is_crowded() const;
    /// Gives these modes of the last solution in the new coordinates.
    EigenPairs restart(const EigenPairs &modes);
    QuadraticEigenproblem problem() const;
    ReducedModel::RayleighForms rayleigh_forms(const EigenPairs &modes) const;
    std::vector<Term> project(const std::vector<Term> &terms) const;
    EigenPairs expand(const EigenPairs &modes) const;
    EigenPairs pad(const EigenPairs &modes) const;
    static bool is_reduced(const EigenPairs &modes, const RowRange &rows)
    {
      return ReducedModel::is_reduced(modes, rows);
    }

  private:
    struct Part
    {
      std::optional<ParitySpace> space; ///< without: the whole
      Parity parity;                    ///< of its modes
      ReducedModel reduced;
      std::shared_ptr<InertiaCount> reference;
      unsigned int n_modes         = 0; ///< of the expansion point in the disc
      unsigned int expansion_count = 0;
      /// V_h^T A V_h by A
      std::map<std::shared_ptr<const Matrix>, std::shared_ptr<const Matrix>> restricted;
      std::vector<Term> terms; ///< the last ones
    };

    /// Puts the terms into the parts; false if they have lost the symmetry.
    bool restrict(const std::vector<Term> &terms);
    bool are_symmetric(const std::vector<Term> &terms) const;
    unsigned int dimension() const;
    MultiVector apply_inverse(const MultiVector &b) const;
    /// The numbers of the modes of a part.
    std::vector<unsigned int> modes_of(const EigenPairs &modes, const Part &part) const;
    /// The part's modes in its coordinates, of which there were @p sizes when the modes were found.
    EigenPairs extract(const EigenPairs &modes, unsigned int part,
                       const std::vector<unsigned int> &sizes) const;
    const std::vector<unsigned int> &sizes_of(const EigenPairs &modes) const;

    EigensolverOptions options;
    std::optional<MirrorSymmetry> symmetry;
    std::vector<Part> parts;
    std::array<double, 3> norms{}; ///< of the expansion point's matrices by order
    mutable unsigned int n_inverse_ = 0;
    std::vector<std::shared_ptr<const Factorization>> inverse_factors; ///< by part
    /// Coordinates by part, by the sum of them: bases only grow.
    std::map<unsigned int, std::vector<unsigned int>> sizes;
  };
} // namespace squeal
