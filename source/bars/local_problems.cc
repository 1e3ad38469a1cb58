#include <squeal/bars/local_problems.h>
#include <squeal/linalg/inverse_diagonal.h>
#include <squeal/mesh/finite_element_space.h>

#include <deal.II/base/quadrature_lib.h>

#include <algorithm>
#include <cmath>

// The problem of one cell in the hierarchical complement of V_h. make() assembles it in this order:
// stiffness of the complement's functions, without those of fixed and hanging nodes; tractions of
// joints on first sides of ties; on a pad's contact face its pressures, with friction. resistance()
// tells how stiffly the cell answers on faces and edges, by which residuals there are divided among
// neighbours.

namespace squeal
{
  using namespace dealii;

  template <int dim>
  LocalProblems<dim>::LocalProblems(const FiniteElementSpace<dim> &spaces, const CellMap<dim> &map,
                                    const CellResiduals<dim> &integrals,
                                    const Contact<dim> *contact, const double pad_pressure,
                                    const bool with_friction, const double tie_scale)
      : functions(hierarchical_complement(spaces.fe)), spaces(spaces), map(map), contact(contact),
        pad_pressure(pad_pressure), with_friction(with_friction), tie_scale(tie_scale),
        n(spaces.fe.n_dofs_per_cell()), derivatives(integrals.reference_derivatives(functions)),
        face_values(spaces.mapping, spaces.fe, QGauss<dim - 1>(spaces.fe.degree + 1),
                    update_values | update_normal_vectors | update_quadrature_points |
                        update_JxW_values),
        stiffness(dim * functions.n_columns, dim * functions.n_columns)
  {
    // In each direction: 0 at the lower end, 1 at the upper, 2 between
    const std::vector<Point<dim>> &points = spaces.fe.get_unit_support_points();
    for (const Point<dim> &x : points)
    {
      unsigned int entity = 0;
      for (unsigned int d = 0; d < dim; ++d)
        entity = 3 * entity + (x[d] < 1e-12 ? 0 : x[d] > 1 - 1e-12 ? 1 : 2);
      entity_of_node.push_back(entity);
    }
    // A hat belongs to the end where it does not vanish; what vanishes at both ends is between.
    for (unsigned int w = 0; w < functions.n_columns; ++w)
    {
      unsigned int entity = 0;
      for (unsigned int d = 0; d < dim; ++d)
      {
        bool low = false, high = false;
        for (unsigned int a = 0; a < n; ++a)
          if (functions(a, w) != 0)
          {
            low |= points[a][d] < 1e-12;
            high |= points[a][d] > 1 - 1e-12;
          }
        entity = 3 * entity + (low ? 0 : high ? 1 : 2);
      }
      entity_of_function.push_back(entity);
    }
  }

  template <int dim>
  std::vector<double> LocalProblems<dim>::resistance(const Material &material,
                                                     CellResiduals<dim> &integrals)
  {
    const unsigned int n_w = functions.n_columns;
    integrals.stiffness(material, derivatives, stiffness);
    // No rigid motion is among the functions: the matrix is definite.
    const auto diagonal = [&]
    {
      try
      {
        return inverse_diagonal(stiffness);
      }
      catch (const SolverError &) // of LAPACK, which knows a row
      {
        throw SolverError(
            "The error bars solve a small elastic problem in each cell. In one cell its matrix is "
            "not positive definite to rounding: the cell is too thin for its length. Try fewer "
            "Discretization/Clamp layers or Discretization/Pad edge layers, or Eigenproblem/Error "
            "bars = false.");
      }
    };
    const std::vector<double> compliance = diagonal();
    std::vector<double> result(spaces.n_fields() * n, 1.), sums(Utilities::pow(3, dim));
    for (unsigned int c = 0; c < dim; ++c)
    {
      std::fill(sums.begin(), sums.end(), 0.);
      for (unsigned int w = 0; w < n_w; ++w)
        sums[entity_of_function[w]] += 1 / compliance[c * n_w + w];
      for (unsigned int a = 0; a < n; ++a)
        if (const double sum = sums[entity_of_node[a]]; sum > 0)
          result[c * n + a] = sum;
    }
    return result;
  }

  template <int dim>
  std::pair<int, const ContactInterface *>
  LocalProblems<dim>::contact_face(const CellIterator &cell) const
  {
    for (const unsigned int f : cell->face_indices())
      for (const ContactInterface &interface : spaces.geometry.interfaces)
        if (cell->face(f)->at_boundary() && cell->face(f)->boundary_id() == interface.pad_face)
          return {f, &interface};
    return {-1, nullptr};
  }

  /// Appends the contact pressures of a pad's cell, and where it sticks the tangential tractions:
  /// the traces of the complement's functions that do not vanish on the contact face, where it is
  /// closed.
  template <int dim>
  void LocalProblems<dim>::add_pressures(const CellIterator &cell, const int face,
                                         const std::vector<bool> &direct,
                                         std::vector<int> &kept) const
  {
    const std::vector<Point<dim>> &points = spaces.fe.get_unit_support_points();
    std::vector<types::global_dof_index> nodes(n);
    cell->get_dof_indices(nodes);
    for (const unsigned int field : contact_fields())
      for (unsigned int w = 0; w < functions.n_columns; ++w)
      {
        bool on_face = false, is_free = true;
        for (unsigned int a = 0; a < n; ++a)
          if (functions(a, w) != 0 && std::abs(points[a][face / 2] - face % 2) < 1e-12)
          {
            on_face = true;
            is_free &=
                direct[field * n + a] && contact->is_closed(spaces.field_equation(nodes[a], field));
          }
        if (on_face && is_free)
          kept.push_back(field * functions.n_columns + w);
      }
  }

  template <int dim>
  std::vector<unsigned int> LocalProblems<dim>::contact_fields() const
  {
    std::vector<unsigned int> fields = {dim};
    for (unsigned int field = spaces.first_stick_field(); field < spaces.n_fields(); ++field)
      fields.push_back(field);
    return fields;
  }

  /// The contact's part of a pad's local problem, the rotor held: with v.n and v.e along the
  /// rotor's normal and the sliding direction, penalty
  ///     int (v.n + mu v.e) k_C u.n,
  /// mortar -int (v.n + mu v.e) p, -int psi u.n - 1/k_C int psi p, and where it sticks
  /// -int v.t T, -int psi u.t for both tangential directions t.
  template <int dim>
  void LocalProblems<dim>::add_contact(const FEFaceValues<dim> &on_face,
                                       const ContactInterface &interface, const FaceTraces &traces,
                                       const unsigned int n_w, const std::vector<int> &kept,
                                       DenseMatrix &local) const
  {
    const ContactModel<dim> &law = contact->contact_model();
    const double scale = contact->pressure_scale(), omega = law.angular_velocity;
    const unsigned int first_stick = spaces.first_stick_field();
    std::vector<unsigned int> there;
    for (const unsigned int q : on_face.quadrature_point_indices())
    {
      const auto trace = [&](const int unknown)
      { return (unknown < int(dim * n_w) ? traces.moves : traces.multipliers)(unknown % n_w, q); };
      const Tensor<1, dim> normal = -on_face.normal_vector(q);
      Tensor<1, dim> e;
      double mu = 0;
      if (interface.slides())
      {
        e = spaces.geometry.transport(on_face.quadrature_point(q));
        e -= (e * normal) * normal;
        const double speed = e.norm();
        e *= law.direction() / speed;
        if (with_friction)
          mu = law.friction_of(interface.name)
                   .traction(std::abs(omega) * speed, pad_pressure)
                   .d_pressure;
      }
      else
        e = direction_in_surface(normal, interface.along);
      const std::array<Tensor<1, dim>, 2> tangents = {{e, binormal_of<dim>(normal, e)}};
      // Most functions vanish on the face.
      there.clear();
      for (unsigned int r = 0; r < kept.size(); ++r)
        if ((kept[r] < int((dim + 1) * n_w) || kept[r] >= int(first_stick * n_w)) &&
            std::abs(trace(kept[r])) > 1e-12)
          there.push_back(r);
      const double k = law.mortar ? 0 : law.penalty_stiffness;
      for (const unsigned int r : there)
      {
        const unsigned int c = kept[r] / n_w;
        const double v       = trace(kept[r]);
        for (const unsigned int s : there)
        {
          const unsigned int d = kept[s] / n_w;
          const double u       = trace(kept[s]);
          double value         = 0;
          if (c >= first_stick || d >= first_stick)
          {
            const unsigned int moved = std::min(c, d), traction = std::max(c, d) - first_stick;
            value = moved < dim ? -scale * tangents[traction][moved] : 0;
          }
          else if (c < dim && d < dim)
            value = k * (normal[c] + mu * e[c]) * normal[d];
          else if (c < dim)
            value = -scale * (normal[c] + mu * e[c]);
          else if (d < dim)
            value = -scale * normal[d];
          else
            value = -scale * scale * law.compliance;
          local(r, s) += on_face.JxW(q) * v * u * value;
        }
      }
    }
  }

  template <int dim>
  std::vector<unsigned int> LocalProblems<dim>::tied_faces(const CellIterator &cell) const
  {
    std::vector<unsigned int> faces;
    for (const TiedSurfaces &tie : spaces.geometry.ties)
      for (const unsigned int f : cell->face_indices())
        if (cell->face(f)->at_boundary() && cell->face(f)->boundary_id() == tie.side)
          faces.push_back(f);
    return faces;
  }

  /// Appends the tractions of a cell at the first side of a tie: for each component the traces of
  /// the complement's functions that do not vanish on the tied faces, if they are among those that
  /// may move.
  template <int dim>
  void LocalProblems<dim>::add_tractions(const CellIterator &cell,
                                         const std::vector<unsigned int> &faces,
                                         const std::vector<bool> &direct,
                                         std::vector<int> &kept) const
  {
    const std::vector<Point<dim>> &points = spaces.fe.get_unit_support_points();
    std::vector<types::global_dof_index> nodes(n);
    cell->get_dof_indices(nodes);
    const unsigned int n_w           = functions.n_columns;
    const std::vector<int> displaced = kept;
    for (const int move : displaced)
    {
      if (move >= int(dim * n_w))
        continue;
      const unsigned int c = move / n_w, w = move % n_w;
      bool on_face = false, is_free = true;
      for (unsigned int a = 0; a < n; ++a)
        if (functions(a, w) != 0 && std::any_of(faces.begin(), faces.end(),
                                                [&](const unsigned int f) {
                                                  return std::abs(points[a][f / 2] - f % 2) < 1e-12;
                                                }))
        {
          on_face = true;
          is_free &= direct[(dim + 1 + c) * n + a];
        }
      if (on_face && is_free)
        kept.push_back((dim + 1 + c) * n_w + w);
    }
  }

  /// The tie's part of a cell's local problem, the other side held: -int v . Lambda,
  /// -int Psi . u.
  template <int dim>
  void LocalProblems<dim>::add_tie(const FEFaceValues<dim> &on_face, const FaceTraces &traces,
                                   const unsigned int n_w, const std::vector<int> &kept,
                                   DenseMatrix &local) const
  {
    for (const unsigned int q : on_face.quadrature_point_indices())
      for (unsigned int s = 0; s < kept.size(); ++s)
      {
        if (kept[s] < int((dim + 1) * n_w) || kept[s] >= int(spaces.first_stick_field() * n_w))
          continue;
        const unsigned int c = kept[s] / n_w - dim - 1;
        for (unsigned int r = 0; r < kept.size(); ++r)
          if (unsigned(kept[r]) / n_w == c)
          {
            const double value = -tie_scale * on_face.JxW(q) * traces.moves(kept[r] % n_w, q) *
                                 traces.multipliers(kept[s] % n_w, q);
            local(r, s) += value;
            local(s, r) += value;
          }
      }
  }

  /// The traces of a cell's functions on a face: those of pressures are those of displacements.
  template <int dim>
  FaceTraces LocalProblems<dim>::traces_on(const FEFaceValues<dim> &on_face) const
  {
    DenseMatrix traces(functions.n_columns, on_face.n_quadrature_points);
    for (const unsigned int q : on_face.quadrature_point_indices())
      for (unsigned int w = 0; w < functions.n_columns; ++w)
        for (unsigned int a = 0; a < n; ++a)
          traces(w, q) += functions(a, w) * on_face.shape_value(a, q);
    return {traces, traces};
  }

  template <int dim>
  LocalProblem LocalProblems<dim>::make(const CellIterator &cell, const unsigned int number,
                                        const Material &material, CellResiduals<dim> &integrals)
  {
    const unsigned int n_w = functions.n_columns;
    LocalProblem problem;
    std::vector<int> &kept = problem.unknowns;
    std::vector<bool> direct(spaces.n_fields() * n);
    for (const auto &entry : map.cells[number])
      direct[entry.unknown] = direct[entry.unknown] || entry.direct;
    for (unsigned int c = 0; c < dim; ++c)
      for (unsigned int w = 0; w < n_w; ++w)
      {
        bool is_free = true;
        for (unsigned int a = 0; a < n && is_free; ++a)
          is_free = functions(a, w) == 0 || direct[c * n + a];
        if (is_free)
          kept.push_back(c * n_w + w);
      }
    const auto [face, interface] =
        contact ? contact_face(cell) : std::pair<int, const ContactInterface *>(-1, nullptr);
    const unsigned int n_moves = kept.size();
    if (face >= 0 && contact->contact_model().mortar)
      add_pressures(cell, face, direct, kept);

    const std::vector<unsigned int> tied = tied_faces(cell);
    if (!tied.empty())
      add_tractions(cell, tied, direct, kept);

    integrals.stiffness(material, derivatives, stiffness);
    problem.matrix = DenseMatrix(kept.size(), kept.size());
    for (unsigned int s = 0; s < n_moves; ++s)
      for (unsigned int r = 0; r < n_moves; ++r)
        problem.matrix(r, s) = stiffness(kept[r], kept[s]);
    if (face >= 0)
    {
      face_values.reinit(cell, face);
      add_contact(face_values, *interface, traces_on(face_values), n_w, kept, problem.matrix);
    }
    for (const unsigned int f : tied)
    {
      face_values.reinit(cell, f);
      add_tie(face_values, traces_on(face_values), n_w, kept, problem.matrix);
    }
    problem.symmetric = face < 0 && tied.empty();
    return problem;
  }

  template class LocalProblems<2>;
  template class LocalProblems<3>;
} // namespace squeal
