#include <squeal/bars/enriched_residuals.h>
#include <squeal/bars/surface_vectors.h>
#include <squeal/contact/contact_forces.h>
#include <squeal/contact/contact_matrices.h>
#include <squeal/statics/bedding.h>

#include <algorithm>
#include <cmath>
#include <map>

// Residuals of modes on the space of one degree more. The constructor goes in this order: factors
// of each body's matrices at each eigenvalue; the modes' vectors as columns of the coarse space,
// interpolated; products of the bodies' operators cell by cell (add_bodies); contact, paired anew
// (pair_contact, add_contact); what is there as matrices (add_matrices) and measured damping; loads
// of the static state. Last, multipliers beside the edge of the contact zone are released, for the
// pressure has no smooth continuation there; close_at_edge() takes that back for the local
// problems.

namespace squeal
{
  using namespace dealii;
  using Complex = std::complex<double>;

  namespace
  {
    /// Sums of a body's terms at the eigenvalue l: sum c l^order for each kind of matrix, and what
    /// f(l) makes of the stiffness. The static stress has one, if there is any.
    OperatorFactors factors_at(const Parameters::All &prm, const Parameters::BodyMaterial &material,
                               const Complex l, const bool has_stress)
    {
      std::array<Complex, 5> sums{};
      if (prm.terms().material_damping)
        sums[static_cast<unsigned int>(BodyTerm::Kind::K)] =
            material.material.stiffness_factor(l) - 1.;
      for (const BodyTerm &term : body_terms(prm, material))
        sums[static_cast<unsigned int>(term.matrix)] +=
            term.coefficient * (term.order == 0   ? 1.
                                : term.order == 1 ? l
                                                  : l * l);
      const auto of = [&](const BodyTerm::Kind kind)
      { return sums[static_cast<unsigned int>(kind)]; };
      return {of(BodyTerm::Kind::M),      of(BodyTerm::Kind::K), of(BodyTerm::Kind::G),
              of(BodyTerm::Kind::M_star), has_stress ? 1. : 0.,  of(BodyTerm::Kind::V)};
    }
    /// Whether eigenvalues depend on a pressure that is computed: by friction's damping.
    template <int dim>
    bool depend_on_pressure(const BrakeModel<dim> &model)
    {
      const std::vector<ContactInterface> &interfaces = model.spaces().geometry.interfaces;
      return model.equilibrium() && model.parameters().terms().friction_damping &&
             std::any_of(interfaces.begin(), interfaces.end(),
                         [](const ContactInterface &interface) { return interface.slides(); });
    }
  } // namespace

  template <int dim>
  EnrichedResiduals<dim>::EnrichedResiduals(const BrakeModel<dim> &model, const EigenPairs &modes)
      : n_modes(modes.size()), with_state(depend_on_pressure(model)),
        n_vectors(n_modes + with_state), space(model.spaces()), cells(space.base, space.fine),
        materials(model.parameters().materials()), lifted(space.fine.rows, 4 * n_vectors),
        values(space.map.zeros(4 * n_vectors)), model(model), prm(model.parameters()), modes(modes)
  {
    for (const Parameters::BodyMaterial &material : materials)
    {
      factors.emplace_back();
      for (const Complex &l : modes.lambda)
        factors.back().push_back(factors_at(prm, material, l, is_stressed(material)));
      if (with_state)
        factors.back().push_back(factors_at(prm, material, 0, false));
    }
    pair_contact();
    of_joints = model.joint_terms(space.fine);
    add_bodies(import_columns(), factors, lifted, values);
    add_contact();
    add_matrices();
    add_measured_damping();
    if (with_state)
      add_static_residual();
    if (contact && prm.contact.mortar())
      release_at_edge();
  }

  template <int dim>
  bool EnrichedResiduals<dim>::is_stressed(const Parameters::BodyMaterial &material) const
  {
    return model.equilibrium() && prm.prestress.needs_state() &&
           (material.of_rotor || prm.prestress.stress_stiffness);
  }

  /// [Re X, Im X, Re Z, Im Z] of all modes; the static state, if wanted, is the last one's Re X.
  template <int dim>
  std::vector<Column> EnrichedResiduals<dim>::import_columns() const
  {
    std::vector<Column> columns = space.base_map.zeros(4 * n_vectors);
    const auto import           = [&](const double *values, const unsigned int j)
    { std::copy_n(values, space.base.rows.n_local(), columns[j].begin()); };
    const MultiVector *blocks[] = {&modes.right.re, &modes.right.im, &modes.left.re,
                                   &modes.left.im};
    for (unsigned int part = 0; part < 4; ++part)
      for (unsigned int j = 0; j < n_modes; ++j)
        import(blocks[part]->column(j), part * n_vectors + j);
    if (with_state)
      import(model.equilibrium()->state.data(), n_modes);
    for (Column &column : columns)
      column.update_ghost_values();
    return columns;
  }

  template <int dim>
  void
  EnrichedResiduals<dim>::add_bodies(const std::vector<Column> &columns,
                                     const std::vector<std::vector<OperatorFactors>> &by_material,
                                     MultiVector &in_fine_space, std::vector<Column> &forces)
  {
    const unsigned int n_columns    = columns.size();
    const std::vector<Column> state = prm.prestress.needs_state() && model.equilibrium()
                                          ? space.base_map.import(model.equilibrium()->state)
                                          : std::vector<Column>();
    DenseMatrix u_0(space.n_fields * space.base.fe.n_dofs_per_cell(), 1), coarse,
        u(space.base.fe.n_dofs_per_cell(), dim * n_columns), r(space.n, dim * n_columns);
    unsigned int number = 0;
    for (const auto &cell : space.fine.nodes.active_cell_iterators())
      if (cell->is_locally_owned())
      {
        if (space.map.is_part_of_element(number))
        {
          ++number;
          continue;
        }
        space.lift_cell(number, columns, coarse, in_fine_space);
        std::copy_n(coarse.values.begin(), u.values.size(), u.values.begin());
        cells.reinit(cell);
        const unsigned int material = material_of(cell);
        if (is_stressed(materials[material]))
        {
          space.base_map.gather(number, state, u_0);
          cells.set_stress(
              materials[material].material,
              {space.base.fe.n_dofs_per_cell(),
               dim,
               {u_0.values.begin(), u_0.values.begin() + dim * space.base.fe.n_dofs_per_cell()}});
        }
        cells.apply(materials[material].material, by_material[material], u, r);
        for (unsigned int j = 0; j < n_columns; ++j)
          for (const auto &entry : space.map.cells[number])
            if (entry.unknown < dim * space.n)
              forces[j].local_element(entry.index) +=
                  entry.weight * r.values[std::size_t(j) * dim * space.n + entry.unknown];
        ++number;
      }
    if constexpr (dim == 3)
      add_elements(columns, state, by_material, forces);
    space.lift_elements(columns, in_fine_space);
    for (Column &column : forces)
      column.compress(VectorOperation::add);
    space.copy_rows_without_cells(columns, in_fine_space);
  }

  /// The parts of elements with own polynomials.
  template <int dim>
  void EnrichedResiduals<dim>::add_elements(
      const std::vector<Column> &columns, const std::vector<Column> &state,
      const std::vector<std::vector<OperatorFactors>> &by_material, std::vector<Column> &forces)
  {
    for (unsigned int e = 0; e < space.map.elements.size(); ++e)
    {
      const typename CellMap<dim>::Element &element = space.map.elements[e],
                                           &of_base = space.base_map.elements[e];
      if (!element.mine)
        continue;
      const unsigned int material = material_of(element.cells.cells[0]),
                         n_base   = of_base.nodes.size();
      cells.reinit(element);
      if (is_stressed(materials[material]))
        cells.set_stress(materials[material].material,
                         space.base_map.gather(of_base, n_base, 0, dim, state));
      DenseMatrix r(element.nodes.size(), dim * columns.size());
      cells.apply(materials[material].material, by_material[material],
                  space.base_map.gather(of_base, n_base, 0, dim, columns), r);
      for (const auto &unknown : element.unknowns)
        for (unsigned int j = 0; j < columns.size() && unknown.field < dim; ++j)
          forces[j].local_element(unknown.index) += r(unknown.node, dim * j + unknown.field);
    }
  }

  /// Adds the damping of modes with measured ratios, (f(l) - 1) sum_k (M phi_k) c_k (M phi_k)^T x:
  /// the inner product is the model's, the force is M phi_k in the enriched space.
  template <int dim>
  void EnrichedResiduals<dim>::add_measured_damping()
  {
    for (const RelaxationTerm &term : model.relaxation())
    {
      if (!term.low_rank)
        continue;
      // Four blocks of columns are wanted; with a real factor each column is by itself.
      const unsigned int n_shapes = term.low_rank->weights.size(), n_each = (n_shapes + 3) / 4;
      MultiVector shapes = term.low_rank->preimages;
      shapes.append(MultiVector(space.base.rows, 4 * n_each - n_shapes));
      MultiVector fine_shapes(space.fine.rows, 4 * n_each);
      std::vector<Column> forces = space.map.zeros(4 * n_each);
      const std::vector<OperatorFactors> inertia(n_each, {1., 0., 0., 0., 0., 0.});
      add_bodies(space.base_map.import(shapes), {materials.size(), inertia}, fine_shapes, forces);
      const MultiVector of_points = multiply(sum_of(space.fine.rows, of_joints, 2), fine_shapes);
      for (unsigned int k = 0; k < n_shapes; ++k)
        for (unsigned int i = 0; i < of_points.n_local(); ++i)
          forces[k].local_element(i) += of_points.column(k)[i];

      for (const bool is_left : {false, true})
      {
        const ComplexMultiVector &x = is_left ? modes.left : modes.right;
        const unsigned int side     = is_left ? 2 * n_vectors : 0;
        const DenseMatrix re        = term.low_rank->weighted_products(x.re),
                          im        = term.low_rank->weighted_products(x.im);
        for (unsigned int j = 0; j < n_modes; ++j)
        {
          const Complex of_right = term.coefficient * (term.factor(modes.lambda[j]) - 1.),
                        factor   = is_left ? std::conj(of_right) : of_right;
          for (unsigned int k = 0; k < n_shapes; ++k)
          {
            const Complex c = factor * Complex(re(k, j), im(k, j));
            for (unsigned int i = 0; i < of_points.n_local(); ++i)
            {
              values[side + j].local_element(i) += c.real() * forces[k].local_element(i);
              values[side + n_vectors + j].local_element(i) +=
                  c.imag() * forces[k].local_element(i);
            }
          }
        }
      }
    }
  }

  /// The edge of the contact zone stays where it is: pressures are enriched only where all
  /// contacts are closed. The enriched space has nodes on both sides of the edge, and each that
  /// is closed or open by mistake would outweigh all other values.
  template <int dim>
  void EnrichedResiduals<dim>::release_at_edge()
  {
    MultiVector closed(space.base.rows, 1);
    for (unsigned int row = space.base.first_local_multiplier; row < space.base.first_local_tie;
         ++row)
      closed.data()[row - space.base.rows.begin] = model.contact()->is_closed(row);
    MultiVector fine_closed = space.interpolate(closed);
    std::fill(fine_closed.data(),
              fine_closed.data() + (space.fine.first_local_multiplier - space.fine.rows.begin), 1.);
    std::fill(fine_closed.data() + (space.fine.first_local_tie - space.fine.rows.begin),
              fine_closed.data() + space.fine.rows.n_local(), 1.);
    const std::vector<double> flags = replicate(fine_closed);
    for (unsigned int row = 0; row < flags.size(); ++row)
      if (std::abs(flags[row] - 1) > 1e-9 && contact->is_closed(row))
        released.push_back(row);
    contact->set_closed(released, false);
  }

  template <int dim>
  void EnrichedResiduals<dim>::close_at_edge()
  {
    contact->set_closed(released, true);
    released.clear();
  }

  /// Contact on the enriched space, with the static state interpolated.
  template <int dim>
  void EnrichedResiduals<dim>::pair_contact()
  {
    if (!model.contact() || space.base.geometry.interfaces.empty())
      return;
    contact = std::make_unique<Contact<dim>>(space.fine, BrakeModel<dim>::contact_model(prm));
    contact->scale_as(*model.contact());
    take_wear(*model.contact(), *contact);
    if (model.equilibrium())
    {
      const MultiVector fine_state = space.interpolate(model.equilibrium()->state);
      if (!prm.contact.mortar())
        contact->update_active_set(fine_state);
      pressure = contact->pressure_of(fine_state);
    }
    else
    {
      const std::optional<WornPressure<dim>> &worn = model.steady_state().worn;
      if (worn && !prm.contact.mortar())
        worn->release(*contact);
      pressure = BrakeModel<dim>::known_pressure(prm, worn, *contact);
    }
    if (!prm.prestress.turning_contact)
      return;
    TurningContact turning = turning_contact(*contact, pressure, prm.terms().friction);
    for (Matrix *matrix : {&turning.pressure, &turning.friction})
      if (*matrix)
        turning_terms.push_back(
            {Origin::prestress, 0, 1., std::make_shared<const Matrix>(std::move(*matrix))});
  }

  template <int dim>
  ContactPressure EnrichedResiduals<dim>::friction_gradient() const
  {
    if (!prm.terms().friction)
      return {};
    auto [largest, slopes] = friction_slopes(*contact, pressure);
    for (std::vector<double> &of_interface : slopes)
      for (double &slope : of_interface)
        slope *= largest;
    return std::move(slopes);
  }

  template <int dim>
  std::vector<ContactProduct>
  EnrichedResiduals<dim>::static_products(const unsigned int interface,
                                          const ContactKinematics<dim> &k,
                                          const ContactPressure &slopes) const
  {
    std::vector<ContactProduct> products = normal_products(*contact, interface, k);
    if (!slopes.empty() && contact->slides(interface))
      products.push_back(friction_product(*contact, interface, k, slopes));
    return products;
  }

  /// Mortar: pressures of the modes vanish where contact is open, so that constraints need not be
  /// released there.
  template <int dim>
  void EnrichedResiduals<dim>::add_contact()
  {
    if (!contact)
      return;
    const StageTerms stage       = prm.terms();
    const ContactPressure slopes = friction_gradient();
    // What a term is multiplied with, for each vector: the static state has no damping.
    using Factors = std::vector<Complex>;
    Factors of_state(n_vectors, 1.), of_position = of_state, of_velocity = modes.lambda;
    of_velocity.resize(n_vectors);
    if (with_state)
      of_position[n_modes] = 0.;
    const auto factors_of = [&](const ContactProduct &product) -> const Factors &
    {
      if (product.order == 1)
        return of_velocity;
      const bool is_static =
          product.origin == Origin::contact || product.origin == Origin::friction;
      return is_static ? of_state : of_position;
    };
    for (const bool is_left : {false, true})
    {
      SurfaceVectors<dim> surface(*contact, lifted, is_left ? 2 * n_vectors : 0, 2 * n_vectors);
      contact->for_each_pair(
          [&](const unsigned int i, const ContactKinematics<dim> &k)
          {
            std::vector<ContactProduct> products = static_products(i, k, slopes);
            if (stage.friction_damping && contact->slides(i))
              for (ContactProduct &product : damping_products(*contact, i, k, pressure))
                products.push_back(std::move(product));
            std::map<Trace, DenseMatrix> traces, forces;
            // left c f right^T x, right c conj(f) left^T z
            const auto act = [&](const ContactProduct &product, const Trace from, const Trace to)
            {
              const Factors &factors = factors_of(product);
              DenseMatrix &x = traces[from], &y = forces[to];
              if (x.values.empty())
                x = surface.traces(from, k);
              if (y.values.empty())
                y = DenseMatrix(2 * n_vectors, k.n_points);
              for (unsigned int q = 0; q < k.n_points; ++q)
              {
                const double c = product.c[q], *const of_x = &x.values[std::size_t(q) * x.n_rows];
                double *const of_y = &y.values[std::size_t(q) * y.n_rows];
                for (unsigned int j = 0; j < n_vectors; ++j)
                {
                  const double re = c * factors[j].real(),
                               im = is_left ? -c * factors[j].imag() : c * factors[j].imag();
                  of_y[j] += re * of_x[j] - im * of_x[n_vectors + j];
                  of_y[n_vectors + j] += re * of_x[n_vectors + j] + im * of_x[j];
                }
              }
            };
            for (const ContactProduct &product : products)
              for (const bool transpose : {false, true})
              {
                if (transpose && !product.transposed_too)
                  continue;
                if (transpose == is_left)
                  act(product, product.right, product.left);
                else
                  act(product, product.left, product.right);
              }
            for (const auto &[trace, of_points] : forces)
              surface.add(trace, k, of_points);
          });
      surface.add_to(values);
    }
    for (unsigned int row = space.fine.first_local_multiplier;
         row < space.fine.first_local_tie && prm.contact.mortar(); ++row)
      if (!contact->is_closed(row)) // Lambda = 0
        for (unsigned int j = 0; j < 4 * n_vectors; ++j)
          values[j].local_element(row - space.fine.rows.begin) +=
              contact->constraint_stiffness() * lifted.column(j)[row - space.fine.rows.begin];
  }

  template <int dim>
  void EnrichedResiduals<dim>::add_matrices()
  {
    std::vector<Term> terms = of_joints;
    terms.insert(terms.end(), turning_terms.begin(), turning_terms.end());
    std::array<Matrix, 3> sums;
    for (unsigned int order = 0; order < sums.size(); ++order)
      sums[order] = sum_of(space.fine.rows, terms, order);
    for (const bool is_left : {false, true}) // one after the other: copies are large
    {
      if (terms.empty())
        break;
      const unsigned int side   = is_left ? 2 * n_vectors : 0;
      const MultiVector vectors = lifted.columns(side, 2 * n_vectors);
      for (unsigned int order = 0; order < sums.size(); ++order)
      {
        const Matrix &A = sums[order];
        if (!A)
          continue;
        const MultiVector product =
            is_left ? multiply_transposed(A, vectors) : multiply(A, vectors);
        for (unsigned int j = 0; j < n_modes; ++j) // the state has its own terms
        {
          const Complex l      = is_left ? std::conj(modes.lambda[j]) : modes.lambda[j],
                        factor = order == 0   ? 1.
                                 : order == 1 ? l
                                              : l * l;
          for (unsigned int i = 0; i < product.n_local(); ++i)
          {
            const Complex value =
                factor * Complex(product.column(j)[i], product.column(n_vectors + j)[i]);
            values[side + j].local_element(i) += value.real();
            values[side + n_vectors + j].local_element(i) += value.imag();
          }
        }
      }
    }
  }

  /// K x_0 + N Lambda_0 + mu T Lambda_0 - f of the interpolated state: the parts of bodies and
  /// contact are there.
  template <int dim>
  void EnrichedResiduals<dim>::add_static_residual()
  {
    const MultiVector state   = lifted.columns(n_modes, 1),
                      loads[] = {model.static_load(prm, space.fine),
                                 contact_load(*contact, pressure, prm.terms().friction)};
    const auto add            = [&](const double factor, const MultiVector &block)
    {
      for (unsigned int i = 0; i < block.n_local(); ++i)
        values[n_modes].local_element(i) += factor * block.data()[i];
    };
    for (const Term &term : of_joints)
      if (term.order == 0)
        add(term.coefficient, multiply(*term.matrix, state));
    for (const MultiVector &load : loads)
      add(-1, load);
  }

  template class EnrichedResiduals<2>;
  template class EnrichedResiduals<3>;
} // namespace squeal
