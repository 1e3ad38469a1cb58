#include <squeal/mesh/coarse_mesh.h>
#include <squeal/mesh/quadratic_manifold.h>

#include <deal.II/base/numbers.h>
#include <deal.II/grid/grid_tools.h>
#include <deal.II/grid/manifold_lib.h>
#include <deal.II/grid/tria.h>

#include <algorithm>
#include <cmath>

namespace squeal
{
  using namespace dealii;

  namespace
  {
    template <int dim>
    std::vector<CellData<dim>> cells_of(const std::vector<CoarseCell<dim>> &cells)
    {
      std::vector<CellData<dim>> result(cells.size());
      for (unsigned int c = 0; c < cells.size(); ++c)
      {
        result[c].vertices.assign(cells[c].vertices.begin(), cells[c].vertices.end());
        result[c].material_id = cells[c].material_id;
      }
      return result;
    }

    /// Gives each cell that middle nodes bend, with its faces and edges, a manifold of its own: new
    /// points lie where the cell's polynomial has them. Ids are @p first_id + cell.
    void attach(const QuadraticCells &quadratic, Triangulation<3> &triangulation,
                const types::manifold_id first_id)
    {
      for (const auto &cell : triangulation.cell_iterators_on_level(0))
      {
        const unsigned int number = cell->index();
        if (quadratic.cells.count(number) == 0)
          continue;
        std::array<Point<3>, 8> corners;
        std::array<unsigned int, 8> vertices{};
        for (unsigned int v = 0; v < 8; ++v)
        {
          corners[v]  = cell->vertex(v);
          vertices[v] = cell->vertex_index(v);
        }
        cell->set_all_manifold_ids(first_id + number);
        triangulation.set_manifold(first_id + number,
                                   QuadraticManifold(quadratic.points(number, corners, vertices)));
      }
    }

    /// Whether a face lies where the rule says, to within @p tolerance, m.
    template <int dim, typename Face>
    bool lies_at(const typename Geometry<dim>::BoundaryRule &rule, const Face &face,
                 const double tolerance)
    {
      for (const unsigned int v : face->vertex_indices())
      {
        const Point<dim> &x = face->vertex(v);
        const double r      = std::hypot(x[0], x[1]);
        double difference   = x[std::min<unsigned int>(rule.coordinate, dim - 1)] - rule.value;
        if (dim == 3 && rule.coordinate == 0)
          difference = r - rule.value;
        else if (dim == 3 && rule.coordinate == 1)
          difference = r * std::remainder(std::atan2(x[1], x[0]) - rule.value, 2 * numbers::PI);
        if (!(std::abs(difference) < tolerance))
          return false;
      }
      return true;
    }

    template <int dim>
    void name_boundaries(const Geometry<dim> &geometry, Triangulation<dim> &triangulation)
    {
      double size = 0;
      for (const Point<dim> &vertex : triangulation.get_vertices())
        size = std::max(size, vertex.norm());
      for (const auto &cell : triangulation.active_cell_iterators())
        for (const unsigned int f : cell->face_indices())
          if (const auto face = cell->face(f); face->at_boundary() && geometry.rules.empty())
          {
            std::array<unsigned int, 4> vertices{};
            for (const unsigned int v : face->vertex_indices())
              vertices[v] = face->vertex_index(v);
            std::sort(vertices.begin(), vertices.end());
            if (const auto named = geometry.named_faces.find(vertices);
                named != geometry.named_faces.end())
              face->set_boundary_id(named->second);
          }
          else if (face->at_boundary())
          {
            unsigned int n_matching = 0;
            for (const auto &rule : geometry.rules)
              if (rule.body == cell->material_id() && lies_at<dim>(rule, face, 1e-10 * size))
              {
                face->set_boundary_id(rule.id);
                ++n_matching;
              }
            Assert(n_matching == 1, ExcMessage("A boundary face has no name, or several."));
            (void)n_matching;
          }
    }
  } // namespace

  template <int dim>
  void make_coarse_mesh(const Geometry<dim> &geometry, Triangulation<dim> &triangulation)
  {
    triangulation.create_triangulation(geometry.vertices, cells_of(geometry.cells), SubCellData());
    if constexpr (dim == 3)
    {
      for (const auto &cell : triangulation.active_cell_iterators())
        if (geometry.parts[cell->material_id()].curved)
          cell->set_all_manifold_ids(0);
      triangulation.set_manifold(0, CylindricalManifold<3>(2));
      attach(geometry.quadratic, triangulation, 1);
    }
    name_boundaries(geometry, triangulation);
    if constexpr (dim == 2)
      if (geometry.is_periodic())
      {
        std::vector<GridTools::PeriodicFacePair<typename Triangulation<dim>::cell_iterator>> pairs;
        GridTools::collect_periodic_faces(triangulation, geometry.periodic.first,
                                          geometry.periodic.second, 0, pairs);
        triangulation.add_periodicity(pairs);
      }
  }

  bool order_consistently(std::vector<CoarseCell<3>> &cells)
  {
    std::vector<CellData<3>> ordered = cells_of(cells);
    try
    {
      GridTools::consistently_order_cells(ordered);
    }
    catch (const ExceptionBase &)
    {
      return false;
    }
    for (unsigned int c = 0; c < cells.size(); ++c)
      std::copy(ordered[c].vertices.begin(), ordered[c].vertices.end(), cells[c].vertices.begin());
    return true;
  }

  template void make_coarse_mesh(const Geometry<2> &, Triangulation<2> &);
  template void make_coarse_mesh(const Geometry<3> &, Triangulation<3> &);
} // namespace squeal
