#include <squeal/projection/eigensolver_options.h>
#include <squeal/projection/reduced_eigenproblem.h>

#include <cmath>

namespace squeal
{
  void ReducedEigenproblem::set_violations(const DenseMatrix &violations)
  {
    constexpr double closed = 1e-6; // of unit vectors
    kernel                  = DenseMatrix();
    if (violations.largest_entry() <= closed)
      return;
    const unsigned int m            = violations.n_rows;
    DenseMatrix vectors             = violations * violations.transpose();
    const std::vector<double> sizes = symmetric_eigen(vectors); // ascending
    unsigned int n                  = 0;
    while (n < m && sizes[n] <= closed * closed)
      ++n;
    kernel = vectors.columns(0, n);
    // The squares leave gaps of the root of rounding: Z -= R S^{-1} R^T G G^T Z, R the others.
    const DenseView<double> range = vectors.columns(n, m - n);
    DenseMatrix c = range.transpose() * (violations * (violations.transpose() * kernel));
    for (unsigned int j = 0; j < n; ++j)
      for (unsigned int i = 0; i < m - n; ++i)
        c(i, j) /= sizes[n + i];
    add_product(-1, range, c, kernel);
  }

  void ReducedEigenproblem::set_terms(const unsigned int order, const DenseMatrix &projected)
  {
    if (order == 0)
      dimension = projected.n_rows;
    (order == 2   ? problem.m
     : order == 1 ? problem.p
                  : problem.q) = kernel.empty() || projected.empty()
                                     ? projected
                                     : DenseMatrix(kernel.transpose() * (projected * kernel));
  }

  SmallPairs ReducedEigenproblem::solve() const
  {
    const double radius  = search_radius(accuracy.max_imaginary);
    const SmallPairs all = problem.solve(0, radius, true);
    std::vector<unsigned int> in_disc;
    for (unsigned int k = 0; k < all.size(); ++k)
      if (const double size = std::abs(all.lambda[k]);
          size <= radius && size > rigid_body_limit(accuracy.max_imaginary) &&
          !is_overdamped(all.lambda[k]))
        in_disc.push_back(k);
    SmallPairs result = all.select(in_disc);
    for (ComplexDenseMatrix *vectors : {&result.right, &result.left})
    {
      vectors->normalise();
      if (!kernel.empty())
        *vectors = kernel * *vectors;
    }
    return result;
  }

  bool ReducedEigenproblem::improve(SmallPairs &pairs) const
  {
    SmallPairs corrected = pairs;
    for (ComplexDenseMatrix *vectors : {&corrected.right, &corrected.left})
    {
      vectors->resize_rows(dimension);
      if (!kernel.empty())
        *vectors = kernel.transpose() * *vectors;
    }
    if (!problem.improve(corrected, accuracy))
      return false;
    for (ComplexDenseMatrix *vectors : {&corrected.right, &corrected.left})
      if (!kernel.empty())
        *vectors = kernel * *vectors;
    pairs = std::move(corrected);
    return true;
  }
} // namespace squeal
