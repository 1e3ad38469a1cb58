#include <squeal/assessment/stability.h>
#include <squeal/equations/term_list.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

// From eigenpairs to a table of verdicts. A mode's Rayleigh coefficients d + j g = x^H P x and k +
// j n = x^H Q x say what feeds it; rayleigh_parts() splits them by origin and body, contributions()
// turns the parts into shares of the growth rate. verdict() compares the growth rate with its bar,
// or with rounding where there is none; assess_stability() does all of this for one mesh. Below
// stand what other rooms ask of a table: sensitivities of eigenvalues, the least stable mode, and
// which mode of a fine mesh is which of a coarse one (an assignment of least cost).

namespace squeal
{
  using Complex = std::complex<double>;

  double algebraic_error(const std::complex<double> lambda, const double backward_error,
                         const double condition)
  {
    constexpr double rounding = 10 * std::numeric_limits<double>::epsilon();
    return std::abs(lambda) * condition * std::max(backward_error, rounding);
  }

  Verdict verdict(const std::complex<double> lambda, const double tolerance,
                  const double growth_rate_error)
  {
    const double rounding = std::max(tolerance, smallest_tolerance) * std::abs(lambda);
    if (std::abs(lambda.real()) <= rounding && growth_rate_error <= rounding)
      return Verdict::marginal;
    if (std::abs(lambda.real()) <= growth_rate_error)
      return Verdict::undecided;
    if (lambda.real() < 0)
      return Verdict::stable;
    return lambda.imag() == 0 ? Verdict::divergence : Verdict::flutter;
  }

  std::vector<ModeRow> analyse(const QuadraticEigenproblem &problem, const EigenPairs &modes,
                               const unsigned int cycle, const double tolerance)
  {
    return analyse(modes, diagonal_form(modes.right, problem.P, modes.right),
                   diagonal_form(modes.right, problem.Q, modes.right), cycle, tolerance);
  }

  std::vector<ModeRow> analyse(const EigenPairs &modes,
                               const std::vector<std::complex<double>> &of_p,
                               const std::vector<std::complex<double>> &of_q,
                               const unsigned int cycle, const double tolerance)
  {
    const unsigned int n_modes = modes.lambda.size();
    std::vector<ModeRow> rows(n_modes);
    for (unsigned int j = 0; j < n_modes; ++j)
    {
      ModeRow &row       = rows[j];
      row.cycle          = cycle;
      row.mode           = j + 1;
      row.lambda         = modes.lambda[j];
      row.backward_error = modes.backward_error[j];
      row.k              = of_q[j].real();
      row.n              = of_q[j].imag();
      row.d              = of_p[j].real();
      row.g              = of_p[j].imag();
      // The tolerance is for the backward error. Near a double root, where the condition number is
      // large, rounding alone decides on which side of zero an eigenvalue comes out.
      row.verdict = verdict(
          row.lambda, tolerance,
          j < modes.condition.size() ? algebraic_error(row.lambda, 0, modes.condition[j]) : 0.);
      if (j < modes.condition.size())
      {
        row.condition_number    = modes.condition[j];
        row.left_backward_error = modes.left_backward_error[j];
      }
      if (j < modes.parity.size())
        row.parity = modes.parity[j];
      const auto roots = rayleigh_roots(row.d, row.g, row.k, row.n);
      row.rayleigh_defect =
          std::min(std::abs(roots[0] - row.lambda), std::abs(roots[1] - row.lambda)) /
          std::abs(row.lambda);
      row.criterion = row.k * row.d * row.d + row.n * row.d * row.g - row.n * row.n;
    }
    return rows;
  }

  std::array<std::complex<double>, 2> rayleigh_roots(const double d, const double g, const double k,
                                                     const double n)
  {
    const Complex b = Complex(d, g), c = Complex(k, n), root = std::sqrt(b * b - 4. * c);
    // Without cancellation: the larger root first, the other from their product.
    const Complex larger = (std::abs(b + root) > std::abs(b - root) ? -b - root : -b + root) / 2.;
    return {{larger, larger == 0. ? Complex() : c / larger}};
  }

  RayleighParts rayleigh_parts(const Model &model, const EigenPairs &modes)
  {
    RayleighParts result;
    std::vector<unsigned int> body_of_row;
    std::tie(result.bodies, body_of_row) = model.bodies_of_rows();
    const unsigned int n_modes = modes.lambda.size(), n_bodies = result.bodies.size();
    result.n_modes       = n_modes;
    const auto number_of = [&result](const Origin origin)
    {
      const auto known          = std::find(result.origins.begin(), result.origins.end(), origin);
      const unsigned int number = known - result.origins.begin();
      if (known == result.origins.end())
        result.origins.push_back(origin);
      return number;
    };
    // Stiffness and damping may be multiples of one matrix.
    TermList list;
    for (const Term &term : model.terms())
      if (term.order < 2)
      {
        number_of(term.origin);
        list.add(term);
      }
    for (const RelaxationTerm &term : model.relaxation())
      number_of(term.origin);
    result.parts.resize(result.origins.size() * n_bodies * n_modes);

    std::vector<Complex> forms(n_bodies * n_modes); // of a matrix: by body, by mode
    const auto make_forms = [&](const Matrix &matrix)
    {
      const ComplexMultiVector a = multiply(matrix, modes.right);
      std::fill(forms.begin(), forms.end(), 0.);
      for (unsigned int j = 0; j < n_modes; ++j)
        for (unsigned int i = 0; i < a.n_local(); ++i)
          forms[body_of_row[i] * n_modes + j] += std::conj(modes.right(i, j)) * a(i, j);
    };
    for (const RelaxationTerm &term : model.relaxation())
    {
      make_forms(*term.matrix);
      const unsigned int o = number_of(term.origin);
      for (unsigned int b = 0; b < n_bodies; ++b)
        for (unsigned int j = 0; j < n_modes; ++j)
        {
          // (f - 1) c a = (p + i q) a is (p - rho q / w) a + l (q / w) a with l = rho + i w: a
          // stiffness and a damping of this l, as other terms have them.
          const Complex l = modes.lambda[j], f = term.coefficient * (term.factor(l) - 1.);
          const double damping         = l.imag() == 0 ? 0 : f.imag() / l.imag(),
                       stiffness       = f.real() - l.real() * damping;
          const Complex form           = forms[b * n_modes + j];
          std::array<double, 4> &parts = result.at(o, b, j);
          parts[0] += damping * form.real();
          parts[1] += damping * form.imag();
          parts[2] += stiffness * form.real();
          parts[3] += stiffness * form.imag();
        }
    }
    for (unsigned int k = 0; k < list.n_matrices(); ++k)
    {
      make_forms(*list.matrix(k));
      for (const Term &term : list.terms_of(k))
      {
        const unsigned int o = number_of(term.origin), part = term.order == 1 ? 0 : 2;
        for (unsigned int b = 0; b < n_bodies; ++b)
          for (unsigned int j = 0; j < n_modes; ++j)
          {
            result.at(o, b, j)[part] += term.coefficient * forms[b * n_modes + j].real();
            result.at(o, b, j)[part + 1] += term.coefficient * forms[b * n_modes + j].imag();
          }
      }
    }
    if (!result.parts.empty())
      MPI_Allreduce(MPI_IN_PLACE, result.parts.data(), 4 * result.parts.size(), MPI_DOUBLE, MPI_SUM,
                    modes.right.row_range().comm);
    return result;
  }

  std::vector<ModeRow> analyse(const RayleighParts &parts, const EigenPairs &modes,
                               const unsigned int cycle, const double tolerance)
  {
    std::vector<Complex> of_p(parts.n_modes), of_q(parts.n_modes);
    for (unsigned int o = 0; o < parts.origins.size(); ++o)
      for (unsigned int b = 0; b < parts.bodies.size(); ++b)
        for (unsigned int j = 0; j < parts.n_modes; ++j)
        {
          const auto &[d, g, k, n] = parts.at(o, b, j);
          of_p[j] += Complex(d, g);
          of_q[j] += Complex(k, n);
        }
    return analyse(modes, of_p, of_q, cycle, tolerance);
  }

  std::vector<Contribution> contributions(const RayleighParts &parts, const EigenPairs &modes,
                                          const std::vector<ModeRow> &rows)
  {
    std::vector<Contribution> result;
    for (unsigned int j = 0; j < parts.n_modes; ++j)
    {
      const double rho = modes.lambda[j].real(), w = modes.lambda[j].imag(),
                   denominator = 2 * w + rows[j].g;
      // A real eigenvalue has a real vector: nothing is left of the imaginary part.
      const bool is_real = w == 0;
      for (unsigned int o = 0; o < parts.origins.size(); ++o)
        for (unsigned int b = 0; b < parts.bodies.size(); ++b)
        {
          const std::array<double, 4> &form = parts.at(o, b, j);
          if (std::all_of(form.begin(), form.end(), [](const double x) { return x == 0; }))
            continue;
          Contribution c{
              rows[j].mode, name_of(parts.origins[o]), parts.bodies[b], form[0], form[1], form[2],
              form[3]};
          if (is_real)
            c.growth_rate = rho == 0 ? 0 : -(c.d + c.k / rho);
          else
            c.growth_rate = denominator == 0 ? 0 : -(c.d * w + c.n) / denominator;
          c.energy = -M_PI * (c.d * w + c.n);
          result.push_back(c);
        }
    }
    return result;
  }

  void set_bar(ModeRow &row, const ErrorBounds &bars, const unsigned int j, const double tolerance)
  {
    const double algebraic = row.condition_number ? algebraic_error(row.lambda, row.backward_error,
                                                                    *row.condition_number)
                                                  : 0;
    row.corrected          = row.lambda + bars.correction[j];
    row.growth_rate_error  = bars.growth_rate[j] + algebraic;
    row.frequency_error    = (bars.imaginary[j] + algebraic) / (2 * M_PI);
    row.verdict            = verdict(row.lambda, tolerance, *row.growth_rate_error);
  }

  ModeTable assess_stability(const Model &model, const EigenPairs &modes, const unsigned int cycle,
                             const double tolerance, const ErrorBounds &bars)
  {
    const RayleighParts parts = rayleigh_parts(model, modes);
    ModeTable table;
    table.rows = analyse(parts, modes, cycle, tolerance);
    for (unsigned int j = 0; j < bars.growth_rate.size(); ++j)
      set_bar(table.rows[j], bars, j, tolerance);
    table.contributions = contributions(parts, modes, table.rows);
    return table;
  }

  unsigned int least_stable(const std::vector<ModeRow> &rows)
  {
    return std::max_element(rows.begin(), rows.end(),
                            [](const ModeRow &a, const ModeRow &b)
                            { return a.growth_rate() < b.growth_rate(); }) -
           rows.begin();
  }

  std::vector<std::complex<double>> sensitivities(const ParameterDerivative &derivative,
                                                  const EigenPairs &modes)
  {
    const unsigned int n_modes = modes.lambda.size();
    std::vector<Complex> sums(n_modes);
    const TermList terms(derivative.terms);
    for (unsigned int k = 0; k < terms.n_matrices(); ++k)
    {
      const auto form = diagonal_form(modes.left, *terms.matrix(k), modes.right);
      for (const Term &term : terms.terms_of(k))
        for (unsigned int j = 0; j < n_modes; ++j)
          sums[j] += term.coefficient * std::pow(modes.lambda[j], int(term.order)) * form[j];
    }
    for (const ParameterDerivative::OfModulus &term : derivative.moduli)
    {
      const auto form = diagonal_form(modes.left, *term.matrix, modes.right);
      for (unsigned int j = 0; j < n_modes; ++j)
        sums[j] += term.coefficient * term.factor(modes.lambda[j]) * form[j];
    }
    for (unsigned int j = 0; j < n_modes; ++j)
      sums[j] /= -2. * modes.lambda[j];
    return sums;
  }

  std::vector<int> match_modes(const std::vector<ModeRow> &fine, const std::vector<ModeRow> &coarse)
  {
    std::vector<std::vector<double>> costs(fine.size());
    for (unsigned int i = 0; i < fine.size(); ++i)
      for (const ModeRow &row : coarse)
        costs[i].push_back(fine[i].corrected && row.corrected
                               ? std::norm(*fine[i].corrected - *row.corrected)
                               : std::norm(fine[i].lambda - row.lambda));
    return assign(costs, coarse.size());
  }

  std::vector<int> assign(const std::vector<std::vector<double>> &costs,
                          const unsigned int n_columns)
  {
    // The assignment problem by shortest augmenting paths (Jonker and Volgenant, 1987) on a square
    // cost matrix; missing partners cost nothing, in whichever row or column they are.
    const unsigned int n = std::max<std::size_t>(costs.size(), n_columns);
    std::vector<std::vector<double>> cost(n + 1, std::vector<double>(n + 1, 0));
    for (unsigned int i = 0; i < costs.size(); ++i)
      std::copy(costs[i].begin(), costs[i].end(), cost[i + 1].begin() + 1);

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

    std::vector<int> match(costs.size(), -1);
    for (unsigned int j = 1; j <= n_columns; ++j)
      if (row_of[j] <= costs.size())
        match[row_of[j] - 1] = j - 1;
    return match;
  }
} // namespace squeal
