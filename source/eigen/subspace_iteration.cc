#include <squeal/eigen/subspace_iteration.h>
#include <squeal/linalg/dense.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <sstream>

namespace squeal
{
  using Complex = std::complex<double>;

  BackwardError::BackwardError(const QuadraticEigenproblem &problem)
      : problem(problem), norm_m(problem.M.infinity_norm()), norm_p(problem.P.infinity_norm()),
        norm_q(problem.Q.infinity_norm())
  {
  }

  BackwardError::Result BackwardError::residuals(const std::vector<Complex> &lambda,
                                                 const MultiVector &re, const MultiVector &im) const
  {
    const MultiVector m_re = multiply(problem.M, re), m_im = multiply(problem.M, im);
    const MultiVector p_re = multiply(problem.P, re), p_im = multiply(problem.P, im);
    Result result{multiply(problem.Q, re), multiply(problem.Q, im), {}};
    for (unsigned int j = 0; j < lambda.size(); ++j)
    {
      const Complex l = lambda[j], l2 = l * l;
      for (unsigned int i = 0; i < re.n_local(); ++i)
      {
        const Complex r = l2 * Complex(m_re.column(j)[i], m_im.column(j)[i]) +
                          l * Complex(p_re.column(j)[i], p_im.column(j)[i]) +
                          Complex(result.re.column(j)[i], result.im.column(j)[i]);
        result.re.column(j)[i] = r.real();
        result.im.column(j)[i] = r.imag();
      }
    }
    return result;
  }

  std::vector<double> BackwardError::errors(const std::vector<Complex> &lambda,
                                            const Result &residuals, const MultiVector &re,
                                            const MultiVector &im) const
  {
    std::vector<double> largest(2 * lambda.size()), result;
    for (unsigned int j = 0; j < lambda.size(); ++j)
      for (unsigned int i = 0; i < re.n_local(); ++i)
      {
        largest[2 * j] =
            std::max(largest[2 * j],
                     std::abs(Complex(residuals.re.column(j)[i], residuals.im.column(j)[i])));
        largest[2 * j + 1] =
            std::max(largest[2 * j + 1], std::abs(Complex(re.column(j)[i], im.column(j)[i])));
      }
    MPI_Allreduce(MPI_IN_PLACE, largest.data(), largest.size(), MPI_DOUBLE, MPI_MAX,
                  problem.rows.comm);
    for (unsigned int j = 0; j < lambda.size(); ++j)
    {
      const double size = std::norm(lambda[j]) * norm_m + std::abs(lambda[j]) * norm_p + norm_q;
      result.push_back(largest[2 * j] / (size * largest[2 * j + 1]));
    }
    return result;
  }

  BackwardError::Result BackwardError::operator()(const std::vector<Complex> &lambda,
                                                  const MultiVector &re,
                                                  const MultiVector &im) const
  {
    Result result = residuals(lambda, re, im);
    result.errors = errors(lambda, result, re, im);
    return result;
  }

  std::vector<unsigned int> nearest_partners(const std::vector<Complex> &lambda,
                                             const std::vector<Complex> &others)
  {
    std::vector<bool> taken(others.size(), false);
    std::vector<unsigned int> partners;
    for (unsigned int j = 0; j < std::min(lambda.size(), others.size()); ++j)
    {
      unsigned int best = others.size();
      for (unsigned int k = 0; k < others.size(); ++k)
        if (!taken[k] && (best == others.size() ||
                          std::abs(others[k] - lambda[j]) < std::abs(others[best] - lambda[j])))
          best = k;
      taken[best] = true;
      partners.push_back(best);
    }
    return partners;
  }

  void inverse_iteration(const QuadraticEigenproblem &problem, const ShiftInvert &shift_invert,
                         Pairs &pairs)
  {
    const unsigned int n_pairs = pairs.lambda.size(), n = problem.rows.n_local();
    const MultiVector m_re = multiply(problem.M, pairs.re), m_im = multiply(problem.M, pairs.im);
    const MultiVector p_re = multiply(problem.P, pairs.re), p_im = multiply(problem.P, pairs.im);
    MultiVector right(problem.rows, 2 * n_pairs);
    for (unsigned int j = 0; j < n_pairs; ++j)
    {
      const Complex c_m = pairs.lambda[j] * pairs.lambda[j] - shift_invert.square,
                    c_p = pairs.lambda[j] - shift_invert.shift;
      for (unsigned int i = 0; i < n; ++i)
      {
        const Complex r = -c_m * Complex(m_re.column(j)[i], m_im.column(j)[i]) -
                          c_p * Complex(p_re.column(j)[i], p_im.column(j)[i]);
        right.column(2 * j)[i]     = r.real();
        right.column(2 * j + 1)[i] = r.imag();
      }
    }
    const MultiVector x = shift_invert.solve(right);
    for (unsigned int j = 0; j < n_pairs; ++j)
    {
      std::copy_n(x.column(2 * j), n, pairs.re.column(j));
      std::copy_n(x.column(2 * j + 1), n, pairs.im.column(j));
    }
  }

  Pairs select(const Pairs &pairs, const std::vector<unsigned int> &numbers)
  {
    Pairs result{{},
                 MultiVector(pairs.re.row_range(), numbers.size()),
                 MultiVector(pairs.re.row_range(), numbers.size())};
    for (unsigned int k = 0; k < numbers.size(); ++k)
    {
      result.lambda.push_back(pairs.lambda[numbers[k]]);
      std::copy_n(pairs.re.column(numbers[k]), pairs.re.n_local(), result.re.column(k));
      std::copy_n(pairs.im.column(numbers[k]), pairs.im.n_local(), result.im.column(k));
    }
    return result;
  }

  double largest_change(const std::vector<Complex> &lambda, const std::vector<Complex> &previous)
  {
    if (lambda.size() != previous.size())
      return 1;
    double change                            = 0;
    const std::vector<unsigned int> partners = nearest_partners(lambda, previous);
    for (unsigned int k = 0; k < lambda.size(); ++k)
      change = std::max(change, std::abs(previous[partners[k]] - lambda[k]) / std::abs(lambda[k]));
    return change;
  }

  void clear_pressures(const unsigned int n_local_constraints, MultiVector &block)
  {
    for (unsigned int k = 0; k < block.n_columns(); ++k)
      std::fill_n(block.column(k) + block.n_local() - n_local_constraints, n_local_constraints, 0.);
  }

  namespace
  {
    /// Multipliers are no part of a subspace: they follow from the displacements. Those of a
    /// compliant contact do so within the subspace already.
    void clear_multipliers(const QuadraticEigenproblem &problem, MultiVector &block)
    {
      if (!problem.compliant)
        clear_pressures(problem.n_local_constraints, block);
    }
  } // namespace

  Pairs rayleigh_ritz(const QuadraticEigenproblem &problem, const MultiVector &trial,
                      const MultiVector &test, const double radius, const double shift)
  {
    const unsigned int n = trial.n_columns();
    const auto project   = [&](const Matrix &matrix)
    {
      return matrix ? DenseMatrix(n, n, inner_products(test, multiply(matrix, trial)))
                    : DenseMatrix();
    };
    const std::vector<DensePair> all = quadratic_eigenpairs(project(problem.M), project(problem.P),
                                                            project(problem.Q), shift, radius);

    Pairs pairs;
    std::vector<double> c_re, c_im;
    for (const DensePair &pair : all)
      if (std::abs(pair.lambda) <= radius)
      {
        pairs.lambda.push_back(pair.lambda);
        for (const Complex &c : pair.vector)
        {
          c_re.push_back(c.real());
          c_im.push_back(c.imag());
        }
      }
    pairs.re = combine(trial, c_re, pairs.lambda.size());
    pairs.im = combine(trial, c_im, pairs.lambda.size());
    return pairs;
  }

  Modes polish(const QuadraticEigenproblem &problem, const ShiftInvert &shift_invert,
               MultiVector start, std::vector<Complex> previous, const double radius,
               const bool known, const EigensolverOptions &options)
  {
    const BackwardError backward_error(problem);
    const bool galerkin = problem.n_constraints == 0 || problem.compliant;
    // The basis and, unless Galerkin's, its test vectors; both grow until they are too many.
    MultiVector basis(problem.rows, 0), test(problem.rows, 0);
    Modes modes;
    const auto expand = [&](MultiVector block)
    {
      clear_multipliers(problem, block);
      block = orthonormal_complement(basis, std::move(block));
      if (!galerkin)
        test.append(shift_invert.solve_transposed(multiply(problem.M, block)));
      modes.n_solves += galerkin ? 0 : block.n_columns();
      basis.append(block);
    };
    expand(std::move(start));
    const unsigned int n_wanted = previous.size(), largest = basis.n_columns() + 5 * n_wanted;
    double worst = 0, change = 0, last_change = 1;
    for (unsigned int step = 0; step < 12; ++step)
    {
      Pairs pairs =
          rayleigh_ritz(problem, basis, galerkin ? basis : test, radius, shift_invert.shift);

      // Zero eigenvalues of free bodies are defective and never accurate; they are counted, not
      // polished. Of known eigenvalues only the partners are wanted.
      std::vector<unsigned int> order;
      if (known)
        order = nearest_partners(previous, pairs.lambda);
      else
        for (unsigned int j = 0; j < pairs.lambda.size(); ++j)
          if (std::abs(pairs.lambda[j]) > rigid_body_limit(options.max_imaginary))
            order.push_back(j);
      pairs = select(pairs, order);
      modes.n_solves += 2 * pairs.lambda.size();
      MultiVector ritz_vectors = pairs.re;
      ritz_vectors.append(pairs.im);
      inverse_iteration(problem, shift_invert, pairs);
      const std::vector<double> errors = backward_error(pairs.lambda, pairs.re, pairs.im).errors;

      order.resize(pairs.lambda.size());
      std::iota(order.begin(), order.end(), 0u);
      if (!known)
        std::sort(order.begin(), order.end(),
                  [&](const unsigned int a, const unsigned int b)
                  { return errors[a] < errors[b]; });
      order.resize(std::min<std::size_t>(order.size(), n_wanted));
      Pairs best   = select(pairs, order);
      modes.lambda = std::move(best.lambda);
      modes.re     = std::move(best.re);
      modes.im     = std::move(best.im);
      modes.backward_error.clear();
      for (const unsigned int j : order)
        modes.backward_error.push_back(errors[j]);
      worst  = order.empty()
                   ? 0
                   : *std::max_element(modes.backward_error.begin(), modes.backward_error.end());
      change = largest_change(modes.lambda, previous);
      options.progress("  polishing step " + std::to_string(step) + ": " +
                       std::to_string(order.size()) + " pairs");
      // Near coalescence the eigenvalue is known to the square root of the backward error only:
      // once that is at rounding and the eigenvalue does not settle further, nothing can be
      // improved.
      const bool settled = change <= options.tolerance ||
                           (worst <= 1e-3 * options.tolerance && change >= 0.1 * last_change);
      if (order.size() >= n_wanted && worst <= options.tolerance && settled)
        return modes;
      last_change = change;
      if (!known)
        previous = modes.lambda;

      if (basis.n_columns() > largest) // start anew from the best so far
      {
        basis = test = MultiVector(problem.rows, 0);
        expand(std::move(ritz_vectors));
      }
      MultiVector improved = pairs.re;
      improved.append(pairs.im);
      expand(std::move(improved));
    }
    std::ostringstream message;
    message << "The eigenpairs could not be polished to the tolerance " << options.tolerance << ": "
            << modes.lambda.size() << " of " << n_wanted << " pairs, largest backward error "
            << worst << ", last relative change " << change
            << ". Try a larger Eigenproblem/Tolerance, or the solver dense for a small problem.";
    throw SolverError(message.str());
  }

  MultiVector orthonormal_complement(const MultiVector &basis, MultiVector block)
  {
    // Twice is enough (Kahan); between the two, what lay in the span up to rounding is dropped.
    for (unsigned int pass = 0; pass < 2; ++pass)
    {
      std::vector<double> before(block.n_columns()), after(block.n_columns());
      const auto norms = [&](std::vector<double> &squares)
      {
        for (unsigned int k = 0; k < block.n_columns(); ++k)
          for (unsigned int i = 0; i < block.n_local(); ++i)
            squares[k] += block.column(k)[i] * block.column(k)[i];
        MPI_Allreduce(MPI_IN_PLACE, squares.data(), squares.size(), MPI_DOUBLE, MPI_SUM,
                      block.row_range().comm);
      };
      norms(before);
      if (basis.n_columns() > 0)
        subtract_combination(block, basis, inner_products(basis, block));
      norms(after);
      MultiVector kept(block.row_range(), 0);
      for (unsigned int k = 0; k < block.n_columns(); ++k)
        if (after[k] > 1e-20 * before[k])
        {
          MultiVector column(block.row_range(), 1);
          for (unsigned int i = 0; i < block.n_local(); ++i)
            column.data()[i] = block.column(k)[i] / std::sqrt(after[k]);
          kept.append(column);
        }
      block = orthonormalize(std::move(kept));
    }
    return block;
  }

  MultiVector scattered_numbers(const RowRange &rows, const unsigned int n_columns,
                                const unsigned int seed)
  {
    MultiVector block(rows, n_columns);
    for (unsigned int j = 0; j < n_columns; ++j)
      for (unsigned int i = 0; i < block.n_local(); ++i)
      {
        std::uint64_t state = 0x9e3779b97f4a7c15u * (rows.begin + i + 1) +
                              0xbf58476d1ce4e5b9u * (j + 1) + 0x94d049bb133111ebu * (seed + 1);
        state              = (state ^ (state >> 30)) * 0xbf58476d1ce4e5b9u;
        state              = (state ^ (state >> 27)) * 0x94d049bb133111ebu;
        block.column(j)[i] = static_cast<double>(state >> 11) / (1ull << 52) - 1;
      }
    return block;
  }

  MultiVector krylov_basis(const QuadraticEigenproblem &problem, const ShiftInvert &shift_invert,
                           const unsigned int n_columns, const unsigned int seed)
  {
    constexpr unsigned int block_size = 8;
    MultiVector block                 = scattered_numbers(problem.rows, block_size, seed);
    MultiVector basis(problem.rows, 0);
    while (basis.n_columns() < n_columns)
    {
      block = shift_invert.solve(multiply(problem.M, block));
      clear_multipliers(problem, block);
      block = orthonormal_complement(basis, std::move(block));
      if (block.n_columns() == 0) // the whole space
        break;
      basis.append(block);
    }
    return basis;
  }

  std::vector<Complex> sesquilinear_form(const MultiVector &z_re, const MultiVector &z_im,
                                         const Matrix &matrix, const MultiVector &x_re,
                                         const MultiVector &x_im)
  {
    std::vector<Complex> form(std::size_t(z_re.n_columns()) * x_re.n_columns());
    if (!matrix || form.empty())
      return form;
    // (z_re - i z_im)^T (a_re + i a_im)
    const MultiVector a_re = multiply(matrix, x_re), a_im = multiply(matrix, x_im);
    const auto rr = inner_products(z_re, a_re), ri = inner_products(z_re, a_im),
               ir = inner_products(z_im, a_re), ii = inner_products(z_im, a_im);
    for (std::size_t k = 0; k < form.size(); ++k)
      form[k] = Complex(rr[k] + ii[k], ri[k] - ir[k]);
    return form;
  }

  std::vector<Complex> biorthogonality(const QuadraticEigenproblem &problem,
                                       const std::vector<Complex> &lambda_z,
                                       const MultiVector &z_re, const MultiVector &z_im,
                                       const std::vector<Complex> &lambda_x,
                                       const MultiVector &x_re, const MultiVector &x_im)
  {
    std::vector<Complex> form       = sesquilinear_form(z_re, z_im, problem.M, x_re, x_im);
    const std::vector<Complex> of_p = sesquilinear_form(z_re, z_im, problem.P, x_re, x_im);
    for (std::size_t j = 0, k = 0; j < lambda_x.size(); ++j)
      for (std::size_t i = 0; i < lambda_z.size(); ++i, ++k)
        form[k] = (lambda_z[i] + lambda_x[j]) * form[k] + of_p[k];
    return form;
  }
} // namespace squeal
