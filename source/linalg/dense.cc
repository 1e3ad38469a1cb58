#include <squeal/base/errors.h>
#include <squeal/linalg/dense.h>

#include <deal.II/base/exceptions.h>

#include <petscsys.h>

#include <petscblaslapack.h>
#include <slepcblaslapack.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace squeal
{
  void gemm(const bool transpose_a, const unsigned int n_rows, const unsigned int n_columns,
            const double alpha, const double *a, const unsigned int n, const double *b,
            const double beta, double *c)
  {
    const PetscBLASInt lda = n_rows, m = transpose_a ? n_columns : n_rows,
                       k = transpose_a ? n_rows : n_columns, n_products = n, one = 1;
    if (m == 0 || n == 0 || k == 0)
      return;
    if (n == 1)
    {
      const PetscBLASInt width = n_columns;
      BLASgemv_(transpose_a ? "T" : "N", &lda, &width, &alpha, a, &lda, b, &one, &beta, c, &one);
    }
    else if (transpose_a && m == 1) // a row is the same as the column B^T a
      BLASgemv_("T", &k, &n_products, &alpha, b, &k, a, &one, &beta, c, &one);
    else
      BLASgemm_(transpose_a ? "T" : "N", "N", &m, &n_products, &k, &alpha, a, &lda, b, &k, &beta, c,
                &m);
  }

  void gemm(const bool transpose_a, const double alpha, const DenseMatrix &a, const DenseMatrix &b,
            const double beta, DenseMatrix &c)
  {
    Assert(c.n_rows == (transpose_a ? a.n_columns : a.n_rows) && c.n_columns == b.n_columns &&
               b.n_rows == (transpose_a ? a.n_rows : a.n_columns),
           dealii::StandardExceptions::ExcMessage("Matrices do not fit."));
    gemm(transpose_a, a.n_rows, a.n_columns, alpha, a.values.data(), b.n_columns, b.values.data(),
         beta, c.values.data());
  }

  void add_multiple(const double factor, const double *x, const unsigned int n, double *y)
  {
    const PetscBLASInt size = n, one = 1;
    BLASaxpy_(&size, &factor, x, &one, y, &one);
  }

  DenseMatrix outer_product(const DenseMatrix &a, const DenseMatrix &b)
  {
    DenseMatrix c(a.n_rows, b.n_rows);
    const PetscBLASInt m = a.n_rows, n = b.n_rows, k = a.n_columns;
    const double one = 1, zero = 0;
    if (m > 0 && n > 0 && k > 0)
      BLASgemm_("N", "T", &m, &n, &k, &one, a.values.data(), &m, b.values.data(), &n, &zero,
                c.values.data(), &m);
    return c;
  }

  DenseMatrix congruent(const DenseMatrix &a, const DenseMatrix &b)
  {
    DenseMatrix a_b(a.n_rows, b.n_columns), result(b.n_columns, b.n_columns);
    gemm(false, 1, a, b, 0, a_b);
    gemm(true, 1, b, a_b, 0, result);
    return result;
  }

  DenseMatrix transposed(const DenseMatrix &a)
  {
    DenseMatrix result(a.n_columns, a.n_rows);
    for (unsigned int j = 0; j < a.n_columns; ++j)
      for (unsigned int i = 0; i < a.n_rows; ++i)
        result(j, i) = a(i, j);
    return result;
  }

  DenseMatrix with_rows(const DenseMatrix &a, const unsigned int n_rows)
  {
    DenseMatrix result(n_rows, a.n_columns);
    for (unsigned int j = 0; j < a.n_columns; ++j)
      std::copy_n(a.values.data() + std::size_t(j) * a.n_rows, std::min(n_rows, a.n_rows),
                  result.values.data() + std::size_t(j) * n_rows);
    return result;
  }

  DenseMatrix some_rows(const DenseMatrix &a, const unsigned int first, const unsigned int n)
  {
    DenseMatrix result(n, a.n_columns);
    for (unsigned int j = 0; j < a.n_columns; ++j)
      std::copy_n(&a.values[first + std::size_t(j) * a.n_rows], n,
                  result.values.data() + std::size_t(j) * n);
    return result;
  }

  DenseMatrix some_columns(const DenseMatrix &a, const unsigned int first, const unsigned int n)
  {
    const auto begin = a.values.begin() + std::size_t(first) * a.n_rows;
    return {a.n_rows, n, std::vector<double>(begin, begin + std::size_t(n) * a.n_rows)};
  }

  void append(DenseMatrix &a, const DenseMatrix &b)
  {
    if (b.n_columns == 0)
      return;
    a.values.insert(a.values.end(), b.values.begin(), b.values.end());
    a.n_rows = b.n_rows;
    a.n_columns += b.n_columns;
  }

  void add(const double factor, const DenseMatrix &a, DenseMatrix &sum)
  {
    if (a.values.empty() || factor == 0)
      return;
    if (sum.values.empty())
      sum = DenseMatrix(a.n_rows, a.n_columns);
    for (std::size_t k = 0; k < a.values.size(); ++k)
      sum.values[k] += factor * a.values[k];
  }

  DenseMatrix symmetrised(DenseMatrix a)
  {
    for (unsigned int j = 0; j < a.n_columns; ++j)
      for (unsigned int i = 0; i < j; ++i)
        a(i, j) = a(j, i) = (a(i, j) + a(j, i)) / 2;
    return a;
  }

  DenseMatrix solve(DenseMatrix a, DenseMatrix b)
  {
    const PetscBLASInt n = a.n_rows, n_rhs = b.n_columns;
    if (n == 0 || n_rhs == 0)
      return b;
    std::vector<PetscBLASInt> pivots(n);
    PetscBLASInt info = 0;
    LAPACKgetrf_(&n, &n, a.values.data(), &n, pivots.data(), &info);
    if (info != 0)
      throw SingularMatrix("LAPACK: a dense matrix is singular to working precision (row " +
                               std::to_string(info) + " of " + std::to_string(n) + ").",
                           {Failure::singular_matrix});
    LAPACKgetrs_("N", &n, &n_rhs, a.values.data(), &n, pivots.data(), b.values.data(), &n, &info);
    return b;
  }

  DenseMatrix pseudo_inverse(DenseMatrix a, const double smallest)
  {
    const PetscBLASInt m = a.n_rows, n = a.n_columns, k = std::min(m, n);
    if (k == 0)
      return DenseMatrix(n, m);
    DenseMatrix u(m, k), vt(k, n);
    std::vector<double> sigma(k), work(1);
    PetscBLASInt size = -1, info = 0; // the first call asks for the size
    for (unsigned int call = 0; call < 2; ++call)
    {
      LAPACKgesvd_("S", "S", &m, &n, a.values.data(), &m, sigma.data(), u.values.data(), &m,
                   vt.values.data(), &k, work.data(), &size, &info);
      size = work[0];
      work.resize(size);
    }
    if (info != 0)
      throw SolverError("LAPACK dgesvd did not converge (info " + std::to_string(info) + ").");
    unsigned int rank = 0;
    while (rank < sigma.size() && sigma[rank] > smallest * sigma[0])
      ++rank;
    u = some_columns(u, 0, rank);
    for (unsigned int j = 0; j < rank; ++j)
      for (PetscBLASInt i = 0; i < m; ++i)
        u(i, j) /= sigma[j];
    return outer_product(transposed(some_rows(vt, 0, rank)), u);
  }

  PositiveFactors::PositiveFactors(DenseMatrix a, const std::string &what) : factors(std::move(a))
  {
    const PetscBLASInt n = factors.n_rows;
    PetscBLASInt info    = 0;
    if (n > 0)
      LAPACKpotrf_("U", &n, factors.values.data(), &n, &info);
    if (info != 0)
      throw SolverError("LAPACK: " + what + " is not positive definite (row " +
                        std::to_string(info) + " of " + std::to_string(n) + ").");
  }

  DenseMatrix PositiveFactors::solve(DenseMatrix b) const
  {
    const PetscBLASInt n = b.n_rows, n_rhs = b.n_columns;
    PetscBLASInt info = 0;
    if (n > 0 && n_rhs > 0)
      LAPACKpotrs_("U", &n, &n_rhs, factors.values.data(), &n, b.values.data(), &n, &info);
    return b;
  }

  std::vector<double> symmetric_eigen(DenseMatrix &a)
  {
    const PetscBLASInt n = a.n_rows;
    PetscBLASInt info = 0, n_work = std::max<PetscBLASInt>(1, 34 * n);
    std::vector<double> eigenvalues(n), work(n_work);
    LAPACKsyev_("V", "U", &n, a.values.data(), &n, eigenvalues.data(), work.data(), &n_work, &info);
    if (info != 0)
      throw SolverError("LAPACK dsyev did not converge (info " + std::to_string(info) + ").");
    return eigenvalues;
  }

  DenseMatrix principal_combinations(DenseMatrix products, const double smallest)
  {
    const unsigned int n              = products.n_rows;
    const std::vector<double> squares = symmetric_eigen(products);
    DenseMatrix result(n, 0);
    for (unsigned int k = 0; k < n; ++k)
      if (squares[k] > smallest * smallest)
      {
        for (unsigned int i = 0; i < n; ++i)
          result.values.push_back(products(i, k) / std::sqrt(squares[k]));
        ++result.n_columns;
      }
    return result;
  }

  DenseMatrix independent_combinations(DenseMatrix products, const DenseMatrix &before,
                                       const double shortest, const double dependent)
  {
    const unsigned int n = products.n_rows;
    DenseMatrix result(n, 0);
    if (n == 0)
      return result;
    std::vector<double> scales(n);
    for (unsigned int k = 0; k < n; ++k)
      if (products(k, k) > shortest * shortest * before(k, k))
        scales[k] = 1 / std::sqrt(products(k, k));
    for (unsigned int k = 0; k < n; ++k)
      for (unsigned int i = 0; i < n; ++i)
        products(i, k) *= scales[i] * scales[k];
    result = principal_combinations(std::move(products), dependent);
    for (unsigned int k = 0; k < result.n_columns; ++k)
      for (unsigned int i = 0; i < n; ++i)
        result(i, k) *= scales[i];
    return result;
  }

  namespace
  {
    /// The vector that begins in a row of a column, or its conjugate; @p is_complex: the next
    /// column is the imaginary part.
    std::vector<std::complex<double>> unpacked(const DenseMatrix &columns, const unsigned int row,
                                               const unsigned int n, const unsigned int j,
                                               const bool is_complex, const bool conjugate)
    {
      std::vector<std::complex<double>> x(n);
      for (unsigned int i = 0; i < n; ++i)
        x[i] = {columns(row + i, j),
                is_complex ? (conjugate ? -1 : 1) * columns(row + i, j + 1) : 0.};
      return x;
    }
  } // namespace

  std::vector<std::complex<double>> DenseEigenpairs::vector(const unsigned int j) const
  {
    return unpacked(vectors, 0, vectors.n_rows, j, im[j] != 0, false);
  }

  DenseEigenpairs general_eigen(DenseMatrix a, const bool with_left)
  {
    const PetscBLASInt n = a.n_rows;
    DenseEigenpairs result{std::vector<double>(n),
                           std::vector<double>(n),
                           DenseMatrix(n, n),
                           with_left ? DenseMatrix(n, n) : DenseMatrix(),
                           {}};
    PetscBLASInt info = 0, n_work = -1;
    double best_size = 0, norm = 0;
    std::vector<double> scale, reciprocal_condition;
    if (with_left)
    {
      scale.resize(n);
      reciprocal_condition.resize(n);
    }
    for (int pass = 0; n > 0 && pass < 2; ++pass)
    {
      std::vector<double> work(pass == 0 ? 1 : n_work);
      double *const place = pass == 0 ? &best_size : work.data();
      if (with_left)
      {
        PetscBLASInt low = 0, high = 0, unused_integers = 0;
        double unused_conditions = 0;
        LAPACKgeevx_("B", "V", "V", "E", &n, a.values.data(), &n, result.re.data(),
                     result.im.data(), result.left.values.data(), &n, result.vectors.values.data(),
                     &n, &low, &high, scale.data(), &norm, reciprocal_condition.data(),
                     &unused_conditions, place, &n_work, &unused_integers, &info);
      }
      else
        LAPACKgeev_("N", "V", &n, a.values.data(), &n, result.re.data(), result.im.data(), nullptr,
                    &n, result.vectors.values.data(), &n, place, &n_work, &info);
      if (info != 0)
        throw SolverError("LAPACK dgeev did not converge (info " + std::to_string(info) + ").");
      n_work = PetscBLASInt(best_size);
    }
    for (const double reciprocal : reciprocal_condition)
      result.rounding.push_back(std::numeric_limits<double>::epsilon() * norm / reciprocal);
    return result;
  }

  std::vector<SquareRoot> upper_square_roots(const std::complex<double> square)
  {
    // The roots of a negative number are exactly imaginary; std::sqrt may leave a rounding error.
    if (square.imag() == 0 && square.real() < 0)
      return {{{0, std::sqrt(-square.real())}, false}};
    const std::complex<double> root = std::sqrt(square);
    if (square.imag() == 0)
      return {{root, false}, {-root, false}};
    const std::complex<double> upper = root.imag() >= 0 ? root : -root;
    return {{upper, false}, {-std::conj(upper), true}};
  }

  namespace
  {
    /// A^{-T} B of the first rows of B, if it is not empty.
    DenseMatrix solve_left(const DenseMatrix &a, const DenseMatrix &b)
    {
      return b.values.empty() ? DenseMatrix() : solve(transposed(a), with_rows(b, a.n_rows));
    }

    /// l^2 M x + Q x = 0 as the eigenproblem of Q^{-1} M: theta = -1/l^2.
    std::vector<DensePair> without_velocity_term(const DenseMatrix &m, const DenseMatrix &q,
                                                 const bool with_left)
    {
      const unsigned int n    = m.n_rows;
      const DenseEigenpairs e = general_eigen(solve(q, m), with_left);
      const DenseMatrix left  = solve_left(q, e.left);
      // An infinite eigenvalue is theta = 0. What rounding makes of it cannot be told from a finite
      // eigenvalue of so small a theta, which would have no correct digit.
      double largest = 0;
      for (unsigned int j = 0; j < n; ++j)
        largest = std::max(largest, std::hypot(e.re[j], e.im[j]));
      const double infinite = 10 * n * std::numeric_limits<double>::epsilon() * largest;

      std::vector<DensePair> pairs;
      for (unsigned int j = 0; j < n; ++j)
      {
        const bool complex_pair = e.im[j] != 0;
        const std::complex<double> theta(e.re[j], e.im[j]);
        if (std::abs(theta) > infinite)
        {
          for (const SquareRoot &root : upper_square_roots(-1. / theta))
          {
            pairs.push_back(
                {root.value, unpacked(e.vectors, 0, n, j, complex_pair, root.conjugate), {}});
            if (with_left)
              pairs.back().left = unpacked(left, 0, n, j, complex_pair, !root.conjugate);
          }
        }
        j += complex_pair;
      }
      return pairs;
    }
  } // namespace

  std::vector<DensePair> quadratic_eigenpairs(const DenseMatrix &m, const DenseMatrix &p,
                                              const DenseMatrix &q, const double shift,
                                              const double scale, const bool with_left)
  {
    const unsigned int n = m.n_rows;
    if (n == 0)
      return {};
    if (p.n_rows == 0 && shift == 0)
      return without_velocity_term(m, q, with_left);

    const double s  = shift / scale;
    DenseMatrix q_s = q, right(n, 2 * n);
    for (std::size_t k = 0; k < q.values.size(); ++k)
    {
      const double m_k = scale * scale * m.values[k];
      const double p_k = p.n_rows == 0 ? 0. : scale * p.values[k];
      q_s.values[k] += s * p_k + s * s * m_k;
      right.values[k]                   = -(p_k + 2 * s * m_k);
      right.values[k + q.values.size()] = -m_k;
    }
    const DenseMatrix top = solve(q_s, std::move(right));

    DenseMatrix companion(2 * n, 2 * n);
    for (unsigned int j = 0; j < 2 * n; ++j)
      for (unsigned int i = 0; i < n; ++i)
        companion(i, j) = top(i, j);
    for (unsigned int i = 0; i < n; ++i)
      companion(n + i, i) = 1;

    DenseEigenpairs e = general_eigen(companion, with_left);
    double largest    = 0;
    for (unsigned int j = 0; j < 2 * n; ++j)
      largest = std::max(largest, std::hypot(e.re[j], e.im[j]));
    // Infinite eigenvalues are theta = 0. They are defective, in Jordan blocks of up to four with
    // constraints, hence rounding spreads them to its fourth root: what is as small may be one of
    // them, or the real eigenvalue of a dashpot without mass, whose condition is modest. The
    // condition tells them apart. A threshold there would drop the modes of a body that is almost
    // free: the nearness of its zero to the shift makes the largest theta.
    const double nothing = 1e-9 * largest,
                 spread = std::pow(20 * n * std::numeric_limits<double>::epsilon(), 0.25) * largest;
    const auto is_small = [&](const unsigned int j, const double bound)
    { return std::hypot(e.re[j], e.im[j]) <= bound; };
    const auto may_be_infinite = [&](const unsigned int j)
    { return is_small(j, spread) && !is_small(j, nothing); };
    for (unsigned int j = 0; j < 2 * n && e.rounding.empty(); ++j)
      if (may_be_infinite(j))
        e = general_eigen(companion, true);

    const DenseMatrix left = with_left ? solve_left(q_s, e.left) : DenseMatrix();
    std::vector<DensePair> pairs;
    for (unsigned int j = 0; j < 2 * n; ++j)
    {
      // dgeev lists the eigenvalue with positive imaginary part of each pair first.
      const bool complex_pair = e.im[j] != 0;
      if (!is_small(j, nothing) && !(may_be_infinite(j) && is_small(j, 10 * e.rounding[j])))
      {
        // The lower half of the companion vector is x; conj(theta) has Im l > 0 and the conjugate
        // vectors.
        pairs.push_back({shift + scale / std::complex<double>(e.re[j], -e.im[j]),
                         unpacked(e.vectors, n, n, j, complex_pair, true),
                         {}});
        if (with_left)
          pairs.back().left = unpacked(left, 0, n, j, complex_pair, false);
      }
      j += complex_pair;
    }
    return pairs;
  }

  std::complex<double> nearest_root(const std::complex<double> a, const std::complex<double> b,
                                    const std::complex<double> c, const std::complex<double> given)
  {
    const std::complex<double> root = std::sqrt(b * b - 4. * a * c), one = (-b + root) / (2. * a),
                               other = (-b - root) / (2. * a);
    return std::abs(one - given) < std::abs(other - given) ? one : other;
  }
} // namespace squeal
