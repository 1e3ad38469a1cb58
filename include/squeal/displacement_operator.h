#pragma once

#include <squeal/material_operator.h>
#include <squeal/spaces.h>

#include <deal.II/lac/la_parallel_block_vector.h>
#include <deal.II/matrix_free/matrix_free.h>

#include <array>
#include <memory>
#include <utility>
#include <vector>

namespace squeal
{
  /// Products of the bodies' matrices with vectors, without the matrices: sums over the cells, in
  /// which integrals factorise along the coordinate directions (deal.II's MatrixFree, Kronbichler
  /// and Kormann 2012). A product costs O(p) per unknown where a stored matrix costs O(p^3), and
  /// there is nothing to store. The same quadrature and geometry as assemble_body().
  template <int dim>
  class DisplacementOperator
  {
  public:
    /// @p spaces must outlive it unchanged. Each cell belongs to one of the @p parts.
    DisplacementOperator(const Spaces<dim> &spaces, const std::vector<MaterialOperator> &parts);

    /// Other factors on the same bodies in the same order, with what the cells of @p other are
    /// evaluated by; without diagonal().
    DisplacementOperator(const DisplacementOperator &other,
                         const std::vector<MaterialOperator> &parts);

    /// Zero in the rows of multipliers, which are not read either.
    Block multiply(const Block &x, bool transposed = false) const;

    /// The entries on the diagonal but for those of M; of nodes that others hang on without what
    /// couples these. Zero in the rows of multipliers.
    const Block &diagonal() const
    {
      return diagonal_;
    }

  private:
    using Number  = dealii::VectorizedArray<double>;
    using Vectors = dealii::LinearAlgebra::distributed::BlockVector<double>; ///< by component

    /// A part of the integrand, with moduli as in ElasticModuli times k.
    struct Law
    {
      std::array<std::array<double, dim>, dim> l, m;
      double m_star, g, mass; ///< times the density
      bool is_elastic;

      explicit Law(const MaterialOperator &part);
      bool turns() const
      {
        return m_star != 0 || g != 0;
      }
      bool needs_values() const
      {
        return mass != 0 || g != 0;
      }
      bool needs_gradients() const
      {
        return is_elastic || turns();
      }

      /// What is tested with grad v: K's part, and that of M* and G for given u and w; what is
      /// tested with v.
      dealii::Tensor<2, dim, Number> stress(const dealii::Tensor<2, dim, Number> &gradient) const;
      void add_transport(const dealii::Tensor<1, dim, Number> &w,
                         const dealii::Tensor<2, dim, Number> &gradient,
                         const dealii::Tensor<1, dim, Number> &u, double g,
                         dealii::Tensor<1, dim, Number> &force,
                         dealii::Tensor<2, dim, Number> &flux) const;
    };

    /// What does not depend on the factors.
    struct Cells
    {
      std::vector<unsigned int> number_of_part; ///< by material id of cells
      dealii::MatrixFree<dim> data;
      std::vector<unsigned int> number_of_batch;
      unsigned int n_points = 0;                                       ///< of a cell
      dealii::AlignedVector<dealii::Tensor<1, dim, Number>> transport; ///< at points, if needed
      /// Component and local number of the node of each displacement row of this rank.
      std::vector<std::pair<unsigned int, unsigned int>> place_of_row;
      mutable Vectors from, to;
    };

    void add_cells(Vectors &to, const Vectors &from,
                   const std::pair<unsigned int, unsigned int> &batches, bool transposed) const;
    void number_rows(Cells &cells) const;
    /// At all points; collective only in name.
    void tabulate_transport(Cells &cells) const;
    void compute_diagonal();

    const Spaces<dim> &spaces;
    std::vector<Law> laws; ///< by part
    std::shared_ptr<Cells> cells;
    Block diagonal_;
  };
} // namespace squeal
