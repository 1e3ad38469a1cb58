#include <squeal/projection/shift_invert.h>

#include <algorithm>
#include <cstdint>

namespace squeal
{
  using Complex = std::complex<double>;

  void inverse_iteration(const QuadraticEigenproblem &problem, const ShiftInvert &shift_invert,
                         EigenPairs &pairs)
  {
    const unsigned int n_pairs = pairs.size(), n = problem.rows.n_local();
    const ComplexMultiVector m_x = multiply(problem.M, pairs.right),
                             p_x = multiply(problem.P, pairs.right);
    MultiVector right(problem.rows, 2 * n_pairs);
    for (unsigned int j = 0; j < n_pairs; ++j)
    {
      const Complex c_m = pairs.lambda[j] * pairs.lambda[j] - shift_invert.square,
                    c_p = pairs.lambda[j] - shift_invert.shift;
      for (unsigned int i = 0; i < n; ++i)
      {
        const Complex r            = -c_m * m_x(i, j) - c_p * p_x(i, j);
        right.column(2 * j)[i]     = r.real();
        right.column(2 * j + 1)[i] = r.imag();
      }
    }
    for (const FrozenTerm &term : problem.frozen)
    {
      const ComplexMultiVector a_x = multiply(term.matrix, pairs.right);
      for (unsigned int j = 0; j < n_pairs; ++j)
      {
        const Complex h = term.h(pairs.lambda[j]);
        for (unsigned int i = 0; i < n; ++i)
        {
          const Complex r = h * a_x(i, j);
          right.column(2 * j)[i] -= r.real();
          right.column(2 * j + 1)[i] -= r.imag();
        }
      }
    }
    const MultiVector x = shift_invert.solve(right);
    for (unsigned int j = 0; j < n_pairs; ++j)
    {
      std::copy_n(x.column(2 * j), n, pairs.right.re.column(j));
      std::copy_n(x.column(2 * j + 1), n, pairs.right.im.column(j));
    }
  }

  void clear_pressures(const unsigned int n_local_constraints, MultiVector &block)
  {
    for (unsigned int k = 0; k < block.n_columns(); ++k)
      std::fill_n(block.column(k) + block.n_local() - n_local_constraints, n_local_constraints, 0.);
  }

  void clear_multipliers(const QuadraticEigenproblem &problem, MultiVector &block)
  {
    if (!problem.compliant)
      clear_pressures(problem.n_local_constraints, block);
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
} // namespace squeal
