#pragma once

#include <squeal/bars/cell_residuals.h>
#include <squeal/contact/contact.h>
#include <squeal/mesh/cell_map.h>

namespace squeal
{
  /// The problem of one cell for what one degree more adds: the functions of the hierarchical
  /// complement and, on a pad's contact face, their pressures.
  struct LocalProblem
  {
    /// Component times number of functions plus function; contact pressures are component dim.
    std::vector<int> unknowns;
    DenseMatrix matrix;
    bool symmetric = true; ///< and positive: no contact, no tie
  };

  /// The columns of a, then those of b.
  DenseMatrix side_by_side(const DenseMatrix &a, const DenseMatrix &b);

  /// K_WW - K_WV K_VV^{-1} K_VW in the displacements of a local problem's @p matrix, which come
  /// first in it: @p moves and @p base are the places of W and V in @p stiffness.
  DenseMatrix give_way(const DenseMatrix &stiffness, const std::vector<unsigned int> &moves,
                       const std::vector<unsigned int> &base, const DenseMatrix &matrix);

  /// The added functions on a face: traces of displacements and of pressures and tractions, by
  /// (function, point).
  struct FaceTraces
  {
    DenseMatrix moves, multipliers;
  };

  /// Sets up the local problems of theory.md, section 6, on the cells of the space of one degree
  /// more.
  template <int dim>
  class LocalProblems
  {
  public:
    using CellIterator = typename dealii::DoFHandler<dim>::active_cell_iterator;

    /// @p contact may be null; then there is none. @p tie_scale is Ties::scale.
    LocalProblems(const FiniteElementSpace<dim> &spaces, const CellMap<dim> &map,
                  const CellResiduals<dim> &integrals, const Contact<dim> *contact,
                  double pad_pressure, bool with_friction, double tie_scale);

    /// The values of the functions at the nodes, one column each.
    const DenseMatrix functions;

    /// The problem of a cell with its number among this rank's, to whose shape @p integrals was
    /// set. Functions that would move a fixed or a hanging node are left out.
    LocalProblem make(const CellIterator &cell, unsigned int number, const Material &material,
                      CellResiduals<dim> &integrals);

    /// How stiffly the cell, to whose shape @p integrals was set, resists forces on its faces and
    /// edges: for each unknown (field times n plus node) the sum of
    /// 1/(K^{-1})_ww over the complement's functions w of that component that belong to the node's
    /// face or edge. The diagonal of K itself would take a rubber between stiff cells for stiff,
    /// which gives way by bulging. Pressures and tractions, and what has no functions, have 1.
    std::vector<double> resistance(const Material &material, CellResiduals<dim> &integrals);

    /// Adds the contact's part on a face, to which @p on_face was set, of a problem whose unknowns
    /// are field times @p n_w plus function.
    void add_contact(const dealii::FEFaceValues<dim> &on_face, const ContactInterface &interface,
                     const FaceTraces &traces, unsigned int n_w, const std::vector<int> &kept,
                     DenseMatrix &local) const;
    /// The fields of a node that are multipliers of the contact: pressure, tangential tractions.
    std::vector<unsigned int> contact_fields() const;
    const Contact<dim> *contact_of_pads() const
    {
      return contact;
    }

  private:
    /// Adds a tie's part of such a problem likewise.
    void add_tie(const dealii::FEFaceValues<dim> &on_face, const FaceTraces &traces,
                 unsigned int n_w, const std::vector<int> &kept, DenseMatrix &local) const;
    FaceTraces traces_on(const dealii::FEFaceValues<dim> &on_face) const;
    /// The first sides of ties among the cell's faces.
    std::vector<unsigned int> tied_faces(const CellIterator &cell) const;
    void add_tractions(const CellIterator &cell, const std::vector<unsigned int> &faces,
                       const std::vector<bool> &direct, std::vector<int> &kept) const;
    /// The number of the cell's face on the first side of a contact, or -1, and the contact.
    std::pair<int, const ContactInterface *> contact_face(const CellIterator &cell) const;
    void add_pressures(const CellIterator &cell, int face, const std::vector<bool> &direct,
                       std::vector<int> &kept) const;
    const FiniteElementSpace<dim> &spaces;
    const CellMap<dim> &map;
    const Contact<dim> *const contact;
    const double pad_pressure;
    const bool with_friction;
    const double tie_scale;
    const unsigned int n; ///< nodes of a cell
    const DenseMatrix derivatives;
    /// Vertex, edge, face or inside of the reference cell to which a node and a function belong.
    std::vector<unsigned int> entity_of_node, entity_of_function;
    dealii::FEFaceValues<dim> face_values;
    DenseMatrix stiffness;
  };
} // namespace squeal
