#pragma once

#include <squeal/linalg/multi_vector.h>
#include <squeal/mesh/geometry.h>

#include <deal.II/base/conditional_ostream.h>
#include <deal.II/distributed/tria.h>
#include <deal.II/dofs/dof_handler.h>
#include <deal.II/fe/fe_q.h>
#include <deal.II/fe/mapping_q_cache.h>
#include <deal.II/lac/affine_constraints.h>
#include <deal.II/lac/la_parallel_vector.h>

#include <memory>

namespace squeal
{
  /// One free node and its weight in the interpolation of a (perhaps hanging) node.
  struct WeightedNode
  {
    dealii::types::global_dof_index node;
    double weight;
  };

  /// Holds mesh, finite element and numbering.
  ///
  /// Displacement components share one scalar element, so everything is indexed by *nodes* (degrees
  /// of freedom of the scalar element). An *equation* is a row of the eigenproblem: a displacement
  /// component of a node that is neither fixed nor hanging, the contact pressure of a node on a
  /// contact face, where that sticks with the tangential tractions along e and b, which follow
  /// it, or a component of the traction of a node on the first side of a tie. Fixed
  /// components and hanging nodes have no equation: nothing is stored or solved for them. Each
  /// rank's equations are contiguous, its displacements first, then its contact pressures, then the
  /// tractions of its ties. Those of the points that joints need (theory.md, section 11) are the
  /// first rank's: six motions of each, after its displacements, and six multipliers of each
  /// definition and rigid link, its last ones. So are those of superelements: their coordinates
  /// after the points' motions, and three multipliers of each node that is held after theirs.
  template <int dim>
  class FiniteElementSpace
  {
  public:
    static constexpr unsigned int none = -1;

    FiniteElementSpace(const Geometry<dim> &geometry, unsigned int degree, bool with_multipliers,
                       MPI_Comm comm);

    /// Makes a space of another degree of the same scene on the *same* mesh, which must outlive it
    /// unchanged. One of a higher degree has pressures of degree 2 on elements with own
    /// polynomials.
    FiniteElementSpace(const FiniteElementSpace &other, unsigned int degree);

    /// Numbers nodes and equations on the present mesh. Call it after every change of the mesh.
    void distribute();

    /// The equation of displacement @p component at a locally relevant node, or none.
    unsigned int equation(const dealii::types::global_dof_index node,
                          const unsigned int component) const
    {
      return to_equation(equations[component](node));
    }
    /// The equation of the contact pressure at a locally relevant node, or none.
    unsigned int multiplier(const dealii::types::global_dof_index node) const
    {
      return to_equation(equations[dim](node));
    }

    /// The first of dim - 1 equations of the tangential tractions of a stick contact at a locally
    /// relevant node, or none. They follow that of the contact pressure.
    unsigned int stick(const dealii::types::global_dof_index node) const
    {
      return geometry.has_stick() ? to_equation(equations.back()(node)) : none;
    }
    /// The first of dim equations, one for each component, of the traction of a tie at a locally
    /// relevant node, or none. Surfaces that share nodes share these.
    unsigned int tie(const dealii::types::global_dof_index node) const
    {
      return has_ties() ? to_equation(equations[dim + 1](node)) : none;
    }
    /// The unknowns of a node: displacements, contact pressure, and where there are ties and stick
    /// contacts their tractions.
    unsigned int n_fields() const
    {
      return first_stick_field() + (geometry.has_stick() ? dim - 1 : 0);
    }
    unsigned int first_stick_field() const
    {
      return has_ties() ? 2 * dim + 1 : dim + 1;
    }
    /// The equation of a node's unknown in that order, or none.
    unsigned int field_equation(const dealii::types::global_dof_index node,
                                const unsigned int field) const
    {
      if (field <= dim)
        return to_equation(equations[field](node));
      const unsigned int first_field = field < first_stick_field() ? dim + 1 : first_stick_field(),
                         first       = field < first_stick_field() ? tie(node) : stick(node);
      return first == none ? none : first + field - first_field;
    }
    /// The equation of a motion of a point: along x, y, z, then about them.
    unsigned int point(const unsigned int number, const unsigned int motion) const
    {
      return first_point + 6 * number + motion;
    }
    /// The equation of a multiplier of a point's definition or, with numbers after those of the
    /// points, of a rigid link.
    unsigned int point_multiplier(const unsigned int number, const unsigned int motion) const
    {
      return first_point_multiplier + 6 * number + motion;
    }
    /// The equation of the first coordinate of a superelement.
    unsigned int superelement(unsigned int number) const;
    /// The equation of the first multiplier of a superelement: three of each node that is held.
    unsigned int superelement_multiplier(unsigned int number) const;
    /// Whether there are rows that belong to no node: of points or superelements.
    bool has_nodeless_rows() const
    {
      return has_points() || !geometry.superelements.empty();
    }
    bool has_points() const
    {
      return !geometry.point_joints.points.empty();
    }
    bool has_ties() const
    {
      return !geometry.ties.empty();
    }

    /// The free nodes that interpolate a locally relevant node: itself unless it hangs, lies on the
    /// far side of a periodic boundary, or is none of its element's own (OwnElements).
    std::vector<WeightedNode> expand(dealii::types::global_dof_index node) const;
    /// Whether a locally relevant node moves in a direction, with others or by itself: no support
    /// holds it.
    bool moves(dealii::types::global_dof_index node, unsigned int component) const;
    /// The nodes that interpolate pressures and tractions at a locally relevant node. On elements
    /// with own polynomials these are linear between corners: functions of degree 2 of a triangle's
    /// corners have no resultant, so that a pressure that is positive at nodes need not press.
    std::vector<WeightedNode> expand_multiplier(dealii::types::global_dof_index node) const;
    /// The degree of a field's polynomials on elements with own ones.
    unsigned int degree_on_elements(const unsigned int field) const
    {
      return field < dim ? fe.degree : multiplier_degree;
    }
    /// Where a node of an own or ghost cell is. Only with elements that have own polynomials.
    dealii::Point<dim> position(const dealii::types::global_dof_index node) const
    {
      dealii::Point<dim> x;
      for (unsigned int d = 0; d < dim; ++d)
        x[d] = positions[d](node);
      return x;
    }
    /// Constraints of the nodes of displacements (0 to dim - 1) and of pressures and tractions.
    const dealii::AffineConstraints<double> &lines_of(const unsigned int field) const
    {
      return field < dim || geometry.own.empty() ? hanging : multiplier_lines;
    }

    const Geometry<dim> &geometry;
    const MPI_Comm comm;

  private:
    using Mesh = dealii::parallel::distributed::Triangulation<dim>;
    const std::shared_ptr<Mesh> mesh; ///< shared by spaces of other degrees

  public:
    Mesh &triangulation;
    const dealii::FE_Q<dim> fe;
    dealii::MappingQCache<dim> mapping;
    dealii::DoFHandler<dim> nodes;
    dealii::AffineConstraints<double> hanging; ///< and periodic nodes, and those of own elements
    /// Nodes of own and ghost cells, nodes that these hang on, nodes that share a matrix entry with
    /// own ones.
    dealii::IndexSet relevant_nodes;
    RowRange rows;
    unsigned int n_displacements = 0, n_multipliers = 0, n_ties = 0; ///< global
    unsigned int first_local_multiplier = 0, first_local_tie = 0;    ///< global rows
    unsigned int first_point = 0, first_point_multiplier = 0;        ///< global rows, of all ranks

  private:
    using NodeVector = dealii::LinearAlgebra::distributed::Vector<double>;
    /// Whether it is of a higher degree than the one that it was made from.
    bool is_enriched() const
    {
      return multiplier_degree > 1;
    }
    static unsigned int to_equation(const double value)
    {
      return value < 0 ? none : static_cast<unsigned int>(value);
    }
    /// Makes the geometry isoparametric: cells are polynomials through their nodes, which lie on
    /// the manifold, except for hanging ones (@p constraints), which lie where their parents'
    /// polynomial is. Without that fine faces would leave gaps to, or overlap, the coarse one that
    /// they hang on, and the coordinates themselves, hence rotations, would not be finite element
    /// functions.
    void shape_cells(const dealii::AffineConstraints<double> &constraints);
    /// Gives elements with own polynomials the shape that they have in the space that this one was
    /// made from, so that its functions are functions here, too: with circles followed by one
    /// degree more, rotations of flat elements would no longer fit their deflections.
    void shape_elements_as_before();

    const FiniteElementSpace *const coarser = nullptr;  ///< from which it was made
    dealii::AffineConstraints<double> multiplier_lines; ///< with own elements
    const bool with_multipliers;
    const unsigned int multiplier_degree; ///< on elements with own polynomials
    std::vector<NodeVector> positions;    ///< with own elements: by component
    std::vector<NodeVector> equations;    ///< components, multiplier, tie, stick; -1: none
  };
} // namespace squeal
