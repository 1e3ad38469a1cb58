#pragma once

#include <deal.II/base/aligned_vector.h>

#include <array>
#include <vector>

namespace squeal
{
  /// So many cells are computed side by side, each in its lane of a register.
  constexpr unsigned int n_lanes = 8;

  /// A part of the integrand: l and m as in ElasticModuli times k, the others times the density.
  template <int dim>
  struct CellLaw
  {
    std::array<std::array<double, dim>, dim> l, m;
    double m_star = 0, g = 0, mass = 0;
    bool is_elastic = false;

    bool turns() const
    {
      return m_star != 0 || g != 0;
    }
  };

  /// Cells in batches of n_lanes, all of one law, and their geometry. Nodes and quadrature points
  /// of a cell are numbered lexicographically, n = degree + 1 in each direction; a *place* is
  /// (node dim + component) n_lanes + lane.
  template <int dim>
  struct CellBatches
  {
    /// A value in the place of a hanging (or periodic) node is a sum over others.
    struct Share
    {
      unsigned int place, index;
      double weight;
    };

    unsigned int degree = 0;
    std::vector<unsigned int> laws;    ///< by batch
    std::vector<unsigned int> indices; ///< of the vectors' entries, by batch and place
    /// Places of each batch without an entry of their own (whose index is a valid one all the
    /// same), and what is in some of them.
    std::vector<std::vector<unsigned int>> without_entry;
    std::vector<std::vector<Share>> shares;

    /// Functions at points: values of the nodes' polynomials, and derivatives of the polynomials
    /// through the points; n rows of n, by points.
    std::vector<double> interpolation, differentiation;
    /// By batch and point, the lanes innermost; zero weights in lanes without a cell.
    dealii::AlignedVector<double> weights, ///< times the determinant
        inverse_jacobians,                 ///< dim rows: derivatives of a reference coordinate
        transport;                         ///< in reference coordinates; may be empty unless needed

    unsigned int n_points() const; ///< of a cell
  };

  /// Adds to columns y the products of all batches' integrals with columns x.
  template <int dim>
  void add_products(const CellBatches<dim> &batches, const std::vector<CellLaw<dim>> &laws,
                    const std::vector<const double *> &x, const std::vector<double *> &y);
} // namespace squeal
