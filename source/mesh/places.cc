#include <squeal/base/errors.h>
#include <squeal/base/text.h>
#include <squeal/mesh/boundary_faces.h>
#include <squeal/mesh/places.h>

#include <deal.II/base/mpi.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace squeal
{
  using namespace dealii;

  namespace
  {
    using Place = Parameters::Response::Place;

    /// Weights w of nodes with sum w u(node) the motion, of this rank's cells.
    struct NodeWeights
    {
      std::vector<types::global_dof_index> nodes;
      std::vector<double> weights;
    };

    /// A point as this rank's cells of one body have it.
    template <int dim>
    struct FoundPoint
    {
      double distance = std::numeric_limits<double>::infinity(); ///< beside, in sizes of the cell
      typename DoFHandler<dim>::active_cell_iterator cell;
      Point<dim> xi;
    };

    template <int dim>
    FoundPoint<dim> find_point(const FiniteElementSpace<dim> &spaces, const Body body,
                               const Point<dim> &x)
    {
      FoundPoint<dim> found;
      for (const auto &cell : spaces.nodes.active_cell_iterators())
      {
        if (!cell->is_locally_owned() || spaces.geometry.parts[cell->material_id()].body != body ||
            cell->center().distance(x) > cell->diameter())
          continue;
        try
        {
          const Point<dim> xi    = spaces.mapping.transform_real_to_unit_cell(cell, x);
          const Point<dim> there = GeometryInfo<dim>::project_to_unit_cell(xi);
          // The first one has points that cells share.
          if (const double distance = xi.distance(there); distance < found.distance - 1e-8)
            found = {distance, cell, there};
        }
        catch (const typename Mapping<dim>::ExcTransformationFailed &)
        {
        }
      }
      return found;
    }

    /// Weights of the point, of one rank.
    template <int dim>
    NodeWeights at_point(const FiniteElementSpace<dim> &spaces, const Place &place,
                         const std::string &where)
    {
      constexpr double beside = 1e-2;
      Point<dim> x;
      std::copy(place.point.begin(), place.point.end(), x.begin_raw());
      std::vector<std::string> bodies_there;
      FoundPoint<dim> found;
      int owner = 0;
      std::string known;
      bool is_known = place.name.empty();
      for (const auto &[name, body] : spaces.geometry.named_bodies())
      {
        known += (known.empty() ? "" : ", ") + name;
        if (!place.name.empty() && name != place.name)
          continue;
        is_known                  = true;
        const FoundPoint<dim> own = find_point(spaces, body, x);
        const double nearest      = Utilities::MPI::min(own.distance, spaces.comm);
        if (nearest > beside)
          continue;
        bodies_there.push_back(name);
        found = own;
        owner = Utilities::MPI::min(own.distance <= nearest + 1e-8
                                        ? int(Utilities::MPI::this_mpi_process(spaces.comm))
                                        : std::numeric_limits<int>::max(),
                                    spaces.comm);
      }
      if (!is_known)
        throw InputError(where + ": there is no body '" + place.name + "'; allowed are " + known +
                         ".");
      if (bodies_there.empty())
        throw InputError(
            where + ": " +
            (place.name.empty() ? "no body has" : "'" + place.name + "' does not have") +
            " this point.");
      if (bodies_there.size() > 1)
      {
        std::string names;
        for (const std::string &name : bodies_there)
          names += (names.empty() ? "" : " and ") + name;
        throw InputError(where + ": " + names +
                         " have this point; put the name of one before the coordinates.");
      }
      NodeWeights result;
      if (owner != int(Utilities::MPI::this_mpi_process(spaces.comm)))
        return result;
      result.nodes.resize(spaces.fe.n_dofs_per_cell());
      found.cell->get_dof_indices(result.nodes);
      for (unsigned int a = 0; a < result.nodes.size(); ++a)
        result.weights.push_back(spaces.fe.shape_value(a, found.xi));
      return result;
    }

    /// Weights of the mean over a surface, of this rank's faces.
    template <int dim>
    NodeWeights at_surface(const FiniteElementSpace<dim> &spaces,
                           const std::set<types::boundary_id> &boundaries, const std::string &where)
    {
      NodeWeights result;
      double area = 0;
      std::vector<types::global_dof_index> nodes(spaces.fe.n_dofs_per_cell());
      for_boundary_faces(spaces, boundaries, update_values | update_JxW_values,
                         [&](const auto &cell, const FEFaceValues<dim> &values)
                         {
                           cell->get_dof_indices(nodes);
                           for (const unsigned int q : values.quadrature_point_indices())
                             area += values.JxW(q);
                           for (unsigned int a = 0; a < nodes.size(); ++a)
                           {
                             double weight = 0;
                             for (const unsigned int q : values.quadrature_point_indices())
                               weight += values.JxW(q) * values.shape_value(a, q);
                             result.nodes.push_back(nodes[a]);
                             result.weights.push_back(weight);
                           }
                         });
      area = Utilities::MPI::sum(area, spaces.comm);
      if (!(area > 0))
        throw InputError(where + ": the mesh has no face of this surface.");
      for (double &weight : result.weights)
        weight /= area;
      return result;
    }

    template <int dim>
    NodeWeights weights_at(const FiniteElementSpace<dim> &spaces, const Place &place,
                           const std::string &where)
    {
      if (!place.point.empty())
        return at_point(spaces, place, where);
      const Geometry<dim> &geometry = spaces.geometry;
      if (const auto named = geometry.response_surfaces.find(place.name);
          named != geometry.response_surfaces.end())
        return at_surface(spaces, named->second, where);
      if (const auto named = geometry.boundaries.find(place.name);
          named != geometry.boundaries.end())
        return at_surface(spaces, std::set<types::boundary_id>{named->second}, where);
      std::string known;
      for (const auto &boundary : geometry.boundaries)
        known += (known.empty() ? "" : ", ") + boundary.first;
      throw InputError(where + ": there is no surface '" + place.name + "'; allowed are " + known +
                       ".");
    }
  } // namespace

  template <int dim>
  MultiVector motions_at(const FiniteElementSpace<dim> &spaces, const std::vector<Place> &places,
                         const std::string &key)
  {
    MultiVector result(spaces.rows, 0);
    const std::vector<JointPoint> &points = spaces.geometry.point_joints.points;
    for (const Place &place : places)
    {
      std::vector<PetscInt> rows;
      std::vector<PetscScalar> values;
      const auto joint = std::find_if(points.begin(), points.end(),
                                      [&](const JointPoint &point)
                                      { return place.point.empty() && point.name == place.name; });
      if (joint != points.end())
      {
        for (unsigned int c = 0; c < dim; ++c)
          if (Utilities::MPI::this_mpi_process(spaces.comm) == 0)
          {
            rows.push_back(spaces.point(joint - points.begin(), c));
            values.push_back(place.direction[c]);
          }
      }
      else
      {
        const NodeWeights found = weights_at(spaces, place, key + ": '" + place.text + "'");
        for (unsigned int a = 0; a < found.nodes.size(); ++a)
          for (const WeightedNode &node : spaces.expand(found.nodes[a]))
            for (unsigned int c = 0; c < dim; ++c)
              if (const unsigned int row = spaces.equation(node.node, c);
                  row != FiniteElementSpace<dim>::none)
              {
                rows.push_back(row);
                values.push_back(node.weight * found.weights[a] * place.direction[c]);
              }
      }
      result.append(sum_entries(spaces.rows, rows, values));
    }
    return result;
  }

  template MultiVector motions_at(const FiniteElementSpace<2> &, const std::vector<Place> &,
                                  const std::string &);
  template MultiVector motions_at(const FiniteElementSpace<3> &, const std::vector<Place> &,
                                  const std::string &);
} // namespace squeal
