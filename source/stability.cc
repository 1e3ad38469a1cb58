#include <squeal/stability.h>

#include <algorithm>
#include <limits>

namespace squeal
{
  std::string verdict(const std::complex<double> lambda, const double tolerance)
  {
    if (std::abs(lambda.real()) <= tolerance * std::abs(lambda))
      return "marginal";
    if (lambda.real() < 0)
      return "stable";
    return lambda.imag() == 0 ? "divergence" : "flutter";
  }

  std::vector<ModeRow> analyse(const QuadraticEigenproblem &problem, const Modes &modes,
                               const unsigned int cycle, const double tolerance)
  {
    const unsigned int n_modes = modes.lambda.size(), n_local = problem.rows.n_local();
    std::vector<ModeRow> rows(n_modes);
    std::vector<double> forms(4 * n_modes);
    for (const unsigned int order : {0u, 1u})
    {
      const Matrix &matrix = order == 0 ? problem.Q : problem.P;
      const Block a_re = multiply(matrix, modes.re), a_im = multiply(matrix, modes.im);
      for (unsigned int j = 0; j < n_modes; ++j)
        for (unsigned int i = 0; i < n_local; ++i)
        {
          // x^H A x = (re - j im)^T (A re + j A im)
          const double re = modes.re.column(j)[i], im = modes.im.column(j)[i];
          forms[4 * j + 2 * order] += re * a_re.column(j)[i] + im * a_im.column(j)[i];
          forms[4 * j + 2 * order + 1] += re * a_im.column(j)[i] - im * a_re.column(j)[i];
        }
    }
    MPI_Allreduce(MPI_IN_PLACE, forms.data(), forms.size(), MPI_DOUBLE, MPI_SUM, problem.rows.comm);

    for (unsigned int j = 0; j < n_modes; ++j)
    {
      ModeRow &row       = rows[j];
      row.cycle          = cycle;
      row.mode           = j + 1;
      row.lambda         = modes.lambda[j];
      row.verdict        = verdict(row.lambda, tolerance);
      row.backward_error = modes.backward_error[j];
      row.k              = forms[4 * j];
      row.n              = forms[4 * j + 1];
      row.d              = forms[4 * j + 2];
      row.g              = forms[4 * j + 3];
    }
    return rows;
  }

  std::vector<int> match_modes(const std::vector<ModeRow> &fine, const std::vector<ModeRow> &coarse)
  {
    // The assignment problem by shortest augmenting paths (Jonker and Volgenant, 1987) on a square
    // cost matrix; missing partners are dear.
    const unsigned int n = std::max(fine.size(), coarse.size());
    std::vector<std::vector<double>> cost(n + 1, std::vector<double>(n + 1, 0));
    for (unsigned int i = 0; i < fine.size(); ++i)
      for (unsigned int j = 0; j < coarse.size(); ++j)
        cost[i + 1][j + 1] = std::norm(fine[i].lambda - coarse[j].lambda);

    std::vector<double> row_price(n + 1), column_price(n + 1);
    std::vector<unsigned int> row_of(n + 1), previous(n + 1); // index 0: none
    for (unsigned int i = 1; i <= n; ++i)
    {
      std::vector<double> shortest(n + 1, std::numeric_limits<double>::infinity());
      std::vector<bool> done(n + 1, false);
      unsigned int column = 0;
      row_of[0]           = i;
      do
      {
        done[column]           = true;
        const unsigned int row = row_of[column];
        unsigned int next      = 0;
        double delta           = std::numeric_limits<double>::infinity();
        for (unsigned int j = 1; j <= n; ++j)
          if (!done[j])
          {
            const double reduced = cost[row][j] - row_price[row] - column_price[j];
            if (reduced < shortest[j])
            {
              shortest[j] = reduced;
              previous[j] = column;
            }
            if (shortest[j] < delta)
            {
              delta = shortest[j];
              next  = j;
            }
          }
        for (unsigned int j = 0; j <= n; ++j)
          if (done[j])
          {
            row_price[row_of[j]] += delta;
            column_price[j] -= delta;
          }
          else
            shortest[j] -= delta;
        column = next;
      } while (row_of[column] != 0);
      for (; column != 0; column = previous[column])
        row_of[column] = row_of[previous[column]];
    }

    std::vector<int> match(fine.size(), -1);
    for (unsigned int j = 1; j <= coarse.size(); ++j)
      if (row_of[j] <= fine.size())
        match[row_of[j] - 1] = j - 1;
    return match;
  }
} // namespace squeal
