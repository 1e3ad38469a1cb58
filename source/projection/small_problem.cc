#include <squeal/equations/eigenproblem.h>
#include <squeal/projection/eigensolver_options.h>
#include <squeal/projection/small_problem.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

// First the dense solution, by l^2 or by the companion matrix: eigenvalues of LAPACK's, the choice
// of those that are finite, and their vectors. Then the correction of known pairs, whose products
// with the matrices are formed for all of them at once. Last T(l), which both and the way to exact
// frozen terms (projected_nonlinear.cc) need.
namespace squeal
{
  using Complex = std::complex<double>;

  SmallPairs SmallPairs::select(const std::vector<unsigned int> &numbers) const
  {
    SmallPairs result;
    for (const unsigned int k : numbers)
    {
      result.lambda.push_back(lambda[k]);
      if (!errors.empty())
        result.errors.push_back(errors[k]);
    }
    result.right = right.columns(numbers);
    if (left.n_rows > 0) // no pairs keep their size, too
      result.left = left.columns(numbers);
    return result;
  }

  std::vector<SquareRoot> upper_square_roots(const Complex square)
  {
    // The roots of a negative number are exactly imaginary; std::sqrt may leave a rounding error.
    if (square.imag() == 0 && square.real() < 0)
      return {{{0, std::sqrt(-square.real())}, false}};
    const Complex root = std::sqrt(square);
    if (square.imag() == 0)
      return {{root, false}, {-root, false}};
    const Complex upper = root.imag() >= 0 ? root : -root;
    return {{upper, false}, {-std::conj(upper), true}};
  }

  Complex nearest_root(const Complex a, const Complex b, const Complex c, const Complex given)
  {
    const Complex root = std::sqrt(b * b - 4. * a * c), one = (-b + root) / (2. * a),
                  other = (-b - root) / (2. * a);
    return std::abs(one - given) < std::abs(other - given) ? one : other;
  }

  namespace
  {
    /// An eigenvalue l of the problem, the number of its theta, and whether its vectors are the
    /// conjugate ones of theta's.
    struct Found
    {
      Complex lambda;
      unsigned int number;
      bool conjugate;
    };

    /// Columns of some rows of A, or their conjugate ones.
    ComplexDenseMatrix vectors_of(const std::vector<Found> &found, const ComplexDenseMatrix &a,
                                  const unsigned int first, const unsigned int n,
                                  const bool others_conjugate)
    {
      ComplexDenseMatrix result(n, found.size());
      for (unsigned int k = 0; k < found.size(); ++k)
        for (unsigned int i = 0; i < n; ++i)
        {
          const Complex value = a(first + i, found[k].number);
          result(i, k)        = found[k].conjugate != others_conjugate ? std::conj(value) : value;
        }
      return result;
    }

    /// x is the lower part of the matrix's vectors, y = Q(s)^{-T} conj(u), u the upper one.
    SmallPairs pairs_of(const std::vector<Found> &found, const DenseEigenpairs &e,
                        const LuFactors<double> &factors, const unsigned int n,
                        const bool with_left)
    {
      SmallPairs pairs;
      for (const Found &f : found)
        pairs.lambda.push_back(f.lambda);
      pairs.right = vectors_of(found, e.right, e.right.n_rows - n, n, false);
      if (with_left)
        pairs.left =
            to_complex(factors.solve(real_and_imaginary(vectors_of(found, e.left, 0, n, true)),
                                     DenseView<double>::Form::transposed));
      return pairs;
    }

    double largest_modulus(const std::vector<Complex> &values)
    {
      double largest = 0;
      for (const Complex &value : values)
        largest = std::max(largest, std::abs(value));
      return largest;
    }

    /// l^2 M x + Q x = 0 as the eigenproblem of Q^{-1} M: theta = -1/l^2.
    SmallPairs solve_squares(const DenseMatrix &m, const DenseMatrix &q, const bool with_left)
    {
      const unsigned int n = m.n_rows;
      const LuFactors<double> factors(q);
      const DenseEigenpairs e = general_eigen(factors.solve(m), with_left);
      // An infinite eigenvalue is theta = 0. What rounding makes of it cannot be told from a finite
      // eigenvalue of so small a theta, which would have no correct digit.
      const double infinite =
          10 * n * std::numeric_limits<double>::epsilon() * largest_modulus(e.values);
      std::vector<Found> found;
      for (unsigned int j = 0; j < n; ++j)
        if (const Complex theta = e.values[j]; std::abs(theta) > infinite && theta.imag() >= 0)
          for (const SquareRoot &root : upper_square_roots(-1. / theta))
            found.push_back({root.value, j, root.conjugate});
      return pairs_of(found, e, factors, n, with_left);
    }
  } // namespace

  SmallPairs SmallProblem::solve(const double shift, const double scale, const bool with_left) const
  {
    const unsigned int n = m.n_rows;
    if (n == 0)
      return {};
    if (p.empty() && shift == 0)
      return solve_squares(m, q, with_left);

    const double s  = shift / scale;
    DenseMatrix q_s = q, right(n, 2 * n);
    for (std::size_t k = 0; k < q.values.size(); ++k)
    {
      const double m_k = scale * scale * m.values[k];
      const double p_k = p.empty() ? 0. : scale * p.values[k];
      q_s.values[k] += s * p_k + s * s * m_k;
      right.values[k]                   = -(p_k + 2 * s * m_k);
      right.values[k + q.values.size()] = -m_k;
    }
    const LuFactors<double> factors(std::move(q_s));
    DenseMatrix companion = factors.solve(std::move(right));
    companion.resize_rows(2 * n);
    for (unsigned int i = 0; i < n; ++i)
      companion(n + i, i) = 1;

    DenseEigenpairs e    = general_eigen(companion, with_left);
    const double largest = largest_modulus(e.values);
    // Infinite eigenvalues are theta = 0. They are defective, in Jordan blocks of up to four with
    // constraints, hence rounding spreads them to its fourth root: what is as small may be one of
    // them, or the real eigenvalue of a dashpot without mass, whose condition is modest. The
    // condition tells them apart. A threshold there would drop the modes of a body that is almost
    // free: the nearness of its zero to the shift makes the largest theta.
    const double nothing = 1e-9 * largest,
                 spread = std::pow(20 * n * std::numeric_limits<double>::epsilon(), 0.25) * largest;
    const auto is_small = [&](const unsigned int j, const double bound)
    { return std::abs(e.values[j]) <= bound; };
    const auto may_be_infinite = [&](const unsigned int j)
    { return is_small(j, spread) && !is_small(j, nothing); };
    for (unsigned int j = 0; j < 2 * n && e.rounding.empty(); ++j)
      if (may_be_infinite(j))
        e = general_eigen(companion, true);

    std::vector<Found> found;
    for (unsigned int j = 0; j < 2 * n; ++j)
      if (e.values[j].imag() >= 0 && !is_small(j, nothing) &&
          !(may_be_infinite(j) && is_small(j, 10 * e.rounding[j])))
        // conj(theta) has Im l > 0 and the conjugate vectors.
        found.push_back({shift + scale / std::conj(e.values[j]), j, true});
    return pairs_of(found, e, factors, n, with_left);
  }

  namespace
  {
    /// The products of some vectors with Q, P and M, or with their transposes.
    struct Products
    {
      ComplexDenseMatrix q, p, m;

      Products(const SmallProblem &problem, const ComplexDenseMatrix &x, const bool transposed)
      {
        const auto product = [&](const DenseMatrix &a)
        { return transposed ? a.transpose() * x : a * x; };
        q = product(problem.q);
        m = product(problem.m);
        p = problem.p.empty() ? ComplexDenseMatrix(q.n_rows, q.n_columns) : product(problem.p);
      }

      /// Lengths of Q(l) x by those of Q x.
      std::vector<double> residuals(const std::vector<Complex> &lambda) const
      {
        ComplexDenseMatrix sum = q;
        for (unsigned int k = 0; k < sum.n_columns; ++k)
          for (unsigned int i = 0; i < sum.n_rows; ++i)
            sum(i, k) += lambda[k] * (p(i, k) + lambda[k] * m(i, k));
        std::vector<double> lengths = sum.column_norms(), of_q = q.column_norms();
        for (unsigned int k = 0; k < lengths.size(); ++k)
          lengths[k] /= of_q[k];
        return lengths;
      }

      /// Q'(l) x of one of them.
      ComplexDenseMatrix slope(const unsigned int k, const Complex l) const
      {
        ComplexDenseMatrix result = p.columns(k, 1);
        for (unsigned int i = 0; i < result.n_rows; ++i)
          result(i, 0) += 2. * l * m(i, k);
        return result;
      }
    };

    bool are_distinct(const std::vector<Complex> &lambda)
    {
      for (unsigned int k = 0; k < lambda.size(); ++k)
        for (unsigned int j = 0; j < k; ++j)
          if (std::abs(lambda[k] - lambda[j]) <= 1e-9 * std::abs(lambda[k]))
            return false;
      return true;
    }
  } // namespace

  bool SmallProblem::improve(SmallPairs &pairs, const Accuracy &accuracy) const
  {
    constexpr unsigned int max_iterations = 5;
    // Of Q x: far below the tolerance, though the eigenvalue's error is of the second order in it
    // and the next one of the third. Beyond the window modes need only be known.
    constexpr double known        = 1e-8;
    const double largest_residual = std::clamp(1e-3 * accuracy.tolerance, 1e-11, known),
                 radius           = search_radius(accuracy.max_imaginary);
    using Factors                 = LuFactors<Complex>;
    SmallPairs result             = pairs;
    result.right.normalise();
    result.left.normalise();
    std::vector<unsigned int> open(pairs.size());
    std::iota(open.begin(), open.end(), 0u);
    for (unsigned int iteration = 0;; ++iteration)
    {
      const SmallPairs now = result.select(open);
      const Products of_right(*this, now.right, false), of_left(*this, now.left, true);
      // The two-sided Rayleigh functional: y^T (l^2 M + l P + Q) x = 0
      const std::vector<Complex> y_m_x = column_products(now.left, of_right.m),
                                 y_p_x = column_products(now.left, of_right.p),
                                 y_q_x = column_products(now.left, of_right.q);
      std::vector<Complex> lambda;
      for (unsigned int k = 0; k < open.size(); ++k)
      {
        lambda.push_back(nearest_root(y_m_x[k], y_p_x[k], y_q_x[k], now.lambda[k]));
        if (!(std::abs(lambda[k]) <= radius) || is_overdamped(lambda[k]))
          return false;
        result.lambda[open[k]] = lambda[k];
      }
      const std::vector<double> right_residuals = of_right.residuals(lambda),
                                left_residuals  = of_left.residuals(lambda);
      std::vector<unsigned int> still_open;
      for (unsigned int k = 0; k < open.size(); ++k)
      {
        const double largest =
            lambda[k].imag() <= accuracy.max_imaginary ? largest_residual : known;
        if (right_residuals[k] <= largest && left_residuals[k] <= largest)
          continue;
        if (iteration == max_iterations)
          return false;
        // x := Q(l)^{-1} Q'(l) x, y := Q(l)^{-T} Q'(l)^T y
        const Factors factors(at(lambda[k], 0), Factors::ZeroPivot::becomes_rounding);
        const ComplexDenseMatrix x = factors.solve(of_right.slope(k, lambda[k])).normalise(),
                                 y = factors
                                         .solve(of_left.slope(k, lambda[k]),
                                                DenseView<Complex>::Form::transposed)
                                         .normalise();
        std::copy_n(x.column(0), size(), result.right.column(open[k]));
        std::copy_n(y.column(0), size(), result.left.column(open[k]));
        still_open.push_back(open[k]);
      }
      if (still_open.empty())
        break;
      open = std::move(still_open);
    }
    if (!are_distinct(result.lambda))
      return false;
    pairs = std::move(result);
    return true;
  }

  namespace
  {
    void add_real(const Complex factor, const DenseMatrix &a, ComplexDenseMatrix &sum)
    {
      for (std::size_t k = 0; k < a.values.size(); ++k)
        sum.values[k] += factor * a.values[k];
    }
  } // namespace

  ComplexDenseMatrix SmallProblem::at(const Complex l, const Complex t) const
  {
    ComplexDenseMatrix result(size(), size());
    add_real(l * l, m, result);
    add_real(l, p, result);
    add_real(1, q, result);
    for (unsigned int b = 0; b < frozen.size(); ++b)
      add_real(t * (*frozen_terms)[b].h(l), frozen[b], result);
    return result;
  }

  ComplexDenseMatrix SmallProblem::derivative(const Complex l, const Complex t) const
  {
    ComplexDenseMatrix result(size(), size());
    add_real(2. * l, m, result);
    add_real(1, p, result);
    for (unsigned int b = 0; b < frozen.size(); ++b)
      add_real(t * (*frozen_terms)[b].derivative(l), frozen[b], result);
    return result;
  }
} // namespace squeal
