#pragma once

#include <squeal/eigen/block_krylov.h>
#include <squeal/eigen/eigensolvers.h>
#include <squeal/eigen/inertia_count.h>
#include <squeal/projection/search_region.h>
#include <squeal/projection/shift_invert.h>

namespace squeal
{
  /// Solves by one real factorisation at a real shift and a search with it. In this order: counts
  /// the reference modes of the region; factorises; searches all modes of the region, once more if
  /// the numbers differ; refines what is not accurate; adds left vectors; looks for modes of the
  /// window that grow outside of the disc. What kind of search it is, derived classes say.
  class ShiftInvertSolver : public Eigensolver
  {
  public:
    /// @p kind decides where it searches (search_region()).
    explicit ShiftInvertSolver(const ModeSolver kind) : kind(kind) {}
    EigenSolution solve(const QuadraticEigenproblem &problem, const EigensolverOptions &options,
                        const Counting &counting = {}) const override;

  protected:
    struct Task
    {
      const QuadraticEigenproblem &problem;
      const EigensolverOptions &options;
      const Factorization &factorization;
      SearchRegion region;
      double shift;                     ///< of l; in a window the shift of l^2 is region.square
      unsigned int n_expected, n_rigid; ///< by the inertia, in the region

      double radius() const
      {
        return region.radius;
      }
      ShiftInvert shift_invert(const bool adjoint = false) const
      {
        return region.is_disc() ? ShiftInvert(factorization, shift, adjoint)
                                : ShiftInvert::of_square(factorization, region.square, adjoint);
      }
      bool in_region(const std::complex<double> &l) const
      {
        return region.contains(l) && std::abs(l) > rigid_body_limit(options.max_imaginary);
      }
    };
    static BlockSearchOptions search_options(const Task &task, unsigned int seed);
    static void add_left_by_block_search(const Task &task, EigenSolution &solution);
    /// Finds the eigenvalues of the region (proof.eigenvalues) and either the wanted modes or a
    /// space that has them (reuse.search_space).
    virtual EigenSolution search(const Task &task, unsigned int seed) const = 0;
    /// Adds left vectors to modes that have none.
    virtual void add_left(const Task &task, EigenSolution &solution) const = 0;
    /// Whether right and left vectors of the whole disc are computed.
    virtual bool has_all_of_disc() const
    {
      return false;
    }

  private:
    /// Searches with a shift beside zero if there are reference modes at zero. They are looked for
    /// if @p may_be_soft.
    EigenSolution solve_in(const SearchRegion &region, const QuadraticEigenproblem &problem,
                           const EigensolverOptions &options, const Counting &counting,
                           bool may_be_soft) const;
    /// Searches twice if the inertia does not confirm the number found. @p start becomes what spans
    /// the vectors found, to be refined if need be. Throws SolverError if the numbers differ by
    /// more than friction and damping explain.
    EigenSolution search_all(const Task &task, MultiVector &start) const;

    /// Adds modes of the window that grow outside of the disc, and tells what is known of them.
    /// Returns whether there are signs of them.
    static bool look_for_growth_beyond(const Task &task, EigenSolution &solution);

    const ModeSolver kind;
    mutable RememberedCounts count_reference;
  };
} // namespace squeal
