#include <squeal/base/text.h>
#include <squeal/linalg/gmres.h>
#include <squeal/studies/frequency_response.h>

#include <algorithm>
#include <cmath>
#include <limits>

// First HarmonicSolver: direct solutions at one frequency, by GMRES with factors of a frequency
// nearby. Then what the modal method adds: the sum over the modes, polynomials through what is left
// of direct solutions, and the errors of these. frequency_response() adds direct solutions until
// the errors are within the tolerance.
namespace squeal
{
  using Complex = std::complex<double>;

  namespace
  {
    /// Real and imaginary part of one column below each other.
    MultiVector stacked(const RowRange &rows, const double *re, const double *im)
    {
      MultiVector result({rows.comm, 2 * rows.begin, 2 * rows.end, 2 * rows.size}, 1);
      std::copy_n(re, rows.n_local(), result.data());
      std::copy_n(im, rows.n_local(), result.data() + rows.n_local());
      return result;
    }
    MultiVector two_columns(const RowRange &rows, const MultiVector &stacked)
    {
      MultiVector result(rows, 2);
      std::copy_n(stacked.data(), std::size_t(2) * rows.n_local(), result.data());
      return result;
    }
    MultiVector stacked(const MultiVector &columns)
    {
      return stacked(columns.row_range(), columns.column(0), columns.column(1));
    }
  } // namespace

  HarmonicSolver::HarmonicSolver(const EquationsOfMotion &equations, const Sectors &sectors)
      : equations(equations), given(sectors)
  {
  }

  /// A and B as sums of terms: real and imaginary part of (i w)^order, and of f - 1.
  std::vector<std::vector<Term>> HarmonicSolver::dynamic_stiffness(const double omega) const
  {
    std::vector<Term> real, imaginary;
    for (Term term : equations.terms)
    {
      if (!term.matrix || !*term.matrix)
        continue;
      const bool is_real = term.order != 1;
      term.coefficient *= term.order == 0 ? 1 : term.order == 1 ? omega : -omega * omega;
      term.order = 0;
      (is_real ? real : imaginary).push_back(std::move(term));
    }
    for (const RelaxationTerm &term : equations.relaxation)
    {
      if (term.low_rank)
        continue;
      const Complex beyond = term.coefficient * (term.factor(Complex(0, omega)) - 1.);
      real.push_back({term.origin, 0, beyond.real(), term.matrix});
      imaginary.push_back({term.origin, 0, beyond.imag(), term.matrix});
    }
    return {std::move(real), std::move(imaginary)};
  }

  ComplexMultiVector HarmonicSolver::solve(const double omega, const MultiVector &forces,
                                           const ComplexMultiVector &start)
  {
    const std::vector<std::vector<Term>> sums = dynamic_stiffness(omega);
    const std::vector<Sector> sectors = (given.keep(sums) ? given : Sectors()).all(equations.rows);
    parts.resize(sectors.size());
    ComplexMultiVector result(equations.rows, forces.n_columns());
    for (unsigned int s = 0; s < sectors.size(); ++s)
    {
      const Sector &sector = sectors[s];
      ComplexMultiVector x(sector.restrict(start.re), sector.restrict(start.im));
      const std::vector<Matrix> of_sector = sector.sums(sums);
      std::vector<Factored> dense;
      for (const RelaxationTerm &term : equations.relaxation)
        if (term.low_rank)
          dense.push_back({term.coefficient * (term.factor(Complex(0, omega)) - 1.),
                           sector.restrict(term.low_rank)});
      solve(omega, of_sector[0], of_sector[1], dense, sector.restrict(forces),
            largest_entry(forces), parts[s], x);
      result.re += sector.expand(x.re);
      result.im += sector.expand(x.im);
    }
    return result;
  }

  void HarmonicSolver::solve(const double omega, const Matrix &A, const Matrix &B,
                             const std::vector<Factored> &dense, const MultiVector &forces,
                             const double largest_force, Part &part, ComplexMultiVector &x)
  {
    const RowRange &rows = forces.row_range();
    const auto apply     = [&](const MultiVector &x)
    {
      const MultiVector both = two_columns(rows, x);
      MultiVector result     = multiply(A, both);
      if (B)
      {
        const MultiVector turned = multiply(B, both);
        for (unsigned int i = 0; i < rows.n_local(); ++i)
        {
          result.column(0)[i] -= turned.column(1)[i];
          result.column(1)[i] += turned.column(0)[i];
        }
      }
      for (const auto &[factor, matrix] : dense)
      {
        const MultiVector image = multiply(matrix, both);
        for (unsigned int i = 0; i < rows.n_local(); ++i)
        {
          const Complex y = factor * Complex(image.column(0)[i], image.column(1)[i]);
          result.column(0)[i] += y.real();
          result.column(1)[i] += y.imag();
        }
      }
      return stacked(result);
    };
    const auto precondition = [&](const MultiVector &x)
    { return stacked(part.factors->solve(two_columns(rows, x))); };

    // An iteration costs two solutions; factors cost as much as some forty.
    constexpr double tolerance = 1e-11, largest_backward_error = 1e-9;
    constexpr unsigned int most_with_others = 20, most_iterations = 300;
    constexpr double nearby = 0.02;
    double norm             = A.infinity_norm() + B.infinity_norm();
    for (const auto &[factor, matrix] : dense)
      norm += std::abs(factor) * matrix.infinity_norm();
    bool has_own_factors = false;
    const std::vector<double> zeros(rows.n_local(), 0.);
    for (unsigned int k = 0; k < forces.n_columns(); ++k)
    {
      const MultiVector b = stacked(rows, forces.column(k), zeros.data());
      if (largest_entry(b) <= 1e-14 * largest_force) // of other sectors
      {
        std::fill_n(x.re.column(k), rows.n_local(), 0.);
        std::fill_n(x.im.column(k), rows.n_local(), 0.);
        continue;
      }
      double error      = std::nan("");
      const auto solves = [&](const unsigned int n)
      {
        MultiVector solution = stacked(rows, x.re.column(k), x.im.column(k));
        const bool converged = bool(gmres(apply, precondition, b, solution, tolerance, n));
        error                = largest_entry(difference(b, apply(solution))) /
                (norm * largest_entry(solution) + largest_entry(b));
        std::copy_n(solution.data(), rows.n_local(), x.re.column(k));
        std::copy_n(solution.data() + rows.n_local(), rows.n_local(), x.im.column(k));
        return converged && error <= largest_backward_error;
      };
      const bool is_near = part.factors && std::abs(omega - part.factorised_at) <=
                                               nearby * std::max(omega, part.factorised_at);
      if (is_near && !has_own_factors && solves(most_with_others))
        continue;
      if (!has_own_factors)
      {
        part.factors.reset(); // two of them would double the memory
        part.factors = std::make_unique<const Factorization>(
            A, Factorization::Kind::lu,
            "the dynamic stiffness at " + number(omega / (2 * M_PI), 6) + " Hz");
        has_own_factors    = true;
        part.factorised_at = omega;
        ++n_factorizations_;
      }
      if (!solves(most_iterations))
        throw SolverError("The frequency response at " + number(omega / (2 * M_PI), 6) +
                          " Hz does not converge: backward error " + number(error, 3) +
                          ". A frequency beside it may do.");
    }
  }

  namespace
  {
    /// H by forces and observations at one frequency.
    using Values = std::vector<Complex>;

    /// e_j^T x_k at k * n + j.
    Values observed(const MultiVector &observations, const ComplexMultiVector &x)
    {
      const std::vector<double> re = inner_products(observations, x.re).values,
                                im = inner_products(observations, x.im).values;
      Values result;
      for (std::size_t i = 0; i < re.size(); ++i)
        result.emplace_back(re[i], im[i]);
      return result;
    }

    /// The sum over the modes.
    class ModalSum
    {
    public:
      ModalSum(const EigenPairs &modes, const MultiVector &forces, const MultiVector &observations,
               const bool with_conjugates)
          : modes(modes), n_forces(forces.n_columns()), n_observations(observations.n_columns()),
            with_conjugates(with_conjugates)
      {
        if (modes.empty())
          return;
        seen    = observed(observations, modes.right);
        excited = observed(forces, modes.left);
      }

      /// What is observed.
      Values operator()(const double omega) const
      {
        Values sum(std::size_t(n_forces) * n_observations);
        for (unsigned int m = 0; m < modes.size(); ++m)
          for (unsigned int k = 0; k < n_forces; ++k)
          {
            const auto [of_mode, of_conjugate] = amplitudes(m, k, omega);
            for (unsigned int j = 0; j < n_observations; ++j)
            {
              const Complex x = seen[std::size_t(m) * n_observations + j];
              sum[std::size_t(k) * n_observations + j] += of_mode * x + of_conjugate * std::conj(x);
            }
          }
        return sum;
      }

      /// The motion under each force.
      ComplexMultiVector motions(const double omega) const
      {
        const unsigned int n = modes.size();
        // (a + b) Re x + i (a - b) Im x for a x + b conj(x)
        std::vector<double> re_of_re, re_of_im, im_of_re, im_of_im;
        for (unsigned int k = 0; k < n_forces; ++k)
          for (unsigned int m = 0; m < n; ++m)
          {
            const auto [a, b]   = amplitudes(m, k, omega);
            const Complex of_re = a + b, of_im = Complex(0, 1) * (a - b);
            re_of_re.push_back(of_re.real());
            im_of_re.push_back(of_re.imag());
            re_of_im.push_back(of_im.real());
            im_of_im.push_back(of_im.imag());
          }
        ComplexMultiVector x(combine(modes.right.re, re_of_re, n_forces),
                             combine(modes.right.re, im_of_re, n_forces));
        x.re += combine(modes.right.im, re_of_im, n_forces);
        x.im += combine(modes.right.im, im_of_im, n_forces);
        return x;
      }

    private:
      /// a and b of a x + b conj(x).
      std::pair<Complex, Complex> amplitudes(const unsigned int m, const unsigned int k,
                                             const double omega) const
      {
        const Complex l      = modes.lambda[m], s(0, omega);
        const Complex of_all = std::conj(excited[std::size_t(m) * n_forces + k]) / (2. * l);
        return {of_all / (s - l), with_conjugates && l.imag() != 0
                                      ? std::conj(of_all) / (s - std::conj(l))
                                      : Complex(0)};
      }

      const EigenPairs &modes;
      const unsigned int n_forces, n_observations;
      const bool with_conjugates;
      Values seen, excited;
    };

    /// A polynomial through values at points that are added one by one, each where the product of
    /// distances to those before is largest (Leja), in barycentric form.
    class LejaInterpolation
    {
    public:
      LejaInterpolation(const double first, const double last) : middle((first + last) / 2)
      {
        // Distances in these units keep products in range.
        unit                     = std::max((last - first) / 4, std::numeric_limits<double>::min());
        constexpr unsigned int n = 2000;
        for (unsigned int i = 0; i <= n; ++i)
          candidates.push_back(middle - 2 * unit * std::cos(M_PI * i / n));
        products.assign(candidates.size(), 1.);
      }
      /// Where the next value is wanted.
      double next() const
      {
        if (points.empty())
          return candidates.back(); // modes that are not known are nearest there
        return candidates[std::max_element(products.begin(), products.end()) - products.begin()];
      }
      void add(const double x, Values y)
      {
        for (unsigned int i = 0; i < candidates.size(); ++i)
          products[i] *= std::abs(candidates[i] - x) / unit;
        double own = 1;
        for (unsigned int j = 0; j < points.size(); ++j)
        {
          const double d = (x - points[j]) / unit;
          weights[j] /= -d;
          own /= d;
        }
        points.push_back(x);
        weights.push_back(own);
        values.push_back(std::move(y));
      }
      Values operator()(const double x) const
      {
        Values sum(values.front().size());
        double total = 0;
        for (unsigned int j = 0; j < points.size(); ++j)
        {
          if (x == points[j])
            return values[j];
          const double weight = weights[j] / (x - points[j]);
          total += weight;
          for (unsigned int i = 0; i < sum.size(); ++i)
            sum[i] += weight * values[j][i];
        }
        for (Complex &value : sum)
          value /= total;
        return sum;
      }
      bool empty() const
      {
        return points.empty();
      }

    private:
      double middle, unit;
      std::vector<double> candidates, products, points, weights;
      std::vector<Values> values;
    };

    /// Differences of interpolated and direct values, one after the other, and what they are
    /// measured by: the geometric mean of the direct ones.
    class Differences
    {
    public:
      Differences(const unsigned int n_forces, const unsigned int n_observations)
          : n_observations(n_observations), logarithms(std::size_t(n_forces) * n_observations)
      {
      }
      void add(const Values &difference, const Values &direct)
      {
        all.emplace_back();
        for (std::size_t i = 0; i < difference.size(); ++i)
        {
          all.back().push_back(std::abs(difference[i]));
          logarithms[i] += std::log(std::max(std::abs(direct[i]), 1e-300));
        }
      }
      /// a / (1 - q), a the largest of the last three, which fall by q from one to the next since
      /// the three before; empty without these. It is what all that would come after adds up to.
      std::vector<double> errors() const
      {
        if (all.size() < 6)
          return {};
        std::vector<double> result;
        for (std::size_t i = 0; i < logarithms.size(); ++i)
        {
          const auto largest = [&](const std::size_t end) {
            return std::max({all[end - 1][i], all[end - 2][i], all[end - 3][i]});
          };
          const double last = largest(all.size()), before = largest(all.size() - 3);
          constexpr double slowest = 0.97;
          const double q = last < before ? std::min(std::cbrt(last / before), slowest) : slowest;
          result.push_back(last / (1 - q));
        }
        return result;
      }
      /// Whether the errors are within the tolerance, relative to the means.
      bool are_within(const double tolerance, const std::vector<double> &errors) const
      {
        bool holds = !errors.empty();
        for (std::size_t i = 0; i < errors.size(); ++i)
        {
          const auto of_force       = logarithms.begin() + i / n_observations * n_observations;
          const double most         = *std::max_element(of_force, of_force + n_observations);
          constexpr double smallest = 1e-5; // what vanishes by symmetry is rounding
          const double mean         = std::max(std::exp(logarithms[i] / all.size()),
                                               smallest * std::exp(most / all.size()));
          holds &= errors[i] <= tolerance * mean;
        }
        return holds;
      }

    private:
      const unsigned int n_observations;
      std::vector<double> logarithms; ///< summed, of the direct values
      std::vector<std::vector<double>> all;
    };
  } // namespace

  FrequencyResponse frequency_response(const EquationsOfMotion &equations, const Sectors &sectors,
                                       const EigenPairs &modes, const MultiVector &forces,
                                       const MultiVector &observations,
                                       const std::vector<double> &frequencies,
                                       const ResponseOptions &options)
  {
    FrequencyResponse result{frequencies, forces.n_columns(), observations.n_columns(), {}, {}, 0};
    const std::size_t n = std::size_t(result.n_forces) * result.n_observations;
    HarmonicSolver solver(equations, sectors);
    const ModalSum known(modes, forces, observations, equations.relaxation.empty());
    const auto direct = [&](const double frequency)
    {
      options.progress(text_of("  response: direct solution ", ++result.n_direct, " at ",
                               number(frequency, 5), " Hz"));
      const double omega = 2 * M_PI * frequency;
      // Modes nearby are what iterations are slow for.
      return observed(observations,
                      solver.solve(omega, forces,
                                   modes.empty()
                                       ? ComplexMultiVector(equations.rows, forces.n_columns())
                                       : known.motions(omega)));
    };

    if (options.method == ResponseMethod::modal && frequencies.size() > 1)
    {
      LejaInterpolation rest(frequencies.front(), frequencies.back());
      const auto power = [&](const double frequency)
      { return equations.may_move_rigidly ? -std::pow(2 * M_PI * frequency, 2) : 1.; };
      const auto interpolated = [&](const double frequency)
      {
        Values value       = known(2 * M_PI * frequency);
        const Values added = rest(frequency);
        for (std::size_t i = 0; i < n; ++i)
          value[i] += added[i] / power(frequency);
        return value;
      };
      Differences differences(result.n_forces, result.n_observations);
      constexpr unsigned int most_points = 100;
      while (result.n_direct < std::min<std::size_t>(most_points, frequencies.size()))
      {
        const double frequency = rest.next();
        const Values exact = direct(frequency), of_modes = known(2 * M_PI * frequency);
        Values sizes, remainder;
        for (std::size_t i = 0; i < n; ++i)
        {
          sizes.push_back(exact[i] * power(frequency));
          remainder.push_back((exact[i] - of_modes[i]) * power(frequency));
        }
        if (!rest.empty())
        {
          Values difference = rest(frequency);
          for (std::size_t i = 0; i < n; ++i)
            difference[i] -= remainder[i];
          differences.add(difference, sizes);
        }
        rest.add(frequency, std::move(remainder));
        const std::vector<double> errors = differences.errors();
        if (!differences.are_within(options.tolerance, errors))
          continue;
        for (const double f : frequencies)
        {
          const Values value = interpolated(f);
          result.values.insert(result.values.end(), value.begin(), value.end());
          for (const double error : errors)
            result.errors.push_back(error / std::abs(power(f)));
        }
        result.n_factorizations = solver.n_factorizations();
        return result;
      }
      result.n_direct = 0;
    }
    for (const double f : frequencies)
    {
      const Values value = direct(f);
      result.values.insert(result.values.end(), value.begin(), value.end());
    }
    result.errors.assign(result.values.size(), 0.);
    result.n_factorizations = solver.n_factorizations();
    return result;
  }
} // namespace squeal
