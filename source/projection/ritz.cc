#include <squeal/base/text.h>
#include <squeal/projection/backward_error.h>
#include <squeal/projection/davidson.h>
#include <squeal/projection/ritz.h>
#include <squeal/projection/search_space.h>
#include <squeal/projection/small_problem.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace squeal
{
  using Complex = std::complex<double>;

  namespace
  {
    /// Between the two projections, what lay in the span up to rounding is dropped.
    constexpr Novelty anything_new = {1e-10};

    /// The state of refine_eigenpairs(): the pairs, and how far they are from accurate.
    class Refinement
    {
    public:
      Refinement(const QuadraticEigenproblem &problem, const ShiftInvert &shift_invert,
                 std::vector<Complex> previous, const double radius, const bool known,
                 const EigensolverOptions &options)
          : problem(problem), shift_invert(shift_invert), previous(std::move(previous)),
            radius(radius), known(known), options(options), backward_error(problem),
            n_wanted(this->previous.size()), davidson(problem, method())
      {
      }

      EigenSolution run(MultiVector start);

    private:
      DavidsonMethod method();
      /// The Ritz pairs that are to be refined.
      EigenPairs ritz_pairs() const;
      /// Improves the pairs and chooses modes among them. Returns whether these are accurate.
      bool improve(EigenPairs &pairs, unsigned int step);
      [[noreturn]] void fail() const;

      const QuadraticEigenproblem &problem;
      const ShiftInvert &shift_invert;
      std::vector<Complex> previous;
      const double radius;
      const bool known;
      const EigensolverOptions &options;
      const BackwardError backward_error;
      const unsigned int n_wanted;
      Davidson davidson;
      EigenSolution solution;
      double worst = 0, change = 0, last_change = 1;
    };

    DavidsonMethod Refinement::method()
    {
      DavidsonMethod result;
      result.novelty    = anything_new;
      result.most_steps = 12;
      result.constrain  = [this](MultiVector &block, Side) { clear_multipliers(problem, block); };
      if (problem.n_constraints > 0 && !problem.compliant)
        result.partners = [this](const MultiVector &added, Side)
        {
          solution.cost.n_solves += added.n_columns();
          return shift_invert.solve_transposed(multiply(problem.M, added));
        };
      return result;
    }

    EigenPairs Refinement::ritz_pairs() const
    {
      const SmallPairs all = davidson.projected().solve(shift_invert.shift, radius);
      std::vector<unsigned int> in_disc;
      for (unsigned int j = 0; j < all.size(); ++j)
        if (std::abs(all.lambda[j]) <= radius)
          in_disc.push_back(j);
      const SmallPairs found             = all.select(in_disc);
      const std::vector<Complex> &lambda = found.lambda;
      // Zero eigenvalues of free bodies are defective and never accurate; they are counted, not
      // refined. Overdamped modes crowd, and nobody wants them. Of known eigenvalues only the
      // partners are wanted.
      std::vector<unsigned int> chosen;
      if (known)
        chosen = nearest_partners(previous, lambda);
      else
        for (unsigned int j = 0; j < lambda.size(); ++j)
          if (const Complex l = lambda[j]; std::abs(l) > rigid_body_limit(options.max_imaginary) &&
                                           (l.real() > 0 || !is_nearly_real(l)))
            chosen.push_back(j);
      EigenPairs pairs;
      for (const unsigned int j : chosen)
        pairs.lambda.push_back(lambda[j]);
      pairs.right = davidson.vectors(found.right.columns(chosen), Side::right);
      return pairs;
    }

    bool Refinement::improve(EigenPairs &pairs, const unsigned int step)
    {
      inverse_iteration(problem, shift_invert, pairs);
      solution.cost.n_solves += 2 * pairs.size();
      pairs.backward_error              = backward_error(pairs);
      const std::vector<double> &errors = pairs.backward_error;
      std::vector<unsigned int> order(pairs.size());
      std::iota(order.begin(), order.end(), 0u);
      if (!known)
        std::sort(order.begin(), order.end(),
                  [&](const unsigned int a, const unsigned int b)
                  { return errors[a] < errors[b]; });
      order.resize(std::min<std::size_t>(order.size(), n_wanted));
      EigenPairs &modes = solution.modes;
      modes             = pairs.select(order);
      worst             = order.empty()
                              ? 0
                              : *std::max_element(modes.backward_error.begin(), modes.backward_error.end());
      change            = largest_change(modes.lambda, previous);
      options.progress(text_of("  refinement step ", step, ": ", order.size(), " pairs"));
      // Near coalescence the eigenvalue is known to the square root of the backward error only:
      // once that is at rounding and the eigenvalue does not settle further, nothing can be
      // improved.
      const bool settled = change <= options.tolerance ||
                           (worst <= 1e-3 * options.tolerance && change >= 0.1 * last_change);
      last_change = change;
      if (!known)
        previous = modes.lambda;
      return order.size() >= n_wanted && worst <= options.tolerance && settled;
    }

    EigenSolution Refinement::run(MultiVector start)
    {
      davidson.expand({std::move(start), {}});
      const unsigned int most_vectors = davidson.n_columns() + 5 * n_wanted;
      const auto correct              = [&](const unsigned int step) -> std::optional<BothSides>
      {
        EigenPairs pairs         = ritz_pairs();
        MultiVector ritz_vectors = pairs.right.real_span();
        if (improve(pairs, step))
          return std::nullopt;
        if (davidson.n_columns() > most_vectors) // the best so far
          davidson.restart({std::move(ritz_vectors), {}});
        return BothSides{pairs.right.real_span(), {}};
      };
      if (!davidson.run(correct))
        fail();
      return std::move(solution);
    }

    void Refinement::fail() const
    {
      if (solution.modes.empty()) // those found have no finite eigenvalue, or are rigid motions
        throw SolverError(
            text_of("The eigenpairs could not be refined: none of the ", n_wanted,
                    " has a finite eigenvalue that is not zero to rounding. Numbers of the problem "
                    "are too far apart to compute with."),
            {Failure::pairs_not_refined});
      throw SolverError(text_of("The eigenpairs could not be refined to the tolerance ",
                                options.tolerance, ": ", solution.modes.size(), " of ", n_wanted,
                                " pairs, largest backward error ", worst, ", last relative change ",
                                change, "."),
                        {Failure::pairs_not_refined});
    }
  } // namespace

  EigenPairs dense_eigenpairs(const QuadraticEigenproblem &problem, const double radius,
                              const double shift,
                              const std::function<bool(const Complex &)> &is_wanted)
  {
    std::vector<unsigned int> all_rows(problem.rows.size);
    std::iota(all_rows.begin(), all_rows.end(), 0u);
    const MultiVector identity = unit_columns(problem.rows, all_rows);
    const auto entries_of      = [&](const Matrix &matrix)
    { return matrix ? inner_products(identity, multiply(matrix, identity)) : DenseMatrix(); };
    const SmallPairs all =
        SmallProblem{
            entries_of(problem.M), entries_of(problem.P), entries_of(problem.Q), {}, nullptr}
            .solve(shift, radius, true);
    std::vector<unsigned int> wanted;
    for (unsigned int k = 0; k < all.size(); ++k)
      if (is_wanted(all.lambda[k]))
        wanted.push_back(k);
    SmallPairs found = all.select(wanted);
    EigenPairs pairs;
    pairs.lambda = found.lambda;
    pairs.right  = combine(identity, found.right);
    pairs.left   = combine(identity, found.left.conjugate()); // z = conj(y)
    return pairs;
  }

  MultiVector krylov_basis(const QuadraticEigenproblem &problem, const ShiftInvert &shift_invert,
                           const unsigned int n_columns, const unsigned int seed)
  {
    constexpr unsigned int block_size = 8;
    MultiVector block                 = scattered_numbers(problem.rows, block_size, seed);
    SearchSpace space(problem.rows);
    while (space.n_columns() < n_columns)
    {
      block = shift_invert.solve(multiply(problem.M, block));
      clear_multipliers(problem, block);
      block = space.add(std::move(block), anything_new);
      if (block.n_columns() == 0) // the whole space
        break;
    }
    return space.release();
  }

  EigenSolution refine_eigenpairs(const QuadraticEigenproblem &problem,
                                  const ShiftInvert &shift_invert, MultiVector start,
                                  std::vector<Complex> previous, const double radius,
                                  const bool known, const EigensolverOptions &options)
  {
    return Refinement(problem, shift_invert, std::move(previous), radius, known, options)
        .run(std::move(start));
  }
} // namespace squeal
