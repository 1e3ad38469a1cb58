#include <squeal/stability.h>

#include <algorithm>
#include <tuple>

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



  std::vector<ModeRow> analyse(const QuadraticEigenproblem &problem,
                               const Modes                 &modes,
                               const unsigned int           cycle,
                               const double                 tolerance)
  {
    const unsigned int   n_modes = modes.lambda.size(), n_local = problem.rows.n_local();
    std::vector<ModeRow> rows(n_modes);
    std::vector<double>  forms(4 * n_modes);
    for (const unsigned int order : {0u, 1u})
    {
      const Matrix &matrix = order == 0 ? problem.Q : problem.P;
      const Block   a_re = multiply(matrix, modes.re), a_im = multiply(matrix, modes.im);
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
    std::vector<std::tuple<double, unsigned int, unsigned int>> distances;
    for (unsigned int i = 0; i < fine.size(); ++i)
      for (unsigned int j = 0; j < coarse.size(); ++j)
        distances.emplace_back(std::abs(fine[i].lambda - coarse[j].lambda), i, j);
    std::sort(distances.begin(), distances.end());

    std::vector<int>  match(fine.size(), -1);
    std::vector<bool> used(coarse.size(), false);
    for (const auto &[distance, i, j] : distances)
      if (match[i] < 0 && !used[j])
      {
        match[i] = j;
        used[j]  = true;
      }
    return match;
  }
} // namespace squeal
