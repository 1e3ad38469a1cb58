#include <squeal/eigen/window.h>

namespace squeal
{
  using Complex = std::complex<double>;

  bool is_wanted(const EigensolverOptions &options, const Complex &l)
  {
    return l.imag() >= options.min_imaginary * (1 - rounding_of_window) &&
           l.imag() <= options.max_imaginary * (1 + rounding_of_window);
  }

  void restrict_to_window(const QuadraticEigenproblem &problem, const EigensolverOptions &options,
                          EigenSolution &solution)
  {
    const std::vector<Complex> &lambda = solution.modes.lambda;
    std::vector<unsigned int> inside;
    unsigned int n_zero = 0;
    for (const unsigned int j : order_of_modes(lambda))
      if (std::abs(lambda[j]) <= rigid_body_limit(options.max_imaginary))
        ++n_zero;
      else if (is_wanted(options, lambda[j]) && !is_overdamped(lambda[j]))
        inside.push_back(j); // real eigenvalues only if they diverge
    solution.proof.n_rigid_body_modes += n_zero / 2;
    solution.modes = solution.modes.select(inside);
    normalise(problem, solution.modes);
  }

  SearchRegion search_region(const ModeSolver solver, const EigensolverOptions &options,
                             const double widening)
  {
    if (solver != ModeSolver::block_krylov ||
        options.min_imaginary < far_from_zero * options.max_imaginary)
      return {0, search_radius(options.max_imaginary)};
    const double margin = 1 + 0.05 * widening;
    return SearchRegion::between(options.min_imaginary / margin, options.max_imaginary * margin);
  }

  std::vector<double> ends_of(const SearchRegion &region, const EigensolverOptions &options,
                              const bool may_move_rigidly)
  {
    std::vector<double> ends;
    if (!region.is_disc())
      ends.push_back(region.lower());
    else if (may_move_rigidly)
      ends.push_back(rigid_body_limit(options.max_imaginary));
    ends.push_back(region.upper());
    return ends;
  }
} // namespace squeal
