#include <squeal/equations/sector.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace squeal
{
  std::vector<Matrix> Sector::sums(const std::vector<std::vector<Term>> &sums) const
  {
    if (space)
      return space->restrict(sums);
    std::vector<Matrix> result;
    for (const std::vector<Term> &sum : sums)
      result.push_back(sum_of_terms(rows, sum));
    return result;
  }

  std::vector<Matrix> Sector::sums(const std::vector<Sector> &sectors, const std::vector<Term> &sum)
  {
    std::vector<Matrix> result;
    if (sectors.front().is_whole())
    {
      result.push_back(sum_of_terms(sectors.front().rows, sum));
      return result;
    }
    std::vector<ParitySpace::Wanted> wanted;
    for (const Sector &sector : sectors)
      wanted.push_back({sector.space.get(), {sum}});
    for (std::vector<Matrix> &of_sector : ParitySpace::restrict(wanted))
      result.push_back(std::move(of_sector.front()));
    return result;
  }

  const ParitySpace &Sector::parity_space() const
  {
    if (!space)
      throw std::logic_error("The whole has no parity.");
    return *space;
  }

  std::vector<Sector> Sectors::all(const RowRange &whole, const bool at_once,
                                   const unsigned int n_first) const
  {
    if (!symmetry)
      return {Sector(whole)};
    if (!at_once)
      return {Sector(*symmetry, Parity::symmetric), Sector(*symmetry, Parity::antisymmetric)};
    int n_ranks = 0;
    MPI_Comm_size(whole.comm, &n_ranks);
    const auto group = [&](const unsigned int first, const unsigned int n)
    { return std::make_shared<const Subcommunicator>(whole.comm, first, n); };
    return {Sector(*symmetry, Parity::symmetric, group(0, n_first)),
            Sector(*symmetry, Parity::antisymmetric, group(n_first, n_ranks - n_first))};
  }

  bool Sectors::keep(const std::vector<unsigned int> &rows) const
  {
    return symmetry && std::all_of(rows.begin(), rows.end(),
                                   [&](const unsigned int row) {
                                     return std::find(rows.begin(), rows.end(),
                                                      symmetry->image[row]) != rows.end();
                                   });
  }

  bool Sectors::keep(const Term &term, const double largest) const
  {
    const MultiVector x = symmetry->scattered(1), s_x = symmetry->reflect(x),
                      asymmetry = difference(multiply(*term.matrix, x),
                                             symmetry->reflect(multiply(*term.matrix, s_x)));
    return std::abs(term.coefficient) * largest_entry(asymmetry) <= largest;
  }
} // namespace squeal
