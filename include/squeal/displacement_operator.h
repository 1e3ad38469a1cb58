#pragma once

#include <squeal/spaces.h>
#include <squeal/static_body.h>

#include <deal.II/lac/la_parallel_block_vector.h>
#include <deal.II/matrix_free/matrix_free.h>

#include <array>
#include <utility>
#include <vector>

namespace squeal
{
  /// The product of the bodies' static matrices with a vector, without the matrices: sums over the
  /// cells, in which integrals factorise along the coordinate directions (deal.II's MatrixFree,
  /// Kronbichler and Kormann 2012). A product costs O(p) per unknown where a stored matrix costs
  /// O(p^3), and there is nothing to store. The same quadrature and geometry as assemble_body().
  template <int dim>
  class DisplacementOperator
  {
  public:
    /// @p spaces must outlive it unchanged.
    DisplacementOperator(const Spaces<dim> &spaces, const std::vector<StaticBody> &bodies);

    /// One column; zero in the rows of multipliers.
    Block multiply(const Block &x) const;

    /// The entries on the diagonal; of nodes that others hang on without what couples these.
    /// Zero in the rows of multipliers.
    const Block &diagonal() const
    {
      return diagonal_;
    }

  private:
    using Number  = dealii::VectorizedArray<double>;
    using Vectors = dealii::LinearAlgebra::distributed::BlockVector<double>; ///< by component

    /// A body's part of the integrand, with moduli as in ElasticModuli.
    struct Law
    {
      std::array<std::array<double, dim>, dim> l, m;
      double m_star, g; ///< times the density

      /// What is tested with grad v: K's part, and that of M* and G for given u and w.
      dealii::Tensor<2, dim, Number> stress(const dealii::Tensor<2, dim, Number> &gradient) const;
      void add_transport(const dealii::Tensor<1, dim, Number> &w,
                         const dealii::Tensor<2, dim, Number> &gradient,
                         dealii::Tensor<1, dim, Number> &value,
                         dealii::Tensor<2, dim, Number> &flux) const;
    };

    void apply_cells(const dealii::MatrixFree<dim> &, Vectors &to, const Vectors &from,
                     const std::pair<unsigned int, unsigned int> &batches) const;
    void tabulate();
    void compute_diagonal();

    const Spaces<dim> &spaces;
    std::vector<Law> laws;                 ///< by body of the constructor
    std::vector<unsigned int> law_of_part; ///< by material id of cells
    dealii::MatrixFree<dim> cells;
    std::vector<unsigned int> law_of_batch;
    dealii::AlignedVector<dealii::Tensor<1, dim, Number>> transport; ///< at points, if it is needed
    /// Component and local number of the node of each displacement row of this rank.
    std::vector<std::pair<unsigned int, unsigned int>> place_of_row;
    mutable Vectors from, to;
    Block diagonal_;
  };
} // namespace squeal
