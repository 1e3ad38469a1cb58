#pragma once

#include <squeal/linalg/dense.h>
#include <squeal/mesh/finite_element_space.h>

#include <deal.II/base/partitioner.h>

#include <memory>
#include <vector>

namespace squeal
{
  using Column = dealii::LinearAlgebra::distributed::Vector<double>;

  /// Where the unknowns of each own cell stand in a distributed vector. A cell's unknown is
  /// numbered c n + a: field c of node a, as FiniteElementSpace::field_equation() counts them.
  template <int dim>
  class CellMap
  {
  public:
    struct Entry
    {
      unsigned int unknown, index; ///< number in the cell, local index in the vector
      double weight;
      bool direct; ///< the node itself, not a part of a hanging one
    };

    explicit CellMap(const FiniteElementSpace<dim> &spaces);

    /// The columns with the values of other ranks that own cells need.
    std::vector<Column> import(const MultiVector &block) const;
    std::vector<Column> zeros(unsigned int n_columns) const;
    /// The unknowns of a cell, one column for each vector.
    void gather(unsigned int cell, const std::vector<Column> &from, DenseMatrix &to) const;

    /// The local index of an equation of a node of an own cell, or of an own node of an element of
    /// which this rank has a cell.
    unsigned int index_of(const unsigned int equation) const
    {
      return partitioner->global_to_local(equation);
    }

    std::vector<std::vector<Entry>> cells;
    const RowRange rows;

  private:
    std::shared_ptr<dealii::Utilities::MPI::Partitioner> partitioner;
  };

  /// The shape functions of one element at the nodes of another.
  template <int dim>
  DenseMatrix interpolation(const dealii::FiniteElement<dim> &from,
                            const dealii::FiniteElement<dim> &to);

  /// The functions of degree p + 1 that one more degree adds to those of degree p, on the
  /// reference cell: products of the hierarchical one-dimensional functions (two hats, integrated
  /// Legendre polynomials) with at least one of degree p + 1. As values at the nodes of degree
  /// p + 1: one column each.
  template <int dim>
  DenseMatrix hierarchical_complement(const dealii::FiniteElement<dim> &fe);
} // namespace squeal
