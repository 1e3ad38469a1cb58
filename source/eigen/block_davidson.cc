#include <squeal/base/memory.h>
#include <squeal/base/text.h>
#include <squeal/eigen/block_davidson.h>
#include <squeal/eigen/left_vectors.h>
#include <squeal/linalg/dense.h>
#include <squeal/projection/backward_error.h>
#include <squeal/projection/davidson.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <sstream>
#include <utility>

// Modes without factors. MatrixFreeSearch brings to Davidson what is its own: one basis for right
// and left vectors, whose test vectors are moved to the left constraints and not kept (method()).
// A step takes Ritz pairs of the disc (ritz_pairs()), leaves those at rest (open_pairs()), computes
// residuals and B r of the others (residuals_of()), estimates errors of eigenvalues from these
// (inaccurate()), and gives B r of what is not accurate to the engine; a large basis is turned to
// what the pairs of two steps span (restart()).

namespace squeal
{
  using Complex = std::complex<double>;

  namespace
  {
    /// Residuals r of right or left vectors, of each, turned, the longer one of its two real
    /// directions; B r and the pressures that were added to r, turned alike.
    struct Residuals
    {
      MultiVector columns, pressures, of_b;
      std::vector<double> shares; ///< how much longer, squared, the whole is
    };

    /// Re(t_j x_j).
    MultiVector real_parts(const std::vector<Complex> &turns, const ComplexMultiVector &x)
    {
      MultiVector result(x.row_range(), x.n_columns());
      for (unsigned int j = 0; j < turns.size(); ++j)
      {
        add_multiple(turns[j].real(), x.re.column(j), x.n_local(), result.column(j));
        add_multiple(-turns[j].imag(), x.im.column(j), x.n_local(), result.column(j));
      }
      return result;
    }

    class MatrixFreeSearch
    {
    public:
      MatrixFreeSearch(const DavidsonProblem &problem, const EigensolverOptions &options)
          : problem(problem), equations(problem.equations), adjoint(adjoint_of(equations)),
            options(options), of_right(equations), of_left(adjoint), davidson(equations, method())
      {
      }

      EigenSolution run(MultiVector start);

    private:
      DavidsonMethod method() const;
      /// Pairs in the disc, by ascending frequency.
      SmallPairs ritz_pairs() const;
      bool is_wanted(const Complex &l) const
      {
        return l.imag() <= options.max_imaginary && (l.imag() > 0 || l.real() > 0) &&
               std::abs(l) > rigid_body_limit(options.max_imaginary);
      }
      /// Right vectors, or the right ones of the transposed problem. @p residuals become theirs,
      /// relieved by @p pressures.
      EigenPairs vectors_of(const SmallPairs &ritz, Side side, ComplexMultiVector &residuals,
                            ComplexMultiVector &pressures) const;
      /// Computes residuals of right vectors and, unless they are the same, of left ones.
      std::vector<Residuals> residuals_of(const SmallPairs &ritz) const;
      /// Takes out the pairs whose eigenvalues were accurate and stay where they are.
      SmallPairs open_pairs(const SmallPairs &wanted);
      /// The numbers of the pairs whose eigenvalues are not accurate. `worst` becomes the
      /// largest estimate.
      std::vector<unsigned int> inaccurate(const SmallPairs &ritz,
                                           const std::vector<Residuals> &residuals);
      /// The relative error of an eigenvalue whose estimate is given: times the factor by which the
      /// estimate was too small in the step before, for the eigenvalue that has become this one.
      double error_of(const Complex &l, double estimated) const;
      /// The basis becomes what the pairs of two steps span; the first ones are then given in it.
      void restart(SmallPairs &ritz, const SmallPairs &before);
      /// Right and left vectors of all given pairs.
      EigenPairs modes_of(const SmallPairs &wanted) const;
      void check_memory(unsigned int n_vectors) const;
      const DavidsonProblem &problem;
      const QuadraticEigenproblem &equations;
      const QuadraticEigenproblem adjoint;
      const EigensolverOptions &options;
      const BackwardError of_right, of_left;
      Davidson davidson; ///< U
      struct Estimate
      {
        Complex lambda;
        double relative; ///< error
      };
      std::vector<Estimate> last_estimates;
      std::vector<Complex> accurate;
      double worst                            = 0;
      static constexpr unsigned int at_a_time = 8; ///< pairs whose vectors are in memory
    };

    DavidsonMethod MatrixFreeSearch::method() const
    {
      DavidsonMethod result;
      // What columns add by less than a millionth of their length is left out: rounding of the
      // constraints would grow as much.
      result.novelty    = {1e-6, 1e-6};
      result.most_steps = 300;
      result.measures   = true;
      result.constrain  = [this](MultiVector &columns, const Side side)
      {
        problem.constraints.satisfy(columns, side == Side::left);
        clear_multipliers(equations, columns);
      };
      result.partners = [this](MultiVector columns, const Side side)
      {
        problem.constraints.satisfy(columns, side == Side::left);
        return columns;
      };
      result.relieve = [this](MultiVector &image) { problem.constraints.relieve(image, false); };
      return result;
    }

    SmallPairs MatrixFreeSearch::ritz_pairs() const
    {
      const double radius  = search_radius(options.max_imaginary);
      const SmallPairs all = davidson.projected().solve(0, radius, true);
      std::vector<unsigned int> in_disc;
      for (const unsigned int k : order_of_modes(all.lambda))
        if (std::abs(all.lambda[k]) <= radius)
          in_disc.push_back(k);
      return all.select(in_disc);
    }

    EigenPairs MatrixFreeSearch::vectors_of(const SmallPairs &ritz, const Side side,
                                            ComplexMultiVector &residuals,
                                            ComplexMultiVector &pressures) const
    {
      const bool left = side == Side::left;
      EigenPairs pairs;
      pairs.lambda               = ritz.lambda;
      pairs.right                = davidson.vectors(left ? ritz.left : ritz.right, side);
      const BackwardError &error = left ? of_left : of_right;
      residuals                  = error.residuals(pairs);
      // Pressures of a compliant contact are in the basis; others are what the residual tells.
      if (equations.compliant)
        pairs.backward_error = error.errors(pairs, residuals);
      pressures = {problem.constraints.relieve(residuals.re, left),
                   problem.constraints.relieve(residuals.im, left)};
      if (!equations.compliant)
      {
        pairs.right.re += pressures.re;
        pairs.right.im += pressures.im;
        pairs.backward_error = error.errors(pairs, residuals);
      }
      return pairs;
    }

    std::vector<Residuals> MatrixFreeSearch::residuals_of(const SmallPairs &ritz) const
    {
      std::vector<Residuals> result;
      const MultiVector none(equations.rows, 0);
      for (const Side side : {Side::right, Side::left})
      {
        if (side == Side::left && problem.is_conservative)
          continue;
        Residuals all{none, none, none, {}};
        for (unsigned int first = 0; first < ritz.size(); first += at_a_time)
        {
          std::vector<unsigned int> some(std::min(at_a_time, ritz.size() - first));
          std::iota(some.begin(), some.end(), first);
          ComplexMultiVector residuals, pressures;
          vectors_of(ritz.select(some), side, residuals, pressures);
          std::vector<Complex> turns;
          for (const auto &[turn, longer, shorter] : main_parts(residuals))
          {
            turns.push_back(turn);
            all.shares.push_back(longer > 0 ? 1 + shorter / longer : 1);
          }
          const MultiVector longer_parts = real_parts(turns, residuals);
          all.columns.append(longer_parts);
          all.pressures.append(real_parts(turns, pressures));
          all.of_b.append(problem.precondition(longer_parts));
        }
        result.push_back(std::move(all));
      }
      return result;
    }

    double MatrixFreeSearch::error_of(const Complex &l, const double estimated) const
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

    std::vector<unsigned int> MatrixFreeSearch::inaccurate(const SmallPairs &ritz,
                                                           const std::vector<Residuals> &residuals)
    {
      const unsigned int n_pairs = ritz.size(), n_sides = residuals.size();
      std::vector<double> energies(n_sides * n_pairs); // r^H B r, s^H B s
      for (unsigned int j = 0; j < n_pairs; ++j)
        for (unsigned int side = 0; side < n_sides; ++side)
        {
          const double *r = residuals[side].columns.column(j), *t = residuals[side].of_b.column(j);
          for (unsigned int i = 0; i < equations.rows.n_local(); ++i)
            energies[n_sides * j + side] += residuals[side].shares[j] * r[i] * t[i];
        }
      MPI_Allreduce(MPI_IN_PLACE, energies.data(), energies.size(), MPI_DOUBLE, MPI_SUM,
                    equations.rows.comm);
      // |U c|_M^2 of each column
      const auto masses_of = [this](const ComplexDenseMatrix &c)
      { return column_products(ComplexDenseMatrix(c).conjugate(), davidson.mass() * c); };
      const std::vector<Complex> right_masses = masses_of(ritz.right),
                                 left_masses  = masses_of(ritz.left);
      worst                                   = 0;
      std::vector<unsigned int> result;
      std::vector<Estimate> estimates;
      for (unsigned int j = 0; j < n_pairs; ++j)
      {
        const Complex l        = ritz.lambda[j];
        const double estimated = std::sqrt(energies[n_sides * j] * energies[n_sides * (j + 1) - 1] /
                                           (right_masses[j].real() * left_masses[j].real())) /
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
        else
          accurate.push_back(l);
      }
      last_estimates = std::move(estimates);
      return result;
    }

    void MatrixFreeSearch::restart(SmallPairs &ritz, const SmallPairs &before)
    {
      // Eigenvalues change by the energy of what is dropped, which may be rough.
      const double dropped = 1e-4 * std::sqrt(options.tolerance);
      const unsigned int n = davidson.n_columns();
      DenseMatrix spanning(n, 0);
      for (const SmallPairs *pairs : {static_cast<const SmallPairs *>(&ritz), &before})
        for (ComplexDenseMatrix unit : {pairs->right, pairs->left})
        {
          unit.resize_rows(n);
          spanning.append(real_and_imaginary(unit.normalise()));
        }
      DenseMatrix vectors               = spanning * spanning.transpose();
      const std::vector<double> squares = symmetric_eigen(vectors);
      const unsigned int n_dropped =
          std::upper_bound(squares.begin(), squares.end(), dropped * dropped) - squares.begin();
      const DenseMatrix turn = vectors.columns(n_dropped, n - n_dropped);
      davidson.turn(turn);
      ritz.right = turn.transpose() * ritz.right;
      ritz.left  = turn.transpose() * ritz.left;
    }

    EigenPairs MatrixFreeSearch::modes_of(const SmallPairs &wanted) const
    {
      ComplexMultiVector residuals, pressures;
      EigenPairs modes = vectors_of(wanted, Side::right, residuals, pressures);
      EigenPairs transposed =
          problem.is_conservative ? modes : vectors_of(wanted, Side::left, residuals, pressures);
      if (problem.is_conservative) // Q(l)^T is the conjugate of Q(l)
        transposed.right.conjugate();
      attach_left_vectors(equations, std::move(transposed), modes);
      return modes;
    }

    void MatrixFreeSearch::check_memory(const unsigned int n_vectors) const
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

    SmallPairs MatrixFreeSearch::open_pairs(const SmallPairs &wanted)
    {
      std::vector<Complex> at_rest = std::exchange(accurate, {});
      std::vector<unsigned int> open;
      for (unsigned int k = 0; k < wanted.size(); ++k)
      {
        const auto found = std::find_if(
            at_rest.begin(), at_rest.end(),
            [&](const Complex &l)
            { return std::abs(l - wanted.lambda[k]) <= 2 * options.tolerance * std::abs(l); });
        if (found == at_rest.end())
          open.push_back(k);
        else
        {
          accurate.push_back(*found);
          at_rest.erase(found);
        }
      }
      return wanted.select(open);
    }

    EigenSolution MatrixFreeSearch::run(MultiVector start)
    {
      davidson.expand({std::move(start), {}});
      const unsigned int n_start = davidson.n_columns(), n_expected = ritz_pairs().size();
      // Restarts that come after few steps lose much.
      const auto most_vectors = [n_start](const unsigned int n_pairs)
      { return n_start + std::max(60u, 6 * n_pairs); };
      // The basis, once more while it is turned; corrections, and what becomes of some vectors.
      check_memory(2 * most_vectors(n_expected) + 4 * n_expected + 16 * at_a_time);
      SmallPairs before;
      EigenSolution solution;
      const auto correct = [&](const unsigned int step) -> std::optional<BothSides>
      {
        SmallPairs ritz = ritz_pairs();
        std::vector<unsigned int> chosen;
        for (unsigned int k = 0; k < ritz.size(); ++k)
          if (is_wanted(ritz.lambda[k]))
            chosen.push_back(k);
        const SmallPairs wanted = ritz.select(chosen), open = open_pairs(wanted);
        const std::vector<Residuals> residuals = residuals_of(open);
        solution.cost.n_solves += residuals.size() * open.size();
        const std::vector<unsigned int> moving = inaccurate(open, residuals);
        std::ostringstream text;
        text.precision(2);
        text << "  Davidson step " << step + 1 << ": " << wanted.size() - moving.size() << " of "
             << wanted.size() << " eigenvalues accurate, error " << worst << ", subspace of "
             << davidson.n_columns();
        options.progress(text.str());
        if (moving.empty())
        {
          solution.modes = modes_of(wanted);
          return std::nullopt;
        }
        MultiVector added(equations.rows, 0);
        for (const unsigned int j : moving)
          for (const Residuals &r : residuals)
            added.append(difference(r.pressures.columns(j, 1), r.of_b.columns(j, 1)));
        if (davidson.n_columns() + added.n_columns() > most_vectors(ritz.size()))
          restart(ritz, before);
        before = std::move(ritz);
        return BothSides{std::move(added), {}};
      };
      if (!davidson.run(correct))
        throw SolverError(text_of("Davidson's method has not made all eigenvalues accurate in ",
                                  method().most_steps,
                                  " steps; the largest estimated relative error is ", worst, "."),
                          {Failure::davidson_stalled});
      return solution;
    }
  } // namespace

  EigenSolution block_davidson(const DavidsonProblem &problem, MultiVector start,
                               const EigensolverOptions &options)
  {
    return MatrixFreeSearch(problem, options).run(std::move(start));
  }
} // namespace squeal
