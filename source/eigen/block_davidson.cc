#include <squeal/base/memory.h>
#include <squeal/eigen/block_davidson.h>
#include <squeal/eigen/left_vectors.h>
#include <squeal/linalg/dense.h>
#include <squeal/projection/backward_error.h>
#include <squeal/projection/search_space.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>
#include <utility>

namespace squeal
{
  using Complex = std::complex<double>;

  namespace
  {
    /// Of each complex vector a + i b, turned, the longest real part; how much longer, squared, the
    /// whole is.
    struct MainParts
    {
      MultiVector columns, pressures; ///< of residuals, and what was added to them, turned alike
      std::vector<double> shares;
    };

    /// Right or left vectors with what is left of their equations.
    struct Vectors
    {
      EigenPairs pairs; ///< of the problem or of its transpose
      MainParts residual;
    };

    MainParts main_parts(const ComplexMultiVector &x, const ComplexMultiVector &pressures)
    {
      const unsigned int n_pairs = x.n_columns(), n = x.n_local();
      std::vector<std::pair<const double *, const double *>> parts;
      for (unsigned int j = 0; j < n_pairs; ++j)
        parts.push_back({x.re.column(j), x.im.column(j)});
      const std::vector<MainPart> turned = main_parts(parts, x.row_range());
      MainParts result{
          MultiVector(x.row_range(), n_pairs), MultiVector(x.row_range(), n_pairs), {}};
      for (unsigned int j = 0; j < n_pairs; ++j)
      {
        const auto &[turn, longer, shorter] = turned[j];
        result.shares.push_back(longer > 0 ? 1 + shorter / longer : 1);
        const std::array<std::pair<MultiVector *, const ComplexMultiVector *>, 2> both = {
            {{&result.columns, &x}, {&result.pressures, &pressures}}};
        for (const auto &[to, from] : both)
        {
          add_multiple(turn.real(), from->re.column(j), n, to->column(j));
          add_multiple(-turn.imag(), from->im.column(j), n, to->column(j));
        }
      }
      return result;
    }

    class Davidson
    {
    public:
      Davidson(const DavidsonProblem &problem, const EigensolverOptions &options)
          : problem(problem), equations(problem.equations), adjoint(adjoint_of(equations)),
            options(options), of_right(equations), of_left(adjoint), space(equations.rows)
      {
      }

      EigenSolution run(MultiVector start);

    private:
      /// Adds what the columns add to the span of the basis, moved to where they satisfy the
      /// constraints.
      void expand(MultiVector columns);
      /// Those in the disc, by ascending frequency.
      std::vector<DensePair> ritz_pairs() const;
      bool is_wanted(const Complex &l) const
      {
        return l.imag() <= options.max_imaginary && (l.imag() > 0 || l.real() > 0) &&
               std::abs(l) > rigid_body_limit(options.max_imaginary);
      }
      Vectors vectors_of(const std::vector<DensePair> &ritz, bool left) const;
      /// A residual r and B r.
      struct Correction
      {
        MainParts residual;
        MultiVector of_b;
      };
      /// Those of right vectors and, unless they are the same, of left ones.
      std::vector<Correction> corrections_of(const std::vector<DensePair> &ritz) const;
      /// The numbers of the pairs whose eigenvalues are not accurate. @p worst becomes the largest
      /// estimate.
      std::vector<unsigned int> inaccurate(const std::vector<DensePair> &ritz,
                                           const std::vector<Correction> &corrections,
                                           double &worst);
      /// The relative error of an eigenvalue whose estimate is given: times the factor by which the
      /// estimate was too small in the step before, for the eigenvalue that has become this one.
      double error_of(const Complex &l, double estimated) const;
      /// The basis becomes what the pairs of two steps span; the first ones are then given in it.
      void restart(std::vector<DensePair> &ritz, const std::vector<DensePair> &before);
      /// Right and left vectors of all given pairs.
      EigenPairs modes_of(const std::vector<DensePair> &wanted) const;
      void check_memory(unsigned int n_vectors) const;
      unsigned int n_columns() const
      {
        return space.n_columns();
      }

      const DavidsonProblem &problem;
      const QuadraticEigenproblem &equations;
      const QuadraticEigenproblem adjoint;
      const EigensolverOptions &options;
      const BackwardError of_right, of_left;
      SearchSpace space;   ///< U
      DenseMatrix m, p, q; ///< Z^T M U, Z^T P U, Z^T Q U
      DenseMatrix mass;    ///< U^T M U
      struct Estimate
      {
        Complex lambda;
        double relative; ///< error
      };
      std::vector<Estimate> last_estimates;
      static constexpr unsigned int at_a_time = 8; ///< pairs whose vectors are in memory
    };

    void Davidson::expand(MultiVector columns)
    {
      problem.constraints.satisfy(columns, false);
      if (!equations.compliant)
        clear_pressures(equations.n_local_constraints, columns);
      const unsigned int old = n_columns();
      // What columns add by less than a millionth of their length is left out: rounding of the
      // constraints would grow as much.
      columns              = space.add(std::move(columns), {1e-6, 1e-6});
      const unsigned int n = columns.n_columns();
      MultiVector tests    = columns;
      problem.constraints.satisfy(tests, true);
      const auto extend =
          [&](const DenseMatrix &known, const DenseMatrix &right, const DenseMatrix &lower)
      {
        return grow(known, old + n,
                    [&](unsigned int, unsigned int, const unsigned int column, unsigned int)
                    { return column == old ? right : lower; });
      };
      // Z^T A U of the images of the new u and z: U^T Pi^T A u, Pi^T relieving forces, and
      // (A^T z)^T U.
      const auto project =
          [&](const DenseMatrix &known, MultiVector image, const MultiVector &of_tests)
      {
        problem.constraints.relieve(image, false);
        return extend(known, DenseMatrix(old + n, n, inner_products(space.basis(), image)),
                      DenseMatrix(n, old, inner_products(of_tests, 0, n, space.basis(), 0, old)));
      };
      MultiVector image = multiply(equations.M, columns);
      const DenseMatrix right(old + n, n, inner_products(space.basis(), image));
      mass = extend(mass, right, transposed(with_rows(right, old)));
      m    = project(m, std::move(image), multiply(adjoint.M, tests));
      if (equations.P)
        p = project(p, multiply(equations.P, columns), multiply(adjoint.P, tests));
      q = project(q, multiply(equations.Q, columns), multiply(adjoint.Q, tests));
    }

    std::vector<DensePair> Davidson::ritz_pairs() const
    {
      const double radius = search_radius(options.max_imaginary);
      std::vector<DensePair> result;
      for (DensePair &pair : quadratic_eigenpairs(m, p, q, 0, radius, true))
        if (std::abs(pair.lambda) <= radius)
          result.push_back(std::move(pair));
      std::sort(result.begin(), result.end(),
                [](const DensePair &a, const DensePair &b)
                { return precedes(a.lambda, b.lambda); });
      return result;
    }

    Vectors Davidson::vectors_of(const std::vector<DensePair> &ritz, const bool left) const
    {
      const unsigned int n_pairs = ritz.size(), n = equations.rows.n_local();
      std::vector<double> re, im;
      Vectors result;
      for (const DensePair &pair : ritz)
      {
        result.pairs.lambda.push_back(pair.lambda);
        std::vector<Complex> coefficients = left ? pair.left : pair.vector;
        coefficients.resize(n_columns()); // of a smaller basis
        for (const Complex &c : coefficients)
        {
          re.push_back(c.real());
          im.push_back(c.imag());
        }
      }
      const auto vectors = [&](const std::vector<double> &coefficients)
      {
        MultiVector x = combine(space.basis(), coefficients, n_pairs);
        if (left)
          problem.constraints.satisfy(x, true);
        return x;
      };
      EigenPairs &pairs           = result.pairs;
      pairs.right                 = {vectors(re), vectors(im)};
      const BackwardError &error  = left ? of_left : of_right;
      ComplexMultiVector residual = error.residuals(pairs);
      // Pressures of a compliant contact are in the basis; others are what the residual tells.
      if (equations.compliant)
        pairs.backward_error = error.errors(pairs, residual);
      const ComplexMultiVector pressures(problem.constraints.relieve(residual.re, left),
                                         problem.constraints.relieve(residual.im, left));
      if (!equations.compliant)
      {
        for (unsigned int k = 0; k < n_pairs; ++k)
        {
          add_multiple(1, pressures.re.column(k), n, pairs.right.re.column(k));
          add_multiple(1, pressures.im.column(k), n, pairs.right.im.column(k));
        }
        pairs.backward_error = error.errors(pairs, residual);
      }
      result.residual = main_parts(residual, pressures);
      return result;
    }

    std::vector<Davidson::Correction>
    Davidson::corrections_of(const std::vector<DensePair> &ritz) const
    {
      std::vector<Correction> result;
      for (const bool left : {false, true})
      {
        if (left && problem.is_conservative)
          continue;
        Correction all{{MultiVector(equations.rows, 0), MultiVector(equations.rows, 0), {}},
                       MultiVector(equations.rows, 0)};
        for (unsigned int first = 0; first < ritz.size(); first += at_a_time)
        {
          const auto begin     = ritz.begin() + first,
                     end       = begin + std::min<std::size_t>(at_a_time, ritz.size() - first);
          const MainParts some = vectors_of({begin, end}, left).residual;
          all.residual.columns.append(some.columns);
          all.residual.pressures.append(some.pressures);
          all.residual.shares.insert(all.residual.shares.end(), some.shares.begin(),
                                     some.shares.end());
          all.of_b.append(problem.precondition(some.columns));
        }
        result.push_back(std::move(all));
      }
      return result;
    }

    double Davidson::error_of(const Complex &l, const double estimated) const
    {
      constexpr double safety = 2;
      // Before there is anything to compare with.
      constexpr double unknown = 10;
      const auto before        = std::min_element(last_estimates.begin(), last_estimates.end(),
                                                  [&](const Estimate &a, const Estimate &b) {
                                             return std::abs(a.lambda - l) < std::abs(b.lambda - l);
                                           });
      if (before == last_estimates.end())
        return safety * unknown * estimated;
      // The error before was change/(1 - rate), rate being what a step leaves.
      const double change = std::abs(before->lambda - l) / std::abs(l),
                   rate   = std::min(estimated / before->relative, 0.95);
      return safety * std::max(1., change / before->relative) / (1 - rate) * estimated;
    }

    std::vector<unsigned int> Davidson::inaccurate(const std::vector<DensePair> &ritz,
                                                   const std::vector<Correction> &corrections,
                                                   double &worst)
    {
      const unsigned int n_pairs = ritz.size(), n_sides = corrections.size();
      std::vector<double> energies(n_sides * n_pairs); // r^H B r, s^H B s
      for (unsigned int j = 0; j < n_pairs; ++j)
        for (unsigned int side = 0; side < n_sides; ++side)
        {
          const MainParts &residual = corrections[side].residual;
          const double *r = residual.columns.column(j), *t = corrections[side].of_b.column(j);
          for (unsigned int i = 0; i < equations.rows.n_local(); ++i)
            energies[n_sides * j + side] += residual.shares[j] * r[i] * t[i];
        }
      MPI_Allreduce(MPI_IN_PLACE, energies.data(), energies.size(), MPI_DOUBLE, MPI_SUM,
                    equations.rows.comm);
      // |U c|_M^2
      const auto mass_of = [this](const std::vector<Complex> &c)
      {
        double sum = 0;
        for (unsigned int j = 0; j < c.size(); ++j)
          for (unsigned int i = 0; i < c.size(); ++i)
            sum += (std::conj(c[i]) * mass(i, j) * c[j]).real();
        return sum;
      };
      worst = 0;
      std::vector<unsigned int> result;
      std::vector<Estimate> estimates;
      for (unsigned int j = 0; j < n_pairs; ++j)
      {
        const Complex l        = ritz[j].lambda;
        const double estimated = std::sqrt(energies[n_sides * j] * energies[n_sides * (j + 1) - 1] /
                                           (mass_of(ritz[j].vector) * mass_of(ritz[j].left))) /
                                 (2 * std::norm(l));
        if (!std::isfinite(estimated))
          throw SolverError("The error of an eigenvalue could not be estimated: multigrid is no "
                            "positive definite preconditioner here.",
                            {Failure::multigrid_indefinite});
        const double error = error_of(l, estimated);
        worst              = std::max(worst, error);
        estimates.push_back({l, estimated});
        if (error > options.tolerance)
          result.push_back(j);
      }
      last_estimates = std::move(estimates);
      return result;
    }

    void Davidson::restart(std::vector<DensePair> &ritz, const std::vector<DensePair> &before)
    {
      // Eigenvalues change by the energy of what is dropped, which may be rough.
      const double dropped = 1e-4 * std::sqrt(options.tolerance);
      const unsigned int n = n_columns();
      DenseMatrix spanning(n, 4 * (ritz.size() + before.size()));
      unsigned int column = 0;
      const auto add      = [&](const std::vector<Complex> &coefficients)
      {
        double square = 0;
        for (const Complex &c : coefficients)
          square += std::norm(c);
        for (unsigned int i = 0; i < coefficients.size(); ++i)
        {
          spanning(i, column)     = coefficients[i].real() / std::sqrt(square);
          spanning(i, column + 1) = coefficients[i].imag() / std::sqrt(square);
        }
        column += 2;
      };
      for (const auto *pairs : {static_cast<const std::vector<DensePair> *>(&ritz), &before})
        for (const DensePair &pair : *pairs)
        {
          add(pair.vector);
          add(pair.left);
        }
      DenseMatrix vectors               = outer_product(spanning, spanning);
      const std::vector<double> squares = symmetric_eigen(vectors);
      const unsigned int n_dropped =
          std::upper_bound(squares.begin(), squares.end(), dropped * dropped) - squares.begin();
      const DenseMatrix turn(
          n, n - n_dropped,
          {vectors.values.begin() + std::size_t(n) * n_dropped, vectors.values.end()});

      space.turn(turn);
      for (DenseMatrix *matrix : {&m, &p, &q, &mass})
        if (matrix->n_rows > 0)
        {
          DenseMatrix half(n, turn.n_columns), turned(turn.n_columns, turn.n_columns);
          gemm(false, 1, *matrix, turn, 0, half);
          gemm(true, 1, turn, half, 0, turned);
          *matrix = std::move(turned);
        }
      for (DensePair &pair : ritz)
        for (std::vector<Complex> *coefficients : {&pair.vector, &pair.left})
        {
          std::vector<Complex> turned(turn.n_columns);
          for (unsigned int k = 0; k < turn.n_columns; ++k)
            for (unsigned int i = 0; i < n; ++i)
              turned[k] += turn(i, k) * (*coefficients)[i];
          *coefficients = std::move(turned);
        }
    }

    EigenPairs Davidson::modes_of(const std::vector<DensePair> &wanted) const
    {
      EigenPairs modes      = vectors_of(wanted, false).pairs;
      EigenPairs transposed = problem.is_conservative ? modes : vectors_of(wanted, true).pairs;
      if (problem.is_conservative) // Q(l)^T is the conjugate of Q(l)
        transposed.right.conjugate();
      attach_left_vectors(equations, std::move(transposed), modes);
      return modes;
    }

    void Davidson::check_memory(const unsigned int n_vectors) const
    {
      int n_ranks = 0;
      MPI_Comm_size(equations.rows.comm, &n_ranks);
      const double mib =
          double(n_vectors) * equations.rows.size * sizeof(double) / n_ranks / (1024. * 1024.);
      if (memory_load(mib, equations.rows.comm) > 1)
        throw SolverError("Davidson's method is expected to keep " + std::to_string(n_vectors) +
                              " vectors, " + std::to_string(std::lround(mib)) +
                              " MiB for each rank; that is not there.",
                          {Failure::davidson_too_large});
    }

    EigenSolution Davidson::run(MultiVector start)
    {
      constexpr unsigned int max_steps = 300;
      expand(std::move(start));
      const unsigned int n_start = n_columns(), n_expected = ritz_pairs().size();
      // Restarts that come after few steps lose much.
      const auto largest = [n_start](const unsigned int n_pairs)
      { return n_start + std::max(60u, 6 * n_pairs); };
      // The basis, once more while it is turned; corrections, and what becomes of some vectors.
      check_memory(2 * largest(n_expected) + 4 * n_expected + 16 * at_a_time);
      std::vector<DensePair> before;
      std::vector<Complex> accurate;
      unsigned int n_cycles = 0;
      double worst          = 0;
      EigenSolution solution;
      const auto correct = [&](const unsigned int step) -> std::optional<MultiVector>
      {
        std::vector<DensePair> ritz = ritz_pairs(), wanted, open;
        for (const DensePair &pair : ritz)
          if (is_wanted(pair.lambda))
            wanted.push_back(pair);
        // Accurate eigenvalues stay where they are.
        std::vector<Complex> at_rest = std::exchange(accurate, {});
        for (const DensePair &pair : wanted)
        {
          const auto found = std::find_if(
              at_rest.begin(), at_rest.end(),
              [&](const Complex &l)
              { return std::abs(l - pair.lambda) <= 2 * options.tolerance * std::abs(l); });
          if (found == at_rest.end())
            open.push_back(pair);
          else
          {
            accurate.push_back(*found);
            at_rest.erase(found);
          }
        }
        const std::vector<Correction> corrections = corrections_of(open);
        n_cycles += corrections.size() * open.size();
        const std::vector<unsigned int> moving = inaccurate(open, corrections, worst);
        for (unsigned int j = 0; j < open.size(); ++j)
          if (std::find(moving.begin(), moving.end(), j) == moving.end())
            accurate.push_back(open[j].lambda);
        std::ostringstream text;
        text.precision(2);
        text << "  Davidson step " << step + 1 << ": " << wanted.size() - moving.size() << " of "
             << wanted.size() << " eigenvalues accurate, error " << worst << ", subspace of "
             << n_columns();
        options.progress(text.str());
        if (moving.empty())
        {
          solution.modes         = modes_of(wanted);
          solution.cost.n_solves = n_cycles;
          return std::nullopt;
        }
        MultiVector added(equations.rows, 0);
        for (const unsigned int j : moving)
          for (const Correction &c : corrections)
            added.append(difference(c.residual.pressures.columns(j, 1), c.of_b.columns(j, 1)));
        if (n_columns() + added.n_columns() > largest(ritz.size()))
          restart(ritz, before);
        before = std::move(ritz);
        return added;
      };
      if (expand_until_accurate(max_steps, correct,
                                [&](MultiVector added) { expand(std::move(added)); }))
        return solution;
      std::ostringstream message;
      message << "Davidson's method has not made all eigenvalues accurate in " << max_steps
              << " steps; the largest estimated relative error is " << worst << ".";
      throw SolverError(message.str(), {Failure::davidson_stalled});
    }
  } // namespace

  EigenSolution block_davidson(const DavidsonProblem &problem, MultiVector start,
                               const EigensolverOptions &options)
  {
    return Davidson(problem, options).run(std::move(start));
  }
} // namespace squeal
