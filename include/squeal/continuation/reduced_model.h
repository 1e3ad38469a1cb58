#pragma once

#include <squeal/continuation/interface_terms.h>
#include <squeal/continuation/projection_basis.h>
#include <squeal/continuation/reduced_eigenproblem.h>

#include <array>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

namespace squeal
{
  /// The equations of motion projected on vectors of a full solution, for parameters nearby.
  ///
  /// With a basis V of displacements and test vectors W of the same number, real,
  ///     (l^2 W^T M V + l W^T P V + W^T Q V) c = 0,   x = V c,   z = W d.
  /// V begins with the modes of the full solution, the expansion point, and with what its search
  /// knows of the modes beyond them. W has the expansion point's left vectors in place of the right
  /// ones, and is V else. Terms whose matrices stay the same are projected once, those with
  /// constant coefficients as one sum; those that change (the contact's) are projected again for
  /// every solution, in the few rows that they couple.
  ///
  /// Displacements of V satisfy N^T u = 0. Those of W must satisfy (N + mu T)^T w = 0, which
  /// changes with the friction: each time they are moved there by the shortest way,
  ///     w - C^T (C C^T)^{-1} C w,   C = (N + mu T)^T,
  /// so that the contact pressures drop out of the projection; they follow from the residual.
  ///
  /// Every solution is certified by the residual of the whole problem. What fails is corrected by
  /// inverse iteration with the factors of the expansion point, x - Q_0^{-1} Q(l) x, which makes V
  /// richer (block Davidson); so most parameter values need no factorisation. Contacts that have
  /// opened since the expansion point enter by its response to a gap there; combinations of V with
  /// gaps that are closed now are left out. The right pairs are as good as those of full solutions;
  /// the left vectors are those of the projected problem.
  class ReducedModel
  {
  public:
    explicit ReducedModel(const EigensolverOptions &options)
        : options(options), small(options.max_imaginary)
    {
    }

    /// Begins anew: @p found is what a full solution of the @p terms keeps
    /// (EigensolverOptions::keep_factors).
    void set_expansion_point(const QuadraticEigenproblem &problem, const std::vector<Term> &terms,
                             const EigenSolution::Reuse &found);
    /// The expansion point's terms whose coefficients have been seen to change, by number. Sums do
    /// not contain them; a run that is resumed is told, so that it adds in the same order.
    std::vector<double> varying_terms() const;
    void keep_apart(const std::vector<double> &varying_terms);

    bool has_expansion_point() const
    {
      return bool(factors);
    }

    /// The modes of other terms as coordinates in V and W (blocks of MPI_COMM_SELF), with upper
    /// bounds of their backward errors. Nothing if these are not below the tolerance or the number
    /// of modes near the window has changed: then solve the whole problem.
    std::optional<EigenPairs> solve(const std::vector<Term> &terms);

    /// Whether V has become so large that it should restart(). (Measured: with 3 and 22 modes.)
    bool is_crowded() const
    {
      // ReducedPairs with the same contacts tell more of those to come.
      const bool is_steady = n_steady >= most_recent;
      // Overdamped modes are in V, but not in what the last solutions span.
      return !has_overdamped && !recent.empty() &&
             dimension() > (is_steady ? 56 + 6 * n_disc : 106 + 9 * n_disc);
    }
    /// Makes V and W anew of what the last solutions span: the parameters' path is smooth, and what
    /// has been learnt far back on it is of no more use. Modes in coordinates become invalid.
    void restart();

    /// W^T M V, W^T P V, W^T Q V of the last solution: the form in which left and right coordinates
    /// are orthogonal.
    QuadraticEigenproblem problem() const
    {
      return projected_problem(petrov);
    }
    /// x^H P x and x^H Q x of modes of the last solution.
    struct RayleighForms
    {
      std::vector<std::complex<double>> of_p, of_q;
    };
    RayleighForms rayleigh_forms(const EigenPairs &modes) const;
    /// W^T A V of any other terms.
    std::vector<Term> project(const std::vector<Term> &terms) const;

    /// Modes in coordinates of now or of before the last enrichment as whole vectors.
    EigenPairs expand(const EigenPairs &modes) const;
    /// Coordinates of whole vectors of the span, as of modes before restart().
    EigenPairs coordinates(const EigenPairs &whole) const
    {
      return basis.coordinates(whole);
    }
    /// Coordinates of before an enrichment with zeros for what was added.
    EigenPairs pad(const EigenPairs &modes) const;
    static bool is_reduced(const EigenPairs &modes, const RowRange &rows)
    {
      return modes.right.row_range().size != rows.size || modes.right.row_range().comm != rows.comm;
    }

    unsigned int dimension() const
    {
      return basis.dimension();
    }

  private:
    using Complex = std::complex<double>;

    /// A matrix in one of the orders and the sum of its coefficients.
    struct Member
    {
      std::shared_ptr<const Matrix> matrix;
      unsigned int order;
      double coefficient;
      bool of_contact; ///< changes with the area of contact, also where it has not yet
    };
    using Members = std::vector<Member>;
    /// The sum of all matrices of an order with constant coefficients, or one whose coefficient
    /// varies.
    struct Fixed
    {
      unsigned int order;
      std::shared_ptr<const Matrix> matrix;
      Members members;
    };
    /// W^T A V, V^T A V, W^T A W.
    enum Form
    {
      petrov,
      of_right,
      of_left
    };
    double radius() const
    {
      return search_radius(options.max_imaginary);
    }
    /// Eigenvalues of a projection are of the first order in the residual.
    double accepted_error() const
    {
      return 0.1 * options.tolerance;
    }
    /// Beyond it a new expansion point is cheaper. (Measured for whole problems: 50 + 12 a mode;
    /// for halves only a sweep with this number.)
    unsigned int largest_dimension() const
    {
      return 200 + 12 * n_disc;
    }
    /// In the order of the terms: sums must not depend on addresses.
    static Members members_of(const std::vector<Term> &terms);
    static const Member *find(const Members &members, const Member &member);
    bool find_fixed(const std::vector<Term> &terms);
    void forget_images();
    bool gather_changing(const std::vector<Term> &terms);
    void clean(MultiVector &added) const;
    void add_images();
    void satisfy_constraints();
    DenseMatrix sum_of_fixed(const std::vector<DenseMatrix> &by_matrix, unsigned int order) const;
    void project_terms();
    void project_tests();
    QuadraticEigenproblem projected_problem(unsigned int form) const;
    std::vector<std::vector<Complex>> factors_of(const std::vector<Complex> &lambda) const;
    std::array<DenseMatrix, 2> forces_at_interface(const std::vector<Complex> &lambda,
                                                   const DenseMatrix &re,
                                                   const DenseMatrix &im) const;
    std::array<DenseMatrix, 2> residuals_at_interface(const ReducedPairs &solutions) const;
    /// Q(l) x with the pressures that make the interface rows smallest, Re and Im.
    MultiVector residuals(const ReducedPairs &solutions) const;
    void certify(const MultiVector &residuals, ReducedPairs &solutions) const;
    bool is_in_window(const Complex lambda) const
    {
      return lambda.imag() <= options.max_imaginary;
    }
    /// Of the pairs of the given numbers those with larger errors. Beyond the window pairs need
    /// only be known.
    std::vector<unsigned int> failing(const ReducedPairs &solutions,
                                      const std::vector<unsigned int> &which,
                                      double largest_error) const;
    /// Q_0^{-1} Q(l) x of some, Re and Im.
    MultiVector corrections(const MultiVector &residuals,
                            const std::vector<unsigned int> &which) const;
    /// Enlarges V by the corrections of pairs that fail; false if there is nothing new in them.
    bool enrich(const MultiVector &residuals, const ReducedPairs &x);
    std::optional<EigenPairs> solve_by_projection(const std::vector<Term> &terms);
    /// Whether the disc has no more modes than those that are followed, as far as V shows.
    bool has_number_of_expansion_point() const;
    void add_openings();
    /// The first summands of the responses to gaps at these interface rows.
    void add_responses(const std::vector<unsigned int> &added, unsigned int n_summands);
    MultiVector solve_projected(ReducedPairs &x, ReducedPairs &y);
    /// The pairs with the smallest errors, as many as the expansion point has in the disc.
    std::vector<unsigned int> best_pairs(const ReducedPairs &solutions) const;
    EigenPairs make_modes(const ReducedPairs &x, const ReducedPairs &y,
                          const std::vector<unsigned int> &which) const;
    void normalise(EigenPairs &modes) const;

    EigensolverOptions options;
    RowRange rows;
    unsigned int n_local_constraints = 0;
    std::shared_ptr<const Factorization> factors;
    /// Modes of the expansion point in the disc, but for overdamped ones
    unsigned int n_disc = 0;
    /// Whether there are overdamped ones, too: two of them may become a pair, or one may grow. Then
    /// all of the projected problem are counted, which V must hold.
    bool has_overdamped = false, has_others = false; ///< another one has been seen

    unsigned int n_real_at_expansion = 0; ///< eigenvalues of the disc
    std::vector<Term> expansion_terms;
    Members varying;
    std::vector<Fixed> fixed;
    std::vector<double> fixed_norms;
    std::array<std::vector<double>, 3> coefficients; ///< by order and fixed matrix
    bool has_velocity_terms = false;
    InterfaceTerms interface;
    std::vector<unsigned int> opened;      ///< interface rows whose openings' responses are in V
    std::vector<unsigned int> open_before; ///< open contacts of the last solution
    ProjectionBasis basis;
    ReducedEigenproblem small;
    DenseMatrix right_rows, left_rows; ///< of V and W in the interface: a column a row
    DenseMatrix left_balance;          ///< - (C C^T)^{-1} C V of the left constraints
    DenseMatrix left_change;           ///< what makes W satisfy the present constraints
    DenseMatrix left_moved;            ///< left_rows + left_change
    DenseMatrix right_change;          ///< the same for V: not zero where contacts have closed
    unsigned int n_imaged = 0;         ///< columns with images

    std::vector<MultiVector> images;            ///< A V by fixed matrix, zero in the interface rows
    std::vector<DenseMatrix> at_rows;           ///< (A V) in the interface rows, by fixed matrix
    DenseMatrix peaks;                          ///< V in the rows where modes are largest
    std::array<DenseMatrix, 3> changing_images; ///< of V in the interface rows, by order
    std::array<DenseMatrix, 3> images_at_rows;  ///< of all terms, by order
    std::array<std::vector<DenseMatrix>, 3> projected;   ///< by form and fixed matrix
    std::array<std::array<DenseMatrix, 3>, 3> operators; ///< by form and order
    DenseMatrix left_pressures, right_pressures;         ///< of a compliant contact
    ReducedPairs last_right, last_left;
    static constexpr unsigned int most_recent = 3;
    std::vector<std::pair<ReducedPairs, ReducedPairs>>
        recent; ///< those accepted, the last one first
    /// What the last solution says of the next one's errors.
    struct Predictor
    {
      MultiVector residuals;
      ReducedPairs solutions;
      double worst = 0, growth = 1; ///< error in the window, and its ratio to the one before
    };
    Predictor predictor;
    unsigned int n_steady = 0; ///< solutions accepted since contacts opened or closed
  };
} // namespace squeal
