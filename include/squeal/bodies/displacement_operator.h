#pragma once

#include <squeal/bodies/cell_kernels.h>
#include <squeal/bodies/material_operator.h>
#include <squeal/mesh/finite_element_space.h>

#include <deal.II/base/partitioner.h>
#include <deal.II/fe/fe_values.h>

#include <functional>
#include <memory>
#include <vector>

namespace squeal
{
  /// Products of the bodies' matrices with vectors, without the matrices: sums over the cells, in
  /// which integrals factorise along the coordinate directions (Kronbichler and Kormann 2012). A
  /// product costs O(p) per unknown where a stored matrix costs O(p^3), and all that is stored is
  /// the geometry. The same quadrature and geometry as assemble_body(). Why not deal.II's
  /// MatrixFree: as Debian builds it, it computes one number at a time.
  template <int dim>
  class DisplacementOperator
  {
  public:
    /// @p spaces must outlive it unchanged. Each cell belongs to one of the @p parts.
    DisplacementOperator(const FiniteElementSpace<dim> &spaces,
                         const std::vector<MaterialOperator> &parts);

    /// Other factors on the same bodies in the same order, with what the cells of @p other are
    /// evaluated by; without diagonal().
    DisplacementOperator(const DisplacementOperator &other,
                         const std::vector<MaterialOperator> &parts);

    /// Zero in the rows of multipliers, which are not read either.
    MultiVector multiply(const MultiVector &x, bool transposed = false) const;

    /// The entries on the diagonal but for those of M; of nodes that others hang on without what
    /// couples these. Zero in the rows of multipliers.
    const MultiVector &diagonal() const
    {
      return diagonal_;
    }

  private:
    /// What does not depend on the factors.
    struct Cells
    {
      std::vector<unsigned int> number_of_part; ///< by material id of cells
      CellBatches<dim> batches;
      /// Cells in the lanes of the batches.
      std::vector<std::vector<typename dealii::DoFHandler<dim>::active_cell_iterator>> members;
      std::shared_ptr<const dealii::Utilities::MPI::Partitioner> partitioner;
    };

    using CellValues = dealii::FEValues<dim>;
    /// Visits every lane of every batch, those without a cell as if it were the first one's.
    void for_each_lane(dealii::UpdateFlags flags,
                       const std::function<void(unsigned int batch, unsigned int lane,
                                                const CellValues &values)> &visit) const;
    void make_batches();
    void tabulate_indices();
    void tabulate_geometry();
    /// At all points; collective only in name.
    void tabulate_transport();
    void compute_diagonal();

    const FiniteElementSpace<dim> &spaces;
    std::vector<CellLaw<dim>> laws; ///< by part
    std::shared_ptr<Cells> cells;
    MultiVector diagonal_;
  };
} // namespace squeal
