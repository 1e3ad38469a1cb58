#include <squeal/projection/davidson.h>

#include <algorithm>
#include <utility>

namespace squeal
{
  Davidson::Davidson(const QuadraticEigenproblem &problem, DavidsonMethod given)
      : problem(problem), method(std::move(given)), right(problem.rows), left(problem.rows),
        kept_tests(problem.rows, 0)
  {
    small.frozen_terms = &problem.frozen;
    small.frozen.resize(problem.frozen.size());
  }

  bool Davidson::run(const std::function<std::optional<BothSides>(unsigned int step)> &correct)
  {
    for (unsigned int step = 0; step < method.most_steps; ++step)
    {
      std::optional<BothSides> corrections = correct(step);
      if (!corrections)
        return true;
      expand(std::move(*corrections));
    }
    return false;
  }

  void Davidson::expand(BothSides columns)
  {
    BothSides added = {MultiVector(problem.rows, 0), MultiVector(problem.rows, 0)};
    add(std::move(columns.right), Side::right, added);
    if (method.has_two_bases)
    {
      add(std::move(columns.left), Side::left, added);
      balance(added);
    }
    else if (method.partners)
      added.left = method.partners(added.right, Side::left);
    if (added.right.n_columns() == 0)
      return;
    if (keeps_tests())
      kept_tests.append(added.left);
    project(added.right, method.partners ? added.left : added.right);
    if (method.has_two_bases)
      newest = std::move(added);
  }

  void Davidson::restart(BothSides columns)
  {
    right = left = SearchSpace(problem.rows);
    kept_tests   = MultiVector(problem.rows, 0);
    for (DenseMatrix *matrix : {&small.m, &small.p, &small.q, &mass_})
      *matrix = {};
    small.frozen.assign(problem.frozen.size(), {});
    expand(std::move(columns));
  }

  void Davidson::turn(const DenseMatrix &c)
  {
    right.turn(c);
    if (keeps_tests())
      kept_tests = combine(kept_tests, c);
    const auto turn_both = [&c](DenseMatrix &matrix)
    {
      if (matrix.n_rows > 0)
        matrix = c.transpose() * (matrix * c);
    };
    for (DenseMatrix *matrix : {&small.m, &small.p, &small.q, &mass_})
      turn_both(*matrix);
    for (DenseMatrix &matrix : small.frozen)
      turn_both(matrix);
  }

  ComplexMultiVector Davidson::vectors(ComplexDenseMatrix coordinates, const Side side) const
  {
    coordinates.resize_rows(n_columns());
    ComplexMultiVector x = combine(side == Side::right ? right.basis() : tests(), coordinates);
    if (side == Side::left && method.relieve)
      x = {method.partners(x.re, side), method.partners(x.im, side)};
    return x;
  }

  ComplexDenseMatrix Davidson::coordinates(const ComplexMultiVector &vectors, const Side side) const
  {
    const MultiVector &basis = side == Side::right ? right.basis() : tests();
    const DenseMatrix re     = inner_products(basis, vectors.re),
                      im     = inner_products(basis, vectors.im);
    ComplexDenseMatrix result(re.n_rows, re.n_columns);
    for (std::size_t k = 0; k < result.values.size(); ++k)
      result.values[k] = {re.values[k], im.values[k]};
    return result;
  }

  void Davidson::add(MultiVector columns, const Side side, BothSides &added)
  {
    method.constrain(columns, side);
    MultiVector fresh =
        (side == Side::right ? right : left).add(std::move(columns), method.novelty);
    if (added[side].n_columns() == 0)
      added[side] = std::move(fresh);
    else
      added[side].append(fresh);
  }

  void Davidson::balance(BothSides &added)
  {
    if (adds_partners)
    {
      MultiVector of_right = method.partners(newest.right, Side::left);
      add(method.partners(newest.left, Side::right), Side::right, added);
      add(std::move(of_right), Side::left, added);
    }
    // What was not new on one side gives way to the partners of the other's.
    const auto side_with_less = [&added]
    { return added.right.n_columns() < added.left.n_columns() ? Side::right : Side::left; };
    const auto is_unequal = [&added] { return added.right.n_columns() != added.left.n_columns(); };
    for (unsigned int k = 0; k < 3 && is_unequal(); ++k)
    {
      const Side side           = side_with_less();
      const MultiVector &others = added[opposite(side)];
      const unsigned int first  = added[side].n_columns();
      add(method.partners(others.columns(first, others.n_columns() - first), side), side, added);
    }
    // F^{-1} M damps what oscillates quickly: where the spaces are nearly all there is, partners
    // may bring nothing new.
    if (is_unequal())
      keep_what_is_seen(opposite(side_with_less()), added);
  }

  void Davidson::keep_what_is_seen(const Side side, BothSides &added)
  {
    MultiVector &kept         = added[side];
    const MultiVector &others = added[opposite(side)];
    const unsigned int n = kept.n_columns(), n_kept = others.n_columns();
    const DenseMatrix seen   = inner_products(others, multiply(problem.M, kept));
    DenseMatrix combinations = seen.transpose() * seen;
    symmetric_eigen(combinations); // ascending
    kept               = combine(kept, combinations.columns(n - n_kept, n_kept));
    SearchSpace &space = side == Side::right ? right : left;
    MultiVector basis  = space.basis().columns(0, space.n_columns() - n);
    basis.append(kept);
    space = SearchSpace(std::move(basis));
  }

  void Davidson::project(const MultiVector &v, const MultiVector &w)
  {
    const unsigned int n = v.n_columns(), size = n_columns(), old = size - n;
    const auto extend = [&](DenseMatrix &known, const DenseMatrix &of_new, const DenseMatrix &below)
    {
      known = grow(known, size,
                   [&](const unsigned int first, unsigned int, unsigned int, const unsigned int)
                   { return first == 0 ? of_new : below; });
    };
    // W^T A v, which is V^T (Pi^T A v) if Z = Pi V is not kept, and w^T A V = (A^T w)^T V.
    const auto enlarge = [&](const Matrix &matrix, DenseMatrix &known)
    {
      if (!matrix)
        return;
      const bool is_mass = &matrix == &problem.M; // symmetric
      MultiVector image  = multiply(matrix, v);
      if (is_mass && method.measures)
      {
        const DenseMatrix of_new = inner_products(right.basis(), image);
        extend(mass_, of_new, of_new.rows(0, old).transpose());
      }
      if (method.relieve)
        method.relieve(image);
      const DenseMatrix of_new = inner_products(tests(), image);
      DenseMatrix below(n, old);
      if (old > 0)
        below = inner_products(is_mass ? multiply(matrix, w) : multiply_transposed(matrix, w), 0, n,
                               right.basis(), 0, old);
      extend(known, of_new, below);
    };
    enlarge(problem.M, small.m);
    enlarge(problem.P, small.p);
    enlarge(problem.Q, small.q);
    for (unsigned int b = 0; b < problem.frozen.size(); ++b)
      enlarge(problem.frozen[b].matrix, small.frozen[b]);
  }

  std::vector<MainPart> main_parts(const ComplexMultiVector &vectors)
  {
    std::vector<std::pair<const double *, const double *>> parts;
    for (unsigned int j = 0; j < vectors.n_columns(); ++j)
      parts.push_back({vectors.re.column(j), vectors.im.column(j)});
    return main_parts(parts, vectors.row_range());
  }
} // namespace squeal
