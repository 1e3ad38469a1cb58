#include <squeal/projection/search_space.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace squeal
{
  namespace
  {
    /// The remainders that are long enough, at most so many, the longest relative to their columns
    /// first; scaled to length one, in the order of the columns.
    MultiVector long_remainders(const MultiVector &remainders, const DenseMatrix &before,
                                const double shortest, const unsigned int largest_number)
    {
      const DenseMatrix after = inner_products(remainders, remainders);
      const unsigned int n    = remainders.n_columns();
      std::vector<unsigned int> kept;
      for (unsigned int k = 0; k < n; ++k)
        if (after(k, k) > shortest * shortest * before(k, k))
          kept.push_back(k);
      std::stable_sort(kept.begin(), kept.end(),
                       [&](const unsigned int i, const unsigned int j)
                       { return after(i, i) * before(j, j) > after(j, j) * before(i, i); });
      kept.resize(std::min<std::size_t>(kept.size(), largest_number));
      std::sort(kept.begin(), kept.end());
      MultiVector result(remainders.row_range(), 0);
      for (const unsigned int k : kept)
      {
        result.append(remainders.columns(k, 1));
        for (unsigned int i = 0; i < result.n_local(); ++i)
          result.column(result.n_columns() - 1)[i] /= std::sqrt(after(k, k));
      }
      return result;
    }
  } // namespace

  void SearchSpace::take_new(MultiVector &remainders, const DenseMatrix &before,
                             const Novelty &novelty, const std::vector<Image> &images) const
  {
    if (!novelty.by_components && novelty.dependent == 0)
    {
      remainders = orthonormalize(long_remainders(remainders, before, novelty.shortest,
                                                  largest - std::min(largest, n_columns())));
      return;
    }
    const DenseMatrix clear =
        novelty.by_components
            ? principal_combinations(inner_products(remainders, remainders), novelty.shortest)
            : independent_combinations(inner_products(remainders, remainders), before,
                                       novelty.shortest, novelty.dependent);
    remainders = combine(remainders, clear);
    for (const Image &image : images)
      image.of_added = combine(image.of_added, clear);
  }

  MultiVector SearchSpace::add(MultiVector columns, const Novelty &novelty,
                               const std::vector<Image> &images, DenseMatrix *const coefficients)
  {
    const unsigned int n_old = n_columns(), n = columns.n_columns();
    const auto project_out = [&](MultiVector &block)
    {
      DenseMatrix part = inner_products(basis_, block);
      subtract_combination(block, basis_, part);
      for (const Image &image : images)
        subtract_combination(image.of_added, image.of_basis, part);
      return part;
    };
    const DenseMatrix before = inner_products(columns, columns);
    DenseMatrix old(0, n);
    if (n_old > 0)
      old = project_out(columns);
    MultiVector remainders = coefficients ? columns : std::move(columns);
    take_new(remainders, before, novelty, images);
    // Twice is enough (Kahan). What the second projection hurts was noise.
    if (remainders.n_columns() > 0 && n_old > 0)
    {
      project_out(remainders);
      take_new(remainders, {}, {0.5, 0, true}, images);
    }
    if (coefficients)
    {
      const DenseMatrix added = inner_products(remainders, columns);
      *coefficients           = std::move(old);
      coefficients->resize_rows(n_old + added.n_rows);
      for (unsigned int j = 0; j < n; ++j)
        for (unsigned int i = 0; i < added.n_rows; ++i)
          (*coefficients)(n_old + i, j) = added(i, j);
    }
    basis_.append(remainders);
    return remainders;
  }

  void SearchSpace::replace(const unsigned int first, const MultiVector &columns)
  {
    std::copy_n(columns.data(), std::size_t(columns.n_local()) * columns.n_columns(),
                basis_.column(first));
  }
} // namespace squeal
