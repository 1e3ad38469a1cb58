#pragma once

#include <squeal/assessment/stability.h>

#include <algorithm>
#include <string>
#include <vector>

namespace squeal
{
  /// The modes at one value of a parameter, with the numbers of the branches they belong to.
  struct BranchPoint
  {
    double value = 0;
    EigenPairs modes;
    EigenSolution::Reuse reuse;         ///< of a full solution
    std::vector<unsigned int> branches; ///< by mode
    std::vector<double> overlaps;       ///< with the branch's mode at the point before; 0: new
    unsigned int n_branches = 0;        ///< branches so far
    std::vector<ModeRow> rows;          ///< of the modes

    /// The mode of a branch, or -1.
    int index_of(const unsigned int branch) const
    {
      const auto at = std::find(branches.begin(), branches.end(), branch);
      return at == branches.end() ? -1 : int(at - branches.begin());
    }
  };

  /// c_ij = z_i^H [(l_i + l'_j) M + P] x'_j / 2 l_i, by the form in brackets (biorthogonality()) of
  /// the modes before and of the next ones, both column-major:
  ///     [x'_j; l'_j x'_j] = sum_i c_ij [x_i; l_i x_i],
  /// but for what is outside of their span.
  std::vector<std::complex<double>> transition_of(std::vector<std::complex<double>> form,
                                                  const EigenPairs &before);

  /// The branches of the modes of @p next, which continue those of @p before: the assignment with
  /// the largest overlaps
  ///     o_ij = |c_ij|
  /// of @p transition, z_i the left vector before: at equal operators o_ij = delta_ij. Fills @p
  /// next.branches; a mode without a predecessor begins a new branch.
  ///
  /// Returns whether every continuation is beyond doubt: an overlap above 0.8 and no second one
  /// above half of it. Modes in the uppermost hundredth of the window or outside of the search disc
  /// may come and go.
  bool continue_branches(const std::vector<std::complex<double>> &transition,
                         const BranchPoint &before, double max_imaginary, BranchPoint &next);

  /// Follows modes whose vectors cannot be compared, because the meshes differ: the assignment with
  /// the least sum of squared distances of the eigenvalues. A mode that would have to move by more
  /// than a tenth begins a new branch.
  void continue_by_eigenvalues(const BranchPoint &before, BranchPoint &next);
} // namespace squeal
