#include <squeal/base/errors.h>
#include <squeal/base/text.h>
#include <squeal/mesh/coarse_mesh.h>
#include <squeal/parameters/plausibility.h>
#include <squeal/scenes/mesh_report.h>

#include <deal.II/base/quadrature_lib.h>
#include <deal.II/dofs/dof_handler.h>
#include <deal.II/fe/fe_q.h>
#include <deal.II/fe/fe_values.h>
#include <deal.II/fe/mapping_q.h>
#include <deal.II/grid/tria.h>

#include <algorithm>
#include <bitset>
#include <cstdio>
#include <set>
#include <sstream>
#include <utility>

// The measures of a mesh that was read. measure() computes volumes, areas and Jacobians of the
// cells as they will be computed with; report_mesh() sums them up in rows, one for the mesh, each
// body, each group and each contact pair, refuses cells that are folded, and makes of the rows a
// table (table_of()) and a text for the log (describe_*()).

namespace squeal
{
  using namespace dealii;

  namespace
  {
    struct CellMeasures
    {
      double volume = 0, jacobian = 1; ///< the smallest scaled one
    };

    struct Measures
    {
      std::vector<CellMeasures> cells;
      std::map<MeshFile::Face, double> areas;
      unsigned int n_displacements = 0;
    };

    /// Nodes of the cells of elements with own polynomials that are none of the elements'.
    ///
    /// Each edge, face and inside of such an element has one vertex of its cells in its middle, by
    /// which they are counted; cells have as many nodes as their vertices, edges, faces say.
    unsigned int n_interpolated(const Geometry<3> &geometry, const unsigned int degree)
    {
      if (geometry.own.empty())
        return 0;
      const int p = degree, inner = p - 1, of_triangle = (p - 1) * (p - 2) / 2;
      std::vector<char> seen(geometry.vertices.size());
      std::set<std::array<unsigned int, 2>> edges;
      std::set<std::array<unsigned int, 4>> faces;
      int n_own = 0, n_all = 0;
      for (unsigned int c = 0; c < geometry.cells.size(); ++c)
      {
        if (!geometry.own.has(c))
          continue;
        const OwnElements::Cell &cell = geometry.own.cells[c];
        const bool is_tetrahedron = geometry.own.shapes[cell.element] == ElementShape::tetrahedron;
        const auto &vertices      = geometry.cells[c].vertices;
        for (unsigned int v = 0; v < 8; ++v)
        {
          if (std::exchange(seen[vertices[v]], 1))
            continue;
          ++n_all;
          const unsigned int n = std::bitset<8>(cell.between[v]).count();
          n_own += n == 1   ? 1
                   : n == 2 ? inner
                   : n == 3 ? of_triangle
                   : n == 4 ? (is_tetrahedron ? of_triangle * (p - 3) / 3 : inner * inner)
                   : n == 6 ? of_triangle * inner
                            : inner * inner * inner;
        }
        n_all += inner * inner * inner;
        for (unsigned int v = 0; v < 8; ++v)
          for (unsigned int d = 0; d < 3; ++d)
          {
            if (v >> d & 1)
              continue;
            std::array<unsigned int, 2> edge{{vertices[v], vertices[v | 1u << d]}};
            std::sort(edge.begin(), edge.end());
            n_all += edges.insert(edge).second ? inner : 0;
            const unsigned int e = (d + 1) % 3;
            if (v >> e & 1)
              continue;
            std::array<unsigned int, 4> face{{vertices[v], vertices[v | 1u << d],
                                              vertices[v | 1u << e],
                                              vertices[v | 1u << d | 1u << e]}};
            std::sort(face.begin(), face.end());
            n_all += faces.insert(face).second ? inner * inner : 0;
          }
      }
      return n_all - n_own;
    }

    /// Cells as the program computes with them: polynomials through nodes on the manifold.
    Measures measure(const Geometry<3> &geometry, const std::set<MeshFile::Face> &wanted,
                     const unsigned int degree)
    {
      Triangulation<3> triangulation;
      make_coarse_mesh(geometry, triangulation);
      const MappingQ<3> mapping(degree);
      const FE_Q<3> fe(degree);
      FEValues<3> volumes(mapping, fe, QGauss<3>(degree + 1), update_JxW_values),
          shapes(mapping, fe, QGaussLobatto<3>(degree + 1), update_jacobians);
      FEFaceValues<3> areas(mapping, fe, QGauss<2>(degree + 1), update_JxW_values);
      Measures result;
      DoFHandler<3> nodes(triangulation);
      nodes.distribute_dofs(fe);
      result.n_displacements = 3 * (nodes.n_dofs() - n_interpolated(geometry, degree));
      for (const auto &cell : triangulation.active_cell_iterators())
      {
        CellMeasures measures;
        volumes.reinit(cell);
        for (const double JxW : volumes.get_JxW_values())
          measures.volume += JxW;
        shapes.reinit(cell);
        for (const unsigned int q : shapes.quadrature_point_indices())
        {
          const Tensor<2, 3> columns = transpose(Tensor<2, 3>(shapes.jacobian(q)));
          measures.jacobian          = std::min(
                       measures.jacobian,
                       determinant(columns) / (columns[0].norm() * columns[1].norm() * columns[2].norm()));
        }
        result.cells.push_back(measures);
        for (const unsigned int f : cell->face_indices())
        {
          MeshFile::Face face;
          for (unsigned int v = 0; v < 4; ++v)
            face[v] = cell->face(f)->vertex_index(v);
          std::sort(face.begin(), face.end());
          if (wanted.count(face) == 0 || result.areas.count(face) > 0)
            continue;
          areas.reinit(cell, f);
          for (const double JxW : areas.get_JxW_values())
            result.areas[face] += JxW;
        }
      }
      return result;
    }

    SQUEAL_CHOICE(Kind, mesh, body, volume, surface, pair)

    /// One line of mesh.csv. Negative: unknown, an empty field.
    struct Row
    {
      Row(const Kind kind, const std::string &name, const std::string &use = "")
          : kind(kind), name(name), use(use)
      {
      }
      Kind kind;
      std::string name, use;
      unsigned int count = 0;
      double volume = -1, mass = -1, area = -1, jacobian = -1;
      Box box;
      const ContactPairMeasures *pair = nullptr;
    };

    /// Quoted where it must be.
    std::string csv_text(const std::string &text)
    {
      if (text.find_first_of(",\"") == std::string::npos)
        return text;
      std::string quoted = "\"";
      for (const char c : text)
        quoted += c == '"' ? "\"\"" : std::string(1, c);
      return quoted + "\"";
    }

    std::string table_of(const std::vector<Row> &rows)
    {
      std::string text = "kind,name,use,count,volume_m3,mass_kg,area_m2,smallest_jacobian,"
                         "x_min_m,x_max_m,y_min_m,y_max_m,z_min_m,z_max_m,gap_m,overlap_m2,"
                         "least_cover\n";
      const auto known = [](const double value) { return value < 0 ? "" : number(value); };
      for (const Row &row : rows)
      {
        text += name_of(row.kind) + "," + csv_text(row.name) + "," + csv_text(row.use) + "," +
                std::to_string(row.count) + "," + known(row.volume) + "," + known(row.mass) + "," +
                known(row.area) + ",";
        text += row.pair || row.kind == Kind::surface ? "" : number(row.jacobian);
        for (unsigned int d = 0; d < 3; ++d)
          text += "," + number(row.box.low[d]) + "," + number(row.box.high[d]);
        text += row.pair ? "," + number(row.pair->gap) + "," + number(row.pair->overlap) + "," +
                               number(row.pair->least_cover)
                         : ",,,";
        text += "\n";
      }
      return text;
    }

    std::string describe_rows(const std::vector<Row> &rows)
    {
      std::string text =
          "  kind     name                      count      volume      mass      area"
          "   Jacobian   box x, y, z\n"
          "                                                cm^3        kg      cm^2"
          "   smallest   mm\n";
      char line[400];
      const auto known = [](const double value, const double unit, const char *format)
      {
        char field[40];
        std::snprintf(field, sizeof(field), format, value / unit);
        return value < 0 ? std::string("-") : std::string(field);
      };
      for (const Row &row : rows)
      {
        if (row.pair)
          continue;
        std::snprintf(line, sizeof(line),
                      "  %-8s %-24s %6u %11s %9s %9s %10s   %.4g..%.4g, %.4g..%.4g, %.4g..%.4g%s\n",
                      name_of(row.kind).c_str(), row.name.c_str(), row.count,
                      known(row.volume, 1e-6, "%.6g").c_str(), known(row.mass, 1, "%.4g").c_str(),
                      known(row.area, 1e-4, "%.5g").c_str(),
                      row.kind == Kind::surface ? "-" : known(row.jacobian, 1, "%.3f").c_str(),
                      1e3 * row.box.low[0], 1e3 * row.box.high[0], 1e3 * row.box.low[1],
                      1e3 * row.box.high[1], 1e3 * row.box.low[2], 1e3 * row.box.high[2],
                      row.use.empty() ? "" : ("   " + row.use).c_str());
        text += line;
      }
      for (const Row &row : rows)
        if (row.pair)
        {
          std::snprintf(line, sizeof(line),
                        "  Contact pair %s: gap %.3g mm, common area %.6g cm^2, %.2f %% of the "
                        "pad's %.6g cm^2\n",
                        row.name.c_str(), 1e3 * row.pair->gap + 0., 1e4 * row.pair->overlap,
                        100 * row.pair->overlap / row.pair->pad_area, 1e4 * row.pair->pad_area);
          text += line;
        }
      return text;
    }

    /// A word where all bodies together are of a size that no brake has.
    std::string describe_size(const Row &all)
    {
      constexpr double smallest = 0.02, largest = 5; // m
      double size = 0;
      for (unsigned int d = 0; d < 3; ++d)
        size = std::max(size, all.box.high[d] - all.box.low[d]);
      if (size >= smallest && size <= largest)
        return "";
      return text_of("Warning, size: the bodies extend over ", number(size),
                     " m. Mesh/Scale gives the file's unit of length in metres: 1e-3 for mm.\n");
    }

    /// Lines about bodies whose cells are too long for waves at the window's upper end, by the mean
    /// of the cells' longest edges.
    std::string describe_waves(const Parameters::All &prm, const Geometry<3> &geometry)
    {
      const std::vector<Parameters::BodyMaterial> materials = prm.materials();
      std::vector<double> sums(materials.size());
      std::vector<unsigned int> counts(materials.size());
      for (const CoarseCell<3> &cell : geometry.cells)
      {
        double longest = 0;
        for (unsigned int v = 0; v < 8; ++v)
          for (unsigned int d = 0; d < 3; ++d)
            if (const unsigned int w = v | (1u << d); w != v)
              longest = std::max(longest, geometry.vertices[cell.vertices[v]].distance(
                                              geometry.vertices[cell.vertices[w]]));
        const unsigned int m = geometry.parts[cell.material_id].material;
        sums[m] += longest;
        counts[m] += 1;
      }
      std::string text;
      for (unsigned int m = 0; m < materials.size(); ++m)
        if (counts[m] > 0)
          if (const std::string doubt = doubt_about_window(prm, materials[m], sums[m] / counts[m]);
              !doubt.empty())
            text += doubt + "\n";
      return text;
    }

    void add_cell(Row &row, const Geometry<3> &geometry, const unsigned int c,
                  const CellMeasures &cell, const double density)
    {
      row.count += 1;
      row.volume   = std::max(row.volume, 0.) + cell.volume;
      row.mass     = std::max(row.mass, 0.) + density * cell.volume;
      row.jacobian = row.jacobian < 0 ? cell.jacobian : std::min(row.jacobian, cell.jacobian);
      for (const unsigned int vertex : geometry.cells[c].vertices)
        row.box.add(geometry.vertices[vertex]);
    }
    [[noreturn]] void refuse(const Parameters::All &prm, const MeshFacts &facts,
                             const unsigned int cell, const double jacobian)
    {
      const bool by_middle_nodes = facts.file.quadratic.cells.count(cell) > 0;
      throw InputError(
          (by_middle_nodes ? "Mesh/File: "
                           : "Mesh/Curved bodies = " + name_of(prm.mesh.curved) + ": ") +
          facts.file.name + ": element " + std::to_string(facts.file.cells[cell].number) +
          " has the scaled Jacobian " + number(jacobian) +
          (by_middle_nodes
               ? " where its edges follow its middle nodes. These must be nearer to the middles."
               : " where its edges follow circles about the axis. It needs a smaller angle "
                 "or no curvature (none)."));
    }

    /// A line about elements of a deck that are no solids: points and what joins them are taken
    /// from the section Joints, where --from-deck writes them.
    std::string describe_without_volume(const Parameters::Joints &joints, const std::string &type,
                                        const unsigned int n)
    {
      const std::vector<std::pair<std::string, std::pair<std::string, std::size_t>>> sources = {
          {"SPRING", {"Joints/Springs", joints.list_of_springs().size()}},
          {"DASHPOT", {"Joints/Dashpots", joints.list_of_dashpots().size()}},
          {"MASS", {"Joints/Masses", joints.list_of_masses().size()}},
          {"ROTARYI", {"Joints/Masses", joints.list_of_masses().size()}}};
      for (const auto &[beginning, source] : sources)
        if (type.rfind(beginning, 0) == 0)
          return source.second > 0
                     ? text_of("  ", n, " elements of type ", type,
                               " are no volumes: ", source.first, " has ", source.second,
                               " in their place\n")
                     : text_of("Warning, passed over: ", n, " elements of type ", type, "; ",
                               source.first, " is empty. squeal --from-deck writes it.\n");
      return text_of("  Passed over: ", n, " elements of type ", type, "\n");
    }

    /// What became of the elements, unless all were linear hexahedra, and what that costs.
    std::string describe_division(const Parameters::All &prm, const MeshFacts &facts,
                                  const Geometry<3> &geometry, const Measures &measures)
    {
      const Division &division = facts.file.division;
      std::string text;
      for (const auto &[type, n] : division.passed_over)
        text += describe_without_volume(prm.joints, type, n);
      if (division.n_divided + division.n_curved == 0 &&
          division.n_elements.count("linear hexahedron") > 0 && division.n_elements.size() == 1)
        return text;
      std::string kinds;
      for (const auto &[kind, n] : division.n_elements)
        kinds += text_of(kinds.empty() ? "" : ", ", n, " ", kind, n == 1 ? "" : " elements");
      double smallest = 1;
      for (const CellMeasures &cell : measures.cells)
        smallest = std::min(smallest, cell.jacobian);
      text += text_of(
          "  Elements of the file: ", kinds, "; ", 3 * division.n_nodes,
          " displacements of their nodes.\n  Of them ", division.n_divided, " are divided and ",
          division.n_curved, " bend their cells: ", geometry.cells.size(), " hexahedra, ",
          measures.n_displacements, " displacements of degree ", prm.discretization.degree,
          "; smallest scaled Jacobian ", formatted("%.3f", smallest), ".\n");
      if (prm.discretization.degree == 1 && division.n_divided > 0)
        text += "  Hint: divided elements of degree 1 are much too stiff in bending; "
                "Discretization/Degree = 2 or more is what they need.\n";
      return text;
    }

    /// Bodies with cells so flat that low degrees lock: the longest edge over the shortest.
    std::string describe_flat_cells(const Parameters::All &prm, const Geometry<3> &geometry)
    {
      constexpr double longest  = 20;
      const unsigned int degree = prm.discretization.degree;
      unsigned int n            = 0;
      double worst              = 0;
      for (const CoarseCell<3> &cell : geometry.cells)
      {
        double low = 1e300, high = 0;
        for (unsigned int v = 0; v < 8; ++v)
          for (unsigned int d = 0; d < 3; ++d)
            if (const unsigned int w = v | (1u << d); w != v)
            {
              const double length =
                  geometry.vertices[cell.vertices[v]].distance(geometry.vertices[cell.vertices[w]]);
              low  = std::min(low, length);
              high = std::max(high, length);
            }
        n += high > longest * low;
        worst = std::max(worst, high / low);
      }
      if (n == 0 || degree > 2)
        return "";
      return text_of("  Hint: ", n, " cells are more than ", longest,
                     " times as long as thick, up to ", formatted("%.0f", worst),
                     " times: with degree ", degree,
                     " they are too stiff in bending. Discretization/Degree = 3 or shorter cells "
                     "are what they need.\n");
    }
  } // namespace

  void report_mesh(const Parameters::All &prm, const MeshFacts &facts, Geometry<3> &geometry)
  {
    std::set<MeshFile::Face> wanted;
    for (const auto &[name, surface] : facts.file.surfaces)
      wanted.insert(surface.begin(), surface.end());
    const Measures measures = measure(geometry, wanted, prm.discretization.degree);
    for (unsigned int c = 0; c < measures.cells.size(); ++c)
      if (!(measures.cells[c].jacobian > 0))
        refuse(prm, facts, c, measures.cells[c].jacobian);

    const std::vector<Parameters::BodyMaterial> materials = prm.materials();
    const auto part_of = [&](const unsigned int c) -> const Part &
    { return geometry.parts[geometry.cells[c].material_id]; };
    const auto use_of = [&](const std::string &name)
    {
      const auto role = facts.roles.find(name);
      return role == facts.roles.end() ? std::string() : role->second;
    };
    const auto add = [&](Row &row, const unsigned int c) {
      add_cell(row, geometry, c, measures.cells[c],
               materials[part_of(c).material].material.density);
    };
    std::vector<Row> rows = {{Kind::mesh, facts.file.name}};
    for (unsigned int body = 0; body < facts.bodies.size(); ++body)
      rows.emplace_back(Kind::body, body == rotor_body ? "rotor"
                                    : geometry.other_bodies.count(Body(body))
                                        ? facts.bodies[body]
                                        : "pad " + facts.bodies[body]);
    for (unsigned int c = 0; c < geometry.cells.size(); ++c)
    {
      add(rows[0], c);
      add(rows[1 + part_of(c).body], c);
    }
    if (!geometry.has_rotor())
      rows.erase(rows.begin() + 1);
    for (const auto &[name, cells] : facts.file.volumes)
    {
      rows.emplace_back(Kind::volume, name, use_of(name));
      for (const unsigned int c : cells)
        add(rows.back(), c);
    }
    for (const auto &[name, surface] : facts.file.surfaces)
    {
      Row row(Kind::surface, name, use_of(name));
      row.area = 0;
      for (const MeshFile::Face &face : surface)
        if (const auto area = measures.areas.find(face); area != measures.areas.end())
        {
          row.count += 1;
          row.area += area->second;
          for (const unsigned int vertex : face)
            row.box.add(geometry.vertices[vertex]);
        }
      if (row.count > 0)
        rows.push_back(row);
    }
    for (const ContactPairMeasures &pair : facts.pairs)
    {
      const std::string pad = pair.name.substr(0, pair.name.find(" : "));
      const auto surface    = std::find_if(rows.begin(), rows.end(),
                                           [&](const Row &row)
                                           { return row.kind == Kind::surface && row.name == pad; });
      Row row(Kind::pair, pair.name);
      row.pair = &pair;
      row.area = pair.pad_area;
      if (surface != rows.end())
      {
        row.count = surface->count;
        row.box   = surface->box;
      }
      rows.push_back(row);
    }
    std::string joints;
    for (const JointMeasures &joint : facts.joints)
      joints += text_of("  ", joint.kind, " ", joint.name, ": gap ", 1e3 * joint.gap, " mm of ",
                        1e3 * joint.distance, " mm that are allowed, ",
                        100 * joint.overlap / joint.area, " % of ", 1e4 * joint.area, " cm^2\n");
    for (const std::string &point : facts.points)
      joints += "  Point " + point + "\n";
    for (const std::string &superelement : facts.superelements)
      joints += "  Superelement " + superelement + "\n";
    geometry.report_table      = table_of(rows);
    const std::size_t n_bodies = facts.bodies.size() - (geometry.has_rotor() ? 0 : 1);
    geometry.report =
        "\nMesh file " + facts.file.name + ": " + std::to_string(geometry.cells.size()) +
        " hexahedra, " + std::to_string(geometry.vertices.size()) + " nodes, " +
        std::to_string(n_bodies) + (n_bodies == 1 ? " body" : " bodies") +
        (facts.n_turned > 0
             ? ", " + std::to_string(facts.n_turned) + " cells numbered inside out have been turned"
             : "") +
        "\n" + describe_division(prm, facts, geometry, measures) +
        describe_flat_cells(prm, geometry) + describe_rows(rows) + describe_size(rows[0]) +
        describe_waves(prm, geometry) + joints;
  }
} // namespace squeal
