#pragma once

#include <squeal/subspace_iteration.h>

#include <optional>

namespace squeal
{
  /// Adds the vectors of solved problems to a basis for problems nearby: the principal components
  /// of [0.5 basis, Re x, Im x], columns scaled to their weight; what was added long ago fades out.
  /// Contact pressures are carried along with the displacements, which alone decide.
  Block add_snapshot(const QuadraticEigenproblem &problem, const Block &basis, const Block &re,
                     const Block &im);

  /// Vectors of solved problems nearby.
  struct Bases
  {
    const Block &right, &left;
  };

  /// All modes with |l| <= radius by projection on the bases of right and left vectors,
  ///     (l^2 W^T M V + l W^T P V + W^T Q V) c = 0,   x = V c,
  /// and, with the factors of Q, steps of inverse iteration on both sides. The error of l is of the
  /// order of the product of the errors of x and z, so one step is enough if the bases are good.
  /// Nothing if it does not converge to n_expected pairs at once.
  std::optional<Modes> solve_in_basis(const QuadraticEigenproblem &problem, const Bases &bases,
                                      const Factorization &factorization, double radius,
                                      unsigned int n_expected, const EigensolverOptions &options);
} // namespace squeal
