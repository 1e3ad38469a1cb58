#pragma once

#include <squeal/equations/eigenproblem.h>
#include <squeal/linalg/complex_dense.h>

#include <complex>
#include <vector>

namespace squeal
{
  /// (l^2 M + l P + Q + t sum h(l) A) c = 0 with small matrices: a problem with frozen terms that
  /// is projected on a space, between the quadratic problem, t = 0, and the exact one, t = 1.
  struct ProjectedNonlinear
  {
    DenseMatrix m, p, q; ///< p may have no rows: zero
    std::vector<DenseMatrix> a;
    const std::vector<FrozenTerm> *terms = nullptr; ///< of the matrices a

    unsigned int size() const
    {
      return m.n_rows;
    }
    ComplexDense at(std::complex<double> l, std::complex<double> t) const;
    /// The derivative by l.
    ComplexDense derivative(std::complex<double> l, std::complex<double> t) const;
  };

  /// One of its eigenpairs, the vectors of length one.
  struct ProjectedPair
  {
    std::complex<double> lambda;
    std::vector<std::complex<double>> right; ///< T(l) c = 0
    std::vector<std::complex<double>> left;  ///< d^H T(l) = 0
  };

  /// Follows pairs of the quadratic problem to the exact one, in steps of s from 0 to 1 along
  ///     t = s + i s (1 - s) / 5,
  /// a way around those t at which two eigenvalues become one defective one: real problems have
  /// them on the real axis, and by chance none are on another curve. In each step close pairs are
  /// corrected together, so that none is lost to its neighbour:
  ///     Y = T(l)^{-1} T'(l) X,   W = T(l)^{-H} T'(l)^H Z   at their mean l,
  ///     W^H T(l) Y y = theta W^H T'(l) Y y:   l - theta, Y y,
  /// and then each by itself. A step in which an eigenvalue moves by more than half of the way to
  /// another that is not close is halved. Returns the number of steps. Throws SolverError if steps
  /// become too short, or if two pairs have become one.
  unsigned int follow_to_exact(const ProjectedNonlinear &problem,
                               std::vector<ProjectedPair> &pairs);

  /// Corrects approximate pairs of the exact problem. Returns false, and leaves the pairs, if they
  /// move too far or two become one.
  bool correct_exact(const ProjectedNonlinear &problem, std::vector<ProjectedPair> &pairs);
} // namespace squeal
