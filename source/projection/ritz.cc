#include <squeal/linalg/dense.h>
#include <squeal/projection/backward_error.h>
#include <squeal/projection/ritz.h>
#include <squeal/projection/search_space.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <sstream>

namespace squeal
{
  using Complex = std::complex<double>;

  namespace
  {
    /// Between the two projections, what lay in the span up to rounding is dropped.
    constexpr Novelty anything_new = {1e-10};
  } // namespace

  EigenPairs rayleigh_ritz(const QuadraticEigenproblem &problem, const MultiVector &trial,
                           const MultiVector &test, const double radius, const double shift,
                           const std::function<bool(const Complex &)> &is_wanted,
                           const bool with_left)
  {
    const unsigned int n = trial.n_columns();
    const auto project   = [&](const Matrix &matrix)
    {
      return matrix ? DenseMatrix(n, n, inner_products(test, multiply(matrix, trial)))
                    : DenseMatrix();
    };
    const std::vector<DensePair> all = quadratic_eigenpairs(
        project(problem.M), project(problem.P), project(problem.Q), shift, radius, with_left);

    EigenPairs pairs;
    struct
    {
      std::vector<double> re, im;
      void append(const std::vector<Complex> &vector)
      {
        for (const Complex &c : vector)
        {
          re.push_back(c.real());
          im.push_back(c.imag());
        }
      }
    } right, left;
    for (const DensePair &pair : all)
      if (is_wanted ? is_wanted(pair.lambda) : std::abs(pair.lambda) <= radius)
      {
        pairs.lambda.push_back(pair.lambda);
        right.append(pair.vector);
        left.append(pair.left);
      }
    const auto combined = [&](const MultiVector &basis, const auto &coefficients)
    {
      ComplexMultiVector vectors;
      vectors.re = combine(basis, coefficients.re, pairs.size());
      vectors.im = combine(basis, coefficients.im, pairs.size());
      return vectors;
    };
    pairs.right = combined(trial, right);
    if (with_left)
    {
      pairs.left = combined(test, left);
      pairs.left.conjugate(); // z = conj(y)
    }
    return pairs;
  }

  MultiVector identity_columns(const RowRange &rows)
  {
    MultiVector identity(rows, rows.size);
    for (unsigned int row = rows.begin; row < rows.end; ++row)
      identity.column(row)[row - rows.begin] = 1;
    return identity;
  }

  MultiVector krylov_basis(const QuadraticEigenproblem &problem, const ShiftInvert &shift_invert,
                           const unsigned int n_columns, const unsigned int seed)
  {
    constexpr unsigned int block_size = 8;
    MultiVector block                 = scattered_numbers(problem.rows, block_size, seed);
    SearchSpace space(problem.rows);
    while (space.n_columns() < n_columns)
    {
      block = shift_invert.solve(multiply(problem.M, block));
      clear_multipliers(problem, block);
      block = space.add(std::move(block), anything_new);
      if (block.n_columns() == 0) // the whole space
        break;
    }
    return space.release();
  }

  EigenSolution refine_eigenpairs(const QuadraticEigenproblem &problem,
                                  const ShiftInvert &shift_invert, MultiVector start,
                                  std::vector<Complex> previous, const double radius,
                                  const bool known, const EigensolverOptions &options)
  {
    const BackwardError backward_error(problem);
    const bool galerkin = problem.n_constraints == 0 || problem.compliant;
    // The space and, unless Galerkin's, its test vectors; both grow until they are too many.
    SearchSpace space(problem.rows);
    MultiVector test(problem.rows, 0);
    EigenSolution solution;
    EigenPairs &modes      = solution.modes;
    unsigned int &n_solves = solution.cost.n_solves;
    const auto expand      = [&](MultiVector block)
    {
      clear_multipliers(problem, block);
      block = space.add(std::move(block), anything_new);
      if (!galerkin)
        test.append(shift_invert.solve_transposed(multiply(problem.M, block)));
      n_solves += galerkin ? 0 : block.n_columns();
    };
    expand(std::move(start));
    const unsigned int n_wanted = previous.size(), largest = space.n_columns() + 5 * n_wanted;
    double worst = 0, change = 0, last_change = 1;
    const auto correct = [&](const unsigned int step) -> std::optional<MultiVector>
    {
      EigenPairs pairs = rayleigh_ritz(problem, space.basis(), galerkin ? space.basis() : test,
                                       radius, shift_invert.shift);

      // Zero eigenvalues of free bodies are defective and never accurate; they are counted, not
      // refined. Overdamped modes crowd, and nobody wants them. Of known eigenvalues only the
      // partners are wanted.
      std::vector<unsigned int> order;
      if (known)
        order = nearest_partners(previous, pairs.lambda);
      else
        for (unsigned int j = 0; j < pairs.lambda.size(); ++j)
          if (const Complex l = pairs.lambda[j];
              std::abs(l) > rigid_body_limit(options.max_imaginary) &&
              (l.real() > 0 || !is_nearly_real(l)))
            order.push_back(j);
      pairs = pairs.select(order);
      n_solves += 2 * pairs.lambda.size();
      MultiVector ritz_vectors = pairs.right.real_span();
      inverse_iteration(problem, shift_invert, pairs);
      pairs.backward_error              = backward_error(pairs);
      const std::vector<double> &errors = pairs.backward_error;

      order.resize(pairs.lambda.size());
      std::iota(order.begin(), order.end(), 0u);
      if (!known)
        std::sort(order.begin(), order.end(),
                  [&](const unsigned int a, const unsigned int b)
                  { return errors[a] < errors[b]; });
      order.resize(std::min<std::size_t>(order.size(), n_wanted));
      modes  = pairs.select(order);
      worst  = order.empty()
                   ? 0
                   : *std::max_element(modes.backward_error.begin(), modes.backward_error.end());
      change = largest_change(modes.lambda, previous);
      options.progress("  refinement step " + std::to_string(step) + ": " +
                       std::to_string(order.size()) + " pairs");
      // Near coalescence the eigenvalue is known to the square root of the backward error only:
      // once that is at rounding and the eigenvalue does not settle further, nothing can be
      // improved.
      const bool settled = change <= options.tolerance ||
                           (worst <= 1e-3 * options.tolerance && change >= 0.1 * last_change);
      if (order.size() >= n_wanted && worst <= options.tolerance && settled)
        return std::nullopt;
      last_change = change;
      if (!known)
        previous = modes.lambda;

      if (space.n_columns() > largest) // start anew from the best so far
      {
        space = SearchSpace(problem.rows);
        test  = MultiVector(problem.rows, 0);
        expand(std::move(ritz_vectors));
      }
      return pairs.right.real_span();
    };
    if (expand_until_accurate(12, correct, expand))
      return solution;
    if (modes.lambda.empty()) // those found have no finite eigenvalue, or are rigid motions
      throw SolverError("The eigenpairs could not be refined: none of the " +
                            std::to_string(n_wanted) +
                            " has a finite eigenvalue that is not zero to rounding. Numbers of the "
                            "problem are too far apart to compute with.",
                        {Failure::pairs_not_refined});
    std::ostringstream message;
    message << "The eigenpairs could not be refined to the tolerance " << options.tolerance << ": "
            << modes.lambda.size() << " of " << n_wanted << " pairs, largest backward error "
            << worst << ", last relative change " << change << ".";
    throw SolverError(message.str(), {Failure::pairs_not_refined});
  }
} // namespace squeal
