#pragma once

#include <squeal/mesh/own_elements.h>
#include <squeal/mesh/quadratic_cells.h>
#include <squeal/mesh/rigid_motion.h>
#include <squeal/mesh/superelement.h>

#include <deal.II/base/point.h>
#include <deal.II/base/tensor.h>
#include <deal.II/base/types.h>

#include <algorithm>
#include <array>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace squeal
{
  /// Bodies are material ids of the mesh.
  enum Body : dealii::types::material_id
  {
    rotor_body     = 0,
    upper_pad_body = 1,
    lower_pad_body = 2
  };

  inline bool is_pad(const dealii::types::material_id body)
  {
    return body != rotor_body;
  }

  /// What two surfaces in contact do along each other (theory.md, section 11).
  enum class ContactKind
  {
    sliding,      ///< a pad on the rotor: Coulomb friction in steady sliding
    frictionless, ///< nothing
    stick         ///< not move where they touch
  };

  /// A pair of surfaces in contact, of a pad and the rotor or of two bodies that do not turn: the
  /// pad's or first one's is the mortar (slave) side.
  struct ContactInterface
  {
    std::string name; ///< as in static.csv
    Body pad;         ///< or the body of the first surface
    dealii::types::boundary_id pad_face, rotor_face;
    double distance  = 0; ///< that may be between them, m
    ContactKind kind = ContactKind::sliding;
    /// Where nothing slides: e is its direction in the surface.
    dealii::Tensor<1, 3> along = {};
    double friction            = 0; ///< that a stick contact may need, or zero: not known

    bool slides() const
    {
      return kind == ContactKind::sliding;
    }
  };

  /// Two surfaces that are tied (theory.md, section 11): the first has the multipliers.
  struct TiedSurfaces
  {
    std::string name;
    dealii::types::boundary_id side, other;
    double distance; ///< that is allowed between them, m
  };

  /// A point (theory.md, section 11): the mean rigid motion of a surface, or a motion of its own.
  struct JointPoint
  {
    std::string name;
    std::set<dealii::types::boundary_id> surface; ///< empty: a point in space
    dealii::Point<3> place;                       ///< without a surface
    std::array<double, 6> mass = {};              ///< kg three times, kg m^2 about x, y, z
  };

  /// Two points, by number, or a point and the ground, that are connected.
  struct PointConnection
  {
    static constexpr unsigned int ground = -1;
    unsigned int first, second;
    /// Spring and dashpot along and about the axes: N/m three times, N m; N s/m three times, N m s.
    std::array<double, 6> stiffness = {}, damping = {};
    /// Unit vectors along which, and about which, these act.
    std::array<std::array<double, 3>, 3> axes = {{{{1, 0, 0}}, {{0, 1, 0}}, {{0, 0, 1}}}};
  };

  /// Points and what connects them. 3D only.
  struct PointJoints
  {
    std::vector<JointPoint> points;
    std::vector<PointConnection> springs, links; ///< links are rigid
  };

  /// A boundary on which some displacement components are zero.
  template <int dim>
  struct Support
  {
    dealii::types::boundary_id boundary;
    std::array<bool, dim> fixed;
  };

  /// A pressure on a boundary, Pa, against the outward normal.
  template <int dim>
  struct PressureLoad
  {
    dealii::types::boundary_id boundary;
    std::function<double(const dealii::Point<dim> &)> pressure;
    /// The entry of Parameters::Mesh::surface_pressures that scales it; none: Pads/Pressure.
    std::optional<unsigned int> entry = std::nullopt;
  };

  /// What the cells of one material id are.
  struct Part
  {
    Body body; ///< to which they belong: the rotor, the pad of a contact interface, another one
    unsigned int material; ///< in the order of Parameters::All::materials()
    bool curved = true;    ///< whether edges follow circles about the z axis (3D)
  };

  /// A cell of the coarse mesh: its vertices in the order of deal.II.
  template <int dim>
  struct CoarseCell
  {
    std::array<unsigned int, (1u << dim)> vertices;
    dealii::types::material_id material_id = 0;
  };

  /// The bodies of a scene as a value: coarse mesh, boundary names, supports, loads, contact pairs,
  /// joints. Rooms below make spaces and matrices of it; scenes/ makes it (make_scene.h).
  template <int dim>
  struct Geometry
  {
    /// Boundary names, for example "rotor.inner" or "upper_pad.contact".
    std::map<std::string, dealii::types::boundary_id> boundaries;

    std::vector<Support<dim>> supports;
    std::vector<PressureLoad<dim>> loads;
    std::vector<ContactInterface> interfaces;
    bool has_stick() const
    {
      return std::any_of(interfaces.begin(), interfaces.end(),
                         [](const ContactInterface &contact)
                         { return contact.kind == ContactKind::stick; });
    }
    std::vector<TiedSurfaces> ties;
    PointJoints point_joints;
    std::vector<Superelement> superelements;
    /// The body, if any, of which a superelement is to be made, and the surfaces on which it hangs.
    std::optional<SuperelementInterface> superelement_out;
    /// Bodies that neither turn nor touch the rotor, by name.
    std::map<Body, std::string> other_bodies;

    /// Whether cells are the rotor's: not where parts are studied alone.
    bool has_rotor() const
    {
      return std::any_of(parts.begin(), parts.end(),
                         [](const Part &part) { return part.body == rotor_body; });
    }
    /// The bodies: the rotor, the pads by their contact interfaces, the others.
    std::vector<std::pair<std::string, Body>> named_bodies() const;
    /// The boundaries of surfaces at which forces act or motions are observed, by name.
    std::map<std::string, std::set<dealii::types::boundary_id>> response_surfaces;

    /// What cells are, by material id. Where bodies are of one material each, ids are bodies.
    std::vector<Part> parts = {{rotor_body, 0}, {upper_pad_body, 1}, {lower_pad_body, 1}};
    /// The material ids of the cells of one material, of bodies that there are.
    std::vector<Body> bodies_of(unsigned int material) const;

    /// Whether supports and closed contact leave a body a rigid motion.
    bool may_move_rigidly = false;
    /// Independent rigid motions that supports and joints leave to the bodies while the rotor rests
    /// and nothing touches it, each by body. Only where pads are worn.
    std::vector<std::map<Body, RigidMotion<dim>>> free_motions;

    /// Measures of a mesh file for the log, and as a table; else empty.
    std::string report, report_table;

    /// The transport field w of theory.md, section 1: the rotor's velocity is Omega w.
    dealii::Tensor<1, dim> transport(const dealii::Point<dim> &x) const;

    /// The coarse mesh as vertices and cells; ids of the boundaries follow from positions.
    std::vector<dealii::Point<dim>> vertices;
    std::vector<CoarseCell<dim>> cells;
    /// The shapes of cells that middle nodes bend (3D).
    QuadraticCells quadratic;
    /// Elements that keep their own polynomials (3D).
    OwnElements own;

    struct BoundaryRule
    {
      Body body;
      unsigned int coordinate; ///< in 3D 0: radius, 1: angle, 2: z; in 2D 0: x, 1: y
      double value;
      dealii::types::boundary_id id;
    };
    std::vector<BoundaryRule> rules;
    /// Ids of faces by their vertices in ascending order, where there are no rules (3D). Other
    /// faces of the boundary are free.
    std::map<std::array<unsigned int, 4>, dealii::types::boundary_id> named_faces;

    /// Boundaries that are one: the second continues the first along x (strip). Invalid: none.
    std::pair<dealii::types::boundary_id, dealii::types::boundary_id> periodic = {
        dealii::numbers::invalid_boundary_id, dealii::numbers::invalid_boundary_id};
    bool is_periodic() const
    {
      return periodic.first != dealii::numbers::invalid_boundary_id;
    }
  };
} // namespace squeal
