#pragma once

#include <squeal/eigen/eigenproblem.h>

#include <map>
#include <memory>
#include <optional>
#include <vector>

namespace squeal
{
  /// Whether conservative reference problems have as many modes in the search disc as that of an
  /// expansion point, of those that were counted, and of those between them.
  ///
  /// With K = sum k_i K_i and M = sum m_i M_i of semidefinite matrices the eigenfrequencies rise
  /// with each k_i and fall with each m_i (Courant, Fischer): what is as stiff and light as one
  /// problem at least, and as another one at most, has a number of modes between theirs.
  class ReferenceCounts
  {
  public:
    /// Knows nothing; @p semidefinite: whether matrices of inertia, elasticity and transport are.
    explicit ReferenceCounts(const bool semidefinite = false) : semidefinite(semidefinite) {}

    /// A term of a reference problem: what tells its matrix, and how it may change.
    struct Coefficient
    {
      unsigned int order;
      double value, fingerprint;
      bool of_semidefinite;
    };
    using Key = std::vector<Coefficient>;
    /// Collective.
    Key key_of(const std::vector<Term> &terms);

    /// Whether the first has stiffer and lighter matrices than the second (1), softer and heavier
    /// ones (-1), or the same (0). Nothing if it has both, or other matrices.
    static std::optional<int> compare(const Key &first, const Key &second);

    /// Whether the modes are as many as the expansion point's, if that is known.
    std::optional<bool> find(const Key &key) const;
    void add(const Key &key, bool is_same);
    void clear()
    {
      counted.clear();
    }

  private:
    bool semidefinite;
    std::vector<std::pair<Key, bool>> counted;
    std::map<std::shared_ptr<const Matrix>, double> fingerprints; ///< of matrices that stay
  };
} // namespace squeal
