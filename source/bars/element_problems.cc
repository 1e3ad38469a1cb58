#include <squeal/bars/element_problems.h>
#include <squeal/base/errors.h>
#include <squeal/linalg/inverse_diagonal.h>

#include <deal.II/base/quadrature_lib.h>

#include <algorithm>
#include <cmath>

// The problem of an element with own polynomials. It has the form of a cell's (local_problems.cc):
// stiffness of the added functions without those that move a fixed node, pressures on faces of
// pads. On faces the element's functions are given by their values at the nodes of the cells that
// have these.

namespace squeal
{
  using namespace dealii;
  using CellIterator = LocalProblems<3>::CellIterator;

  namespace
  {
    constexpr unsigned int dim = 3;
  } // namespace

  ElementProblems::ElementProblems(const EnrichedSpace<3> &space, CellResiduals<3> &integrals,
                                   LocalProblems<3> &local)
      : space(space), integrals(integrals), local(local),
        of_displacements(interpolation_of(space.fine, 0)),
        of_multipliers(interpolation_of(space.fine, dim)),
        face_values(space.fine.mapping, space.fine.fe, QGauss<2>(space.fine.fe.degree + 1),
                    update_values | update_normal_vectors | update_quadrature_points |
                        update_JxW_values)
  {
  }

  ElementProblems::Functions &ElementProblems::functions_of(const ElementShape shape)
  {
    if (const auto found = functions.find(shape); found != functions.end())
      return found->second;
    const unsigned int degree                         = space.base.fe.degree;
    const std::vector<Point<3>> places                = of_displacements.own_places(shape),
                                places_of_multipliers = of_multipliers.own_places(shape);
    Functions result{
        ElementFunctions(shape, degree), ElementFunctions(shape, 1), {}, {}, {}, {}, {}, {}, 0};
    result.moves_at_nodes       = result.moves.added_at(places);
    result.base_at_nodes        = result.moves.base_at(places);
    result.multipliers_at_nodes = result.multipliers.added_at(places_of_multipliers);
    for (const Point<3> &place : places)
      result.carrier_of_node.push_back(carrier_of(shape, place));
    result.n_functions = std::max(result.moves.n_added(), result.multipliers.n_added());
    return functions.emplace(shape, std::move(result)).first->second;
  }

  unsigned int ElementProblems::n_functions(const ElementShape shape)
  {
    return functions_of(shape).n_functions;
  }

  const DenseMatrix &ElementProblems::values(const ElementShape shape, const unsigned int field)
  {
    const Functions &of = functions_of(shape);
    return field < dim ? of.moves_at_nodes : of.multipliers_at_nodes;
  }

  ElementProblems::OnCell &ElementProblems::on_cell(const Element &element,
                                                    const CellIterator &cell)
  {
    const auto [found, is_new] = cells.try_emplace({element.shape, between(cell)});
    OnCell &result             = found->second;
    if (is_new)
    {
      const Functions &of = functions_of(element.shape);
      const auto &places  = of_displacements.of(element.shape, between(cell)).places;
      result.moves        = of.moves.added_at(places);
      result.multipliers  = of.multipliers.added_at(places);
    }
    return result;
  }

  DenseMatrix ElementProblems::stiffness_of(const Element &element, const Material &material,
                                            const bool with_base)
  {
    integrals.reinit(element);
    Functions &of = functions_of(element.shape);
    if (of.derivatives_of_moves.values.empty())
    {
      of.derivatives_of_moves = integrals.reference_derivatives(element.shape, of.moves_at_nodes);
      of.derivatives_of_all   = integrals.reference_derivatives(
            element.shape, side_by_side(of.moves_at_nodes, of.base_at_nodes));
    }
    const DenseMatrix &derivatives = with_base ? of.derivatives_of_all : of.derivatives_of_moves;
    DenseMatrix result(dim * derivatives.n_columns, dim * derivatives.n_columns);
    integrals.stiffness(material, derivatives, result);
    return result;
  }

  std::vector<double> ElementProblems::resistance(const Element &element, const Material &material)
  {
    const Functions &of    = functions_of(element.shape);
    const unsigned int n_w = of.moves.n_added();
    std::vector<double> compliance;
    try
    {
      compliance = inverse_diagonal(stiffness_of(element, material, false));
    }
    catch (const SolverError &) // of LAPACK, which knows a row
    {
      throw SolverError("The error bars solve a small elastic problem in each element. In one "
                        "element its matrix is not positive definite to rounding: the element is "
                        "too flat. Try a better mesh, or Eigenproblem/Error bars = false.");
    }
    std::vector<double> result;
    for (const auto &unknown : element.unknowns)
    {
      double sum = 0;
      for (unsigned int w = 0; w < n_w && unknown.field < dim; ++w)
        if (of.moves.carrier_of_added(w) == of.carrier_of_node[unknown.node])
          sum += 1 / compliance[unknown.field * n_w + w];
      result.push_back(sum > 0 ? sum : 1.);
    }
    return result;
  }

  std::uint8_t ElementProblems::corners_of(const CellIterator &cell, const unsigned int face) const
  {
    std::uint8_t corners = 0;
    for (unsigned int v = 0; v < 8; ++v)
      if ((v >> (face / 2) & 1) == face % 2)
        corners |= between(cell)[v];
    return corners;
  }

  /// Appends the pressures' functions that do not vanish on a face with these corners, where all
  /// nodes that they have are there and closed.
  void ElementProblems::add_pressures(const Element &element, const std::uint8_t corners,
                                      std::vector<int> &kept)
  {
    const Functions &of = functions_of(element.shape);
    const auto nodes    = nodes_of_element(element.cells, space.base.geometry.own, of_multipliers);
    for (const unsigned int field : local.contact_fields())
    {
      std::vector<bool> is_there(of.multipliers_at_nodes.n_rows);
      for (const auto &unknown : element.unknowns)
        if (unknown.field == field)
          is_there[unknown.node] = local.contact_of_pads()->is_closed(
              space.fine.field_equation(nodes[unknown.node], field));
      for (unsigned int w = 0; w < of.multipliers.n_added(); ++w)
      {
        if ((of.multipliers.carrier_of_added(w) & ~corners) != 0)
          continue;
        bool is_free = true;
        for (unsigned int k = 0; k < is_there.size() && is_free; ++k)
          is_free = of.multipliers_at_nodes(k, w) == 0 || is_there[k];
        const int unknown = field * of.n_functions + w;
        if (is_free && std::find(kept.begin(), kept.end(), unknown) == kept.end())
          kept.push_back(unknown);
      }
    }
  }

  std::vector<bool> ElementProblems::free_functions(const Element &element,
                                                    const DenseMatrix &at_nodes)
  {
    std::vector<bool> is_there(dim * at_nodes.n_rows), result(dim * at_nodes.n_columns, true);
    for (const auto &unknown : element.unknowns)
      if (unknown.field < dim)
        is_there[unknown.field * at_nodes.n_rows + unknown.node] = true;
    for (unsigned int c = 0; c < dim; ++c)
      for (unsigned int w = 0; w < at_nodes.n_columns; ++w)
        for (unsigned int k = 0; k < at_nodes.n_rows; ++k)
          if (at_nodes(k, w) != 0 && !is_there[c * at_nodes.n_rows + k])
            result[c * at_nodes.n_columns + w] = false;
    return result;
  }

  LocalProblem ElementProblems::make(const Element &element, const Material &material)
  {
    const Functions &of    = functions_of(element.shape);
    const unsigned int n_w = of.moves.n_added(), n_f = of.n_functions;
    LocalProblem problem;
    std::vector<int> &kept       = problem.unknowns;
    const std::vector<bool> free = free_functions(element, of.moves_at_nodes);
    for (unsigned int c = 0; c < dim; ++c)
      for (unsigned int w = 0; w < n_w; ++w)
        if (free[c * n_w + w])
          kept.push_back(c * n_f + w);
    const unsigned int n_moves = kept.size();

    // Faces of pads and their pressures. Tractions of joints are taken as given: what one degree
    // more of them asks for the element answers by its functions of degree p, which no local
    // problem has; by those of degree p + 1 alone bars of tied blocks were too short as often as
    // too long, and twice to three times the error without.
    const Geometry<3> &geometry = space.base.geometry;
    struct Face
    {
      CellIterator cell;
      unsigned int number;
      const ContactInterface *contact;
    };
    std::vector<Face> faces;
    const Contact<3> *const contact = local.contact_of_pads();
    for (const CellIterator &cell : element.cells.cells)
      for (const unsigned int f : cell->face_indices())
      {
        if (!cell->face(f)->at_boundary())
          continue;
        const auto id = cell->face(f)->boundary_id();
        for (const ContactInterface &interface : geometry.interfaces)
          if (contact && interface.pad_face == id && interface.slides())
          {
            faces.push_back({cell, f, &interface});
            if (contact->contact_model().mortar)
              add_pressures(element, corners_of(cell, f), kept);
          }
      }

    const DenseMatrix stiffness = stiffness_of(element, material, false);
    const auto place = [&](const int unknown) { return unknown / n_f * n_w + unknown % n_f; };
    problem.matrix   = DenseMatrix(kept.size(), kept.size());
    for (unsigned int s = 0; s < n_moves; ++s)
      for (unsigned int r = 0; r < n_moves; ++r)
        problem.matrix(r, s) = stiffness(place(kept[r]), place(kept[s]));
    for (const Face &face : faces)
    {
      face_values.reinit(face.cell, face.number);
      const OnCell &on     = on_cell(element, face.cell);
      const unsigned int n = face_values.n_quadrature_points;
      DenseMatrix shapes(on.moves.n_rows, n);
      for (unsigned int q = 0; q < n; ++q)
        for (unsigned int a = 0; a < shapes.n_rows; ++a)
          shapes(a, q) = face_values.shape_value(a, q);
      const FaceTraces traces{on.moves.transpose() * shapes, on.multipliers.transpose() * shapes};
      local.add_contact(face_values, *face.contact, traces, n_f, kept, problem.matrix);
    }
    problem.symmetric = faces.empty();
    return problem;
  }

  DenseMatrix ElementProblems::soften(const Element &element, const LocalProblem &problem,
                                      const Material &material)
  {
    const Functions &of    = functions_of(element.shape);
    const unsigned int n_w = of.moves.n_added(), n_base = of.moves.n_base(), n = n_w + n_base;
    const std::vector<bool> movable = free_functions(element, of.base_at_nodes);
    std::vector<unsigned int> moves, base;
    for (const int unknown : problem.unknowns)
      if (unknown < int(dim * of.n_functions))
        moves.push_back(unknown / of.n_functions * n + unknown % of.n_functions);
    for (unsigned int i = 0; i < dim * n_base; ++i)
      if (movable[i])
        base.push_back(i / n_base * n + n_w + i % n_base);
    return give_way(stiffness_of(element, material, true), moves, base, problem.matrix);
  }
} // namespace squeal
