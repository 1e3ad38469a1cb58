#include <squeal/continuation/reference_counts.h>

#include <cstdint>

namespace squeal
{
  namespace
  {
    /// A number that hardly two different matrices share.
    double fingerprint(const Matrix &matrix)
    {
      double sum = 0;
      for_entries(matrix, [&](const std::int64_t row, const std::int64_t column, const double value)
                  { sum += value * (1 + column * 7919 % 1009) * (1 + row * 104729 % 1013); });
      MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_DOUBLE, MPI_SUM,
                    PetscObjectComm(reinterpret_cast<PetscObject>(Mat(matrix))));
      return sum;
    }
  } // namespace

  ReferenceCounts::Key ReferenceCounts::key_of(const std::vector<Term> &terms)
  {
    Key key;
    std::map<std::shared_ptr<const Matrix>, double> present;
    for (const Term &term : terms)
      if (term.order != 1 && term.matrix && *term.matrix && is_conservative(term.origin))
      {
        const auto known = fingerprints.find(term.matrix);
        present[term.matrix] =
            known != fingerprints.end() ? known->second : fingerprint(*term.matrix);
        // K, M, and M* of -Omega^2 M*; with the gyroscopic term transport has order 1.
        const bool of_semidefinite =
            semidefinite && (term.origin == Origin::inertia || term.origin == Origin::elasticity ||
                             term.origin == Origin::transport);
        key.push_back({term.order, term.coefficient, present[term.matrix], of_semidefinite});
      }
    fingerprints = std::move(present);
    return key;
  }

  std::optional<int> ReferenceCounts::compare(const Key &first, const Key &second)
  {
    if (first.size() != second.size())
      return {};
    bool is_stiffer = false, is_softer = false;
    for (std::size_t k = 0; k < first.size(); ++k)
    {
      const Coefficient &a = first[k], &b = second[k];
      if (a.order != b.order || a.fingerprint != b.fingerprint)
        return {};
      if (a.value == b.value)
        continue;
      if (!a.of_semidefinite || !b.of_semidefinite)
        return {};
      ((a.value > b.value) == (a.order == 0) ? is_stiffer : is_softer) = true;
    }
    if (is_stiffer && is_softer)
      return {};
    return int(is_stiffer) - int(is_softer);
  }

  std::optional<bool> ReferenceCounts::find(const Key &key) const
  {
    bool has_stiffer = false, has_softer = false;
    for (const auto &[other, is_same] : counted)
    {
      const std::optional<int> direction = compare(other, key);
      if (direction && *direction == 0)
        return is_same;
      if (!direction || !is_same)
        continue;
      (*direction > 0 ? has_stiffer : has_softer) = true;
    }
    if (has_stiffer && has_softer)
      return true;
    return {};
  }

  void ReferenceCounts::add(const Key &key, const bool is_same)
  {
    counted.emplace_back(key, is_same);
  }
} // namespace squeal
