#pragma once

#include <squeal/parameters/choices.h>
#include <squeal/projection/eigenpairs.h>
#include <squeal/projection/search_region.h>

#include <vector>

namespace squeal
{
  /// Whether an eigenvalue is in the window.
  bool is_wanted(const EigensolverOptions &options, const std::complex<double> &l);

  /// The numbers of the modes, of which left vectors are known, whose eigenvalue the mass matrix
  /// decides by more than rounding. Where M is semi-definite, and rounding leaves a small number in
  /// place of a zero, an infinite eigenvalue becomes l^2 = -k/m with a mass m of either sign. Then
  /// with D = diag |M|
  ///     |x^H M x| <= r x^H D x   and   |z^H Q'(l) x| <= r |2 l| |z|_D |x|_D,   r = 1e-8,
  /// the second because a dashpot may give the motion without mass an eigenvalue of its own.
  std::vector<unsigned int> modes_beyond_rounding_of_mass(const QuadraticEigenproblem &problem,
                                                          const EigenPairs &modes);

  /// Leaves the modes of the window, sorted and normalised; zero eigenvalues are counted.
  void restrict_to_window(const QuadraticEigenproblem &problem, const EigensolverOptions &options,
                          EigenSolution &solution);

  /// The real shift, 1/s. Zero eigenvalues of free bodies rule out a shift of zero.
  inline double real_shift(const EigensolverOptions &options, const bool moves_rigidly)
  {
    return options.max_imaginary * (options.shift > 0 ? options.shift : moves_rigidly ? 0.1 : 0.);
  }

  /// Where a solver searches and counts: in the disc, or around a window far from zero. @p widening
  /// is of the margin at the window's ends, across which friction and damping move modes.
  SearchRegion search_region(ModeSolver solver, const EigensolverOptions &options,
                             double widening = 1);
  /// The frequencies below which reference modes are counted: the ends of a region; of a disc the
  /// lower one is that of rigid bodies, if they may move.
  std::vector<double> ends_of(const SearchRegion &region, const EigensolverOptions &options,
                              bool may_move_rigidly);
} // namespace squeal
