#include <squeal/base/text.h>
#include <squeal/eigen/inertia_count.h>
#include <squeal/linalg/compressed_rows.h>
#include <squeal/linalg/dense.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <string>
#include <utility>

// Counts of one problem: negative pivots of LDL^T less those of constraints, of which open ones are
// found first. RememberedCounts tells by products with a fixed vector whether a problem was counted
// before. InertiaCount serves problems that differ in which contacts are open by one factorisation:
// it compares them with its base, solves for the opened rows and takes the inertia of their block.

namespace squeal
{
  MultiVector scattered_vector(const RowRange &rows)
  {
    MultiVector vector(rows, 1);
    for (unsigned int i = 0; i < vector.n_local(); ++i)
      vector.data()[i] = std::sin(1. + rows.begin + i);
    return vector;
  }

  bool is_own_reference(const QuadraticEigenproblem &problem)
  {
    if (problem.P)
      return false;
    if (!problem.has_reference())
      return true;
    const MultiVector x = scattered_vector(problem.rows), q_x = multiply(problem.Q, x),
                      reference_x = multiply(problem.shifted_reference(0), x);
    const MultiVector other       = difference(q_x, reference_x);
    constexpr double rounding     = 1e-13;
    return inner_product(other, other) <= rounding * rounding * inner_product(q_x, q_x);
  }

  namespace
  {
    constexpr const char *counted_matrix = "the shifted reference problem (for counting its modes)";

    unsigned int n_reference_modes(const QuadraticEigenproblem &problem,
                                   const Factorization &factorization)
    {
      const unsigned int n_negative = factorization.inertia().negative;
      if (n_negative < problem.n_constraints)
        throw SolverError("The inertia count of the reference problem gave " +
                          std::to_string(n_negative) + " negative eigenvalues, less than the " +
                          std::to_string(problem.n_constraints) +
                          " of the contact constraints: the constraints are linearly dependent.");
      return n_negative - problem.n_constraints;
    }
  } // namespace

  unsigned int count_reference_modes(const QuadraticEigenproblem &problem, const double omega)
  {
    return count_reference_modes(problem, problem.shifted_reference(omega));
  }

  unsigned int count_reference_modes(const QuadraticEigenproblem &problem, const Matrix &shifted)
  {
    const Factorization factorization(shifted, Factorization::Kind::ldlt, counted_matrix);
    return n_reference_modes(problem, factorization);
  }

  std::vector<unsigned int> count_reference_modes(const QuadraticEigenproblem &problem,
                                                  const std::vector<double> &omegas, Matrix shifted)
  {
    std::vector<unsigned int> numbers;
    std::optional<Factorization> factorization;
    for (unsigned int k = 0; k < omegas.size(); ++k)
    {
      const auto moves_to_here = [&]()
      {
        const double before = omegas[k - 1] * omegas[k - 1], now = omegas[k] * omegas[k];
        return add_in_place(problem.rows, before - now, problem.M, shifted);
      };
      if (k > 0 && moves_to_here())
        factorization->renew(shifted);
      else
      {
        if (k > 0) // stiffness and inertia had cancelled somewhere
          shifted = problem.shifted_reference(omegas[k]);
        factorization.emplace(shifted, Factorization::Kind::ldlt, counted_matrix);
      }
      numbers.push_back(n_reference_modes(problem, *factorization));
      if (k > 0 && omegas[k] > omegas[k - 1] && numbers[k] < numbers[k - 1])
        throw SolverError(text_of(
            "The reference problem has ", numbers[k - 1], " modes up to ",
            omegas[k - 1] / (2 * M_PI), " Hz and ", numbers[k], " up to ", omegas[k] / (2 * M_PI),
            " Hz: its mass matrix has negative eigenvalues, and no search can be proven "
            "complete."));
    }
    return numbers;
  }

  void check_for_missing(const QuadraticEigenproblem &problem, const SearchRegion &region,
                         const unsigned int n_found, const unsigned int n_zero)
  {
    const bool is_disc  = region.is_disc();
    const double factor = is_disc ? 2 : 1.1, upper = region.upper(), inside = upper / factor;
    const std::vector<double> omegas = is_disc
                                           ? std::vector<double>{inside}
                                           : std::vector<double>{region.lower() * factor, inside};
    const std::vector<unsigned int> n =
        count_reference_modes(problem, omegas, problem.shifted_reference(omegas.front()));
    const unsigned int n_below = is_disc ? n_zero : n.front();
    if (n_found + n_below >= n.back())
      return;
    throw SolverError(text_of(n_found, " modes, overdamped ones included, were found up to ",
                              upper / (2 * M_PI), " Hz; the reference problem has ",
                              n.back() - n_below, " up to ", inside / (2 * M_PI),
                              " Hz: more are missing than friction and damping explain."),
                      {Failure::modes_missing});
  }

  std::vector<unsigned int> RememberedCounts::operator()(const QuadraticEigenproblem &problem,
                                                         const std::vector<double> &omegas)
  {
    const MultiVector vector = scattered_vector(problem.rows);
    Matrix shifted           = problem.shifted_reference(omegas.front());
    std::vector<double> fingerprint;
    for (const Matrix *matrix : {&std::as_const(shifted), &problem.M})
    {
      const MultiVector product = multiply(*matrix, vector);
      for (const MultiVector *other : {&product, &vector})
        fingerprint.push_back(inner_product(product, *other));
    }
    Count &known = counted[omegas];
    if (fingerprint != known.fingerprint)
      known = {fingerprint, count_reference_modes(problem, omegas, std::move(shifted))};
    return known.n_modes;
  }

  std::vector<unsigned int> open_constraints(const RowRange &rows,
                                             const unsigned int n_local_constraints,
                                             const std::vector<const Matrix *> &coupling)
  {
    const unsigned int first = rows.end - n_local_constraints;
    std::vector<char> acts(n_local_constraints);
    for (const Matrix *matrix : coupling)
      for_entries(*matrix,
                  [&](const PetscInt row, const PetscInt column, double)
                  {
                    if (unsigned(row) >= first && column != row)
                      acts[row - first] = 1;
                  });
    std::vector<int> open;
    for (unsigned int i = 0; i < n_local_constraints; ++i)
      if (!acts[i])
        open.push_back(first + i);
    gather(open, MPI_INT, rows.comm);
    return {open.begin(), open.end()};
  }

  unsigned int InertiaCount::n_constraints() const
  {
    unsigned int n = n_local_constraints;
    MPI_Allreduce(MPI_IN_PLACE, &n, 1, MPI_UNSIGNED, MPI_SUM, rows.comm);
    return n;
  }

  bool InertiaCount::is_opened_base(const std::vector<Term> &others,
                                    const std::shared_ptr<const Matrix> &contact,
                                    const std::vector<unsigned int> &open)
  {
    if (!has_bodies_of_base(others) ||
        !std::includes(open.begin(), open.end(), base.open.begin(), base.open.end()))
      return false;
    if (base.compared.contact == contact && base.compared.open == open)
      return base.compared.is_left;
    // What is left of the base's contact is the present one.
    const auto is_open = [&](const PetscInt row)
    { return std::binary_search(open.begin(), open.end(), unsigned(row)); };
    const auto entries_of = [&](const Matrix &matrix)
    {
      std::vector<std::pair<std::pair<PetscInt, PetscInt>, double>> entries;
      for_entries(matrix,
                  [&](const PetscInt row, const PetscInt column, const double value)
                  {
                    if (!is_open(row) && !is_open(column))
                      entries.push_back({{row, column}, value});
                  });
      return entries;
    };
    int is_left = entries_of(*base.contact) == entries_of(*contact);
    MPI_Allreduce(MPI_IN_PLACE, &is_left, 1, MPI_INT, MPI_MIN, rows.comm);
    base.compared = {contact, open, bool(is_left)};
    return is_left;
  }

  std::shared_ptr<const Matrix>
  InertiaCount::closed_where_either_is(const Matrix &contact,
                                       const std::vector<unsigned int> &open) const
  {
    std::vector<unsigned int> of_base; // open now, but not there
    std::set_difference(open.begin(), open.end(), base.open.begin(), base.open.end(),
                        std::back_inserter(of_base));
    const auto is_of_base = [&](const PetscInt row)
    { return std::binary_search(of_base.begin(), of_base.end(), unsigned(row)); };
    EntryList entries;
    const auto take = [&](const Matrix &matrix, const bool from_base)
    {
      for_entries(matrix,
                  [&](const PetscInt row, const PetscInt column, const double value)
                  {
                    if ((is_of_base(row) || is_of_base(column)) == from_base)
                      entries.add(row, column, value);
                  });
    };
    take(contact, false);
    take(*base.contact, true);
    return std::make_shared<const Matrix>(entries.make_matrix(rows));
  }

  void InertiaCount::make_base(const std::vector<Term> &others,
                               std::shared_ptr<const Matrix> contact,
                               std::vector<unsigned int> open)
  {
    base         = {}; // two of them would double the memory
    base.bodies  = KnownTerms(others);
    base.contact = std::move(contact);
    base.open    = std::move(open);
    base.columns = MultiVector(rows, 0);
    std::vector<Summand> summands;
    for (const Term &term : others)
      summands.push_back(
          {term.order == 2 ? -omega * omega * term.coefficient : term.coefficient, *term.matrix});
    if (base.contact)
      summands.push_back({1., *base.contact});
    base.factors =
        std::make_unique<const Factorization>(sum_of(rows, summands), Factorization::Kind::ldlt,
                                              "the shifted reference problem (for counting)");
    base.negative               = base.factors->inertia().negative;
    const unsigned int n_closed = n_constraints() - base.open.size();
    if (base.negative < n_closed)
      throw SolverError("The inertia count of the reference problem gave " +
                        std::to_string(base.negative) + " negative eigenvalues, less than the " +
                        std::to_string(n_closed) +
                        " of the contact constraints: the constraints are linearly dependent.");
  }

  int InertiaCount::negative_of_inverse(const std::vector<unsigned int> &added)
  {
    if (added.empty())
      return 0;
    std::vector<unsigned int> missing;
    for (const unsigned int row : added)
      if (!std::count(base.solved.begin(), base.solved.end(), row))
        missing.push_back(row);
    if (!missing.empty())
    {
      base.columns.append(base.factors->solve(unit_columns(rows, missing)));
      base.solved.insert(base.solved.end(), missing.begin(), missing.end());
    }
    const DenseMatrix at_rows = gather_rows(base.columns, added);
    const unsigned int n      = added.size();
    DenseMatrix inverse(n, n);
    for (unsigned int i = 0; i < n; ++i)
    {
      const unsigned int k =
          std::find(base.solved.begin(), base.solved.end(), added[i]) - base.solved.begin();
      for (unsigned int j = 0; j < n; ++j)
      {
        inverse(i, j) += at_rows(k, j) / 2;
        inverse(j, i) += at_rows(k, j) / 2;
      }
    }
    const std::vector<double> eigenvalues = symmetric_eigen(inverse);
    const double largest = std::max(std::abs(eigenvalues.front()), std::abs(eigenvalues.back()));
    int n_negative       = 0;
    for (const double value : eigenvalues)
    {
      if (!(std::abs(value) > 1e-6 * largest))
        return -1;
      n_negative += value < 0;
    }
    return n_negative;
  }

  unsigned int InertiaCount::count(const std::vector<Term> &terms)
  {
    std::vector<Term> others;
    std::shared_ptr<const Matrix> contact;
    bool is_one = true; // matrix of the contact
    for (const Term &term : terms)
      if (term.order != 1 && term.matrix && *term.matrix && is_conservative(term.origin))
      {
        if (term.origin == Origin::contact && term.order == 0 && term.coefficient == 1 && !contact)
          contact = term.matrix;
        else
        {
          is_one &= term.origin != Origin::contact;
          others.push_back(term);
        }
      }
    std::vector<const Matrix *> coupling;
    if (contact)
      coupling.push_back(contact.get());
    for (const Term &term : others)
      if (term.origin == Origin::joint)
        coupling.push_back(term.matrix.get());
    const std::vector<unsigned int> open = open_constraints(rows, n_local_constraints, coupling);
    const bool may_have_base             = contact && is_one;
    if (may_have_base && has_bodies_of_base(others) && !is_opened_base(others, contact, open))
    {
      // Contacts close and open to and fro: what has been closed once stays so in the base.
      std::vector<unsigned int> of_both;
      std::set_intersection(open.begin(), open.end(), base.open.begin(), base.open.end(),
                            std::back_inserter(of_both));
      make_base(others, closed_where_either_is(*contact, open), of_both);
    }
    if (may_have_base && is_opened_base(others, contact, open))
    {
      std::vector<unsigned int> added;
      std::set_difference(open.begin(), open.end(), base.open.begin(), base.open.end(),
                          std::back_inserter(added));
      const int of_inverse = negative_of_inverse(added);
      if (of_inverse >= 0)
        return base.negative - of_inverse - (n_constraints() - open.size());
    }
    make_base(others, contact, open);
    return base.negative - (n_constraints() - open.size());
  }
} // namespace squeal
