#pragma once

#include <squeal/linalg/dense.h>

#include <complex>
#include <vector>

namespace squeal
{
  struct FrozenTerm;

  /// Eigenpairs of a small problem, vectors as columns.
  struct SmallPairs
  {
    std::vector<std::complex<double>> lambda;
    ComplexDenseMatrix right;   ///< Q(l) x = 0
    ComplexDenseMatrix left;    ///< y^T Q(l) = 0; on demand
    std::vector<double> errors; ///< bounds of backward errors, of who computes them

    unsigned int size() const
    {
      return lambda.size();
    }
    bool empty() const
    {
      return lambda.empty();
    }
    /// The pairs of the given numbers, in their order.
    SmallPairs select(const std::vector<unsigned int> &numbers) const;
  };

  /// (l^2 M + l P + Q + t sum h(l) A) x = 0 with small matrices: what a problem becomes by
  /// projection. Frozen terms, if there are any, lead from the quadratic problem, t = 0, to the
  /// exact one, t = 1.
  struct SmallProblem
  {
    DenseMatrix m, p, q;                                   ///< p may be empty: zero
    std::vector<DenseMatrix> frozen;                       ///< A
    const std::vector<FrozenTerm> *frozen_terms = nullptr; ///< their h

    unsigned int size() const
    {
      return q.n_rows;
    }

    /// All finite eigenpairs with Im l >= 0 of the quadratic problem, shift-inverted at the real
    /// @p shift: with l = s + c/theta, theta is an eigenvalue of the companion matrix
    ///     [ -c Q(s)^{-1} Q'(s)   -c^2 Q(s)^{-1} M ]
    ///     [         I                   0         ].
    /// The @p scale c > 0 should be of the size of the eigenvalues that matter: then theta is of
    /// size one for them, and theirs is the accuracy that dgeev gives. Without a velocity term and
    /// at shift 0 the problem is solved in l^2, so that eigenvalues come in exact +- pairs. M may
    /// be singular: infinite eigenvalues, theta that are zero but for rounding, are left out. With
    /// left vectors [u; u'] of that matrix, those of the problem are
    ///     y = Q(s)^{-T} conj(u).
    /// LAPACK dgeev (Tisseur and Meerbergen, 2001, for linearisations). Throws SolverError,
    /// SingularMatrix if Q(s) is singular.
    SmallPairs solve(double shift, double scale, bool with_left = false) const;

    struct Accuracy
    {
      double max_imaginary, tolerance; ///< of the window
    };
    /// Corrects pairs, right and left, of the quadratic problem by two-sided Rayleigh quotient
    /// iteration (Schwetlick and Schreiber, 2012). Returns false, and leaves the pairs, if some do
    /// not converge, leave the disc of the search, or become overdamped, or if two become one.
    bool improve(SmallPairs &pairs, const Accuracy &accuracy) const;

    /// T(l) with a share t of the frozen terms, and its derivative by l.
    ComplexDenseMatrix at(std::complex<double> l, std::complex<double> t = 1) const;
    ComplexDenseMatrix derivative(std::complex<double> l, std::complex<double> t = 1) const;
  };

  /// A root l of l^2 = s with Im l >= 0 that comes with an eigenvalue s and, if that is complex,
  /// with its conjugate: of the four +-l, +-conj(l) two. The vector of the second is the conjugate
  /// one then.
  struct SquareRoot
  {
    std::complex<double> value;
    bool conjugate;
  };
  std::vector<SquareRoot> upper_square_roots(std::complex<double> square);

  /// The root of a l^2 + b l + c near a given one.
  std::complex<double> nearest_root(std::complex<double> a, std::complex<double> b,
                                    std::complex<double> c, std::complex<double> given);
} // namespace squeal
