#pragma once

#include <squeal/linalg/dense.h>
#include <squeal/mesh/element_cells.h>
#include <squeal/mesh/finite_element_space.h>

#include <deal.II/base/partitioner.h>

#include <memory>
#include <vector>

namespace squeal
{
  using Column = dealii::LinearAlgebra::distributed::Vector<double>;

  /// Where the unknowns of each own cell stand in a distributed vector. A cell's unknown is
  /// numbered c n + a: field c of node a, as FiniteElementSpace::field_equation() counts them.
  /// Cells of elements with own polynomials have none: these elements have them.
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

    /// An element with own polynomials of which this rank has a cell.
    struct Element
    {
      /// A field of an own node of displacements, or of multipliers, that has an equation.
      struct Unknown
      {
        unsigned int field, node, index; ///< index: local, in the vector
      };
      ElementCells cells;
      ElementShape shape;
      bool mine;           ///< this rank has its first cell: it sums what elements add
      unsigned int number; ///< of the first cell among this rank's
      std::vector<dealii::types::global_dof_index> nodes; ///< own ones of displacements
      std::vector<Unknown> unknowns;
    };

    explicit CellMap(const FiniteElementSpace<dim> &spaces);

    /// The columns with the values of other ranks that own cells need.
    std::vector<Column> import(const MultiVector &block) const;
    std::vector<Column> zeros(unsigned int n_columns) const;
    /// The unknowns of a cell, one column for each vector.
    void gather(unsigned int cell, const std::vector<Column> &from, DenseMatrix &to) const;

    /// An element's unknowns of some fields: one row for each own node, and for each vector as many
    /// columns as fields, side by side.
    DenseMatrix gather(const Element &element, unsigned int n_nodes, unsigned int first_field,
                       unsigned int end_field, const std::vector<Column> &from) const;

    /// Whether an own cell, by number, belongs to one of the elements.
    bool is_part_of_element(const unsigned int cell) const
    {
      return is_part[cell];
    }

    std::vector<std::vector<Entry>> cells;
    std::vector<Element> elements;
    const RowRange rows;

  private:
    std::vector<bool> is_part; ///< by cell
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
