#pragma once

#include <squeal/dense.h>
#include <squeal/subspace_iteration.h>

#include <array>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

namespace squeal
{
  /// The equations of motion projected on vectors of a full solution, for parameters nearby.
  ///
  /// With the right vectors' span V and the left vectors' span W, real and of the same dimension,
  ///     (l^2 W^T M V + l W^T P V + W^T Q V) c = 0,   x = V c,   z = W d.
  /// The error of l is of the order of the product of those of x and z. V and W hold displacements;
  /// contact pressures drop out, and follow from the residual. Terms whose matrices stay the same
  /// are projected once; those that change (the contact's) are projected again for every solution,
  /// in the few rows that they couple.
  ///
  /// Displacements of V satisfy N^T u = 0 exactly. Those of W must satisfy (N + mu T)^T w = 0,
  /// which changes with the friction: each time they are moved there by the shortest way,
  ///     w - C^T (C C^T)^{-1} C w,   C = (N + mu T)^T,
  /// so that the pressures drop out of the projection; that these steps remain smooth is up to the
  /// corrections below.
  ///
  /// Every solution is certified by the residual of the whole problem, and by how little its
  /// eigenvalue changes when it is tested with x itself instead of z. What fails is corrected by
  /// inverse iteration with the factors of the full solution,
  ///     x - Q_0^{-1} Q(l) x,   z - Q_0^{-T} Q(l)^H z,
  /// which makes V and W richer (block Davidson); so most parameter values need no factorisation.
  /// Contacts that have opened since the anchor enter by the response of the anchor to a gap there.
  class ReducedModel
  {
  public:
    explicit ReducedModel(const EigensolverOptions &options) : options(options) {}

    /// Begins anew: @p modes are a full solution of the @p terms, with bases and factors
    /// (EigensolverOptions::keep_factors).
    void anchor(const QuadraticEigenproblem &problem, const std::vector<Term> &terms,
                const Modes &modes);
    bool is_anchored() const
    {
      return bool(factors);
    }
    /// Of the anchor's Q; null without.
    const Factorization *factorization() const
    {
      return factors.get();
    }

    /// The modes of other terms as coordinates in V and W (blocks of MPI_COMM_SELF), with upper
    /// bounds of their backward errors. Nothing if these are not below the tolerance or the number
    /// of modes near the window has changed: then solve the whole problem.
    std::optional<Modes> solve(const std::vector<Term> &terms);

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
    RayleighForms rayleigh_forms(const Modes &modes) const;
    /// W^T A V of any other terms.
    std::vector<Term> project(const std::vector<Term> &terms) const;

    /// Modes in coordinates of now or of before the last enrichment as whole vectors.
    Modes expand(const Modes &modes) const;
    /// Coordinates of before an enrichment with zeros for what was added.
    Modes pad(const Modes &modes) const;
    static bool is_reduced(const Modes &modes, const RowRange &rows)
    {
      return modes.re.row_range().size != rows.size || modes.re.row_range().comm != rows.comm;
    }

    unsigned int dimension() const
    {
      return right.vectors.n_columns();
    }

  private:
    using Complex = std::complex<double>;

    /// A basis, displacements orthonormal, and its rows of the interface, those that the changing
    /// terms couple: a column an interface row.
    struct Basis
    {
      Block vectors;
      DenseMatrix at_rows; ///< as they are
      DenseMatrix change;  ///< left: what makes them satisfy the present constraints
      DenseMatrix moved;   ///< the sum
    };
    /// Entries of the changing terms of one order, on all ranks, numbered within the interface.
    struct Entries
    {
      std::vector<int> rows, columns;
      std::vector<double> values;
    };
    /// Eigenpairs in coordinates.
    struct Solutions
    {
      std::vector<Complex> lambda;
      DenseMatrix re, im;
      std::vector<double> errors; ///< bounds of backward errors
    };
    /// W^T A V, V^T A V, W^T A W; V^T A V with V moved to the left constraints.
    enum Form
    {
      petrov,
      of_right,
      of_left,
      tested_by_right
    };
    /// C, the constraints of the displacements, in the interface rows.
    struct Constraints
    {
      std::vector<std::vector<std::pair<unsigned int, double>>> by_row; ///< (constraint, value)
      std::vector<unsigned int> rows; ///< by constraint, in the interface
    };

    double radius() const
    {
      return search_radius(options.max_imaginary);
    }
    /// The bound may exceed the tolerance of full solutions, because it is a bound and eigenvalues
    /// are of second order in it.
    double accepted_error() const
    {
      return 5 * options.tolerance;
    }
    double accepted_change() const
    {
      return 1000 * options.tolerance;
    }
    Block displacements(Block block) const;
    /// The anchor's constraint rows applied to displacements.
    Block violations(const Block &block, bool of_left) const;
    /// The nearest displacements, by the anchor's stiffness, that satisfy its constraints.
    Block moved_by_anchor(const Block &block, bool to_left) const;
    /// Enlarges both bases by what the columns, pairs of right and left ones, add to them, except
    /// for principal components of a size up to @p smallest.
    void append(Block of_right, Block of_left, double smallest);
    /// The same with right vectors and left ones, each with its like on the other side.
    void append_pairs(Block right_ones, const Block &left_ones, double smallest);
    bool find_fixed(const std::vector<Term> &terms);
    bool gather_changing(const std::vector<Term> &terms);
    void add_images();
    bool satisfy_constraints();
    Constraints constraints(bool of_left) const;
    /// - C^T (C C^T)^{-1} C w in the interface rows.
    DenseMatrix shortest_change(const Constraints &constraints, const DenseMatrix &at_rows) const;
    /// - (C C^T)^{-1} C w in the constraints' rows.
    DenseMatrix balancing_pressures(const Constraints &constraints,
                                    const DenseMatrix &at_rows) const;
    DenseMatrix compliant_pressures(const DenseMatrix &basis, bool of_left) const;
    DenseMatrix apply(const Entries &entries, const DenseMatrix &basis) const;
    void clear_constraints(DenseMatrix &at_rows) const;
    /// Columns with the given interface rows, zero elsewhere.
    Block scattered(const DenseMatrix &at_rows) const;
    DenseMatrix sum_of_fixed(const std::vector<DenseMatrix> &by_matrix, unsigned int order) const;
    void project_terms();
    void project_tests();
    QuadraticEigenproblem projected_problem(unsigned int form) const;
    /// All right and left pairs of the disc, in the same order, by LAPACK.
    void solve_densely(Solutions &x, Solutions &y) const;
    /// Those near given ones, of this or a smaller dimension, by two-sided Rayleigh quotient
    /// iteration; false if some do not converge.
    bool improve(Solutions &x, Solutions &y) const;
    static void set_column(Solutions &solutions, unsigned int k,
                           const std::vector<Complex> &vector);
    std::vector<std::vector<Complex>> factors_of(const std::vector<Complex> &lambda) const;
    std::array<DenseMatrix, 2> residuals_at_interface(const Solutions &solutions) const;
    std::vector<double> squares_outside(const Solutions &solutions) const;
    void certify(Solutions &solutions) const;
    /// |dl/l| of each solution for the test with x instead of z.
    std::vector<double> changes(const Solutions &solutions) const;
    Block right_corrections(const Solutions &solutions,
                            const std::vector<unsigned int> &which) const;
    Block left_corrections(const std::vector<Term> &terms, const Solutions &solutions,
                           const std::vector<unsigned int> &which) const;
    Block left_changes(const DenseMatrix &coordinates) const;
    void add_openings();
    Modes make_modes(const Solutions &x, const Solutions &y,
                     const std::vector<unsigned int> &which) const;
    void normalise(Modes &modes) const;

    EigensolverOptions options;
    RowRange rows;
    unsigned int n_local_constraints = 0;
    std::shared_ptr<const Factorization> factors;
    unsigned int n_disc = 0; ///< modes of the anchor in the disc

    std::vector<std::shared_ptr<const Matrix>> candidates, fixed;
    std::vector<double> fixed_norms;
    std::array<std::vector<double>, 3> coefficients; ///< by order and fixed matrix
    bool has_velocity_terms = false;
    std::vector<unsigned int> interface_rows; ///< ascending
    std::vector<int> interface_number;        ///< by row; -1
    std::vector<unsigned int> peak_rows;
    std::vector<char> is_constraint; ///< by interface row
    bool compliant = false, has_constraints = false;
    std::vector<Term> anchor_contact; ///< of order 0, with the constraints
    std::array<Block, 2> pending; ///< the anchor's vectors until the terms that change are known
    Constraints left_constraints; ///< of the present terms
    std::vector<unsigned int> opened; ///< interface rows of the openings in the bases
    std::array<Entries, 3> changing;  ///< by order
    Basis right, left;
    unsigned int n_imaged = 0; ///< columns with images

    std::vector<Block> images;                  ///< A V by fixed matrix, zero in the interface rows
    std::vector<DenseMatrix> gram;              ///< images_i^T images_k, k >= i
    std::vector<DenseMatrix> at_rows;           ///< (A V) in the interface rows, by fixed matrix
    DenseMatrix peaks;                          ///< V in the rows where modes are largest
    std::array<DenseMatrix, 3> changing_images; ///< of V in the interface rows, by order
    std::array<DenseMatrix, 3> images_at_rows;  ///< of all terms, by order
    /// Parts of W^T A V and V^T A V outside and inside of the interface rows, by fixed matrix
    std::vector<std::array<DenseMatrix, 2>> outside, inside;
    std::array<std::vector<DenseMatrix>, 3> projected;   ///< by form and fixed matrix
    std::array<std::array<DenseMatrix, 3>, 4> operators; ///< by form and order
    /// The pressures Lambda_0 + l Lambda_1 + l^2 Lambda_2 of V, in the constraints' rows, and V^T
    /// (N
    /// + mu T) Lambda_order.
    std::array<DenseMatrix, 3> right_pressures, pressure_forms;
    DenseMatrix left_pressures; ///< of a compliant contact
    Solutions last_right, last_left;
  };
} // namespace squeal
