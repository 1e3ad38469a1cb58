#pragma once

#include <squeal/equations/parity.h>
#include <squeal/equations/parity_space.h>
#include <squeal/linalg/complex_multi_vector.h>

#include <memory>
#include <optional>
#include <vector>

namespace squeal
{
  /// A subspace that the equations of motion map to itself: the vectors of one parity, or all of
  /// them. A value; what it is made of is shared.
  class Sector
  {
  public:
    /// All vectors.
    explicit Sector(const RowRange &whole) : rows(whole) {}
    /// The vectors of one parity, on all ranks or on those of a group.
    Sector(const MirrorSymmetry &symmetry, Parity parity,
           std::shared_ptr<const Subcommunicator> group = {})
        : of_parity(parity), group(std::move(group)),
          space(this->group
                    ? std::make_shared<const ParitySpace>(symmetry, parity == Parity::symmetric,
                                                          *this->group)
                    : std::make_shared<const ParitySpace>(symmetry, parity == Parity::symmetric)),
          rows(space->row_range())
    {
    }

    /// Parity::none: all vectors.
    Parity parity() const
    {
      return of_parity;
    }
    bool is_whole() const
    {
      return !space;
    }
    /// The rows of its vectors.
    const RowRange &row_range() const
    {
      return rows;
    }
    /// Whether this rank has a part of it.
    bool is_here() const
    {
      return rows.comm != MPI_COMM_NULL;
    }
    /// The number of pressures among this rank's rows, of which the whole has so many.
    unsigned int n_local_pressures(const unsigned int of_whole) const
    {
      return space ? space->n_local_pressures() : of_whole;
    }

    /// The part of vectors, of the numbers of rows or of a matrix in the sector. Collective.
    template <typename Whole>
    Whole restrict(const Whole &whole) const
    {
      return space ? space->restrict(whole) : whole;
    }
    std::shared_ptr<const Matrix> restrict(const std::shared_ptr<const Matrix> &matrix) const
    {
      return space ? std::make_shared<const Matrix>(space->restrict(matrix)) : matrix;
    }
    Matrix restrict(const std::shared_ptr<const LowRank> &low_rank) const
    {
      return space ? space->restrict(*low_rank) : make_matrix(low_rank);
    }
    /// Vectors of the sector as vectors of the whole. Collective.
    MultiVector expand(const MultiVector &y) const
    {
      return space ? space->expand(y) : y;
    }
    ComplexMultiVector expand(const ComplexMultiVector &y) const
    {
      return {expand(y.re), expand(y.im)};
    }

    /// The parts of several sums of terms in the sector. Collective.
    std::vector<Matrix> sums(const std::vector<std::vector<Term>> &sums) const;
    /// The part of one sum in each of some sectors: groups of ranks finish theirs at the same time.
    static std::vector<Matrix> sums(const std::vector<Sector> &sectors,
                                    const std::vector<Term> &sum);
    /// The space of one parity; throws std::logic_error for the whole.
    const ParitySpace &parity_space() const;

  private:
    Parity of_parity = Parity::none;
    std::shared_ptr<const Subcommunicator> group;
    std::shared_ptr<const ParitySpace> space;
    RowRange rows;
  };

  /// The sectors that a mesh has: two of a mirror-symmetric one, else the whole. Whether loads,
  /// materials and contact keep to them is to be asked.
  class Sectors
  {
  public:
    /// The whole.
    Sectors() = default;
    Sectors(std::nullopt_t) {}
    Sectors(std::optional<MirrorSymmetry> symmetry) : symmetry(std::move(symmetry)) {}
    Sectors(MirrorSymmetry symmetry) : symmetry(std::move(symmetry)) {}

    bool are_two() const
    {
      return symmetry.has_value();
    }
    /// One sector: that of symmetric vectors, where static states are, or the whole.
    Sector symmetric(const RowRange &whole) const
    {
      return symmetry ? Sector(*symmetry, Parity::symmetric) : Sector(whole);
    }
    /// All of them, the symmetric one first; @p at_once: on groups of ranks of their own, the first
    /// @p n_first ranks for the first one.
    std::vector<Sector> all(const RowRange &whole, bool at_once = false,
                            unsigned int n_first = 0) const;

    /// Whether sums of terms, or vectors, map each sector to itself; with every set of rows that of
    /// their mirror images. To rounding; collective.
    bool keep(const EquationsOfMotion &equations) const
    {
      return symmetry && is_symmetric(equations, *symmetry);
    }
    bool keep(const std::vector<std::vector<Term>> &sums) const
    {
      return symmetry && is_symmetric(sums, *symmetry);
    }
    bool keep(const MultiVector &x) const
    {
      return symmetry && is_symmetric(x, *symmetry);
    }
    bool keep(const std::vector<unsigned int> &rows) const;
    /// The mirror image of a row.
    unsigned int image(const unsigned int row) const
    {
      return symmetry->image[row];
    }
    const MirrorSymmetry &mirror() const
    {
      return *symmetry;
    }
    /// Whether a term couples sectors by less than @p largest. Collective.
    bool keep(const Term &term, double largest) const;

  private:
    std::optional<MirrorSymmetry> symmetry;
  };

  /// Finds the sectors of a mesh. Collective.
  template <int dim>
  Sectors find_sectors(const FiniteElementSpace<dim> &spaces)
  {
    return find_mirror_symmetry(spaces);
  }
} // namespace squeal
