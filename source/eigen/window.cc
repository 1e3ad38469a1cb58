#include <squeal/base/text.h>
#include <squeal/eigen/window.h>
#include <squeal/linalg/compressed_rows.h>

#include <cmath>

namespace squeal
{
  using Complex = std::complex<double>;

  bool is_wanted(const EigensolverOptions &options, const Complex &l)
  {
    return l.imag() >= options.min_imaginary * (1 - rounding_of_window) &&
           l.imag() <= options.max_imaginary * (1 + rounding_of_window);
  }

  namespace
  {
    /// |M_ii| of this rank's rows.
    std::vector<double> sizes_of_diagonal(const RowRange &rows, const Matrix &matrix)
    {
      std::vector<double> sizes(rows.n_local());
      for_entries(matrix,
                  [&](const PetscInt row, const PetscInt column, const double value)
                  {
                    if (row == column)
                      sizes[row - rows.begin] = std::abs(value);
                  });
      return sizes;
    }

    /// v^H D v of each column.
    std::vector<double> weighted_squares(const std::vector<double> &weights,
                                         const ComplexMultiVector &v)
    {
      std::vector<double> sums(v.n_columns());
      for (unsigned int j = 0; j < sums.size(); ++j)
        for (unsigned int i = 0; i < weights.size(); ++i)
          sums[j] += weights[i] * std::norm(v(i, j));
      MPI_Allreduce(MPI_IN_PLACE, sums.data(), sums.size(), MPI_DOUBLE, MPI_SUM,
                    v.row_range().comm);
      return sums;
    }
  } // namespace

  std::vector<unsigned int> modes_beyond_rounding_of_mass(const QuadraticEigenproblem &problem,
                                                          const EigenPairs &modes)
  {
    constexpr double rounding = 1e-8;
    std::vector<unsigned int> result;
    if (modes.empty())
      return result;
    const std::vector<double> weights = sizes_of_diagonal(problem.rows, problem.M),
                              of_x    = weighted_squares(weights, modes.right),
                              of_z    = weighted_squares(weights, modes.left);
    const std::vector<Complex> masses = diagonal_form(modes.right, problem.M, modes.right);
    for (unsigned int j = 0; j < modes.size(); ++j)
    {
      if (of_x[j] > 0 && std::abs(masses[j]) <= rounding * of_x[j])
        if (const EigenPairs one = modes.select({j});
            std::abs(biorthogonality(problem, one, one)[0]) <=
            rounding * std::abs(2. * modes.lambda[j]) * std::sqrt(of_z[j] * of_x[j]))
          continue;
      result.push_back(j);
    }
    return result;
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
    solution.modes                       = solution.modes.select(inside);
    const std::vector<unsigned int> kept = modes_beyond_rounding_of_mass(problem, solution.modes);
    if (const unsigned int n = solution.modes.size() - kept.size(); n > 0)
    {
      solution.proof.completeness += text_of(
          "; ", n, " eigenvalues of motions whose mass is zero within rounding were left out");
      solution.modes = solution.modes.select(kept);
    }
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
