#include <squeal/contact_fields.h>
#include <squeal/fields.h>

#include <deal.II/base/data_out_base.h>
#include <deal.II/grid/reference_cell.h>

#include <algorithm>
#include <cmath>
#include <limits>

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
  } // namespace

  template <int dim>
  void write_contact(const Spaces<dim> &spaces, const Contact<dim> &contact, const Block &state,
                     const bool with_friction, const std::string &directory,
                     const unsigned int cycle)
  {
    const std::vector<double> global = replicate(state);
    const ContactModel<dim> &model   = contact.contact_model();
    const FaceElement<dim> &element  = contact.face_element();
    const unsigned int n             = element.n_nodes();

    // Rows of each patch's data: pressure, gap, status, traction, then the points themselves.
    constexpr unsigned int first_traction = 3, first_point = 3 + dim;
    std::vector<DataOutBase::Patch<dim - 1, dim>> patches;
    for (const PairedInterface<dim> &interface : contact.paired_interfaces())
    {
      std::vector<std::vector<const ContactFace<dim> *>> opposite(interface.pad_faces.size());
      for (const FacePair<dim> &pair : interface.pairs)
        opposite[pair.pad_face].push_back(&interface.rotor_faces[pair.rotor_face]);
      for (unsigned int f = 0; f < interface.pad_faces.size(); ++f)
      {
        const ContactFace<dim> &face = interface.pad_faces[f];
        if (opposite[f].empty())
          continue;
        DataOutBase::Patch<dim - 1, dim> patch;
        patch.n_subdivisions       = element.degree();
        patch.patch_index          = patches.size();
        patch.points_are_available = true;
        patch.reference_cell       = ReferenceCells::get_hypercube<dim - 1>();
        patch.data.reinit(first_point + dim, n);
        for (unsigned int a = 0; a < n; ++a)
        {
          const Point<dim> &x         = face.shape.nodes[a];
          const auto [u_rotor, frame] = opposite_point(element, opposite[f], x, global);
          const double penetration =
              (u_rotor - displacement(face.nodes[a], global)) * frame.normal -
              (model.initial_gap ? model.initial_gap(x) : 0.);
          double pressure = 0, status = 0;
          if (model.mortar)
            for (const FreeNode<dim> &node : face.nodes[a])
            {
              pressure += contact.pressure_scale() * node.weight * global[node.equations[dim]];
              status += node.weight * contact.is_active(node);
            }
          else
          {
            pressure = model.penalty_stiffness * std::max(0., penetration);
            status   = penetration > 0;
          }
          Tensor<1, dim> w = spaces.geometry.transport(x);
          w -= (w * frame.normal) * frame.normal;
          const double speed = std::abs(model.angular_velocity) * w.norm();
          const double tau   = with_friction ? model.friction.traction(speed, pressure).value : 0;
          const Tensor<1, dim> traction = (model.angular_velocity < 0 ? tau : -tau) * w / w.norm();

          patch.data(0, a) = pressure;
          patch.data(1, a) = -penetration;
          patch.data(2, a) = status;
          for (unsigned int d = 0; d < dim; ++d)
          {
            patch.data(first_traction + d, a) = traction[d];
            patch.data(first_point + d, a)    = x[d];
          }
        }
        patches.push_back(std::move(patch));
      }
    }

    std::vector<std::string> names = {"contact_pressure_pa", "gap_m", "status"};
    for (unsigned int d = 0; d < dim; ++d)
      names.push_back("friction_traction_pa");
    const std::vector<std::tuple<unsigned int, unsigned int, std::string,
                                 DataComponentInterpretation::DataComponentInterpretation>>
        vectors = {{first_traction, first_traction + dim - 1, "friction_traction_pa",
                    DataComponentInterpretation::component_is_part_of_vector}};

    write_pieces(
        directory, "contact-" + std::to_string(cycle), spaces.comm,
        [&](std::ostream &out)
        { DataOutBase::write_vtu(patches, names, vectors, DataOutBase::VtkFlags(), out); },
        [&](std::ostream &out, const std::vector<std::string> &pieces)
        { DataOutBase::write_pvtu_record(out, pieces, names, vectors, DataOutBase::VtkFlags()); });
  }

  template void write_contact(const Spaces<2> &, const Contact<2> &, const Block &, bool,
                              const std::string &, unsigned int);
  template void write_contact(const Spaces<3> &, const Contact<3> &, const Block &, bool,
                              const std::string &, unsigned int);
} // namespace squeal
