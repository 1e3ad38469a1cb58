#include <squeal/contact/contact_fields.h>
#include <squeal/mesh/fields.h>
#include <squeal/mesh/finite_element_space.h>

#include <deal.II/base/data_out_base.h>
#include <deal.II/grid/reference_cell.h>

#include <algorithm>
#include <cmath>
#include <limits>

// Fields on the pads' contact faces, as patches with values at the faces' nodes: the static state
// or a pressure that is known without one (state_at()), and the work of friction, which is
// projected from the quadrature points (project_to_faces()).

namespace squeal
{
  using namespace dealii;

  namespace
  {
    /// The displacement of a face's node.
    template <int dim>
    Tensor<1, dim> displacement(const std::vector<FreeNode<dim>> &node,
                                const std::vector<double> &global)
    {
      Tensor<1, dim> u;
      for (const FreeNode<dim> &free_node : node)
        for (unsigned int c = 0; c < dim; ++c)
          if (free_node.equations[c] >= 0)
            u[c] += free_node.weight * global[free_node.equations[c]];
      return u;
    }

    /// The rotor's displacement at the point nearest to x, among the rotor faces paired with a pad
    /// face, and the surface's frame there.
    template <int dim>
    std::pair<Tensor<1, dim>, typename FaceElement<dim>::Frame>
    opposite_point(const FaceElement<dim> &element,
                   const std::vector<const ContactFace<dim> *> &candidates, const Point<dim> &x,
                   const std::vector<double> &global)
    {
      double smallest = std::numeric_limits<double>::infinity();
      std::pair<Tensor<1, dim>, typename FaceElement<dim>::Frame> result;
      for (const ContactFace<dim> *face : candidates)
      {
        const auto xi  = element.project(face->shape, x);
        double outside = 0;
        for (unsigned int d = 0; d < dim - 1; ++d)
          outside = std::max({outside, -xi[d], xi[d] - 1});
        if (outside >= smallest)
          continue;
        smallest = outside;
        std::vector<double> values;
        element.evaluate(xi, values);
        result = {Tensor<1, dim>(), element.frame(face->shape, xi)};
        for (unsigned int a = 0; a < values.size(); ++a)
          result.first += values[a] * displacement(face->nodes[a], global);
      }
      return result;
    }

    /// The rotor faces that each pad face is paired with.
    template <int dim>
    std::vector<std::vector<const ContactFace<dim> *>>
    opposite_faces(const PairedInterface<dim> &interface)
    {
      std::vector<std::vector<const ContactFace<dim> *>> opposite(interface.pad_faces.size());
      for (const FacePair<dim> &pair : interface.pairs)
        opposite[pair.pad_face].push_back(&interface.rotor_faces[pair.rotor_face]);
      return opposite;
    }

    /// A pad face as a patch with room for @p n_fields values at each node; behind them stand the
    /// points themselves.
    template <int dim>
    DataOutBase::Patch<dim - 1, dim> patch_of(const ContactFace<dim> &face,
                                              const FaceElement<dim> &element,
                                              const unsigned int n_fields, const unsigned int index)
    {
      DataOutBase::Patch<dim - 1, dim> patch;
      patch.n_subdivisions       = element.degree();
      patch.patch_index          = index;
      patch.points_are_available = true;
      patch.reference_cell       = ReferenceCells::get_hypercube<dim - 1>();
      patch.data.reinit(n_fields + dim, element.n_nodes());
      for (unsigned int a = 0; a < element.n_nodes(); ++a)
        for (unsigned int d = 0; d < dim; ++d)
          patch.data(n_fields + d, a) = face.shape.nodes[a][d];
      return patch;
    }

    using VectorRanges =
        std::vector<std::tuple<unsigned int, unsigned int, std::string,
                               DataComponentInterpretation::DataComponentInterpretation>>;

    template <int dim>
    void write_patches(const std::vector<DataOutBase::Patch<dim - 1, dim>> &patches,
                       const std::vector<std::string> &names, const VectorRanges &vectors,
                       const std::string &directory, const std::string &base, const MPI_Comm comm)
    {
      write_pieces(
          directory, base, comm,
          [&](std::ostream &out)
          { DataOutBase::write_vtu(patches, names, vectors, DataOutBase::VtkFlags(), out); },
          [&](std::ostream &out, const std::vector<std::string> &pieces) {
            DataOutBase::write_pvtu_record(out, pieces, names, vectors, DataOutBase::VtkFlags());
          });
    }

    /// The static state at a node of a pad's face.
    template <int dim>
    struct NodeState
    {
      double pressure = 0, gap = 0, status = 0; ///< Pa, m, 1: closed
      Tensor<1, dim> traction;                  ///< of friction on the rotor, Pa
    };

    /// With a @p known pressure there is no displacement in @p global.
    template <int dim>
    NodeState<dim> state_at(const Contact<dim> &contact, const unsigned int interface,
                            const ContactFace<dim> &face, const unsigned int a,
                            const std::vector<const ContactFace<dim> *> &opposite,
                            const std::vector<double> &global, const double worn_depth,
                            const KnownPressure<dim> &known, const bool with_friction)
    {
      const ContactModel<dim> &model    = contact.contact_model();
      const PairedInterface<dim> &pairs = contact.paired_interfaces()[interface];
      const Point<dim> &x               = face.shape.nodes[a];
      const auto [u_rotor, frame] = opposite_point(contact.face_element(), opposite, x, global);
      const double penetration    = (u_rotor - displacement(face.nodes[a], global)) * frame.normal -
                                 contact.initial_gap(interface, x) - worn_depth;
      NodeState<dim> state;
      state.gap = -penetration;
      if (known)
      {
        state.pressure = known(interface, x, frame.normal);
        state.status   = state.pressure > 0;
      }
      else if (model.mortar)
        for (const FreeNode<dim> &node : face.nodes[a])
        {
          if (node.equations[dim] < 0)
            continue;
          state.pressure +=
              contact.pressure_scale() * node.multiplier_weight * global[node.equations[dim]];
          state.status += node.multiplier_weight * contact.is_active(node);
        }
      else
      {
        state.pressure = model.penalty_stiffness * std::max(0., penetration);
        state.status   = penetration > 0;
      }
      if (pairs.kind == ContactKind::sliding)
      {
        Tensor<1, dim> w = contact.spaces().geometry.transport(x);
        w -= (w * frame.normal) * frame.normal;
        const double speed = std::abs(model.angular_velocity) * w.norm();
        const double tau =
            with_friction ? contact.friction(interface).traction(speed, state.pressure).value : 0;
        state.traction = -tau * model.direction() * w / w.norm();
      }
      else if (pairs.kind == ContactKind::stick)
      {
        const Tensor<1, dim> e = direction_in_surface(frame.normal, pairs.along);
        for (unsigned int direction = 1; direction < dim; ++direction)
          for (const FreeNode<dim> &node : face.nodes[a])
            if (contact.is_active(node, direction))
              state.traction -= contact.pressure_scale() * node.multiplier_weight *
                                global[node.multiplier(direction)] *
                                (direction == 1 ? e : binormal_of<dim>(frame.normal, e));
      }
      return state;
    }
  } // namespace

  namespace
  {
    /// Writes a state, or a known pressure without gaps.
    template <int dim>
    void write_contact(const FiniteElementSpace<dim> &spaces, const Contact<dim> &contact,
                       const std::vector<double> &global, const KnownPressure<dim> &known,
                       const bool with_friction, const std::string &directory,
                       const unsigned int cycle)
    {
      const FaceElement<dim> &element = contact.face_element();

      // Rows of each patch's data: pressure, gap where it is known, status, traction.
      std::vector<std::string> names = {"contact_pressure_pa"};
      if (!known)
        names.push_back("gap_m");
      names.push_back("status");
      const unsigned int of_status = names.size() - 1;
      std::vector<std::vector<std::vector<double>>> depths; // worn
      if (contact.worn())
      {
        depths = project_to_faces(contact, contact.worn()->depth);
        names.push_back("wear_m");
      }
      const unsigned int first_traction = names.size(), n_fields = first_traction + dim;
      std::vector<DataOutBase::Patch<dim - 1, dim>> patches;
      for (unsigned int i = 0; i < contact.paired_interfaces().size(); ++i)
      {
        const PairedInterface<dim> &interface = contact.paired_interfaces()[i];
        const auto opposite                   = opposite_faces(interface);
        for (unsigned int f = 0; f < interface.pad_faces.size(); ++f)
        {
          const ContactFace<dim> &face = interface.pad_faces[f];
          if (opposite[f].empty())
            continue;
          auto patch = patch_of(face, element, n_fields, patches.size());
          for (unsigned int a = 0; a < element.n_nodes(); ++a)
          {
            const double depth = contact.worn() ? depths[i][f][a] : 0.;
            const NodeState<dim> node =
                state_at(contact, i, face, a, opposite[f], global, depth, known, with_friction);
            patch.data(0, a) = node.pressure;
            if (!known)
              patch.data(1, a) = node.gap;
            patch.data(of_status, a) = node.status;
            if (contact.worn())
              patch.data(of_status + 1, a) = depth;
            for (unsigned int d = 0; d < dim; ++d)
              patch.data(first_traction + d, a) = node.traction[d];
          }
          patches.push_back(std::move(patch));
        }
      }

      for (unsigned int d = 0; d < dim; ++d)
        names.push_back("friction_traction_pa");
      write_patches(patches, names,
                    {{first_traction, first_traction + dim - 1, "friction_traction_pa",
                      DataComponentInterpretation::component_is_part_of_vector}},
                    directory, "contact-" + std::to_string(cycle), spaces.comm);
    }
  } // namespace

  template <int dim>
  void write_contact(const FiniteElementSpace<dim> &spaces, const Contact<dim> &contact,
                     const MultiVector &state, const bool with_friction,
                     const std::string &directory, const unsigned int cycle)
  {
    write_contact(spaces, contact, replicate(state), {}, with_friction, directory, cycle);
  }

  template <int dim>
  void write_contact(const FiniteElementSpace<dim> &spaces, const Contact<dim> &contact,
                     const KnownPressure<dim> &pressure, const bool with_friction,
                     const std::string &directory, const unsigned int cycle)
  {
    const std::vector<double> at_rest(spaces.rows.size);
    write_contact(spaces, contact, at_rest, pressure, with_friction, directory, cycle);
  }

  template <int dim>
  std::vector<std::vector<std::vector<double>>> project_to_faces(const Contact<dim> &contact,
                                                                 const ContactPressure &values)
  {
    const FaceElement<dim> &element = contact.face_element();
    const unsigned int n            = element.n_nodes();
    std::vector<std::vector<std::vector<double>>> result;
    for (unsigned int i = 0; i < contact.paired_interfaces().size(); ++i)
    {
      const PairedInterface<dim> &interface = contact.paired_interfaces()[i];
      // int psi psi^T and int psi f of every face
      std::vector<DenseMatrix> mass(interface.pad_faces.size(), DenseMatrix(n, n)),
          right(interface.pad_faces.size(), DenseMatrix(n, 1));
      unsigned int q = 0;
      std::vector<double> psi;
      for (const FacePair<dim> &pair : interface.pairs)
        for (const PairedPoint<dim> &point : pair.points)
        {
          element.evaluate(point.xi_pad, psi);
          for (unsigned int a = 0; a < n; ++a)
          {
            right[pair.pad_face](a, 0) += point.weight * psi[a] * values[i][q];
            for (unsigned int b = 0; b < n; ++b)
              mass[pair.pad_face](a, b) += point.weight * psi[a] * psi[b];
          }
          ++q;
        }
      result.emplace_back(interface.pad_faces.size());
      const auto opposite = opposite_faces(interface);
      for (unsigned int f = 0; f < mass.size(); ++f)
        if (!opposite[f].empty())
          result.back()[f] = solve(std::move(mass[f]), std::move(right[f])).values;
    }
    return result;
  }

  template <int dim>
  void write_friction_work(const FiniteElementSpace<dim> &spaces, const Contact<dim> &contact,
                           const FrictionWork &work, const std::string &directory,
                           const unsigned int cycle, const unsigned int mode)
  {
    const std::array<std::vector<std::vector<std::vector<double>>>, 3> parts = {
        {project_to_faces(contact, work.friction), project_to_faces(contact, work.damping),
         project_to_faces(contact, work.falling)}};
    const FaceElement<dim> &element = contact.face_element();
    std::vector<DataOutBase::Patch<dim - 1, dim>> patches;
    for (unsigned int i = 0; i < contact.paired_interfaces().size(); ++i)
    {
      const PairedInterface<dim> &interface = contact.paired_interfaces()[i];
      for (unsigned int f = 0; f < interface.pad_faces.size(); ++f)
      {
        if (parts[0][i][f].empty()) // no rotor opposite
          continue;
        auto patch = patch_of(interface.pad_faces[f], element, 4, patches.size());
        for (unsigned int a = 0; a < element.n_nodes(); ++a)
        {
          double sum = 0;
          for (unsigned int part = 0; part < parts.size(); ++part)
          {
            patch.data(1 + part, a) = parts[part][i][f][a];
            sum += parts[part][i][f][a];
          }
          patch.data(0, a) = sum;
        }
        patches.push_back(std::move(patch));
      }
    }
    write_patches(patches,
                  {"friction_work_j_per_m2", "pressure_work_j_per_m2", "direction_work_j_per_m2",
                   "speed_work_j_per_m2"},
                  {}, directory, mode_file(cycle, mode) + "-contact", spaces.comm);
  }

  template void write_contact(const FiniteElementSpace<2> &, const Contact<2> &,
                              const KnownPressure<2> &, bool, const std::string &, unsigned int);
  template void write_contact(const FiniteElementSpace<2> &, const Contact<2> &,
                              const MultiVector &, bool, const std::string &, unsigned int);
  template void write_contact(const FiniteElementSpace<3> &, const Contact<3> &,
                              const KnownPressure<3> &, bool, const std::string &, unsigned int);
  template void write_contact(const FiniteElementSpace<3> &, const Contact<3> &,
                              const MultiVector &, bool, const std::string &, unsigned int);
  template std::vector<std::vector<std::vector<double>>> project_to_faces(const Contact<2> &,
                                                                          const ContactPressure &);
  template void write_friction_work(const FiniteElementSpace<2> &, const Contact<2> &,
                                    const FrictionWork &, const std::string &, unsigned int,
                                    unsigned int);
  template std::vector<std::vector<std::vector<double>>> project_to_faces(const Contact<3> &,
                                                                          const ContactPressure &);
  template void write_friction_work(const FiniteElementSpace<3> &, const Contact<3> &,
                                    const FrictionWork &, const std::string &, unsigned int,
                                    unsigned int);
} // namespace squeal
