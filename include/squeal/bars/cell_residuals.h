#pragma once

#include <squeal/linalg/dense.h>
#include <squeal/mesh/cell_map.h>
#include <squeal/mesh/finite_element_space.h>
#include <squeal/parameters/materials.h>

#include <deal.II/fe/fe_values.h>

#include <complex>
#include <map>
#include <memory>
#include <vector>

namespace squeal
{
  /// m M + k K + g G + m_star M* + stress S + v V with the matrices of body_operators.h and the
  /// geometric stiffness S of prestress.h: a body's equations of motion at one eigenvalue.
  struct OperatorFactors
  {
    std::complex<double> m, k, g, m_star, stress, v;
  };

  /// Products of a body's operators with many functions of one space, tested with another on the
  /// same mesh, cell by cell, or on elements with own polynomials as wholes, whose nodes are then
  /// meant by those of the cell. No matrix of a cell is formed: all functions at once are evaluated
  /// at the quadrature points and tested there, two products with matrices of the reference cell.
  template <int dim>
  class CellResiduals
  {
  public:
    using CellIterator = typename dealii::DoFHandler<dim>::active_cell_iterator;

    CellResiduals(const FiniteElementSpace<dim> &trial, const FiniteElementSpace<dim> &test);

    /// Geometry of a cell of the space of the tests, free of static stress.
    void reinit(const CellIterator &cell);
    /// Geometry of an element of that space.
    void reinit(const typename CellMap<dim>::Element &element);

    /// The stress sigma_0 = C grad u_0 that the static displacements cause in the cell: its
    /// geometric stiffness is int sigma_0 : grad(du)^T grad(Du). The values of @p u are those at
    /// the nodes of the trials, one column for each component.
    void set_stress(const Material &material, const DenseMatrix &u);

    /// @p r := [Q_j x_j, Q_j^H z_j] for the functions @p u = [Re X, Im X, Re Z, Im Z], Q_j made
    /// with the j-th factors. One row for each node of the cell; a function has dim columns side by
    /// side, its components.
    void apply(const Material &material, const std::vector<OperatorFactors> &factors,
               const DenseMatrix &u, DenseMatrix &r);

    /// Derivatives on the reference cell at the quadrature points of functions given by their
    /// values at the nodes of the tests, one column each: for stiffness().
    DenseMatrix reference_derivatives(const DenseMatrix &functions) const;
    /// Likewise on an element's shape, of which one has been set.
    DenseMatrix reference_derivatives(ElementShape shape, const DenseMatrix &functions) const;

    /// The stiffness K_ab^ik = int C_ijkl d_j W_a d_l W_b of those functions on the cell: entry (i
    /// n
    /// + a, k n + b).
    void stiffness(const Material &material, const DenseMatrix &derivatives, DenseMatrix &result);

  private:
    struct Point
    {
      std::array<double, dim * dim> inverse; ///< (e, d): d xi_e / d x_d
      std::array<double, dim> transport;
      dealii::Tensor<2, dim> stress;
    };
    /// d_d u_i at a point, of the fields at it: values, then derivatives on the reference cell.
    void gradient_at(const Point &point, const std::array<const double *, dim> &fields,
                     double (&gradient)[dim][dim]) const;
    static void stress_of(const ElasticModuli<dim> &C, const double (&gradient)[dim][dim],
                          double (&stress)[dim][dim]);
    void combine_at_points(const Material &material, const OperatorFactors &factors,
                           double *const *re, double *const *im) const;

    /// Functions at the points of a reference cell or of an element's shape.
    struct Reference
    {
      unsigned int n_q = 0;
      DenseMatrix evaluation; ///< values, then derivatives on the reference cell, of the trials
      DenseMatrix testing;    ///< the same of the tests, transposed
    };
    void set_point(unsigned int q, const dealii::Point<dim> &x, double weight);

    const FiniteElementSpace<dim> &test;
    const Reference of_cells;
    std::map<ElementShape, Reference> of_elements;
    const Reference *now; ///< of the cell or element that was set last
    unsigned int n_q;     ///< its points
    dealii::FEValues<dim> geometry;
    std::unique_ptr<ElementInterpolation> trials_of_elements;
    std::unique_ptr<ElementQuadrature> elements; ///< if there are any
    std::vector<Point> points;
    std::vector<double> jxw;
    DenseMatrix fields, scaled, products;
  };
} // namespace squeal
