#pragma once

#include <squeal/reduction/reduced_projection.h>

#include <memory>
#include <optional>
#include <utility>
#include <vector>

namespace squeal
{
  /// The modes for parameters near those of a full solution, the expansion point, by projection.
  ///
  /// V begins with the modes of the full solution and with what its search knows of the modes
  /// beyond them. W equals V, except that its first columns are the expansion point's left
  /// eigenvectors (ReducedProjection).
  ///
  /// Every solution is certified by the residual of the whole problem. What fails is corrected by
  /// inverse iteration with the factors of the expansion point, x - Q_0^{-1} Q(l) x, which makes V
  /// richer (block Davidson); so most parameter values need no factorisation. Contacts that have
  /// opened since the expansion point enter by its response to a gap there, those that have closed
  /// by its response to their pressure; combinations of V with gaps that are closed now are left
  /// out. The right pairs are as good as those of full solutions; the left vectors are those of the
  /// projected problem.
  class ReducedModel
  {
  public:
    /// How parameters come: along a smooth path, where the last solutions tell most of the next
    /// one, or scattered around the expansion point, where all tell as much.
    enum class Course
    {
      path,
      scattered
    };

    explicit ReducedModel(const EigensolverOptions &options, const Course course = Course::path)
        : options(options), course(course), small(options.max_imaginary, options.tolerance)
    {
    }

    /// Begins anew: @p found is what a full solution of the @p terms keeps
    /// (EigensolverOptions::keep_factors).
    void set_expansion_point(const QuadraticEigenproblem &problem, const std::vector<Term> &terms,
                             const EigenSolution::Reuse &found);
    /// What is known of the expansion point's terms: which of them vary.
    AffineTerms &terms()
    {
      return projection.terms;
    }
    const AffineTerms &terms() const
    {
      return projection.terms;
    }
    bool has_expansion_point() const
    {
      return bool(factors);
    }

    /// The modes of other terms as coordinates in V and W (blocks of MPI_COMM_SELF), with upper
    /// bounds of their backward errors. Nothing if these are not below the tolerance or the number
    /// of modes near the window has changed: then solve the whole problem.
    std::optional<EigenPairs> solve(const std::vector<Term> &terms);

    /// Whether V has become so large that it should restart().
    bool is_crowded() const;
    /// Whether V cannot take a vector for each mode any more.
    bool is_full() const
    {
      return has_expansion_point() && dimension() + counts.in_disc > largest_dimension();
    }
    /// Makes V and W anew: on a path of what the last solutions span, since what has been learnt
    /// far back is of no more use; else of the first solution and of the principal components of
    /// all. Modes in coordinates become invalid.
    void restart();

    /// The equations projected for the last solution, and their bases.
    const ReducedProjection &projected() const
    {
      return projection;
    }

    /// How far corrections have moved eigenvalues, by |l| times their backward errors before. To
    /// the first order a projection is off by y^H r / y^H Q'(l) x with the residual r and the true
    /// left vector y, of which only what W lacks counts: it grows with the distance from the
    /// expansion point, and no norm of r shows it. 0 before any has been seen.
    double amplification() const
    {
      return largest_move;
    }

    /// Modes in coordinates of now or of before the last enrichment as whole vectors.
    EigenPairs expand(const EigenPairs &modes) const;
    static bool is_reduced(const EigenPairs &modes, const RowRange &rows)
    {
      return modes.right.row_range().size != rows.size || modes.right.row_range().comm != rows.comm;
    }

    unsigned int dimension() const
    {
      return projection.dimension();
    }

  private:
    using Complex = std::complex<double>;

    double radius() const
    {
      return search_radius(options.max_imaginary);
    }
    /// Eigenvalues of a projection are of the first order in the residual and in what W lacks of
    /// the left vectors: more where parameters are far from the expansion point. (Measured: of 1344
    /// growth rates of scattered samples 5 were beyond their bars with 0.1, none with 0.03.)
    double accepted_error() const
    {
      return (course == Course::path ? 0.1 : 0.03) * options.tolerance;
    }
    /// Beyond it a new expansion point is cheaper. (Measured for whole problems: 50 + 12 a mode;
    /// for halves only a sweep with this number.)
    unsigned int largest_dimension() const
    {
      return 200 + 30 * counts.in_disc;
    }
    bool is_in_window(const Complex lambda) const
    {
      return lambda.imag() <= options.max_imaginary;
    }
    /// Selects from the given numbers the pairs with larger errors. Beyond the window pairs need
    /// only be known.
    std::vector<unsigned int> failing(const SmallPairs &solutions,
                                      const std::vector<unsigned int> &which,
                                      double largest_error) const;
    /// Re and Im of Q(l) x.
    MultiVector residuals_to_correct(const SmallPairs &x) const;
    /// Enlarges V by corrections for residuals; false if there is nothing new in them.
    bool enrich(const MultiVector &residuals);
    /// Makes the terms those that are projected; false if they cannot be.
    bool take(const std::vector<Term> &terms);
    std::optional<EigenPairs> solve_by_projection(const std::vector<Term> &terms);
    /// Whether the disc has no more modes than those that are followed, as far as V shows.
    bool has_number_of_expansion_point() const;
    /// Enlarges V by what contacts need that have opened or closed since the expansion point.
    void add_openings();
    void add_closings();
    /// Enlarges V by the first summands of the responses to forces.
    void add_responses(MultiVector forces, unsigned int n_summands);
    SmallPairs solve_projected();
    /// Takes note of how far a correction has moved the eigenvalues of the window.
    void observe(const SmallPairs &before, const SmallPairs &after);
    /// The pairs with the smallest errors, as many as the expansion point has in the disc.
    std::vector<unsigned int> best_pairs(const SmallPairs &solutions) const;
    EigenPairs make_modes(const SmallPairs &x, const std::vector<unsigned int> &which) const;
    /// [Re, Im] of vectors of this or a smaller dimension.
    DenseMatrix coordinates_of(const ComplexDenseMatrix &vectors) const;
    /// Re and Im of V x or W y.
    MultiVector whole(const SmallPairs &solutions, bool of_left) const;
    /// What restart() is to begin with.
    void remember(const SmallPairs &solutions);
    void restart_on_path();
    void restart_by_components();

    EigensolverOptions options;
    Course course;
    ReducedProjection projection;
    ReducedEigenproblem small;
    std::shared_ptr<const Factorization> factors;
    /// What the disc holds at the expansion point.
    struct Counts
    {
      unsigned int in_disc = 0; ///< modes of the disc, but for overdamped ones
      unsigned int real    = 0; ///< growing real eigenvalues of the disc
      /// Whether there are overdamped ones, too: two of them may become a pair, or one may grow.
      /// Then all of the projected problem are counted, which V must hold.
      bool overdamped = false;
    };
    Counts counts;
    bool has_others = false; ///< another mode than those of the expansion point has been seen
    std::vector<unsigned int> open_at_expansion; ///< rows of its contacts without a pressure
    std::vector<unsigned int> opened, closed;    ///< interface rows whose responses are in V
    std::vector<unsigned int> open_before;       ///< open contacts of the last solution
    SmallPairs last;
    static constexpr unsigned int most_recent = 3;
    std::vector<SmallPairs> recent; ///< those accepted on a path, the last one first
    /// What scattered solutions that were accepted have in common.
    struct Scattered
    {
      MultiVector first_right, first_left; ///< Re and Im of the first one
      DenseMatrix products;                ///< sum of x x^H of unit vectors x in coordinates
      unsigned int n_solutions = 0, n_since_restart = 0, dimension_at_restart = 0;
    };
    Scattered scattered;
    /// What the last solution says of the next one's errors.
    struct Predictor
    {
      double worst = 0;      ///< error in the window
      MultiVector residuals; ///< of what is going to fail, by how errors have grown
    };
    Predictor predictor;
    double largest_move   = 0; ///< amplification()
    unsigned int n_steady = 0; ///< solutions accepted since contacts opened or closed
  };

  /// Cuts modes in coordinates to the first @p n, or adds zeros up to there, as for what bases have
  /// got since.
  EigenPairs in_coordinates(EigenPairs modes, unsigned int n);
} // namespace squeal
