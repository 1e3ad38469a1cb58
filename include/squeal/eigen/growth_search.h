#pragma once

#include <squeal/projection/eigenpairs.h>

#include <complex>
#include <string>
#include <vector>

namespace squeal
{
  /// Whether a mode of the window |Im l| <= max_imaginary that grows lies outside of the disc
  /// |l| <= search_radius(max_imaginary), in which every mode is looked for.
  inline bool grows_beyond_disc(const std::complex<double> &l, const double max_imaginary)
  {
    return l.real() > 0 && std::abs(l.imag()) <= max_imaginary * (1 + rounding_of_window) &&
           std::abs(l) > search_radius(max_imaginary);
  }

  /// The pairs whose eigenvalues are not infinite ones of the constraints, which rounding spreads
  /// to any size: those of a dense solver far outside of the disc. Their displacements open gaps.
  /// Collective.
  EigenPairs finite_pairs(const QuadraticEigenproblem &problem, const EigenPairs &pairs);

  /// By what factor forces may change before a mode comes into the disc by its sides, where
  /// |Im l| <= max_imaginary, or grows beside it: the distance, relative to the disc's radius, of
  /// the nearest eigenvalue there, or what is missing to its damping ratio of the disc's corner.
  /// What the search has not seen is taken for 3 radii away. (Modes that cross the rim farther up
  /// are not of the window.)
  double clearance_of(const EigenSolution::Proof &found, double max_imaginary);

  /// Whether no strongly damped mode can have come into the disc |l| <= R, nor one grow beside it,
  /// wherever every real part x^H Q(l) x of displacements x was positive at l = -R and R before: it
  /// is so here, too, and on the way if terms change linearly. Of symmetric forces a real pair with
  /// one of its eigenvalues in the disc has x^H Q(-R) x < 0, and others that come in pass
  /// x^H (Q - R^2 M) x = 0, which the count of the reference problem sees. Takes one LDL^T
  /// factorisation, and two more if velocity terms may excite. Throws SolverError. Collective.
  bool is_definite_on_rim(const RowRange &rows, const std::vector<Term> &terms,
                          unsigned int n_constraints, double max_imaginary);

  /// Signs of modes of the window that grow outside of the disc: cheap to see, and no proof that
  /// there are none.
  struct GrowthSigns
  {
    /// Negative eigenvalues of the symmetric part of Q(s) on the rim, s = search_radius(), beyond
    /// one per constraint: where all forces are symmetric, so many real eigenvalues are larger.
    unsigned int n_negative = 0;
    /// Negative eigenvalues of r M + (P + P^T)/2, r the least Re l of such modes. With x^H M x = 1,
    /// d = x^H P x, k + j n = x^H Q x (d, k, n real parts) and l = rho + j w,
    ///     rho + d + (k rho + n w)/|l|^2 = 0,
    /// so that without any of them growth beyond the disc takes k < 0 or circulatory forces n.
    unsigned int n_exciting = 0;
    /// Ritz values of the search of the disc: theta = 1/l of modes that grow lie at the edge of all
    /// others, where Krylov spaces see them first.
    std::vector<std::complex<double>> ritz_values;

    bool any() const
    {
      return n_negative > 0 || n_exciting > 0 || !ritz_values.empty();
    }
  };

  /// Looks for signs. @p found is what the search has found in the disc, @p is_count_as_expected
  /// whether these are as many as the reference problem has, in which negative squares of
  /// frequencies count, and none of those is taken for a rigid motion: only if not, stiffness may
  /// be negative. Takes an LDL^T factorisation then, and one if velocity terms may excite
  /// (may_excite). Throws SolverError. Collective.
  GrowthSigns signs_of_growth(const QuadraticEigenproblem &problem,
                              const EigensolverOptions &options, bool is_count_as_expected,
                              const EigenSolution::Proof &found);

  /// The modes of the window that grow outside of the disc, with left vectors, out of block Krylov
  /// searches around real shifts s,
  ///     |l - s| <= 0.95 s,   s = 2 R, 20 R, 200 R, ...,
  /// R the disc's radius, or beside a Ritz value that was glimpsed (or by LAPACK, if the problem is
  /// small): with l = s + m a quadratic
  /// eigenproblem m^2 M + m (P + 2 s M) + Q(s). They end where no sign points further. proof.beyond
  /// says what was found, proof.lacks_growing whether signs remain. A factorisation for each s:
  /// called where there are signs. Collective.
  EigenSolution search_growth_beyond(const QuadraticEigenproblem &problem,
                                     const EigensolverOptions &options, const GrowthSigns &signs);
} // namespace squeal
