#pragma once

#include <squeal/projection/reduced_eigenproblem.h>
#include <squeal/projection/residual_sketch.h>
#include <squeal/reduction/affine_terms.h>
#include <squeal/reduction/interface_terms.h>
#include <squeal/reduction/projection_basis.h>

#include <array>
#include <complex>
#include <optional>
#include <vector>

namespace squeal
{
  /// The equations of motion projected on a basis V with test vectors W,
  ///     l^2 W^T M V + l W^T P V + W^T Q V,
  /// and the residuals of what is found there.
  ///
  /// Constant matrices are projected once for each vector of the basis; those that change (the
  /// contact's) again for every set of terms, in the few rows that they couple: the interface.
  ///
  /// Displacements of V satisfy N^T u = 0. Those of W must satisfy (N + mu T)^T w = 0, which
  /// changes with the friction: each time they are moved there by the shortest way,
  ///     w - C^T (C C^T)^{-1} C w,   C = (N + mu T)^T,
  /// so that the contact pressures drop out of the projection; they follow from the residual.
  class ReducedProjection
  {
  public:
    /// W^T A V, V^T A V, W^T A W.
    enum Form
    {
      petrov,
      of_right,
      of_left
    };

    ReducedProjection() = default;
    /// Takes the layout of a problem; the basis and the terms begin empty.
    explicit ReducedProjection(const QuadraticEigenproblem &problem);

    /// Finds the constant matrices and the interface, which never loses a row. False if the latter
    /// is no small part. Collective.
    bool split(const std::vector<Term> &terms);
    /// Takes what changes with the contact, from AffineTerms::update(). False if that couples other
    /// rows than the interface. Collective.
    bool set_changing(const TermList &changing);
    /// Must follow when vectors of the basis have become others, not when some are added.
    void forget_images();
    /// In its place where V has become V C and W has other left vectors.
    void turn(const DenseMatrix &c);

    /// Projects what the search for pairs needs, which @p small gets. Collective.
    void project(ReducedEigenproblem &small);
    /// Projects what is to be known of a solution beyond its pairs.
    void project_tests();

    /// The projected problem; the form petrov after project(), all after project_tests().
    QuadraticEigenproblem problem(Form form) const;
    const DenseMatrix &operator_of(const Form form, const unsigned int order) const
    {
      return operators[form][order];
    }
    /// W^T A V of any other terms.
    std::vector<Term> project(const std::vector<Term> &terms) const;

    /// Q(l) x with the pressures that make the interface rows smallest, Re and Im.
    MultiVector residuals(const SmallPairs &solutions) const;
    /// Sets upper bounds of the backward errors in the Euclidean norm, by sketches of residuals().
    void certify(SmallPairs &solutions) const;

    /// x^H P x and x^H Q x of modes.
    struct RayleighForms
    {
      std::vector<std::complex<double>> of_p, of_q;
    };
    RayleighForms rayleigh_forms(const EigenPairs &modes) const;

    unsigned int dimension() const
    {
      return basis.dimension();
    }
    const InterfaceTerms &interface_terms() const
    {
      return interface;
    }

    ProjectionBasis basis;
    AffineTerms terms;

  private:
    using Complex = std::complex<double>;

    void clean(MultiVector &added) const;
    void add_images();
    /// Completes the forms of the constant matrix i by the left vectors' products with A V.
    void set_tests(unsigned int i, const DenseMatrix &of_left_vectors);
    void satisfy_constraints(ReducedEigenproblem &small);
    /// sum_order c_i,order l^order of the constant matrix i, by eigenvalue.
    std::vector<Complex> factors_of(unsigned int i, const std::vector<Complex> &lambda) const;
    DenseMatrix forces_at_interface(const std::vector<Complex> &lambda,
                                    const ComplexDenseMatrix &x) const;
    DenseMatrix residuals_at_interface(const SmallPairs &solutions) const;

    /// W in the interface: a column a row. What makes it satisfy the present constraints.
    struct Tests
    {
      DenseMatrix rows;
      DenseMatrix balance;   ///< - (C C^T)^{-1} C V of the left constraints
      DenseMatrix change;    ///< C^T balance
      DenseMatrix moved;     ///< rows + change
      DenseMatrix pressures; ///< of a compliant contact
    };

    InterfaceTerms interface;
    unsigned int n_imaged = 0; ///< columns with images
    std::optional<ResidualSketch> sketch;
    std::vector<DenseMatrix> sketches; ///< of A V beside the interface, by constant matrix
    std::vector<DenseMatrix> at_rows;  ///< (A V) in the interface, by constant matrix
    DenseMatrix right_rows;            ///< V in the interface
    DenseMatrix right_change;          ///< not zero where contacts have closed
    DenseMatrix right_pressures;       ///< of a compliant contact
    Tests tests;
    std::array<DenseMatrix, 3> changing_images;          ///< of V in the interface, by order
    std::array<DenseMatrix, 3> images_at_rows;           ///< of all terms, by order
    std::array<std::vector<DenseMatrix>, 3> projected;   ///< by form and constant matrix
    std::array<std::array<DenseMatrix, 3>, 3> operators; ///< by form and order
  };
} // namespace squeal
