#include <squeal/base/text.h>
#include <squeal/eigen/growth_search.h>
#include <squeal/eigen/left_vectors.h>
#include <squeal/eigen/window.h>
#include <squeal/equations/term_list.h>
#include <squeal/linalg/compressed_rows.h>
#include <squeal/projection/backward_error.h>
#include <squeal/projection/ritz.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

// Growth outside of the disc that all solvers search. SymmetricParts counts negative directions of
// symmetric parts of Q and of the damping by LDL^T: no mode grows there without one of them
// (signs_of_growth(), is_definite_on_rim()). Where there are signs, search_growth_beyond() goes
// through discs about real shifts, farther and farther out, with a factorisation for each.

namespace squeal
{
  using Complex = std::complex<double>;

  namespace
  {
    /// Sums of matrices by order, of which symmetric parts are factorised.
    class SymmetricParts
    {
    public:
      const bool may_excite; ///< whether velocity terms may

      explicit SymmetricParts(const QuadraticEigenproblem &problem)
          : may_excite(problem.may_excite && problem.P), rows(problem.rows),
            n_constraints(problem.n_constraints), summands{{problem.Q, {{1, 0, 0}}, false},
                                                           {problem.P, {{0, 1, 0}}, false},
                                                           {problem.M, {{0, 0, 1}}, true}}
      {
      }
      SymmetricParts(const RowRange &rows, const std::vector<Term> &given,
                     const unsigned int n_constraints)
          : may_excite(squeal::may_excite(given)), rows(rows), n_constraints(n_constraints)
      {
        const TermList terms(given);
        for (unsigned int k = 0; k < terms.n_matrices(); ++k)
          summands.push_back({*terms.matrix(k), terms.by_order(k),
                              std::any_of(terms.terms_of(k).begin(), terms.terms_of(k).end(),
                                          [](const Term &term) {
                                            return term.order != 1 && is_conservative(term.origin);
                                          })});
      }

      /// Negative eigenvalues of the symmetric part of Q(s), s real, beyond one per constraint.
      unsigned int n_negative_at(const double s) const
      {
        const unsigned int negative =
            n_negative({{1, s, s * s}}, "the symmetric part of Q (for growth)");
        return negative - std::min(negative, n_constraints);
      }
      /// Negative eigenvalues of r M + (P + P^T)/2.
      unsigned int n_exciting(const double r) const
      {
        return may_excite ? n_negative({{0, 1, r}}, "mass and damping (for growth)") : 0;
      }

    private:
      unsigned int n_negative(const std::array<double, 3> &factors, const std::string &name) const
      {
        std::vector<squeal::Summand> sum;
        for (const Summand &summand : summands)
        {
          const double coefficient =
              std::inner_product(factors.begin(), factors.end(), summand.coefficients.begin(), 0.);
          if (coefficient != 0)
            sum.push_back({summand.is_symmetric ? coefficient : coefficient / 2, summand.matrix,
                           !summand.is_symmetric});
        }
        return Factorization(sum_of(rows, sum), Factorization::Kind::ldlt, name).inertia().negative;
      }

      struct Summand
      {
        Mat matrix;
        std::array<double, 3> coefficients; ///< by order
        bool is_symmetric;
      };
      const RowRange rows;
      const unsigned int n_constraints;
      std::vector<Summand> summands;
    };

    /// (m^2 M + m (P + 2 s M) + Q(s)) x = 0 with l = s + m.
    QuadraticEigenproblem about(const QuadraticEigenproblem &problem, const double s)
    {
      QuadraticEigenproblem result = problem.of_same_unknowns();
      result.M                     = problem.M.view(false);
      result.P                     = sum_of(problem.rows, {{1., problem.P}, {2 * s, problem.M}});
      result.Q = sum_of(problem.rows, {{1., problem.Q}, {s, problem.P}, {s * s, problem.M}});
      if (problem.has_reference()) // it is not self-adjoint, and its modes are not counted
        result.make_shifted_reference = [](double) { return Matrix(); };
      return result;
    }

    /// A disc |l - s| <= radius about a real shift.
    struct Shift
    {
      double s, radius;
    };

    /// The modes about a shift, and by proof.ritz_values_beyond a glimpse of what grows farther
    /// out.
    EigenSolution search_about(const QuadraticEigenproblem &problem,
                               const EigensolverOptions &options, const Shift &shift,
                               const unsigned int n_expected)
    {
      const double s                      = shift.s;
      const QuadraticEigenproblem shifted = about(problem, s);
      const Factorization factors(shifted.Q, Factorization::Kind::lu,
                                  "the matrix of the search for growth");
      BlockSearchOptions search;
      search.region        = {0, shift.radius};
      search.max_imaginary = s;
      search.tolerance     = std::min(1e-11, 1e-2 * options.tolerance);
      search.n_expected    = n_expected;
      search.most_vectors  = 300; // a few modes; of hundreds it is enough to know that they are
      const ShiftInvert inverse(factors, 0), transposed(factors, 0, true);
      EigenSolution found = block_krylov_search(shifted, inverse, search, options.progress);
      std::vector<unsigned int> beyond;
      for (unsigned int j = 0; j < found.modes.size(); ++j)
        if (grows_beyond_disc(s + found.modes.lambda[j], options.max_imaginary))
          beyond.push_back(j);
      found.modes = found.modes.select(beyond);
      if (!found.modes.empty())
      {
        const auto refined =
            [&](const QuadraticEigenproblem &of, const ShiftInvert &with, const EigenPairs &pairs)
        {
          return refine_eigenpairs(of, with, pairs.right.real_span(), pairs.lambda,
                                   search.region.radius, true, options)
              .modes;
        };
        search.region.radius *= 1 + 1e-6; // rounding must not lose a partner at the rim
        search.n_expected   = beyond.size();
        search.seed         = 2;
        found.modes         = refined(shifted, inverse, found.modes);
        const auto adjoint  = adjoint_of(shifted);
        const auto of_left  = block_krylov_search(adjoint, transposed, search, options.progress);
        const auto partners = nearest_partners(found.modes.lambda, of_left.modes.lambda);
        if (partners.size() < beyond.size())
          throw SolverError("Left vectors of modes that grow are missing.");
        attach_left_vectors(shifted, refined(adjoint, transposed, of_left.modes.select(partners)),
                            found.modes);
      }
      for (Complex &l : found.modes.lambda)
        l += s;
      // Rounding gives finite values to the infinite eigenvalues of the constraints.
      constexpr double infinite     = 1e5;
      std::vector<Complex> &glimpse = found.proof.ritz_values_beyond;
      glimpse.erase(std::remove_if(glimpse.begin(), glimpse.end(),
                                   [&](const Complex &m)
                                   { return std::abs(m) > infinite * shift.radius; }),
                    glimpse.end());
      for (Complex &l : glimpse)
        l += s;
      return found;
    }

    /// A shift that is an eigenvalue to rounding makes place for another.
    EigenSolution search_near(const QuadraticEigenproblem &problem,
                              const EigensolverOptions &options, const Shift &shift,
                              const unsigned int n_expected)
    {
      try
      {
        return search_about(problem, options, shift, n_expected);
      }
      catch (const SingularMatrix &)
      {
        return search_about(problem, options, {1.01 * shift.s, shift.radius}, n_expected);
      }
    }

    /// Where to look for a mode that has been glimpsed: close to it, but for modes at the corner of
    /// window and disc, which are as far from any real shift as all that decay. R is the disc's
    /// radius.
    Shift shift_for(const Complex &glimpsed, const double R)
    {
      const double s = 1.05 * glimpsed.real(); // an eigenvalue would make Q(s) singular
      if (s < 1.3 * R)
        return {2 * R, 0.95 * 2 * R};
      return {s, std::max(0.6 * s, 1.2 * std::abs(glimpsed.imag()))};
    }
  } // namespace

  EigenPairs finite_pairs(const QuadraticEigenproblem &problem, const EigenPairs &pairs)
  {
    const ComplexMultiVector residuals = BackwardError(problem).residuals(pairs);
    const unsigned int n_local         = pairs.right.n_local(),
                       n_displacements = n_local - problem.n_local_constraints, n = pairs.size();
    std::vector<double> sizes(2 * n); // of displacements, of gaps
    for (unsigned int j = 0; j < n; ++j)
      for (unsigned int i = 0; i < n_local; ++i)
      {
        double &size = sizes[i < n_displacements ? j : n + j];
        size = std::max(size, std::abs(i < n_displacements ? pairs.right(i, j) : residuals(i, j)));
      }
    if (n > 0)
      MPI_Allreduce(MPI_IN_PLACE, sizes.data(), 2 * n, MPI_DOUBLE, MPI_MAX, problem.rows.comm);
    const double norm = problem.Q.infinity_norm();
    std::vector<unsigned int> finite;
    constexpr double closed = 1e-6;
    for (unsigned int j = 0; j < n; ++j)
      if (problem.compliant || sizes[n + j] <= closed * norm * sizes[j])
        finite.push_back(j);
    return pairs.select(finite);
  }

  double clearance_of(const EigenSolution::Proof &found, const double max_imaginary)
  {
    const double radius = search_radius(max_imaginary),
                 corner = std::sqrt(1 - std::pow(max_imaginary / radius, 2));
    double clearance    = 3;
    for (const Complex &l : found.ritz_values_beyond)
    {
      const double damping = std::abs(l.real()) / std::abs(l);
      clearance = std::min(clearance, std::abs(l.imag()) <= max_imaginary ? std::abs(l) / radius
                                      : damping > 0                       ? corner / damping
                                                                          : clearance);
    }
    return std::max(1., clearance);
  }

  bool is_definite_on_rim(const RowRange &rows, const std::vector<Term> &terms,
                          const unsigned int n_constraints, const double max_imaginary)
  {
    const double R = search_radius(max_imaginary);
    const SymmetricParts parts(rows, terms, n_constraints);
    if (parts.n_negative_at(-R) > 0)
      return false;
    // What only damps makes the real parts larger at R than at -R.
    return !parts.may_excite ||
           (parts.n_negative_at(R) == 0 &&
            parts.n_exciting(std::sqrt(R * R - max_imaginary * max_imaginary)) == 0);
  }

  GrowthSigns signs_of_growth(const QuadraticEigenproblem &problem,
                              const EigensolverOptions &options, const bool is_count_as_expected,
                              const EigenSolution::Proof &found)
  {
    const double radius = search_radius(options.max_imaginary);
    GrowthSigns signs;
    for (const Complex &l : found.ritz_values_beyond)
      if (grows_beyond_disc(l, options.max_imaginary))
        signs.ritz_values.push_back(l);
    const SymmetricParts parts(problem);
    if (!is_count_as_expected)
      signs.n_negative = parts.n_negative_at(radius);
    signs.n_exciting =
        parts.n_exciting(std::sqrt(radius * radius - std::pow(options.max_imaginary, 2)));
    return signs;
  }

  namespace
  {
    /// LAPACK on the whole problem: faster than a search if it is small.
    EigenSolution all_growing_beyond(const QuadraticEigenproblem &problem,
                                     const EigensolverOptions &options)
    {
      const double radius = search_radius(options.max_imaginary);
      EigenSolution result;
      result.modes = finite_pairs(
          problem, dense_eigenpairs(problem, radius, 0.1 * radius,
                                    [&](const Complex &l)
                                    { return grows_beyond_disc(l, options.max_imaginary); }));
      complete_left_vectors(problem, result.modes);
      const unsigned int n_found = result.modes.size();
      result.modes = result.modes.select(modes_beyond_rounding_of_mass(problem, result.modes));
      result.modes.backward_error = BackwardError(problem)(result.modes);
      result.proof.beyond         = text_of(result.modes.size(),
                                            " modes of the window grow outside of that disc, listed; all "
                                                    "eigenvalues were computed");
      if (n_found > result.modes.size())
        result.proof.beyond += text_of("; ", n_found - result.modes.size(),
                                       " others left out, of motions whose mass is zero within "
                                       "rounding");
      return result;
    }
  } // namespace

  EigenSolution search_growth_beyond(const QuadraticEigenproblem &problem,
                                     const EigensolverOptions &options, const GrowthSigns &signs)
  {
    constexpr unsigned int small = 300;
    if (problem.rows.size <= small)
      return all_growing_beyond(problem, options);
    const double radius = search_radius(options.max_imaginary);
    EigenSolution result;
    EigenPairs &modes = result.modes;
    modes.right = modes.left = ComplexMultiVector(problem.rows, 0);
    const SymmetricParts parts(problem);
    double reached   = radius;
    bool has_inertia = signs.n_negative > 0 || signs.n_exciting > 0;
    // What has been glimpsed and not found
    std::vector<Complex> targets = signs.ritz_values;
    try
    {
      constexpr unsigned int most_searches = 6;
      unsigned int n_searches              = 0;
      for (double farther = 2 * radius;
           n_searches < most_searches && (has_inertia || !targets.empty()); ++n_searches)
      {
        const Shift shift =
            has_inertia ? Shift{farther, 0.95 * farther} : shift_for(targets.front(), radius);
        if (has_inertia)
          farther *= 10;
        EigenSolution found =
            search_near(problem, options, shift, std::clamp(signs.n_exciting, 4u, 10u));
        result.cost.n_solves += found.cost.n_solves;
        reached = std::max(reached, shift.s + shift.radius);
        std::vector<unsigned int> added; // neighbouring searches overlap
        for (unsigned int j = 0; j < found.modes.size(); ++j)
          if (std::none_of(modes.lambda.begin(), modes.lambda.end(),
                           [&](const Complex &l)
                           { return std::abs(l - found.modes.lambda[j]) <= 1e-7 * std::abs(l); }))
            added.push_back(j);
        modes.append(found.modes.select(added));
        const auto is_new = [&](const Complex &l)
        {
          return grows_beyond_disc(l, options.max_imaginary) &&
                 std::none_of(modes.lambda.begin(), modes.lambda.end(),
                              [&](const Complex &other)
                              { return std::abs(l - other) <= 1e-2 * std::abs(l); });
        };
        // This search has seen what is near better than those before.
        std::vector<Complex> left;
        for (const Complex &l : targets)
          if (is_new(l) && std::abs(l - shift.s) > shift.radius)
            left.push_back(l);
        for (const Complex &l : found.proof.ritz_values_beyond)
          if (is_new(l))
            left.push_back(l);
        targets     = std::move(left);
        has_inertia = has_inertia && (parts.n_exciting(reached) > 0 ||
                                      (signs.n_negative > 0 && parts.n_negative_at(reached) > 0));
      }
    }
    catch (const SolverError &error)
    {
      options.progress(std::string("  growth beyond the disc: ") + error.what());
    }
    // Accurate ones only: another search would have to refine them.
    modes.backward_error = BackwardError(problem)(modes);
    std::vector<unsigned int> accurate;
    for (unsigned int j = 0; j < modes.size(); ++j)
      if (modes.backward_error[j] <= options.tolerance)
        accurate.push_back(j);
    const bool is_complete     = !has_inertia && targets.empty() && accurate.size() == modes.size();
    modes                      = modes.select(accurate);
    result.proof.lacks_growing = !is_complete;
    result.proof.beyond        = text_of(
               modes.size(),
               " modes of the window grow outside of that disc, listed; searched up "
                      "to l = ",
               reached, " 1/s", is_complete ? "" : ". There are signs of others, which were not found");
    return result;
  }
} // namespace squeal
